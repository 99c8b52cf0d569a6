#pragma once
#include <string>

namespace unrig {

/// What the command said last that it was doing (core/files/command.h); empty where it said nothing.
const std::string& last_progress();

}  // namespace unrig
