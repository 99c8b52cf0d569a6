#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "correct/estimate/uncertainty_budget.h"

namespace unrig {

/// Indicial response over semichords after a unit step of downwash; 1 at infinity: phi(s) = 1 - sum_k A_k exp(-beta_k s).
struct IndicialResponse {
  Eigen::VectorXd semichords, value;
  UncertaintyBySource uncertainty;
  Eigen::VectorXd per_radian, per_radian_std;  ///< normal-force coefficient after a step of one radian: slope times phi
  Eigen::VectorXd half_weight, twice_weight;  ///< the answer at half and at twice the regularisation's weight
  double at_step = 0, at_step_std = 0;        ///< phi(0), and its standard deviation
  double steepest_fall = 0;  ///< semichords where the slope is most negative, in its own standard deviations; infinity where it nowhere falls
  double monotone_p = 1;     ///< probability that a response that never falls looks as falling as this one does somewhere
  double trusted_from = 0;   ///< semichords from which on the standard deviation is below 5 % of the value; infinity: nowhere
  double lowest = 0, highest = 0;  ///< Hz: where the standard deviation of the response to oscillation is below 5 %; both 0: nowhere

  /// The start of the response, and whether it falls, as this other estimate has them.
  void take_tests_of(const IndicialResponse& other);
};

/// Where the response is given: 40 values per decade from 0.01 semichords to `longest`.
Eigen::VectorXd response_semichords(double longest);

/// At `response_semichords`, at theta.
///
/// Response to oscillation: C(i w) = 1 - sum_k A_k i w / (i w + beta_k U/b), Theodorsen's function where phi is Wagner's; looked at up to the fastest
/// rate of the model, which is no finer. It falls (p value) by the tube formula of `simultaneous_factor`, one-sided.
/// `semichords_per_second`: U/b.
IndicialResponse indicial_response(const AeroelasticModel& model, const Eigen::VectorXd& theta, const UncertaintyBudget& budget, double longest,
                                   double semichords_per_second);

/// phi at these semichords.
Eigen::VectorXd indicial_values(const AeroelasticModel& model, const Eigen::VectorXd& theta, const Eigen::VectorXd& semichords);

}  // namespace unrig
