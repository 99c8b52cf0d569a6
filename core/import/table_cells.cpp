#include "core/import/table_cells.h"

#include <algorithm>

#include "core/files/scan.h"

namespace unrig {
namespace {

/// Behind the quote that closes the one at `open`; `open` where none does.
std::size_t behind_quotes(std::string_view line, std::size_t open) {
  for (std::size_t at = line.find('"', open + 1); at != std::string_view::npos; at = line.find('"', at + 2)) {
    const bool doubled = at + 1 < line.size() && line[at + 1] == '"';
    if (!doubled) return at + 1;
  }
  return open;
}

/// The line without what is quoted. Quotes open at the begin of a cell only: 5" is five inches.
std::string outside_quotes(std::string_view line) {
  std::string out;
  bool cell_begins = true;
  for (std::size_t at = 0; at < line.size(); ++at) {
    const std::size_t behind = line[at] == '"' && cell_begins ? behind_quotes(line, at) : at;
    cell_begins = (cell_begins && line[at] == ' ') || std::string_view("\t;|,").find(line[at]) != std::string_view::npos;
    out += line[at];
    if (behind > at) at = behind - 1;
  }
  return out;
}

}  // namespace

void split_cells(std::string_view line, const std::string& delimiter, std::vector<std::string_view>& cells) {
  cells.clear();
  if (delimiter == "blanks") {
    for (std::size_t at = line.find_first_not_of(" \t"); at != std::string_view::npos; at = line.find_first_not_of(" \t", at)) {
      const std::size_t end = std::min(line.find_first_of(" \t", at), line.size());
      cells.push_back(line.substr(at, end - at));
      at = end;
    }
    return;
  }
  for (std::size_t at = 0;;) {
    const std::size_t first = std::min(line.find_first_not_of(' ', at), line.size());
    const std::size_t behind = first < line.size() && line[first] == '"' ? behind_quotes(line, first) : first;
    const std::size_t end = std::min(line.find(delimiter, behind), line.size());
    std::string_view cell = trimmed(line.substr(at, end - at));
    if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = trimmed(cell.substr(1, cell.size() - 2));
    cells.push_back(cell);
    if (end == line.size()) return;
    at = end + delimiter.size();
  }
}

std::vector<std::string_view> cells_of(std::string_view line, const std::string& delimiter) {
  std::vector<std::string_view> cells;
  split_cells(line, delimiter, cells);
  return cells;
}

std::string unescaped(std::string_view cell) {
  std::string out;
  for (std::size_t i = 0; i < cell.size(); ++i) {
    out += cell[i];
    if (cell[i] == '"' && i + 1 < cell.size() && cell[i + 1] == '"') ++i;
  }
  return out;
}

std::string delimiter_in(std::string_view line) {
  const std::string bare = outside_quotes(trimmed(line));
  const auto has = [&](char c) { return bare.find(c) != std::string::npos; };
  for (const char c : {'\t', ';'})
    if (has(c)) return std::string(1, c);
  bool between_cells = false;
  for (std::size_t i = 0; i < bare.size(); ++i)
    if (bare[i] == ',') between_cells = between_cells || i == 0 || i + 1 == bare.size() || !is_digit(bare[i - 1]) || !is_digit(bare[i + 1]);
  if (has('|') && !between_cells) return "|";
  // "0,5 1,5" is two numbers, "0,5,1" three.
  if (has(',') && (between_cells || !has(' '))) return ",";
  return "blanks";
}

}  // namespace unrig
