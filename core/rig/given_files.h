#pragma once
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// A file that a command is to write, and the option that names it. An empty path: none is wanted.
struct Output {
  std::string option, path;
};

/// Whether two paths lead to one file, that need not exist yet: also through links, or with and without `./`.
bool same_file(const std::string& a, const std::string& b);

/// What a command asks before it reads or computes anything. Throws InputError where an output would overwrite an input or another output,
/// or cannot be written (text_file.h): in time, and before one output is written whose fellow cannot be.
void check_outputs(const std::vector<Output>& outputs, const std::vector<std::string>& inputs);

/// Throws InputError where a file is given twice: what is fitted to it would count twice.
void check_given_once(const std::vector<std::string>& recordings);

/// The same where two files hold the same recording, as far as it is read with this rig (core/rig/fingerprint.h).
void check_recorded_once(const std::vector<Run>& runs, const Rig& rig);
/// The recording among `runs` that is the same as `run`; none where there is none.
const Run* same_recording(const Run& run, const std::vector<Run>& runs, const Rig& rig);

}  // namespace unrig
