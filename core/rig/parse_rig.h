#pragma once
#include <string>

#include "core/rig/rig.h"

namespace unrig {

/// A rig file's text, whose name is `path`; files beside it are sought there. Throws as read_rig does.
Rig parse_rig(const std::string& text, const std::string& path);

}  // namespace unrig
