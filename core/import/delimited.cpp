#include "core/import/delimited.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/import/number_form.h"
#include "core/import/table_cells.h"
#include "core/import/time_stamp.h"
#include "core/files/scan.h"
#include "core/files/text_kind.h"

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

/// "#N/A", "#DIV/0!", "#NV": marks of spreadsheets, with which a row can begin.
bool is_spreadsheet_mark(std::string_view cell) {
  if (!cell.starts_with('#') || cell.find_first_not_of("#ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/!?") != std::string_view::npos) return false;
  return cell == "#NV" || cell.find_first_of("/!?") != std::string_view::npos;
}

/// The lines of a text one by one.
struct Lines {
  std::string_view text;
  char end = '\n';
  int line = 0;
  bool ended = true;                       ///< the last one has its line end
  std::string_view remark{};               ///< the last one
  std::string delimiter{};                 ///< once it is known, a row may begin with a mark such as #N/A
  std::vector<std::string_view> missing{};  ///< or with one of these

  bool next(std::string_view& out, bool skip_remarks = true) {
    while (!text.empty()) {
      const std::size_t length = text.find(end);
      ended = length != std::string_view::npos;
      out = text.substr(0, length);
      text.remove_prefix(ended ? length + 1 : text.size());
      ++line;
      if (out.ends_with('\r')) out.remove_suffix(1);
      const std::string_view content = trimmed(out);
      if (!skip_remarks || !(content.empty() || is_remark(content))) return true;
      if (!content.empty()) remark = out;
    }
    return false;
  }

 private:
  bool is_remark(std::string_view content) const {
    if (content.front() != '#' && content.front() != '%') return false;
    if (delimiter.empty()) return true;
    const std::string_view first = trimmed(content.substr(0, content.find_first_of(delimiter == "blanks" ? " \t" : delimiter)));
    return !is_spreadsheet_mark(first) && std::find(missing.begin(), missing.end(), first) == missing.end();
  }
};

/// A column, and what its cells have held so far.
struct ReadColumn {
  RecordedChannel channel;
  bool numbers = false;
  std::optional<std::string> first_stamp{};
  SecondsSinceTheFirst seconds{};
  std::optional<LeftOutChannel> left_out{};
};

std::size_t cells_in(std::string_view line, const std::string& delimiter) {
  std::vector<std::string_view> cells = cells_of(line, delimiter);
  while (!cells.empty() && cells.back().empty()) cells.pop_back();
  return cells.size();
}

bool looks_like_numbers(std::string_view line, const std::string& delimiter) {
  for (const std::string_view cell : cells_of(line, delimiter))
    if (cell.find_first_not_of("+-0123456789.,:eE ") != std::string_view::npos) return false;
  return line.find_first_of("0123456789") != std::string_view::npos;
}

