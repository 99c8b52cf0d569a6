#pragma once
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace unrig {

/// A fluid that a run can be recorded in.
struct Medium {
  std::string name;
  double density = 0;  ///< kg/m^3
};

/// What a laboratory can do (correct/manual/propose.md). What it does not name is not proposed.
struct Limits {
  std::string file;
  std::optional<double> pluck_load;           ///< N, largest load that a free decay is released from
  std::optional<std::array<double, 2>> angle; ///< rad, lowest and highest angle of the shaft
  double rate = 0;                            ///< rad/s, largest rate of the shaft
  std::optional<double> angle_noise;          ///< rad, where no step at hand shows it
  std::optional<double> force;                ///< N, largest measured force that drives the rig
  std::optional<double> speed;                ///< m/s, largest; none: the speeds at hand
  std::vector<Medium> media;                  ///< none: those of the runs at hand
  std::optional<double> duration;             ///< s; none: that of the runs at hand
};

/// Reads limits.toml. Throws InputError for what is no such file, for a number that is not positive, and where no kind of run is possible.
Limits read_limits(const std::string& path);

}  // namespace unrig
