#include "core/files/csv_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <unordered_set>

#include "core/files/scan.h"
#include "core/files/text_kind.h"

namespace unrig {
namespace {

const char* skip_blanks(const char* at, const char* end) {
  while (at != end && (*at == ' ' || *at == '\t')) ++at;
  return at;
}

/// The next line without its end; `text` loses both.
std::string_view take_line(std::string_view& text) {
  const auto length = text.find('\n');
  std::string_view line = text.substr(0, length);
  text.remove_prefix(length == std::string_view::npos ? text.size() : length + 1);
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// Where the cell that begins at `at` ends: its comma, or the end of the row. A quoted cell may hold commas.
const char* cell_end(const char* at, const char* end) {
  if (at != end && *at == '"') at = std::find(at + 1, end, '"');
  return std::find(at, end, ',');
}

CsvColumn header_cell(std::string_view cell, const InputError::Place& place) {
  cell = trimmed(cell);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = trimmed(cell.substr(1, cell.size() - 2));
  CsvColumn column;
  // "gauge [N]", or "gauge (N)" as spreadsheets have it.
  const auto bracket = cell.ends_with(']') ? cell.rfind('[') : cell.ends_with(')') ? cell.rfind('(') : std::string_view::npos;
  const bool has_unit = bracket != std::string_view::npos;
  column.name = trimmed(cell.substr(0, has_unit ? bracket : cell.size()));
  if (has_unit) column.unit = trimmed(cell.substr(bracket + 1, cell.size() - bracket - 2));
  if (column.name.empty()) throw InputError(place, "the header has a column without a name", "wanted `name [unit]` for every column", "");
  return column;
}

void check_header(const CsvTable& table, std::string_view line) {
  const InputError::Place place{table.file, table.header_line};
  double number = 0;
  if (read_number(line.data(), line.data() + line.size(), number) != line.data()) {
    throw InputError(place, fmt::format("the row \"{}\" is no header", line.substr(0, 60)),
                     "wanted the header row `name [unit],...` above the numbers", "Write for instance \"time [s],alpha [deg],gauge [N]\".");
  }
  if (table.columns.size() == 1 && line.find_first_of(";\t") != std::string_view::npos) {
    throw InputError(place, "the columns are separated by semicolons or tabs", "wanted commas between columns and a point in numbers",
                     "`unrig import` reads such a table and makes a run file of it.");
  }
  std::unordered_set<std::string_view> names;  // a file of another kind may have 100 000 columns
  for (const CsvColumn& column : table.columns) {
    if (!names.insert(column.name).second) {
      throw InputError(place, fmt::format("the header names the column \"{}\" more than once", column.name), "wanted every name once", "");
    }
  }
}

void read_header(std::string_view line, CsvTable& table) {
  const char* at = line.data();
  const char* const end = at + line.size();
  while (true) {
    const char* stop = cell_end(at, end);
    table.columns.push_back(header_cell({at, stop}, {table.file, table.header_line}));
    if (stop == end) break;
    at = stop + 1;
  }
  check_header(table, line);
}

/// A cell that does not begin with a number, or goes on after it: missing, or text.
void note_odd_cell(std::string_view cell, int line, CsvColumn& column) {
  if (cell.empty()) {
    ++column.missing;
  } else if (column.text.empty()) {
    column.text = printable(cell.substr(0, 40));
    column.text_line = line;
  }
}

/// Reads one cell, with or without quotes around it, and returns where it ends.
const char* read_cell(const char* at, const char* end, int line, double& value, CsvColumn& column, bool is_in_quotes = false) {
  at = skip_blanks(at, end);
  const char* stop = read_number(at, end, value);
  const bool numeric = stop != at;
  if (numeric) stop = skip_blanks(stop, end);
  const bool whole = numeric && (stop == end || (*stop == ',' && !is_in_quotes));
  if (whole && std::isfinite(value)) return stop;
  const bool nan = whole && std::isnan(value);
  if (!whole) stop = is_in_quotes ? end : cell_end(at, end);
  const std::string_view cell = trimmed({at, stop});
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"' && !is_in_quotes) {
    read_cell(cell.data() + 1, cell.data() + cell.size() - 1, line, value, column, true);
    return stop;
  }
  note_odd_cell(nan ? std::string_view{} : cell, line, column);
  value = std::numeric_limits<double>::quiet_NaN();
  return stop;
}

/// Reads one row into the columns and returns how many cells it has.
std::size_t read_row(std::string_view text, int line, Eigen::Index row, std::vector<CsvColumn>& columns) {
  const char* at = text.data();
  const char* const end = at + text.size();
  for (std::size_t cell = 0;; ++cell) {
    const bool extra = cell >= columns.size();
    const char* stop = extra ? cell_end(at, end) : read_cell(at, end, line, columns[cell].value[row], columns[cell]);
    if (stop == end) return cell + 1;
    at = stop + 1;
  }
}

[[noreturn]] void refuse_row(const CsvTable& table, Eigen::Index row, std::size_t cells, bool ends_file) {
  const std::string wanted = fmt::format("wanted {}, as in the header", table.columns.size());
  if (ends_file && cells < table.columns.size()) {
    throw InputError(table.place(row), fmt::format("the file ends in the middle of a row, after {} cells", cells), wanted,
                     "The recording was cut off: copy it again, or delete this row.");
  }
  throw InputError(table.place(row), fmt::format("the row has {} cells", cells), wanted,
                   "A sample that is missing is `nan` or empty between its commas.");
}

}  // namespace

CsvTable read_csv(std::string_view text, int header_line, const std::string& file) {
  CsvTable table{file, header_line, {}};
  std::string converted;
  if (ends_lines_with_returns(text)) text = converted = with_line_feeds(text);
  const std::string_view header = take_line(text);
  require_utf8(header, file, header_line);
  read_header(header, table);

  const Eigen::Index most = std::count(text.begin(), text.end(), '\n') + 1;
  for (CsvColumn& column : table.columns) column.value.resize(most);
  Eigen::Index row = 0;
  while (!text.empty()) {
    const InputError::Place place = table.place(row);
    const bool ended = text.find('\n') != std::string_view::npos;
    const std::string_view line = take_line(text);
    if (trimmed(line).empty()) {
      if (text.find_first_not_of(" \t\r\n") == std::string_view::npos) break;
      throw InputError(place, "a blank line stands between rows", "wanted the rows without a break", "");
    }
    const std::size_t cells = read_row(line, place.line, row, table.columns);
    if (cells != table.columns.size()) refuse_row(table, row, cells, !ended);
    ++row;
  }
  for (CsvColumn& column : table.columns) column.value.conservativeResize(row);
  return table;
}

}  // namespace unrig
