#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace unrig {

/// The cells of a row, blanks and quotes around them taken off; what stands in quotes may hold the delimiter. `delimiter`: one character, or "blanks".
/// A doubled quote within quotes stays doubled: unescaped() makes one of it.
void split_cells(std::string_view line, const std::string& delimiter, std::vector<std::string_view>& cells);
std::vector<std::string_view> cells_of(std::string_view line, const std::string& delimiter);

std::string unescaped(std::string_view cell);

/// What stands between the cells of a table's first row: tab, ; or | where there is one outside quotes, else a comma that is not only within numbers ("0,5 1,5"), else blanks.
std::string delimiter_in(std::string_view line);

}  // namespace unrig
