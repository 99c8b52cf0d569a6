#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"
#include "correct/estimate/indicial_response.h"
#include "fit/fit_files.h"

namespace unrig {

/// What did the fluid do, once the rig is taken out? The rig's parameters come with their uncertainty from a fit; the indicial response does not.
struct CorrectProblem {
  Rig rig;
  FittedRig fit;
  Run run;
  double calibration_uncertainty = 0;  ///< of the gauge, relative, one standard deviation; 0: the rig's
  Imposed imposed = {};                ///< on the indicial response
  bool beyond = false;                 ///< go on where a law of the fit is taken beyond the range that it was learnt on
};

/// A load over the record [N].
struct CorrectedLoad {
  Eigen::VectorXd value, std;
  Eigen::MatrixXd by_source;  ///< samples x sources: the parts of std, whose squares sum to its square
  Eigen::VectorXd of_givens = {};  ///< what stated uncertainties of rig file and head make of the rig's part; empty: nothing is stated
  double simultaneous = 0;    ///< the whole curve stays within this many std with a probability of 95 %
  Eigen::VectorXd half_weight, twice_weight;  ///< the answer at half and at twice the regularisation's weight
};

struct CorrectResult {
  std::string file;
  double start = 0, dt = 0;         ///< s
  double onset = 0;                 ///< s: start of the motion
  double semichords_per_second = 0;
  double force_per_coefficient = 0; ///< rho U^2 b L [N]: normal force per unit coefficient
  Eigen::VectorXd gauge;            ///< as recorded [N]
  Eigen::VectorXd unexplained;      ///< the reading minus the model's [N]
  CorrectedLoad normal_force;       ///< load of the rigid rig
  CorrectedLoad circulatory;        ///< its circulatory part
  Eigen::VectorXd coefficient_std = {};  ///< of normal_force / force_per_coefficient, where the latter is uncertain too; else empty
  IndicialResponse indicial;
  double slope = 0, slope_std = 0;  ///< normal-force slope per radian, the limit of the response
  double reduced_chi2 = 0;
  double noise = 0;                 ///< of the gauge [N]
  double step = 0;                  ///< change of angle over the record [rad]
  double prior_amplitude = 0;       ///< regularisation: standard deviation of the amplitudes' prior; its weight is 1 over the square
  double determined = 0;            ///< number of amplitudes that the data determine
  Eigen::Index amplitudes = 0;      ///< of so many
  bool in_fit = false;              ///< the run took part in the fit
  Imposed imposed;                  ///< on the response; what its limit at the step is and whether it falls are then of the estimate without that
  double calibration_uncertainty = 0;
  std::vector<std::string> warnings;
  std::string no_answer;  ///< why load and response are not to be trusted, and what to do; empty: they are
};

/// The load of a rigid rig out of a gauge record, and the indicial response, without assuming Wagner's shape.
///
/// The build-up of circulation is 1 - sum_k A_k exp(-beta_k s) with rates beta_k spread evenly over ln s, also slower than the record is long, and free amplitudes: it acts in the load of
/// the prescribed motion and in that of the rig's own motion, both at once in the coupled model. Amplitudes, slope and motion are estimated together from
/// gauge and angle. Each amplitude has a normal prior around zero whose standard deviation maximises the evidence (correct/estimate/prior.h); it decides what the
/// record leaves open. The answers at half and at twice its weight, 1/tau^2, are part of the result.
///
/// Where the shaft moves for longer than the fit's knots can follow (in one motion a knot on every third sample will do, in several with rests between every sample needs one), motion and
/// load are found by a settled filter and smoother with a knot on every sample, in time and memory that go with the record (correct/long_motion/restless_run.h, correct/long_motion/restless_correction.h). It
/// does not know the rests as such, so that the band is wider there. Nonlinear forces cannot be followed so: a warning says that the knots lie too far apart.
///
/// Effects of the fit are honoured, but those that are part of the load (`wagner-lag`, `separation-lag`): they belong into the answer, and the free response takes their place.
///
/// What the user wants imposed on the response holds exactly in the answer. The standard deviations under an imposed phi(0) take it for exact; under imposed monotonicity they are
/// those without it: the constrained estimate is the point nearest to the free one in the metric of its information within a convex set that holds the
/// truth, and no further from it there, so that they are upper estimates.
///
/// Standard deviations by source: correct/estimate/uncertainty_budget.h. They are computed at up to some thousand samples, all of those in which the shaft moves as long as
/// these are few, and interpolated between. The gauge's zero and the steady load cannot be told apart: the steady part of the load is the reading
/// before the motion.
/// Throws InputError where the run has no angle channel or no stream, NoAnswer where the angle does not move, where it hardly ever rests and the fit names a nonlinear force, or where the estimated
/// trajectory takes a law of the fit beyond the range that it was learnt on (core/law/learnt_range.h); under CorrectProblem::beyond that is a warning.
CorrectResult correct(const CorrectProblem& problem);

}  // namespace unrig
