#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/rig/beam_flexibility.h"
#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// Which number of a rig file, or of a run's head, a given is.
enum class GivenNumber {
  chord, pitch_axis, strip_length, station, mass, mass_centre, normal_flexibility, normal_length, youngs_modulus, second_moment, normal_clamp_spring, clamp_translation,
  inertia, torsion_flexibility, torsion_station, torsion_length, shear_modulus, polar_moment, torsion_clamp_spring,
  modal_mass, modal_frequency, modal_damping_ratio, modal_gauge_gain,
  speed, density, calibration, force_calibration, clock
};

/// A number that states its uncertainty (correct/manual/rig_files.md, run_files.md).
struct Given {
  GivenNumber number = GivenNumber::chord;
  Eigen::Index row = -1, column = -1;  ///< which entry, from 0; row -1: the only one, or the same value for all
  std::string name;                    ///< "normal.mass[13]", elements from 1
  std::string unit;
  double value = 0;  ///< as stated
  double std = 0;    ///< one standard deviation, all parts together
};

/// The numbers of one rig file or of one run's head that state uncertainties, and how their errors go together.
///
/// The errors are `spread` times independent standard normal deviations: one for each entry's own error, one for an error that all entries of an array share.
struct Givens {
  std::vector<Given> numbers;
  Eigen::MatrixXd spread;          ///< numbers x deviations
  std::vector<std::string> group;  ///< of each deviation: "normal.mass"
  std::vector<bool> common;        ///< of a run: whether the runs of a campaign share the deviation
  /// Chains that the rig file describes by their drawing, whose flexibility follows from these.
  std::optional<SteppedBeam> normal_beam, torsion_beam;
  bool torsion_has_station = false, torsion_has_length = false;  ///< its own; else those of the normal elements

  Eigen::Index deviations() const { return spread.cols(); }
};

/// The rig with its numbers off by `off` (one per entry of `rig.givens`, in their units), flexibilities of drawings made anew. As it is where it states nothing.
/// Throws std::invalid_argument where no rig has such numbers: a mass that is not positive, a station outside its element, a flexibility that is not positive.
Rig with_errors(const Rig& rig, const Eigen::VectorXd& off);

/// The run with the numbers of its head off likewise: `calibration` and `force_calibration` scale their columns, `clock` the times.
Run with_errors(const Run& run, const Eigen::VectorXd& off);

/// Every number that the rig has, each with a standard deviation of one per cent and an error of its own group (spread: one deviation per group): what an error would do that nobody has stated.
/// Flexibility: one error for the whole chain.
Givens one_per_cent_of_everything(const Rig& rig);
Givens one_per_cent_of_everything(const Run& run);

}  // namespace unrig
