#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "fit/fit_files.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// What is known of the parameters before the run is corrected.
///
/// Rig parameters come from the fit with their covariance. Where the run took part in that fit they are `held`: its data are in them already, and for
/// given rig parameters the rest follows from the run alone. Otherwise they are `free` with the fit as prior, so that the run may still improve them.
/// A rig parameter that the fit could not determine is uncertain by its whole value. The run's own parameters (slope and others) are free without prior.
///
/// Amplitudes of the circulation: each normal around zero with standard deviation `amplitude`, chosen by evidence, times its `share`: 1, but for rates beta below 0.05 per semichord
/// beta / 0.05. What is left of the response then dies away like 1/s far behind the step, as behind an airfoil of infinite span, and a wing's does faster; what no record is long
/// enough to show of the limit is in the band.
///
/// What the user imposes: a value of phi(0) is one more known row, with a standard deviation of a millionth; `rising` are rows over theta that may not become negative.
struct Prior {
  std::vector<Eigen::Index> free, held, amplitudes;  ///< indices into theta
  Eigen::MatrixXd known;        ///< rows over theta: sqrt(precision) of the free rig parameters, and of what is imposed
  Eigen::VectorXd known_value;  ///< known theta = known_value, within one
  Eigen::MatrixXd rising;       ///< rising theta >= 0
  Eigen::MatrixXd held_root;  ///< square root of the covariance of the held ones
  double amplitude = 0.5;
  Eigen::VectorXd share;

  Eigen::MatrixXd regularisation() const;  ///< rows over theta: sqrt(precision) of the amplitudes
  Eigen::MatrixXd rows() const;            ///< both
  Eigen::VectorXd off(const Eigen::VectorXd& theta) const;  ///< by how much theta is off them
  bool allows(const Eigen::VectorXd& theta) const;          ///< it rises, up to rounding
};

Prior prior_of(const AeroelasticModel& model, const FittedRig& fit, const Eigen::VectorXd& theta, const std::string& run_file);

/// The amplitudes' standard deviation tau that maximises the evidence, the probability of the data with the unknowns integrated out, with the model linearised
/// at `e` (MacKay, Neural Computation 4 (1992) 415): tau^2 = sum A_k^2 / gamma, gamma the number of amplitudes that the data determine.
/// Within 0.01 and 10.
struct Evidence {
  double amplitude = 0;   ///< tau
  double determined = 0;  ///< gamma
};
Evidence evidence(const RunResidual::Evaluation& e, const Prior& prior, const Eigen::VectorXd& theta);

/// The same with phi(0) imposed where it is given, and with a phi that never falls from one of `semichords` to the next, from 0 to the first, nor behind the last.
struct Imposed {
  bool monotone = false;
  std::optional<double> at_step;  ///< phi(0)

  bool any() const { return monotone || at_step.has_value(); }
};
Prior impose(Prior prior, const Imposed& imposed, const AeroelasticModel& model, const Eigen::VectorXd& semichords);

/// The step to the least of chi-square and prior of the model linearised at `e`, over the free parameters; zero for the others. It ends where the prior allows.
/// Throws std::invalid_argument where it allows nothing.
Eigen::VectorXd gauss_newton_step(const RunResidual::Evaluation& e, const Prior& prior, const Eigen::VectorXd& theta);

/// A search for the best theta, and the prior that it was found with.
struct Search {
  Prior prior;
  RunResidual::Solution solution;
  RunResidual::Evaluation evaluation;  ///< there
  double determined = 0;               ///< amplitudes, by the data
};

/// -2 log of the evidence, the probability of the readings with theta and all that enters linearly integrated out (Laplace), but for what does not depend on the noise's colour.
double minus_twice_log_evidence(const RunResidual& residual, const Search& search);

/// What a search asks of a run: the least chi-square at a theta, with all that enters linearly at its best, and its slopes there. `advance`: where a step leads that may be bent, as
/// long as its beginning is straight; none: straight on.
struct Searched {
  std::function<RunResidual::Solution(const Eigen::VectorXd&)> solve;
  std::function<RunResidual::Evaluation(const RunResidual::Solution&)> differentiate;
  std::function<Eigen::VectorXd(const Eigen::VectorXd& theta, const Eigen::VectorXd& move)> advance = {};
};

/// Gauss-Newton with halved steps over the free parameters until the linear model promises less than `enough` of chi-square. `learn`: the weight of the
/// regularisation follows the evidence at every step. From a theta that the prior does not allow the first step is taken whole.
Search minimise(const Searched& run, Prior prior, const Eigen::VectorXd& theta, double enough, bool learn);
Search minimise(const RunResidual& residual, Prior prior, const Eigen::VectorXd& theta, double enough, bool learn);

}  // namespace unrig
