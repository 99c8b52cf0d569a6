#pragma once
#include <string>

#include "core/import/recording.h"

namespace unrig {

/// Reads the numeric variables of a MATLAB file of version 7.3 by HDF5, and of any other HDF5 file; channels and what is left out as in mat5.h. Damaged files can end a process that
/// has HDF5 read them, so a child process does.
/// Throws InputError where the file cannot be read as such.
Recording read_mat73(const std::string& path);

}  // namespace unrig
