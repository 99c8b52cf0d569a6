#pragma once
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "fit/trial/law_outcome.h"

namespace unrig {

/// trials[].law of trial.json, and what it says.
nlohmann::ordered_json json_of(const LawOutcome& outcome);
LawOutcome law_outcome_of(const nlohmann::ordered_json& json);

/// `laws` of trial.json, and for a person.
nlohmann::ordered_json json_of(const LawCounts& counts);
std::string report(const LawCounts& counts);

}  // namespace unrig
