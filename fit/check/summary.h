#pragma once
#include <optional>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// One vibration of the rig in a medium.
struct RigMode {
  double hertz = 0;
  double damping_ratio = 0;  ///< with the model's start values for the structure's, 0.01 and 0.02; of modes the rig file's
};

/// The rig in one medium.
struct RigInMedium {
  std::string medium;  ///< "vacuum", "air", or a run's label
  double density = 0;  ///< kg/m^3
  double speed = 0;    ///< m/s
  std::vector<RigMode> modes;   ///< ascending, at most eight
  double apparent_mass = 0;     ///< kg, pi rho b^2 over the whole submerged length
  double load_per_degree = 0;   ///< N, of all strips at slope 2 pi
  double gauge_per_degree = 0;  ///< N, what the gauge reads of it
};

/// A rig before any recording.
struct RigSummary {
  std::string name;
  bool modal = false;
  double mass = 0;                ///< kg; of modes the sum of the modal masses
  double deflection = 0;          ///< m/N at the loaded element (the gauge's calibration element, else the first), of a force there; 0 of modes
  int loaded_element = 0;         ///< from 1
  double gauge_per_newton = 0;    ///< reading of 1 N that is spread evenly over the strips
  std::vector<RigInMedium> media; ///< vacuum, air, then those of the runs
};
RigSummary summary_of(const Rig& rig, const std::vector<Run>& runs);

/// One column of a recording.
struct ChannelSummary {
  std::string name, unit;  ///< SI
  double minimum = 0, maximum = 0, mean = 0;
  double noise = 0;                   ///< standard deviation of the white part
  std::optional<double> white_share;  ///< of the variance about a straight line in the rest before the motion of a step, spikes left out; none without such a rest
  std::size_t missing = 0, clipped = 0, bad = 0, spikes = 0;
};

/// A recording by itself.
struct RunSummary {
  std::string file, kind, medium;
  double density = 0, speed = 0;
  Eigen::Index samples = 0;
  double rate = 0, duration = 0;  ///< Hz, s
  bool resampled = false;
  bool moves = false;
  double motion_begin = 0, motion_end = 0;  ///< s
  double onset = 0, step = 0;               ///< rad
  std::optional<Hold> hold;                 ///< before the release of a pluck, left out
  double ringing = 0;                       ///< Hz, the line that stands for the lowest mode; 0: none
  std::vector<ChannelSummary> channels;
};
RunSummary summary_of(const Rig& rig, const Run& run);

}  // namespace unrig
