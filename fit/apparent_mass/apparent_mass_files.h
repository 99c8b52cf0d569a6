#pragma once
#include <string>

#include "core/files/provenance.h"
#include "fit/apparent_mass/apparent_mass.h"

namespace unrig {

/// `apparent.json` (correct/manual/results.md), with `modes` of each run, `parameters` as in fit.json, `frequency_ratio`, `joint_fit`, `agreement`.
/// What a rig that is known only as modes does not have is null.
std::string to_json(const ApparentMassResult& result, const Provenance& made = {});

/// Text report: the apparent mass beside theory and joint fit, every vibration heard and the mode it is.
std::string report(const ApparentMassResult& result);

}  // namespace unrig
