#pragma once
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// The effects that a command's `option` names, as it names them, each once. Throws InputError naming the option and the choices for one that does not exist.
std::vector<std::string> effects_of_option(const std::string& option, const std::vector<std::string>& ids);

/// Throws InputError naming the option, the effect and the reason, where one of these can act in none of the runs of the rig.
void refuse_idle(const std::string& option, const std::vector<std::string>& ids, const Rig& rig, const std::vector<Run>& runs);

/// All that can act in at least one of the runs, in the order of the table.
std::vector<std::string> effects_that_act(const Rig& rig, const std::vector<Run>& runs);

/// Reads law files (core/law/law.h) and puts them to the rig; their ids. Throws InputError for what is no law and for two of one name.
std::vector<std::string> add_laws(Rig& rig, const std::vector<std::string>& paths);

/// The names that may be given, and what each means, for a command's help.
std::string effect_list();

}  // namespace unrig
