#include "core/import/delimited.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/error.h"
#include "core/import/number_form.h"
#include "core/import/table_cells.h"
#include "core/scan.h"

namespace unrig {
namespace {

/// "Force [N]" or "Force (N)" -> name and unit.
RecordedChannel named(std::string_view cell) {
  RecordedChannel channel{unescaped(cell), "", {}, "", 0, 0};
  for (const auto& [open, close] : {std::pair{'[', ']'}, std::pair{'(', ')'}}) {
    const std::size_t at = cell.rfind(open);
    if (at == std::string_view::npos || at == 0 || cell.back() != close) continue;
    channel.name = unescaped(trimmed(cell.substr(0, at)));
    channel.unit = trimmed(cell.substr(at + 1, cell.size() - at - 2));
    break;
  }
  return channel;
}

/// The lines of a text one by one.
struct Lines {
  std::string_view text;
  char end = '\n';
  int line = 0;
  std::string_view remark{};  ///< the last one

  bool next(std::string_view& out, bool skip_remarks = true) {
    while (!text.empty()) {
      const std::size_t length = text.find(end);
      out = text.substr(0, length);
      text.remove_prefix(length == std::string_view::npos ? text.size() : length + 1);
      ++line;
      if (out.ends_with('\r')) out.remove_suffix(1);
      const std::string_view content = trimmed(out);
      const bool is_remark = !content.empty() && (content.front() == '#' || content.front() == '%');
      if (!skip_remarks || !(content.empty() || is_remark)) return true;
      if (is_remark) remark = out;
    }
    return false;
  }
};

class Table {
 public:
  Table(std::string_view text, const std::string& file, const DelimitedFormat& format) : lines_{text}, format_(format), out_{file, "text", {}, {}} {}

  Recording read() {
    if (lines_.text.starts_with("\xEF\xBB\xBF")) lines_.text.remove_prefix(3);
    if (lines_.text.find('\n') == std::string_view::npos) lines_.end = '\r';  // as old Macintosh programs write
    std::string_view line;
    for (int i = 0; i < format_.skip_lines; ++i)
      if (!lines_.next(line, false)) refuse(fmt::format("the file ends within the {} lines to skip", format_.skip_lines), "wanted a table behind them", "");
    const Lines from_here = lines_;
    if (!lines_.next(line)) refuse("the file holds no table", "wanted rows of numbers", "");
    if (format_.delimiter.empty()) format_.delimiter = delimiter_in(line);
    find_number_form(from_here);
    const bool header = format_.header.value_or(!all_numbers(line));
    if (header) {
      name_columns(cells_of(line, format_.delimiter));
      if (lines_.next(line) && !units_row(line)) row(line);
    } else {
      const std::size_t columns = cells_of(line, format_.delimiter).size();
      std::string_view remark = trimmed(lines_.remark);
      remark.remove_prefix(std::min(remark.find_first_not_of("#%"), remark.size()));
      const std::vector<std::string_view> names = cells_of(trimmed(remark), format_.delimiter);
      if (columns > 1 && names.size() == columns) name_columns(names);
      else for (std::size_t c = 0; c < columns; ++c) out_.channels.push_back({fmt::format("{}", c + 1), "", {}, "", 0, 0});
      row(line);
    }
    while (lines_.next(line)) row(line);
    if (out_.channels.empty() || out_.channels.front().value.empty()) refuse("the table has no rows", "wanted rows of numbers", "");
    return std::move(out_);
  }

 private:
  [[noreturn]] void refuse(const std::string& found, const std::string& wanted, const std::string& advice) const { throw InputError({out_.file, lines_.line}, found, wanted, advice); }

  /// What the format says, else what all cells from the first row on show.
  void find_number_form(Lines lines) {
    if (!format_.thousands.empty()) form_.thousands = format_.thousands.front();
    if (!format_.decimal.empty()) form_.decimal = format_.decimal.front();
    else if (form_.thousands == '.') form_.decimal = ',';
    else if (form_.thousands != ',' && format_.delimiter != "," && shows_commas(lines)) {
      form_.decimal = ',';
      out_.format = "text; no number has a point, so commas are taken for the decimal sign";
    }
    const bool twice = format_.delimiter == "," && (form_.decimal == ',' || form_.thousands == ',');
    if (twice && lines.text.find('"') == std::string_view::npos)
      refuse("commas stand between the cells and within numbers, and no cell is quoted", "wanted another delimiter, or numbers in quotes", "The mapping's [format] names delimiter, decimal and thousands.");
    if (format_.delimiter == "blanks" && form_.thousands == ' ')
      refuse("blanks stand between the cells and within numbers", "wanted another delimiter", "The mapping's [format] names delimiter, decimal and thousands.");
  }

