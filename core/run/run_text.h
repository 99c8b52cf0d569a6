#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/run/run.h"
#include "core/files/text_file.h"

namespace unrig {

/// `run` as the text of a run file (correct/manual/run_files.md), which read_run reads back: name, kind, medium, density and speed, then time and
/// every channel. `remarks` become lines of the head that readers skip.
///
/// A channel stands in the unit of the file it came from; one that was calibrated (volts to newtons) or shifted (degC) stands in SI, and so
/// the calibration is not repeated. Numbers carry ten significant digits, missing samples are `nan`.
std::string run_text(const Run& run, const std::vector<std::string>& remarks = {});
/// The same row by row, for files that are long.
void run_text(const TextSink& sink, const Run& run, const std::vector<std::string>& remarks);

/// `text` as a TOML basic string, quotes included.
std::string toml_string(std::string_view text);

}  // namespace unrig
