#pragma once
#include <string>

namespace unrig::seed {

/// The table "The seed, number by number" of README.md beside this file, in Markdown: every line computed here, none written by hand.
std::string number_by_number();

}  // namespace unrig::seed
