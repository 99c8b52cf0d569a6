#pragma once
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "fit/fit_files.h"

namespace unrig {

/// What read_fit does with a fit that stands inside another file, `path`.
FittedRig read_fit(const nlohmann::json& fit, const std::string& path);

}  // namespace unrig
