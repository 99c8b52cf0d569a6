#include "core/files/text_kind.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/files/scan.h"

namespace unrig {
namespace {

struct Known {
  std::string_view key;  ///< that stands in its head
  TextKind kind;
  const char* what;
  const char* wanted;
};
constexpr std::array kinds = {
    Known{"unrig_run", TextKind::run, "a run file (a recording)", "wanted a run file, with `# unrig_run = 1` at its head"},
    Known{"unrig_rig", TextKind::rig, "a rig file", "wanted a rig file, with `unrig_rig = 1` at its head"},
    Known{"unrig_import", TextKind::mapping, "a mapping for `unrig import`", "wanted a mapping, with `unrig_import = 1` at its head"},
};

const Known& of(TextKind kind) {
  return *std::find_if(kinds.begin(), kinds.end(), [&](const Known& one) { return one.kind == kind; });
}

/// `unrig_rig = 1` at the begin of a line, behind a # in run files.
bool has_key(std::string_view head, std::string_view key) {
  for (std::size_t at = head.find(key); at != std::string_view::npos; at = head.find(key, at + 1)) {
    const std::size_t line = head.find_last_of("\r\n", at) + 1;  // npos + 1 is 0
    const std::string_view before = trimmed(head.substr(line, at - line)), behind = trimmed(head.substr(at + key.size(), 8));
    if ((before.empty() || before == "#") && behind.starts_with('=')) return true;
  }
  return false;
}

struct Foreign {
  std::string_view begins;
  const char* what;
  const char* advice;
};
constexpr const char* import_it = "`unrig import` makes a run file of it.";
constexpr const char* export_it = "Export the sheet as CSV (in Excel: save as \"CSV UTF-8\"); `unrig import` makes a run file of that.";
constexpr std::array foreign = {
    Foreign{"PK\x03\x04", "an Excel workbook (.xlsx), or another packed file", export_it},
    Foreign{"\xD0\xCF\x11\xE0", "an Excel workbook (.xls)", export_it},
    Foreign{"TDSm", "an NI TDMS file", import_it},
    Foreign{"MATLAB ", "a MATLAB file", import_it},
    Foreign{"\x89HDF", "an HDF5 file", "`unrig import` reads those of MATLAB."},
    Foreign{"LabVIEW Measurement", "a LabVIEW measurement file", import_it},
    Foreign{"\x1F\x8B", "a file packed by gzip", "Unpack it first."},
};

}  // namespace

std::size_t utf8_length(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (text.empty()) return 0;
  if (byte(0) < 0x80) return 1;
  const std::size_t more = byte(0) >= 0xF0 ? 3 : byte(0) >= 0xE0 ? 2 : byte(0) >= 0xC2 ? 1 : 0;
  if (more == 0 || byte(0) >= 0xF5 || more >= text.size()) return 0;
  for (std::size_t k = 1; k <= more; ++k)
    if ((byte(k) & 0xC0) != 0x80) return 0;
  return more + 1;
}

void require_utf8(std::string_view text, const std::string& file, int first_line) {
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text.substr(at));
    if (length == 0) {
      const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
      throw InputError({file, first_line + static_cast<int>(line)},
                       fmt::format("the file is not UTF-8: the byte 0x{:02X} here is \"{}\" in Latin-1", static_cast<unsigned>(static_cast<unsigned char>(text[at])), printable(text.substr(at, 1))),
                       "wanted UTF-8 or ASCII text", "Save it again as UTF-8 (in Excel: \"CSV UTF-8\").");
    }
    at += length;
  }
}

std::string printable(std::string_view text) {
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text.substr(at));
    if (length > 0) {
      out += text.substr(at, length);
    } else {
      const auto byte = static_cast<unsigned char>(text[at]);
      out += static_cast<char>(0xC0 | byte >> 6);
      out += static_cast<char>(0x80 | (byte & 0x3F));
    }
    at += std::max<std::size_t>(1, length);
  }
  return out;
}

bool ends_lines_with_returns(std::string_view text) { return text.find('\n') == std::string_view::npos && text.find('\r') != std::string_view::npos; }

std::string with_line_feeds(std::string_view text) {
  std::string out(text);
  std::replace(out.begin(), out.end(), '\r', '\n');
  return out;
}

void refuse_other_kinds(std::string_view bytes, const std::string& file, TextKind wanted) {
  const char* const want = of(wanted).wanted;
  if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) {
    throw InputError({file, 1}, "the file is in UTF-16", "wanted UTF-8 or ASCII text", "Save it again as \"CSV UTF-8\".");
  }
  for (const Foreign& one : foreign)
    if (bytes.starts_with(one.begins)) throw InputError({file, 0}, fmt::format("this is {}", one.what), want, one.advice);
  constexpr std::size_t head_bytes = 1 << 16;
  const std::string_view head = bytes.substr(0, head_bytes);
  if (has_key(head, of(wanted).key)) return;
  for (const Known& other : kinds)
    if (other.kind != wanted && has_key(head, other.key))
      throw InputError({file, 1}, fmt::format("this is {}", other.what), want, "Have two files been exchanged on the command line?");
  if (head.starts_with('{') && head.find("\"unrig\"") != std::string_view::npos)
    throw InputError({file, 1}, "this is a result of unrig (JSON)", want, "Have two files been exchanged on the command line?");
  if (head.find('\0') != std::string_view::npos) throw InputError({file, 0}, "this is a binary file, in no format that is known here", want, wanted == TextKind::run ? import_it : "");
}

}  // namespace unrig