/// Lines before the table that have fewer cells than it: what a program or a spreadsheet writes about the recording. The table begins where two rows of numbers are alike,
/// with the rows of as many cells right above them. None in a table between blanks, where words of a title look like names.
int title_lines(std::string_view text, const std::string& given) {
  constexpr std::size_t furthest = 200;
  struct Row {
    std::string_view line;
    int above;
  };
  std::vector<Row> rows;
  Lines lines{text};
  if (text.find('\n') == std::string_view::npos) lines.end = '\r';
  for (std::string_view line; rows.size() < furthest && lines.next(line);) rows.push_back({line, lines.line - 1});
  for (std::size_t k = 1; k + 1 < rows.size(); ++k) {
    const std::string delimiter = given.empty() ? delimiter_in(rows[k].line) : given;
    const std::size_t count = cells_in(rows[k].line, delimiter);
    if (delimiter == "blanks" || count < 2 || !looks_like_numbers(rows[k].line, delimiter) || !looks_like_numbers(rows[k + 1].line, delimiter) || cells_in(rows[k + 1].line, delimiter) != count) continue;
    std::size_t first = k;
    while (first > 0 && cells_in(rows[first - 1].line, delimiter) == count) --first;
    return first == 0 || first == k ? 0 : rows[first].above;
  }
  return 0;
}

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
    lines_.delimiter = format_.delimiter;
    lines_.missing.assign(format_.missing.begin(), format_.missing.end());
    find_number_form(from_here);
    if (format_.header.value_or(!all_values(line))) {
      take_names(cells_of(line, format_.delimiter));
      if (lines_.next(line) && !units_row(line)) row(line);
    } else {
      name_by_remark(cells_of(line, format_.delimiter).size());
      row(line);
    }
    while (lines_.next(line)) row(line);
    return finished();
  }

 private:
  [[noreturn]] void refuse(const std::string& found, const std::string& wanted, const std::string& advice) const { throw InputError({out_.file, lines_.line}, found, wanted, advice); }

  // ------------------------------------------------------------------------------------------------------------ how numbers are written

  /// What the format says, else what all cells from the first row on show.
  void find_number_form(Lines lines) {
    form_.missing = format_.missing;
    if (!format_.thousands.empty()) form_.thousands = format_.thousands.front();
    if (!format_.decimal.empty()) form_.decimal = format_.decimal.front();
    else if (form_.thousands == '.') form_.decimal = ',';
    else if (form_.thousands != ',' && format_.delimiter != "," && shows_commas(lines)) {
      form_.decimal = ',';
      out_.format = "text; by its numbers the decimal sign is the comma";
    }
    const bool twice = format_.delimiter == "," && (form_.decimal == ',' || form_.thousands == ',');
    if (twice && lines.text.find('"') == std::string_view::npos)
      refuse("commas stand between the cells and within numbers, and no cell is quoted", "wanted another delimiter, or numbers in quotes",
             "The mapping's [format] names delimiter, decimal and thousands.");
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

  bool is_missing(std::string_view cell) const { return cell.empty() || std::find(form_.missing.begin(), form_.missing.end(), cell) != form_.missing.end(); }
  bool is_value(std::string_view cell) const { return cell_number(cell, form_) || read_time_stamp(cell); }

  bool all_values(std::string_view line) const {
    const std::vector<std::string_view> cells = cells_of(line, format_.delimiter);
    return std::all_of(cells.begin(), cells.end(), [&](std::string_view cell) { return is_missing(cell) || is_value(cell); });
  }

  // ------------------------------------------------------------------------------------------------------------ names and units

  void take_names(std::vector<std::string_view> cells) {
    while (cells.size() > 1 && cells.back().empty()) cells.pop_back();  // delimiters at the end of the row
    for (const std::string_view cell : cells) {
      if (!format_.header && is_value(cell))
        out_.warnings.push_back(fmt::format("{}:{}: \"{}\" is taken for the name of a column, as the row holds text too; `header = false` in [format] makes it a row", out_.file, lines_.line,
                                            cell.substr(0, 40)));
      columns_.push_back({cell.empty() ? RecordedChannel{fmt::format("{}", columns_.size() + 1), "", {}, "", 0, 0} : named(cell)});
    }
    first_line_ = lines_.line;
  }

  void name_by_remark(std::size_t columns) {
    std::string_view remark = trimmed(lines_.remark);
    remark.remove_prefix(std::min(remark.find_first_not_of("#%"), remark.size()));
    const std::vector<std::string_view> names = cells_of(trimmed(remark), format_.delimiter);
    const bool fit = columns > 1 && names.size() == columns;
    for (std::size_t c = 0; c < columns; ++c) columns_.push_back({fit ? named(names[c]) : RecordedChannel{fmt::format("{}", c + 1), "", {}, "", 0, 0}});
    first_line_ = lines_.line;
  }

  /// Takes a row below a header without units for the units where it holds no value and each column with a value in the first row that has any holds text here.
  bool units_row(std::string_view line) {
    const std::vector<std::string_view> cells = cells_of(line, format_.delimiter);
    const auto no_unit = [&](std::string_view cell) { return !cell.empty() && (is_missing(cell) || is_value(cell) || cell.find_first_not_of("+-0123456789.,") == std::string_view::npos); };
    if (std::any_of(cells.begin(), cells.end(), no_unit)) return false;
    for (std::size_t c = columns_.size(); c < cells.size(); ++c)
      if (!cells[c].empty()) return false;
    if (std::any_of(columns_.begin(), columns_.end(), [](const ReadColumn& column) { return !column.channel.unit.empty(); })) return false;
    if (!heads_values(cells)) return false;
    for (std::size_t c = 0; c < columns_.size() && c < cells.size(); ++c) {
      std::string_view unit = cells[c];
      if (unit.size() > 2 && ((unit.front() == '[' && unit.back() == ']') || (unit.front() == '(' && unit.back() == ')'))) unit = trimmed(unit.substr(1, unit.size() - 2));
      columns_[c].channel.unit = unit;
    }
    return true;
  }

  bool heads_values(const std::vector<std::string_view>& units) const {
    constexpr int furthest = 1000;
    Lines ahead = lines_;
    std::vector<std::string_view> cells;
    std::string_view line;
    for (int i = 0; i < furthest && ahead.next(line); ++i) {
      split_cells(line, format_.delimiter, cells);
      bool any = false;
      for (std::size_t c = 0; c < cells.size(); ++c) {
        if (is_missing(cells[c]) || !is_value(cells[c])) continue;
        any = true;
        if (c >= units.size() || units[c].empty()) return false;
      }
      if (any) return true;
    }
    return false;
  }

  // ------------------------------------------------------------------------------------------------------------ rows

  void row(std::string_view line) {
    const std::size_t before = cells_.size();
    split_cells(line, format_.delimiter, cells_);
    const bool cut = !lines_.ended && rows_ > 0 && cells_.size() < before;  // a number before the cut may be cut too
    while (cells_.size() > columns_.size() && cells_.back().empty()) cells_.pop_back();
    if (cells_.size() > columns_.size() || (cells_.size() < columns_.size() && (cut || format_.delimiter == "blanks"))) refuse_row();
    for (std::size_t c = 0; c < cells_.size(); ++c) take(cells_[c], columns_[c]);
    for (std::size_t c = cells_.size(); c < columns_.size(); ++c) {
      if (columns_[c].numbers || columns_[c].first_stamp) refuse_row();
      leave_out(columns_[c], "the row ends before it", "Each row needs as many cells as the header, if only empty ones.");
    }
    ++rows_;
  }

  [[noreturn]] void refuse_row() const {
    refuse(fmt::format("the row has {} cells", cells_.size()), fmt::format("wanted {}, as in the first", columns_.size()), "The mapping's [format] can name delimiter, decimal and skip_lines.");
  }

  void take(std::string_view cell, ReadColumn& column) {
    if (column.left_out) return;
    const std::optional<double> number = is_missing(cell) ? std::numeric_limits<double>::quiet_NaN() : cell_number(cell, form_);
    if (number && (std::isnan(*number) || !column.first_stamp)) {
      column.numbers = column.numbers || !std::isnan(*number);
      column.channel.value.push_back(*number);
      return;
    }
    const std::optional<TimeStamp> stamp = column.numbers ? std::nullopt : read_time_stamp(cell);
    const std::optional<double> second = stamp ? column.seconds(*stamp) : std::nullopt;
    if (second) {
      if (!column.first_stamp) column.first_stamp = cell;
      column.channel.value.push_back(*second);
      return;
    }
    const NoNumber no = why_no_number(cell, form_);
    if (column.first_stamp) leave_out(column, fmt::format("\"{}\" is no time stamp like \"{}\" above it", cell.substr(0, 40), *column.first_stamp), no.advice);
    else leave_out(column, no.why, no.advice);
  }

  void leave_out(ReadColumn& column, const std::string& why, const std::string& advice) const {
    if (column.left_out) return;
    column.left_out = {column.channel.name, lines_.line, why, advice};
    Values().swap(column.channel.value);
  }

  Recording finished() {
    if (rows_ == 0) refuse("the table has no rows", "wanted rows of numbers", "");
    for (ReadColumn& column : columns_) {
      if (!column.left_out && !column.numbers && !column.first_stamp) column.left_out = {column.channel.name, first_line_, "all its cells are empty", "A column of the run needs numbers."};
      if (column.first_stamp) {
        column.channel.unit = "s";
        column.channel.remark = fmt::format("since {}", *column.first_stamp);
      }
      if (column.left_out) out_.left_out.push_back(*column.left_out);
      else out_.channels.push_back(std::move(column.channel));
    }
    if (out_.channels.empty()) {
      const LeftOutChannel& first = out_.left_out.front();
      throw InputError({out_.file, first.line}, fmt::format("no column holds numbers only: {}, in the column \"{}\"", first.why, first.name), "wanted a column of numbers", first.advice);
    }
    return std::move(out_);
  }

  using Values = std::vector<double>;
  Lines lines_;
  DelimitedFormat format_;
  NumberForm form_;
  std::vector<ReadColumn> columns_;
  std::vector<std::string_view> cells_;  // of the last row
  int first_line_ = 0;                   // of the header, or of the first row
  std::size_t rows_ = 0;
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
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(std::string_view(text).substr(at));
    if (length == 0) {
      for (std::size_t k = 0; k < text.size(); ++k) add(byte(k));
      return out;
    }
    at += length;
  }
  return text;
}

Recording read_delimited(std::string_view text, const std::string& file, const DelimitedFormat& format) {
  DelimitedFormat behind = format;
  if (format.skip_lines == 0) behind.skip_lines = title_lines(text, format.delimiter);
  Recording out = Table(text, file, behind).read();
  if (behind.skip_lines > format.skip_lines) out.warnings.push_back(fmt::format("{}: the first {} line(s) are taken for titles; skip_lines in [format] says otherwise", file, behind.skip_lines));
  return out;
}

}  // namespace unrig
