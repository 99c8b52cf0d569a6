#include "core/import/mat73.h"

#include <fmt/format.h>
#include <matio.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <stdexcept>

#include "core/error.h"
#include "core/import/byte_reader.h"
#include "core/import/matlab_matrix.h"
#include "core/text_file.h"

namespace unrig {
namespace {

struct CloseMat {
  void operator()(mat_t* file) const { Mat_Close(file); }
};
struct FreeVariable {
  void operator()(matvar_t* variable) const { Mat_VarFree(variable); }
};

void be_quiet(int, char*) {}

template <class T>
void append(const void* data, std::size_t count, std::vector<double>& values) {
  const T* numbers = static_cast<const T*>(data);
  values.reserve(count);
  for (std::size_t k = 0; k < count; ++k) values.push_back(static_cast<double>(numbers[k]));
}

/// The first numbers of the variable; false where it holds none.
bool numbers(const matvar_t& v, std::size_t count, std::vector<double>& values) {
  switch (v.class_type) {
    case MAT_C_DOUBLE: return append<double>(v.data, count, values), true;
    case MAT_C_SINGLE: return append<float>(v.data, count, values), true;
    case MAT_C_INT8: return append<mat_int8_t>(v.data, count, values), true;
    case MAT_C_UINT8: return append<mat_uint8_t>(v.data, count, values), true;
    case MAT_C_INT16: return append<mat_int16_t>(v.data, count, values), true;
    case MAT_C_UINT16: return append<mat_uint16_t>(v.data, count, values), true;
    case MAT_C_INT32: return append<mat_int32_t>(v.data, count, values), true;
    case MAT_C_UINT32: return append<mat_uint32_t>(v.data, count, values), true;
    case MAT_C_INT64: return append<mat_int64_t>(v.data, count, values), true;
    case MAT_C_UINT64: return append<mat_uint64_t>(v.data, count, values), true;
    default: return false;
  }
}

void take(const matvar_t& v, const std::string& name, int depth, Recording& out);

void take_structure(const matvar_t& v, const std::string& name, int depth, Recording& out) {
  const unsigned fields = Mat_VarGetNumberOfFields(const_cast<matvar_t*>(&v));
  char* const* names = Mat_VarGetStructFieldnames(&v);
  std::size_t elements = 1;
  for (int d = 0; d < v.rank; ++d) elements *= v.dims[d];
  if (!names || !v.data || elements > most_structures || v.nbytes < elements * fields * sizeof(matvar_t*)) return leave_out(name, "its fields cannot be read", out);
  for (std::size_t i = 0; i < elements; ++i)
    for (unsigned f = 0; f < fields; ++f)
      if (const matvar_t* field = Mat_VarGetStructFieldByIndex(const_cast<matvar_t*>(&v), f, i)) take(*field, field_name(name, i, elements, names[f]), depth + 1, out);
}

void take(const matvar_t& v, const std::string& name, int depth, Recording& out) {
  if (depth > deepest_structure) return leave_out(name, "its structures are nested more than eight deep", out);
  if (v.class_type == MAT_C_STRUCT) return take_structure(v, name, depth, out);
  if (v.isComplex) return leave_out(name, "its numbers are complex", out);
  std::vector<double> held;
  // The data that were read, not the size that the file claims.
  const std::size_t count = v.data ? v.nbytes / static_cast<std::size_t>(std::max(v.data_size, 1)) : 0;
  if (!numbers(v, count, held)) return leave_out(name, "it holds no numbers", out);
  add_matrix(name, v.dims ? std::vector<std::size_t>(v.dims, v.dims + v.rank) : std::vector<std::size_t>{}, v.class_type != MAT_C_DOUBLE && v.class_type != MAT_C_SINGLE, held, out);
}

/// Bytes that the variable and what is in it claim to hold.
double claimed_bytes(const matvar_t& v, int depth = 0) {
  double elements = 1;
  for (int d = 0; d < v.rank && v.dims; ++d) elements *= static_cast<double>(v.dims[d]);
  if (v.class_type != MAT_C_STRUCT && v.class_type != MAT_C_CELL) return elements * std::max(v.data_size, 1);
  double sum = elements;
  const std::size_t held = v.data && v.data_size > 0 ? v.nbytes / static_cast<std::size_t>(v.data_size) : 0;
  for (std::size_t i = 0; i < held && depth < 16; ++i)
    if (const matvar_t* inner = static_cast<matvar_t* const*>(v.data)[i]) sum += claimed_bytes(*inner, depth + 1);
  return sum;
}

/// Nothing where this is no such file.
std::optional<Recording> read_here(const std::string& path) {
  Mat_LogInitFunc("unrig", be_quiet);
  const std::unique_ptr<mat_t, CloseMat> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) return std::nullopt;
  Recording out{path, "MAT", {}, {}};
  constexpr double densest = 1032;  // bytes that a byte of deflate can become (RFC 1951: 258 for two bits)
  const double most = densest * static_cast<double>(std::filesystem::file_size(path));
  while (const std::unique_ptr<matvar_t, FreeVariable> variable{Mat_VarReadNextInfo(file.get())}) {
    const std::string name = variable->name ? variable->name : "";
    if (claimed_bytes(*variable) > most)
      leave_out(name, "it claims to be larger than the file can hold", out);
    else if (Mat_VarReadDataAll(file.get(), variable.get()) != 0)
      leave_out(name, "it cannot be read", out);
    else
      take(*variable, name, 0, out);
  }
  return out;
}

template <class T>
void put(std::string& bytes, const T* numbers, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(numbers), count * sizeof(T));
}

