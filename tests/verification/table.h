#pragma once
#include <string>

namespace unrig::seed {

/// The README's table "The seed, number by number", in Markdown: every line computed here, none written by hand.
std::string number_by_number();

}  // namespace unrig::seed
