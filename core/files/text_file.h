#pragma once
#include <functional>
#include <string>
#include <string_view>

namespace unrig {

/// The whole file as text. Throws InputError where it cannot be read.
std::string read_text(const std::string& path);

/// Writes `text` to `path` whole or not at all: a file without a name in the same folder, flushed to disk, then renamed over it.
/// Throws InputError naming the path and the system's reason; the old file, if any, is untouched then.
void write_text(const std::string& path, const std::string& text);

/// What write_text can know of `path` before it writes, for a command that computes long: its folder is there, and neither it nor an old file is write-protected.
/// Throws as write_text does.
void check_writable(const std::string& path);

/// Takes the next piece of a text.
using TextSink = std::function<void(std::string_view)>;
/// What hands a text to a sink, piece by piece: a table of a million rows need not stand in memory.
using TextSource = std::function<void(const TextSink&)>;

/// The same for a text that comes in pieces. What `text` throws leaves no file behind.
void write_text(const std::string& path, const TextSource& text);
/// All of it in one string.
std::string whole_text(const TextSource& text);

/// The file's name without its folders.
std::string base_name(const std::string& path);

}  // namespace unrig
