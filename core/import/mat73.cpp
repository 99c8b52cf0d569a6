#include "core/import/mat73.h"

#include <fmt/format.h>
#if __has_include(<hdf5.h>)
#include <hdf5.h>
#else
#include <hdf5/serial/hdf5.h>  // where Debian has it
#endif
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>

#include "core/files/error.h"
#include "core/import/byte_reader.h"
#include "core/import/matlab_matrix.h"
#include "core/files/scan.h"
#include "core/files/text_file.h"

namespace unrig {
namespace {

/// An object of HDF5 that closes itself.
class H5Handle {
 public:
  H5Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~H5Handle() {
    if (id_ >= 0) close_(id_);
  }
  H5Handle(const H5Handle&) = delete;
  H5Handle& operator=(const H5Handle&) = delete;
  explicit operator bool() const { return id_ >= 0; }
  operator hid_t() const { return id_; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/// Text of a fixed length, whatever stands behind its end: NUL (MATLAB), NULs up to the length (h5py, hdf5storage), or blanks.
H5Handle text_type(std::size_t length) {
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, std::max<std::size_t>(1, length));
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return {type, H5Tclose};
}

std::string without_padding(std::string_view text) { return std::string(trimmed(text.substr(0, text.find('\0')))); }

/// Empty where the object has no such attribute, or no text in it.
std::string text_attribute(hid_t object, const char* name) {
  if (H5Aexists(object, name) <= 0) return "";
  const H5Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  const H5Handle type(attribute ? H5Aget_type(attribute) : -1, H5Tclose);
  if (!type || H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0) return "";
  constexpr std::size_t longest = 256;
  std::string text(std::min(longest, H5Tget_size(type)), '\0');
  return H5Aread(attribute, text_type(text.size()), text.data()) < 0 ? "" : without_padding(text);
}

/// What a dataset is, as far as it matters here.
struct Dataset {
  H5T_class_t stored = H5T_NO_CLASS;
  std::string matlab;             ///< its class; empty in a file that MATLAB's rules had no part in
  std::vector<std::size_t> size;  ///< as MATLAB counts: its first dimension is the last of HDF5
  double elements = 1;
  std::size_t bytes = 0;  ///< of an element
  bool damaged = false;   ///< its chunks have another shape than itself: HDF5 takes all memory over them
};

Dataset described(hid_t id) {
  Dataset dataset;
  const H5Handle type(H5Dget_type(id), H5Tclose), space(H5Dget_space(id), H5Sclose);
  if (!type || !space) return dataset;
  dataset.stored = H5Tget_class(type);
  dataset.bytes = H5Tget_size(type);
  dataset.matlab = text_attribute(id, "MATLAB_class");
  const int rank = H5Sget_simple_extent_ndims(space);
  std::vector<hsize_t> extent(static_cast<std::size_t>(std::max(0, rank)));
  if (rank > 0) H5Sget_simple_extent_dims(space, extent.data(), nullptr);
  for (const hsize_t n : extent) dataset.elements *= static_cast<double>(n);
  dataset.size.assign(extent.rbegin(), extent.rend());
  while (dataset.size.size() < 2) dataset.size.push_back(1);
  const H5Handle layout(H5Dget_create_plist(id), H5Pclose);
  dataset.damaged = layout && H5Pget_layout(layout) == H5D_CHUNKED && H5Pget_chunk(layout, 0, nullptr) != rank;
  return dataset;
}

bool is_number_class(const std::string& matlab) {
  constexpr std::array classes = {"double", "single", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "logical"};
  return std::find(classes.begin(), classes.end(), matlab) != classes.end();
}

class Mat73File {
 public:
  explicit Mat73File(const std::string& path) : out_{path, "MAT", {}, {}} {
    constexpr double densest = 1032;  // bytes that a byte of deflate can become (RFC 1951: 258 for two bits)
    most_bytes_ = densest * static_cast<double>(std::filesystem::file_size(path));
  }

