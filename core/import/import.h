#pragma once
#include <string>
#include <vector>

#include "core/import/recording.h"

namespace unrig {

/// A laboratory's recording as a run file (correct/manual/run_files.md), by a mapping:
///
///     unrig_import = 1
///     [run]                       # the run file's head: name, kind, medium, density, speed, calibration, force_calibration
///     kind = "step"
///     density = "998.2 kg/m^3"
///     speed = "0.6 m/s"
///     [time]                      # left out: the sampling that the file gives with its channels
///     source = "Time"             # a channel of the file, with `unit` where the file gives none; time stamps become seconds since the first; or else
///     rate = "500 Hz"             # the sampling rate, with `start` = "0 s"
///     [[column]]                  # one table per column of the run
///     name = "gauge"              # as run files name columns; others are read where a [[sensor]] of the rig file names them
///     source = "Rig/Bridge"       # a channel of the file
///     unit = "V"                  # where the file gives none
///     raw = true                  # takes converter counts as they are, in the unit "1", for a calibration in N per count
///     bridge.kind = "full-1"      # volts to strain: quarter-1, quarter-2, half-1, half-2, full-1, full-2, full-3 (core/import/bridge.h)
///     bridge.gauge_factor = 2.1   # with .poisson, .excitation = "2.5 V", .initial_voltage, .gauge_resistance = "350 ohm", .lead_resistance,
///                                 # and .shunt_gain, or .shunt_reading and .shunt_expected (voltages) in its place
///     [format]                    # of text, where it is not found out: delimiter, decimal, thousands, missing, skip_lines, header (core/import/delimited.h)
///
/// Readings that a converter left unscaled are never taken for physical values: without `raw = true` they are an error.
/// `settings` (of the command line) take the place of what [run] says.
struct Imported {
  std::string text;                   ///< of the run file
  std::vector<std::string> warnings;
  std::vector<std::string> columns;   ///< "gauge [V] from Rig/Bridge, 3 missing"
  std::size_t samples = 0;
};

/// One key of a run file's head: "speed", "0.6 m/s".
struct RunSetting {
  std::string key, value;
};
/// "speed=0.6 m/s". Throws InputError, which names `--set`, where there is no such key of a head, and for a value without a unit or with a wrong one.
RunSetting run_setting(const std::string& text);

/// `mapping`: text of the mapping, `mapping_file` its name for messages. Throws InputError for a mapping that does not fit the recording, and for a result
/// that read_run would refuse.
Imported import_recording(const Recording& recording, const std::string& mapping, const std::string& mapping_file, const std::vector<RunSetting>& settings = {});

/// Reads a file of a laboratory, its format told by its content. `mapping` as above, for the [format] of text.
Recording read_recording(const std::string& path, const std::string& mapping, const std::string& mapping_file);

}  // namespace unrig
