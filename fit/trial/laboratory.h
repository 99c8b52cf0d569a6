#pragma once
#include <Eigen/Core>
#include <random>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// Noise of a gauge in a laboratory. A share of the variance has the colour, the rest is white:
///
/// | kind | what else |
/// | --- | --- |
/// | white | - |
/// | first-order | corner of 1 to 30 Hz: amplifiers |
/// | pink | 1/f from a fifth of a period in the record to the Nyquist frequency: bridges, temperature; of first-order parts, three to an octave |
/// | heavy-tailed | Student's t of three degrees of freedom: contacts, radio |
/// | quantised | white, read by a converter in steps of 1 to 6 standard deviations |
enum class NoiseKind { white, first_order, pink, heavy_tailed, quantised };
std::string to_string(NoiseKind kind);

/// Every number of the files is off, by errors of the usual size that the files state.
constexpr const char* as_stated = "stated";

/// What a laboratory adds to a campaign, of which the fit knows nothing.
struct Laboratory {
  NoiseKind noise = NoiseKind::white;
  double corner = 0;     ///< Hz, of first-order noise
  double share = 1;      ///< of the variance that has the colour
  double converter = 0;  ///< step of the quantised gauge, in standard deviations of its noise
  std::string misread;   ///< group of the numbers by which rig file or runs are off, as core/rig/default_errors.h has them ("normal.mass", "speed"); empty: none; `as_stated`: all, and the files state it
  double phase_walk = 0; ///< of signals that wander (Effect::noise): their phase walks by this in a second [rad/s^(1/2)]
};

/// White noise, exact files, steady signals: the world of the model.
inline Laboratory ideal_laboratory() { return {}; }

/// Each kind of noise as often as the others; in a quarter of the campaigns every number is misread and the files state by how much, in another quarter one group is, each as often as the others, and nobody says so; a phase walk of 0.05 to 0.5 rad/s^(1/2).
Laboratory draw_laboratory(const Rig& rig, const std::vector<Run>& runs, std::mt19937_64& random);

/// White noise of variance 1.
Eigen::VectorXd white_noise(Eigen::Index samples, std::mt19937_64& random);

/// Noise of variance 1, before the converter; without mean. `dt`: s.
Eigen::VectorXd draw_noise(const Laboratory& laboratory, Eigen::Index samples, double dt, std::mt19937_64& random);

/// What the files say: rig and runs, with the numbers of `misread` off by errors of the usual size, alike in all runs; errors that they state are those of their numbers.
void misread(const Laboratory& laboratory, Rig& rig, std::vector<Run>& runs, std::mt19937_64& random);

}  // namespace unrig
