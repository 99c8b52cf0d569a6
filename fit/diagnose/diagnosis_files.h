#pragma once
#include <string>

#include "fit/diagnose/diagnose.h"

namespace unrig {

/// What a reader must know of a diagnosis that was stopped.
inline constexpr const char* stopped_words = "The search ended with its limit of work or of time, not by itself: what was not tried may explain more. Give it more (--work, --limit), or name candidates with --effects.";

/// diagnosis.json (correct/manual/results.md), the winning fit in it as `fit`, the sets that were tried as `ranking`.
std::string to_json(const Diagnosis& diagnosis);

/// For a person: the verdict first, then the evidence.
std::string report(const Diagnosis& diagnosis);

}  // namespace unrig
