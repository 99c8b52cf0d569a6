#pragma once
#include <string>

#include <nlohmann/json_fwd.hpp>

#include "fit/fit_files.h"

namespace unrig {

/// What read_fit does with a fit that stands inside another file, `path`.
FittedRig read_fit(const nlohmann::json& fit, const std::string& path);

/// {"v": [-0.3, 0.28, "m/s"]}, as fit.json and diagnosis.json have where a law was learnt.
template <class Json>
Json learnt_json(const LearntOn& learnt_on) {
  Json out = Json::object();
  for (const auto& [symbol, range] : learnt_on) out[std::string(symbol_names[index_of(symbol)])] = {range.lower, range.upper, symbol_units[index_of(symbol)]};
  return out;
}

}  // namespace unrig
