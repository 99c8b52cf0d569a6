#include "core/import/mat73.h"

#include <matio.h>

#include <algorithm>
#include <filesystem>
#include <memory>

#include "core/error.h"
#include "core/import/matlab_matrix.h"

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

}  // namespace

Recording read_mat73(const std::string& path) {
  Mat_LogInitFunc("unrig", be_quiet);
  const auto refuse = [&](const std::string& what) -> InputError { return {{path, 0}, what, "wanted a MATLAB file of version 5 or 7.3", "Save it again with `save(..., '-v7')`."}; };
  const std::unique_ptr<mat_t, CloseMat> file(Mat_Open(path.c_str(), MAT_ACC_RDONLY));
  if (!file) throw refuse("this is no MATLAB file of version 7.3");
  Recording out{path, "MAT", {}, {}};
  constexpr double densest = 1032;  // bytes that a byte of deflate can become (RFC 1951: 258 for two bits)
  const double most = densest * static_cast<double>(std::filesystem::file_size(path));
  while (const std::unique_ptr<matvar_t, FreeVariable> variable{Mat_VarReadNextInfo(file.get())}) {
    const std::string name = variable->name ? variable->name : "";
    if (claimed_bytes(*variable) > most) {
      leave_out(name, "it claims to be larger than the file can hold", out);
      continue;
    }
    if (Mat_VarReadDataAll(file.get(), variable.get()) != 0) {
      leave_out(name, "it cannot be read", out);
      continue;
    }
    take(*variable, name, 0, out);
  }
  if (out.channels.empty()) throw refuse("the file holds no variable with real numbers");
  return out;
}

}  // namespace unrig
