#pragma once
#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// A force at the calibration station that would explain what a fit leaves of one run's gauge.
struct MissingForce {
  std::string run;
  double dt = 0;              ///< s
  Eigen::VectorXd value;      ///< N, per sample; sees the whole record, before and behind
  double standard_deviation = 0;  ///< N, of each sample away from the ends
  double roughness = 0;       ///< N/sqrt(s): what the force changes by in one second, estimated
  double as_read = 0;         ///< N, r.m.s.: the whole recording, its mean removed, read as a steady force; 0 where none is read at all

  double rms() const { return std::sqrt(value.squaredNorm() / static_cast<double>(value.size())); }
  /// Larger than all that the gauge read: at frequencies at which the rig hardly answers a force, noise and errors of the signal and of the rig's description read as a large one.
  bool out_of_proportion() const { return as_read > 0 && rms() > as_read; }
};

/// Input estimation: the force is a random walk, x' = A x + B f, df = q dw, gauge residual = C x + D f + noise; q is the one that makes the residual most likely, the
/// force the mean of all that agree with it (Kalman filter and Bryson-Frazier smoother, both in their steady state, linear in the samples; A. E. Bryson and
/// M. Frazier, TDR 63-119 (1963) 354; Riccati equation by doubling, B. D. O. Anderson, Int. J. Control 28 (1978) 295). Nonlinear effects at work are left out of the
/// rig's answer to it.
///
/// One for every run of a beam rig with a gauge; none for a rig that is known as modes only and has no force in its recording.
std::vector<MissingForce> missing_forces(const JointProblem& joint);

/// The same for one residual [N], of a system with one input and one output; the noise's standard deviation in N. Samples that are not finite are skipped. `states`, where it is given, gets
/// those of the system that go with the force, n x samples.
MissingForce estimate_force(const LinearSystem& system, double dt, const Eigen::VectorXd& residual, double noise, Eigen::MatrixXd* states = nullptr);

/// The Kalman filter of that random walk in its steady state, for readings that are linear in something: it is linear in them.
class ForceFilter {
 public:
  /// `roughness` [N/sqrt(s)] as MissingForce has it.
  ForceFilter(const LinearSystem& system, double dt, double roughness, double noise);

  double variance() const { return variance_; }  ///< of the innovations of what it is made for
  Eigen::Index states() const { return forward_.rows(); }  ///< of system and force
  /// Innovations of these readings; 0 where a sample is not finite.
  Eigen::VectorXd innovations(const Eigen::VectorXd& readings) const;
  /// Innovations of what known forces (samples x count, linear between samples) and, in the last columns, unit initial states make the system read. Where `counts` is 0 there is no sample.
  Eigen::MatrixXd innovations_of_forces(const Eigen::MatrixXd& forces, const Eigen::VectorXd& counts) const;

 private:
  Eigen::MatrixXd forward_;
  Eigen::RowVectorXd observe_;
  Eigen::VectorXd gain_, input0_, input1_;
  double direct_ = 0, variance_ = 0;
};

}  // namespace unrig
