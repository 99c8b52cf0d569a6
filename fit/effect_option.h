#pragma once
#include <string>
#include <vector>

namespace unrig {

/// The effects that a command's `option` names, as it names them, each once. Throws InputError naming the option and the choices for one that does not exist.
std::vector<std::string> effects_of_option(const std::string& option, const std::vector<std::string>& ids);

/// The names that may be given, and what each means, for a command's help.
std::string effect_list();

}  // namespace unrig