  bool shows_commas(Lines lines) const {
    if (lines.text.find(',') == std::string_view::npos) return false;
    DecimalSign sign;
    std::vector<std::string_view> cells;
    for (std::string_view line; !sign.is_point() && lines.next(line);) {
      split_cells(line, format_.delimiter, cells);
      for (const std::string_view cell : cells) sign.see(cell);
    }
    return sign.is_comma();
  }

  void name_columns(const std::vector<std::string_view>& cells) {
    for (const std::string_view cell : cells) out_.channels.push_back(named(cell));
    if (out_.channels.size() > 1 && out_.channels.back().name.empty()) out_.channels.pop_back();  // a delimiter at the end of the row
  }

  bool is_number(std::string_view cell) const { return cell_number(cell, form_).has_value(); }

  bool all_numbers(std::string_view line) const {
    const std::vector<std::string_view> cells = cells_of(line, format_.delimiter);
    return std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) { return cell.empty() || is_number(cell); });
  }

  /// Takes a row below a header without units that holds no number and no gap for the units.
  bool units_row(std::string_view line) {
    const std::vector<std::string_view> cells = cells_of(line, format_.delimiter);
    if (cells.size() < out_.channels.size()) return false;
    for (std::size_t c = 0; c < cells.size(); ++c)
      if (c < out_.channels.size() ? cells[c].empty() || is_number(cells[c]) || !out_.channels[c].unit.empty() : !cells[c].empty()) return false;
    for (std::size_t c = 0; c < out_.channels.size(); ++c) {
      std::string_view unit = cells[c];
      if (unit.size() > 2 && ((unit.front() == '[' && unit.back() == ']') || (unit.front() == '(' && unit.back() == ')'))) unit = trimmed(unit.substr(1, unit.size() - 2));
      out_.channels[c].unit = unit;
    }
    return true;
  }

  void row(std::string_view line) {
    const std::vector<std::string_view> cells = cells_of(line, format_.delimiter);
    // A delimiter at the end of each row makes one empty cell too many.
    const std::size_t count = cells.size() == out_.channels.size() + 1 && cells.back().empty() ? cells.size() - 1 : cells.size();
    if (count != out_.channels.size())
      refuse(fmt::format("the row has {} cells", count), fmt::format("wanted {}, as in the first", out_.channels.size()), "The mapping's [format] can name delimiter, decimal and skip_lines.");
    for (std::size_t c = 0; c < count; ++c) out_.channels[c].value.push_back(number(cells[c], out_.channels[c].name));
  }

  double number(std::string_view cell, const std::string& column) const {
    if (cell.empty()) return std::numeric_limits<double>::quiet_NaN();
    const std::optional<double> value = cell_number(cell, form_);
    if (value) return *value;
    const NoNumber no = why_no_number(cell, form_);
    refuse(fmt::format("{}, in the column \"{}\"", no.why, column), "wanted a number", no.advice);
  }

  Lines lines_;
  DelimitedFormat format_;
  NumberForm form_;
  Recording out_;
};

}  // namespace

std::string in_utf8(std::string text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  std::string out;
  const auto add = [&](unsigned code) {  // below 65536
    if (code < 0x80) out += static_cast<char>(code);
    else if (code < 0x800) (out += static_cast<char>(0xC0 | code >> 6)) += static_cast<char>(0x80 | (code & 0x3F));
    else ((out += static_cast<char>(0xE0 | code >> 12)) += static_cast<char>(0x80 | (code >> 6 & 0x3F))) += static_cast<char>(0x80 | (code & 0x3F));
  };
  if (const bool little = text.starts_with("\xFF\xFE"); little || text.starts_with("\xFE\xFF")) {
    for (std::size_t i = 2; i + 1 < text.size(); i += 2) {
      const unsigned code = little ? byte(i) | byte(i + 1) << 8U : byte(i) << 8U | byte(i + 1);
      add(code >= 0xD800 && code < 0xE000 ? '?' : code);  // pairs of surrogates name no unit
    }
    return out;
  }
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (byte(i) < 0x80) continue;
    const std::size_t more = byte(i) >= 0xF0 ? 3 : byte(i) >= 0xE0 ? 2 : byte(i) >= 0xC2 ? 1 : 0;
    bool whole = more > 0 && byte(i) < 0xF5 && i + more < text.size();
    for (std::size_t k = 1; whole && k <= more; ++k) whole = (byte(i + k) & 0xC0) == 0x80;
    if (!whole) {
      for (std::size_t k = 0; k < text.size(); ++k) add(byte(k));
      return out;
    }
    i += more;
  }
  return text;
}

Recording read_delimited(std::string_view text, const std::string& file, const DelimitedFormat& format) { return Table(text, file, format).read(); }

}  // namespace unrig
