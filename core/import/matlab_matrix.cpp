#include "core/import/matlab_matrix.h"

#include <fmt/format.h>

namespace unrig {

void leave_out(const std::string& name, const std::string& why, Recording& out) {
  constexpr std::size_t most = 100;
  if (out.warnings.size() < most) out.warnings.push_back(fmt::format("{}: the variable {} is left out: {}", out.file, name, why));
  else if (out.warnings.size() == most) out.warnings.push_back(fmt::format("{}: more variables are left out", out.file));
}

std::string field_name(const std::string& name, std::size_t element, std::size_t elements, const std::string& field) {
  return elements == 1 ? fmt::format("{}.{}", name, field) : fmt::format("{}({}).{}", name, element + 1, field);
}

void add_matrix(const std::string& name, const std::vector<std::size_t>& size, bool integers, const std::vector<double>& numbers, Recording& out) {
  if (size.size() != 2) return leave_out(name, "it is no vector or matrix", out);
  const std::size_t rows = size[0], columns = size[1];
  if (rows == 0 || columns == 0) return leave_out(name, "it is empty", out);
  if (rows > numbers.size() / columns) return leave_out(name, "it is cut off", out);
  const bool vector = rows == 1 || columns == 1;
  if (columns > 1000 && !vector) return leave_out(name, "it has more than 1000 columns", out);
  const std::size_t length = vector ? rows * columns : rows;
  for (std::size_t c = 0; c < (vector ? 1 : columns); ++c) {
    const auto first = numbers.begin() + static_cast<std::ptrdiff_t>(c * length);
    out.channels.push_back({vector ? name : fmt::format("{}(:,{})", name, c + 1), "", {first, first + static_cast<std::ptrdiff_t>(length)},
                            integers ? "the file gives integers and no scale" : "", 0, 0});
  }
}

}  // namespace unrig
