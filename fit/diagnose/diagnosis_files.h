#pragma once
#include <string>

#include "fit/diagnose/diagnose.h"

namespace unrig {

/// diagnosis.json (correct/manual/results.md), the winning fit in it as `fit`, the sets that were tried as `ranking`.
std::string to_json(const Diagnosis& diagnosis);

/// For a person: the verdict first, then the evidence.
std::string report(const Diagnosis& diagnosis);

}  // namespace unrig
