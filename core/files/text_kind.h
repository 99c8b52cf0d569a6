#pragma once
#include <string>
#include <string_view>

namespace unrig {

/// The text files that commands read. What a file is stands in its first lines: `unrig_run = 1`.
enum class TextKind { run, rig, mapping };

/// Throws InputError where the bytes are plainly something else than the kind that is wanted: another of these kinds, a result of unrig, an Excel workbook, TDMS, MATLAB,
/// a packed or another binary file, UTF-16. It says what they are and which way leads on.
void refuse_other_kinds(std::string_view bytes, const std::string& file, TextKind wanted);

/// Throws InputError with the line where the text, whose first line is `first_line` of `file`, is no UTF-8: Latin-1 with a degree sign, for one.
void require_utf8(std::string_view text, const std::string& file, int first_line);

/// For messages: text whose bytes are no UTF-8 taken for Latin-1.
std::string printable(std::string_view text);

/// Lines end with CR alone, as old Macintosh programs and some instruments write them.
bool ends_lines_with_returns(std::string_view text);
std::string with_line_feeds(std::string_view text);

/// Of the UTF-8 sequence at the begin of `text`, its length; 0 where there is none.
std::size_t utf8_length(std::string_view text);

}  // namespace unrig
