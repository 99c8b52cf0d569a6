#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "correct/correct.h"

namespace unrig {

/// The load on a rig that is known only as modes, in the unit of its reading: what the gauge would read if the rig were rigid and its mount did not move.
struct ModalLoad {
  std::string file, unit;
  double start = 0, dt = 0;    ///< s
  Eigen::VectorXd gauge;       ///< as recorded
  Eigen::VectorXd from_inputs; ///< what the measured motion of the mount (and a measured force) do to the reading
  Eigen::VectorXd load, std;
  Eigen::MatrixXd by_source;   ///< samples x sources (no angle)
  double simultaneous = 0;     ///< the whole curve stays within this many std with a probability of 95 %
  Eigen::VectorXd half_weight, twice_weight;  ///< the answer at half and at twice the regularisation's weight
  double noise = 0;            ///< of the gauge
  double roughness = 0;        ///< root of the spectral density of load'' [unit / s^1.5]
  double bandwidth = 0;        ///< Hz: up to here the estimate follows the load by half at least; 0: nowhere
  double calibration_uncertainty = 0;
  std::vector<std::string> warnings;
};

/// The rig's modes take the measured inputs u and the load l, spread over the modes as a measured force is:
///
///   x' = A x + B u + B_l l,   l'' = white noise of density q,   gauge = C x + offset of the load itself + noise of variance r,
///
/// the load scaled so that a steady one reads as itself. The estimate is the mean of l for given readings, by Kalman filter and smoother (H. E. Rauch, F. Tung and
/// C. T. Striebel, AIAA J. 3 (1965) 1445): cost and memory go with the record's length. The weight of the regularisation, r/q, and r are those that make the readings most
/// probable (F. C. Schweppe, IEEE Trans. Inf. Theory 11 (1965) 61), by a search over the first fifty thousand samples. States and load are unknown at the start.
///
/// Standard deviations: the smoother's variance, split into that of the noise as it passes through the smoother in the middle of the record, and the rest, which is regularisation;
/// rig parameters by how the estimate moves along each column of a root of their covariance (one that the fit held is held); calibration.
/// Throws InputError where the run has no gauge column or the fit is of another rig.
ModalLoad modal_load(const CorrectProblem& problem);

/// time, gauge, normal_force and its standard deviation, then as in corrected.csv, each in the unit of the reading.
std::string to_csv(const ModalLoad& result, const MadeBy& made_by = {});
/// The same row by row, for files that are long.
void to_csv(const TextSink& sink, const ModalLoad& result, const MadeBy& made_by = {});
std::string report(const ModalLoad& result);

}  // namespace unrig
