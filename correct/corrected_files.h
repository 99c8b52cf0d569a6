#pragma once
#include <string>

#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "correct/correct.h"

namespace unrig {

/// `corrected.csv`: columns as in correct/manual/results.md, the last what a reader must know (correct/estimate/how_far_to_trust.h).
std::string to_csv(const CorrectResult& result, const MadeBy& made_by = {});
/// The same row by row, for files that are long.
void to_csv(const TextSink& sink, const CorrectResult& result, const MadeBy& made_by = {});
/// `indicial.csv`: semichords,indicial,indicial_std and further columns, likewise.
std::string to_indicial_csv(const CorrectResult& result, const MadeBy& made_by = {});
/// What a person wants to know.
std::string report(const CorrectResult& result);

}  // namespace unrig
