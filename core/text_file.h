#pragma once
#include <string>

namespace unrig {

/// The whole file as text. Throws InputError where it cannot be read.
std::string read_text(const std::string& path);

/// Writes `text` to `path` whole or not at all: a file without a name in the same folder, flushed to disk, then renamed over it.
/// Throws InputError naming the path and the system's reason; the old file, if any, is untouched then.
void write_text(const std::string& path, const std::string& text);

}  // namespace unrig
