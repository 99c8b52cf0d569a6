#include "core/import/matlab_matrix.h"

#include <algorithm>

#include <fmt/format.h>

#include "core/files/near_word.h"

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
  const bool vector = rows == 1 || columns == 1, on_its_side = columns > rows;
  const std::size_t channels = vector ? 1 : std::min(rows, columns), samples = rows * columns / channels;
  constexpr std::size_t most = 1000;
  if (channels > most) return leave_out(name, fmt::format("it has more than {} channels", most), out);
  for (std::size_t c = 0; c < channels; ++c) {
    RecordedChannel channel{vector ? name : fmt::format(fmt::runtime(on_its_side ? "{}({},:)" : "{}(:,{})"), name, c + 1), "", std::vector<double>(samples),
                            integers ? "the file gives integers and no scale" : "", 0, 0};
    const std::size_t first = on_its_side && !vector ? c : c * samples, step = on_its_side && !vector ? rows : 1;
    for (std::size_t k = 0; k < samples; ++k) channel.value[k] = numbers[first + k * step];
    out.channels.push_back(std::move(channel));
  }
}

std::string text_of_units(const std::vector<std::uint16_t>& units) {
  std::string text;
  for (const std::uint16_t unit : units) {
    if (unit == 0) break;
    if (unit >= 0xD800 && unit < 0xE000) text += '?';
    else if (unit < 0x80) text += static_cast<char>(unit);
    else if (unit < 0x800) (text += static_cast<char>(0xC0 | unit >> 6)) += static_cast<char>(0x80 | (unit & 0x3F));
    else ((text += static_cast<char>(0xE0 | unit >> 12)) += static_cast<char>(0x80 | (unit >> 6 & 0x3F))) += static_cast<char>(0x80 | (unit & 0x3F));
  }
  return text;
}

namespace {

/// "data.names" -> "data."
std::string scope_of(const std::string& name) { return name.substr(0, name.rfind('.') + 1); }

bool is_of_units(const NamedTexts& list) {
  const std::string own = in_small_letters(list.name.substr(scope_of(list.name).size()));
  return own.find("unit") != std::string::npos || own.find("einheit") != std::string::npos;
}

/// The list with as many texts as a matrix of that scope has channels; null where there is none, or more than one.
const NamedTexts* list_for(const std::vector<NamedTexts>& lists, const std::string& scope, std::size_t channels, bool units) {
  const NamedTexts* found = nullptr;
  for (const NamedTexts& list : lists) {
    if (list.texts.size() != channels || scope_of(list.name) != scope || is_of_units(list) != units) continue;
    if (found) return nullptr;
    found = &list;
  }
  return found;
}

}  // namespace

void name_columns(const std::vector<NamedTexts>& lists, Recording& out) {
  if (lists.empty()) return;
  const auto matrix_of = [](const RecordedChannel& channel) { return channel.name.substr(0, channel.name.ends_with(')') ? channel.name.rfind('(') : 0); };
  for (std::size_t first = 0; first < out.channels.size();) {
    const std::string matrix = matrix_of(out.channels[first]);
    std::size_t last = first + 1;
    while (!matrix.empty() && last < out.channels.size() && matrix_of(out.channels[last]) == matrix) ++last;
    const std::string scope = scope_of(matrix);
    const NamedTexts* const names = matrix.empty() ? nullptr : list_for(lists, scope, last - first, false);
    const NamedTexts* const units = matrix.empty() ? nullptr : list_for(lists, scope, last - first, true);
    for (std::size_t c = first; c < last; ++c) {
      if (names) out.channels[c].label = names->texts[c - first];
      if (units) out.channels[c].unit = units->texts[c - first];
    }
    first = last;
  }
}

}  // namespace unrig
