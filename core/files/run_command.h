#pragma once
#include "core/files/command.h"

namespace unrig {

/// Exit status of a command, what it throws told on standard error: input that cannot be used (2), no trustworthy answer (1), and what nobody foresaw (1).
/// `fault` is set where it was the last: too little memory, or an exception of no command's own.
int run_command(const Command& command, int argc, char** argv, bool* fault = nullptr);

}  // namespace unrig
