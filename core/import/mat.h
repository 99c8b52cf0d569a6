#pragma once
#include <string>

#include "core/import/recording.h"

namespace unrig {

/// Reads the numeric variables of a MATLAB file, version 5 (-v6, -v7) or 7.3, by libmatio.
///
/// A vector is a channel called after its variable; the columns of a matrix are "name(:,1)", "name(:,2)", ...; fields of a structure are
/// "name.field", to any depth up to 8; of an array of structures "name(2).field". Integers count as unscaled readings of a converter. Complex, sparse
/// and text variables are left out with a warning.
/// Throws InputError where the file cannot be read as such.
Recording read_mat(const std::string& path);

}  // namespace unrig
