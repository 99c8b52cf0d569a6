#pragma once
#include <string>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// A run file to begin with: its head with a remark on every key, `# # ?` before what only its user knows, and the columns that a run of this kind has with this rig.
///
/// The rows are a simulation of the rig in air (1.2 kg/m^3; a step at 20 m/s, the others at rest) with noise, some forty periods of its lowest mode: a file that every
/// command reads, to be replaced by a recording. The same rig gives the same bytes. Throws InputError for a step of a rig that is known only as modes.
std::string run_template(RunKind kind, const Rig& rig);

}  // namespace unrig
