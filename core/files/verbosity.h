#pragma once

namespace unrig {

/// What a command says on standard error beside errors and `check:` lines.
///
///   quiet    nothing
///   normal   warnings; progress on a terminal, elsewhere a line every half minute
///   verbose  warnings, and every step of the progress as a line of its own
enum class Verbosity { quiet, normal, verbose };

/// For the rest of the program's call.
void set_verbosity(Verbosity verbosity);

}  // namespace unrig