  /// Nothing where this is no HDF5 file.
  std::optional<Recording> read() {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // what fails is told here
    const H5Handle file(H5Fopen(out_.file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose);
    if (!file) return std::nullopt;
    const H5Handle root(H5Gopen2(file, "/", H5P_DEFAULT), H5Gclose);
    if (!root) return std::nullopt;
    for (const std::string& name : members(root))
      if (!name.starts_with('#')) member(root, name, name, 0);  // MATLAB's own: #refs#, #subsystem#
    name_columns(texts_, out_);
    return std::move(out_);
  }

 private:
  std::vector<std::string> members(hid_t group) const {
    constexpr hsize_t most = 100000;
    H5G_info_t info{};
    std::vector<std::string> names;
    if (H5Gget_info(group, &info) < 0) return names;
    for (hsize_t i = 0; i < std::min(info.nlinks, most); ++i) {
      char name[256] = "";
      if (H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, i, name, sizeof name, H5P_DEFAULT) > 0) names.emplace_back(name);
    }
    return names;
  }

  void member(hid_t group, const std::string& key, const std::string& name, int depth) {
    const H5Handle object(H5Oopen(group, key.c_str(), H5P_DEFAULT), H5Oclose);
    object ? take(object, name, depth) : leave_out(name, "it cannot be read", out_);
  }

