#pragma once
#include <algorithm>

#include "fit/fit.h"

namespace unrig::studies {

/// What became of a fit whose truth is known.
enum class Outcome { arrived, said_so, silent };

struct OutcomeCount {
  int tried = 0, arrived = 0, silent = 0;
  void add(Outcome outcome) {
    ++tried;
    arrived += outcome == Outcome::arrived ? 1 : 0;
    silent += outcome == Outcome::silent ? 1 : 0;
  }
};

inline const char* said(Outcome outcome) { return outcome == Outcome::arrived ? "arrived" : outcome == Outcome::silent ? "WRONG IN SILENCE" : "did not arrive"; }

/// Whether a fit gives its user nothing to doubt: an answer, and every run explained to its noise.
inline bool raises_no_doubt(const FitResult& result) {
  return result.no_answer.empty() && std::all_of(result.runs.begin(), result.runs.end(), [](const FittedRun& run) { return run.explained(); });
}

}  // namespace unrig::studies
