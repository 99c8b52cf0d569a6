#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/error.h"

namespace unrig {

struct DeviationSlopes;
struct Givens;

/// How a recording was made (correct/manual/run_files.md): prescribed pitch, free decay, measured force, moved mount.
enum class RunKind { step, pluck, forced, moved };
std::string to_string(RunKind kind);

/// time, alpha, gauge, force ...: what commands read by itself. Other columns are read where a `[[sensor]]` of the rig names them.
std::vector<std::string_view> columns_with_a_meaning();

/// One measured column of a run on the uniform time grid, in SI. Missing samples are NaN.
struct Channel {
  std::string name;       ///< as in the header
  std::string file_unit;  ///< as in the header
  std::string unit;       ///< SI unit of `value` (after calibration)
  double factor = 1;      ///< SI per file unit (calibration included)
  Eigen::VectorXd value;
  std::size_t missing = 0;  ///< samples without a number in the file
  std::size_t clipped = 0;  ///< readings at the end of the converter's range, left out
  std::size_t bad = 0;      ///< isolated readings far from their neighbours, left out
};

/// What a pluck was held for before its release, and is left out (core/run/release.h).
struct Hold {
  Eigen::Index samples = 0;  ///< before the first that is left
  double release = 0;        ///< s, the likeliest instant
};

/// One recording: the file's meta data and its columns on a uniform grid t_k = start + k dt.
///
/// Columns with a meaning (`alpha`, `gauge`, `force`, `mount_velocity`, `mount_acceleration`, `weight`) are in SI. So are others, which a
/// `[[sensor]]` of the rig may name; where UDUNITS does not know their unit they are kept as they are. `time` is the grid and no channel.
struct Run {
  std::string file;
  int header_line = 0;  ///< of the file, where the columns are named
  std::string name;
  RunKind kind = RunKind::step;
  std::string medium;
  double density = 0;         ///< kg/m^3
  double speed = 0;           ///< m/s
  double start = 0;           ///< s
  double dt = 0;              ///< s
  bool resampled = false;     ///< true where the file's times jitter and the channels were interpolated to the uniform grid
  double largest_jitter = 0;  ///< s
  std::optional<Hold> hold;   ///< of a pluck that was held when its record began
  std::vector<Channel> channels;
  std::shared_ptr<const Givens> givens;  ///< stated uncertainties of the header's numbers; none: all are exact
  std::shared_ptr<const DeviationSlopes> deviations;  ///< of a model whose parameters they are (Rig::deviations); none: no error moves it
  std::vector<std::string> warnings;

  Eigen::Index samples() const { return channels.empty() ? 0 : channels.front().value.size(); }
  double time(Eigen::Index k) const { return start + dt * static_cast<double>(k); }
  const Channel* find(std::string_view column) const;
  /// The channel of that name; throws InputError naming the run file and the column wanted.
  const Channel& channel(std::string_view column) const;
};

/// Reads a run file (correct/manual/run_files.md).
///
/// Times that are printed roughly stay on their uniform grid; where times jitter every channel is interpolated linearly to it, and
/// `resampled` says so; a gap of more than 1.5 steps, or 5 where times jitter throughout, is an error with its place (core/run/time_grid.h has
/// the rules).
///
/// A `gauge` or `force` column in volts or counts is scaled by the meta data's `calibration` or `force_calibration`; without one it stays
/// in volts or counts, with a warning. An unknown column that holds text is left out, with a warning.
///
/// A pluck that begins with a hold is left from its release on (core/run/release.h); `hold` says so.
///
/// Throws InputError for everything that cannot be used: missing or unknown magic, unknown keys, units, header without units, ragged or
/// truncated rows, decreasing or missing time, text or infinity in a column with a meaning, such a column without a single number, a
/// negative or missing weight, a calibration of a column that has its unit already, a required key that is missing.
Run read_run(const std::string& path);

/// The same for a run file's text, which messages call `path`.
Run parse_run(std::string_view text, const std::string& path);

}  // namespace unrig
