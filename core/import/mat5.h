#pragma once
#include <string>
#include <string_view>

#include "core/import/recording.h"

namespace unrig {

/// Reads the numeric variables of a MATLAB file of version 5, packed or not (`save` with -v6 and -v7), in either byte order.
///
/// Channels are named as in matlab_matrix.h; fields of a structure are "name.field", to any depth up to 8; of an array of structures "name(2).field". Complex,
/// sparse and text variables are left out with a warning, as is what is cut off; a cell array of texts names the columns of a matrix beside it.
/// Source: "MAT-File Format", The MathWorks (chapter 1, level 5). An own reader because libmatio ends the program on files that lie about their sizes.
/// Throws InputError where the file is no such file or holds no number.
Recording read_mat5(std::string_view bytes, const std::string& file);

}  // namespace unrig
