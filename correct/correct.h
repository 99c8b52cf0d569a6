#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig.h"
#include "core/run.h"
#include "fit/fit_files.h"

namespace unrig {

/// What did the fluid do, once the rig is taken out? The rig's parameters come with their uncertainty from a fit; the indicial response does not.
struct CorrectProblem {
  Rig rig;
  FittedRig fit;
  Run run;
};

/// Indicial response over semichords after a unit step of downwash; 1 at infinity.
struct IndicialResponse {
  Eigen::VectorXd semichords, value, std;
};

struct CorrectResult {
  std::string file;
  double start = 0, dt = 0;         ///< s
  double onset = 0;                 ///< s: start of the motion
  double semichords_per_second = 0;
  double force_per_coefficient = 0; ///< rho U^2 b L [N]: normal force per unit coefficient
  Eigen::VectorXd gauge;            ///< as recorded [N]
  Eigen::VectorXd normal_force, normal_force_std;  ///< load of the rigid rig [N]
  Eigen::VectorXd circulatory, circulatory_std;    ///< its circulatory part [N]
  IndicialResponse indicial;
  double slope = 0, slope_std = 0;  ///< normal-force slope per radian, the limit of the response
  double reduced_chi2 = 0;
  double noise = 0;                 ///< of the gauge [N]
  double step = 0;                  ///< change of angle over the record [rad]
  double trusted_from = 0;          ///< semichords from which on the indicial response is known to 5 %; infinity: nowhere
  double prior_amplitude = 0;       ///< regularisation: standard deviation of each amplitude's prior
  std::vector<std::string> warnings;
};

/// The load of a rigid rig out of a gauge record, and the indicial response, without assuming Wagner's shape.
///
/// The build-up of circulation is 1 - sum_k A_k exp(-beta_k s) with rates beta_k spread evenly over ln s and free amplitudes: it acts in the load of
/// the prescribed motion and in that of the rig's own motion, both at once in the coupled model. Amplitudes, slope and motion are estimated together from
/// gauge and angle; the rig's parameters stay within their covariance. Each amplitude has a normal prior around zero of standard deviation
/// `prior_amplitude`, wide against any physical response, which only decides what the record leaves open (responses slower than the
/// record is long).
///
/// Standard deviations: gauge and angle noise, the rig's parameters with their correlations, and what the record leaves open, from the joint
/// Gauss-Newton covariance, times the reduced chi-square where that exceeds one. The gauge's zero and the steady load cannot be told apart: the steady
/// part of the load is the reading before the motion.
/// Throws InputError where the run has no angle channel or no stream, NoAnswer where the angle does not move.
CorrectResult correct(const CorrectProblem& problem);

}  // namespace unrig
