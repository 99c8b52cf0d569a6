#pragma once
#include <string>
#include <vector>

#include "core/files/text_file.h"

namespace unrig {

/// A file to be written. An empty path: none is wanted.
struct TextFile {
  std::string path;
  TextSource text;
};

/// Writes files that belong together, as write_text writes one: all of them or none. Each is whole on disk before the first takes its place, and no signal that a process may
/// hold up comes between the first and the last. What is left is the time of one rename, for SIGKILL and for a power failure: no system call renames two files.
/// Throws InputError as write_text does; the old files are untouched then.
void write_together(const std::vector<TextFile>& files);

}  // namespace unrig
