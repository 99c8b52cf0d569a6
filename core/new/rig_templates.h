#pragma once
#include <string>
#include <vector>

namespace unrig {

/// A rig file to begin with, from what is known of the rig. It reads without an error as it stands; lines that begin with `# ?` ask what only its user knows.
struct RigTemplate {
  const char* name;     ///< of `--from`
  const char* summary;  ///< one line
  const char* text;     ///< of the rig file
  bool modal;           ///< known only as modes: it answers to a forced run, not to a step
};

const std::vector<RigTemplate>& rig_templates();
/// Throws InputError for a name that none has, with the one that was probably meant.
const RigTemplate& rig_template(const std::string& name);

}  // namespace unrig