  void take(hid_t object, const std::string& name, int depth) {
    if (depth > deepest_structure) return leave_out(name, "its structures are nested more than eight deep", out_);
    const H5I_type_t kind = H5Iget_type(object);
    if (kind == H5I_GROUP) {
      for (const std::string& field : members(object)) this->field(object, field, name, depth + 1);
      return;
    }
    if (kind != H5I_DATASET) return leave_out(name, "it holds no numbers", out_);
    const Dataset dataset = described(object);
    if (H5Aexists(object, "MATLAB_empty") > 0) return leave_out(name, "it is empty", out_);
    if (dataset.damaged) return leave_out(name, "it is damaged", out_);
    if (dataset.elements * static_cast<double>(dataset.bytes) > most_bytes_) return leave_out(name, "it claims to be larger than the file can hold", out_);
    if (dataset.stored == H5T_REFERENCE) return cell(object, dataset, name);
    if (dataset.stored == H5T_COMPOUND) return leave_out(name, "its numbers are complex", out_);
    if (dataset.stored == H5T_STRING) return take_texts(name, stored_texts(object, dataset));
    const bool numbers = dataset.stored == H5T_FLOAT || dataset.stored == H5T_INTEGER;
    if (!numbers || !(dataset.matlab.empty() || is_number_class(dataset.matlab))) return leave_out(name, "it holds no numbers", out_);
    std::vector<double> values(static_cast<std::size_t>(dataset.elements));
    if (!values.empty() && H5Dread(object, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0) return leave_out(name, "it cannot be read", out_);
    const bool integers = dataset.matlab.empty() ? dataset.stored == H5T_INTEGER : dataset.matlab != "double" && dataset.matlab != "single";
    add_matrix(name, dataset.size, integers, values, out_);
  }

  /// A field of an array of structures holds a reference for each of them.
  void field(hid_t group, const std::string& key, const std::string& structure, int depth) {
    const std::string name = field_name(structure, 0, 1, key);
    const H5Handle object(H5Oopen(group, key.c_str(), H5P_DEFAULT), H5Oclose);
    if (!object) return leave_out(name, "it cannot be read", out_);
    const Dataset dataset = H5Iget_type(object) == H5I_DATASET ? described(object) : Dataset{};
    if (dataset.stored != H5T_REFERENCE || !dataset.matlab.empty()) return take(object, name, depth);
    const std::vector<hobj_ref_t> references = references_of(object, dataset);
    if (references.empty()) return leave_out(name, "its fields cannot be read", out_);
    for (std::size_t i = 0; i < references.size(); ++i) {
      const H5Handle element(H5Rdereference2(object, H5P_DEFAULT, H5R_OBJECT, &references[i]), H5Oclose);
      const std::string own = field_name(structure, i, references.size(), key);
      element ? take(element, own, depth) : leave_out(own, "it cannot be read", out_);
    }
  }

  std::vector<hobj_ref_t> references_of(hid_t object, const Dataset& dataset) const {
    if (!(dataset.elements <= static_cast<double>(most_structures)) || dataset.bytes != sizeof(hobj_ref_t)) return {};
    std::vector<hobj_ref_t> references(static_cast<std::size_t>(dataset.elements));
    if (!references.empty() && H5Dread(object, H5T_STD_REF_OBJ, H5S_ALL, H5S_ALL, H5P_DEFAULT, references.data()) < 0) return {};
    return references;
  }

  void cell(hid_t object, const Dataset& dataset, const std::string& name) {
    std::vector<std::string> texts;
    for (const hobj_ref_t& reference : references_of(object, dataset)) {
      const H5Handle element(H5Rdereference2(object, H5P_DEFAULT, H5R_OBJECT, &reference), H5Oclose);
      if (!element || H5Iget_type(element) != H5I_DATASET) return leave_out(name, "it holds no numbers", out_);
      const Dataset held = described(element);
      if (held.matlab != "char" || held.stored != H5T_INTEGER) return leave_out(name, "it holds no numbers", out_);
      constexpr double longest = 1000;
      std::vector<std::uint16_t> letters(held.elements <= longest ? static_cast<std::size_t>(held.elements) : 0);
      if (!letters.empty() && H5Dread(element, H5T_NATIVE_UINT16, H5S_ALL, H5S_ALL, H5P_DEFAULT, letters.data()) < 0) letters.clear();
      texts.push_back(text_of_units(letters));
    }
    take_texts(name, std::move(texts));
  }

  /// As h5py stores a list of texts.
  std::vector<std::string> stored_texts(hid_t object, const Dataset& dataset) const {
    std::vector<std::string> texts;
    if (!(dataset.elements <= static_cast<double>(most_structures))) return texts;
    const auto count = static_cast<std::size_t>(dataset.elements);
    const H5Handle type(H5Dget_type(object), H5Tclose), space(H5Dget_space(object), H5Sclose);
    if (H5Tis_variable_str(type) > 0) {
      std::vector<char*> held(count, nullptr);
      if (H5Dread(object, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, held.data()) < 0) return texts;
      for (const char* text : held) texts.push_back(text ? without_padding(text) : "");
      H5Dvlen_reclaim(type, space, H5P_DEFAULT, held.data());
      return texts;
    }
    std::string held(count * dataset.bytes, '\0');
    if (H5Dread(object, text_type(dataset.bytes), H5S_ALL, H5S_ALL, H5P_DEFAULT, held.data()) < 0) return texts;
    for (std::size_t i = 0; i < count; ++i) texts.push_back(without_padding(std::string_view(held).substr(i * dataset.bytes, dataset.bytes)));
    return texts;
  }

  void take_texts(const std::string& name, std::vector<std::string> texts) {
    if (texts.size() < 2) return leave_out(name, "it holds no numbers", out_);
    texts_.push_back({name, std::move(texts)});
  }

  Recording out_;
  std::vector<NamedTexts> texts_;
  double most_bytes_ = 0;
};

template <class T>
void put(std::string& bytes, const T* numbers, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(numbers), count * sizeof(T));
}

void put(std::string& bytes, const std::string& text) {
  const auto size = static_cast<std::uint32_t>(text.size());
  put(bytes, &size, 1);
  bytes += text;
}

/// For the other process: channels with name, label, unit, reason for being raw, and values; then the warnings.
std::string packed(const Recording& recording) {
  std::string bytes;
  const std::uint64_t counts[]{recording.channels.size(), recording.warnings.size()};
  put(bytes, counts, 2);
  for (const RecordedChannel& channel : recording.channels) {
    for (const std::string* text : {&channel.name, &channel.label, &channel.unit, &channel.raw}) put(bytes, *text);
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
    RecordedChannel channel;
    for (std::string* text : {&channel.name, &channel.label, &channel.unit, &channel.raw}) *text = from.text();
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
      const std::optional<Recording> found = Mat73File(path).read();
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
  if (!WIFEXITED(status) || WEXITSTATUS(status) != child_done) throw refuse("the file is damaged: HDF5, which reads it, broke down, or asked for more memory or time than a file of this size can need");
  Recording out = unpacked(read_text(handed), path);
  if (out.channels.empty()) throw refuse("the file holds no variable with real numbers");
  return out;
}

}  // namespace unrig