void put(std::string& bytes, const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  put(bytes, &size, 1);
  bytes += text;
}

/// For the other process: channels with name, reason for being raw, and values; then the warnings.
std::string packed(const Recording& recording) {
  std::string bytes;
  const std::uint64_t counts[]{recording.channels.size(), recording.warnings.size()};
  put(bytes, counts, 2);
  for (const RecordedChannel& channel : recording.channels) {
    put(bytes, channel.name);
    put(bytes, channel.raw);
    const std::uint64_t samples = channel.value.size();
    put(bytes, &samples, 1);
    put(bytes, channel.value.data(), channel.value.size());
  }
  for (const std::string& warning : recording.warnings) put(bytes, warning);
  return bytes;
}

Recording unpacked(const std::string& bytes, const std::string& path) {
  ByteReader from(bytes, std::endian::native == std::endian::big);
  Recording out{path, "MAT", {}, {}};
  const auto channels = from.number<std::uint64_t>(), warnings = from.number<std::uint64_t>();
  for (std::uint64_t c = 0; c < channels; ++c) {
    RecordedChannel channel{from.text(), "", {}, "", 0, 0};
    channel.raw = from.text();
    channel.value.resize(from.number<std::uint64_t>());
    const std::string_view values = from.take(channel.value.size() * sizeof(double));
    std::memcpy(channel.value.data(), values.data(), values.size());
    out.channels.push_back(std::move(channel));
  }
  for (std::uint64_t w = 0; w < warnings; ++w) out.warnings.push_back(from.text());
  return out;
}

enum ChildStatus { child_done = 0, child_no_file = 3 };

/// Ends this process with its parent, and where it takes more memory or time than a file of this size can need: a damaged one can ask for any.
void limit(std::uintmax_t file_size) {
  constexpr std::uintmax_t base = 1u << 30, times_the_file = 50;  // bytes of memory: for 130 million samples packed to nothing, beside what is packed
  constexpr std::uintmax_t seconds = 5, bytes_a_second = 2u << 20;  // of processor time
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::uintmax_t pages = 0;  // a sanitizer's shadow is address space too
  std::ifstream("/proc/self/statm") >> pages;
  const auto most = [](int what, std::uintmax_t value) {
    const rlimit both{value, value};
    ::setrlimit(static_cast<__rlimit_resource>(what), &both);
  };
  most(RLIMIT_AS, pages * static_cast<std::uintmax_t>(::sysconf(_SC_PAGESIZE)) + base + times_the_file * file_size);
  most(RLIMIT_CPU, seconds + file_size / bytes_a_second);
  most(RLIMIT_CORE, 0);
}

}  // namespace

Recording read_mat73(const std::string& path) {
  const auto refuse = [&](const std::string& what) -> InputError { return {{path, 0}, what, "wanted a MATLAB file of version 5 or 7.3", "Save it again with `save(..., '-v7')`."}; };
  const int shared = memfd_create("unrig", MFD_CLOEXEC);
  const struct Close {
    int file;
    ~Close() { ::close(file); }
  } close{shared};
  const pid_t child = shared < 0 ? -1 : ::fork();
  if (child < 0) throw std::runtime_error("no second process can be started");
  const std::string handed = fmt::format("/proc/self/fd/{}", shared);
  if (child == 0) {
    int status = 1;
    try {
      std::error_code ignored;  // what cannot be read is found out below
      const std::uintmax_t size = std::filesystem::file_size(path, ignored);
      limit(ignored ? 0 : size);
      const std::optional<Recording> found = read_here(path);
      if (found) write_text(handed, packed(*found));
      status = found ? child_done : child_no_file;
    } catch (...) {  // the status says that something went wrong
    }
    ::_exit(status);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == child_no_file) throw refuse("this is no MATLAB file of version 7.3");
  if (!WIFEXITED(status) || WEXITSTATUS(status) != child_done) throw refuse("the file is damaged: libmatio, which reads it, broke down, or asked for more memory or time than a file of this size can need");
  Recording out = unpacked(read_text(handed), path);
  if (out.channels.empty()) throw refuse("the file holds no variable with real numbers");
  return out;
}

}  // namespace unrig
