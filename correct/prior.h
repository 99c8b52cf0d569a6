#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/aeroelastic_model.h"
#include "fit/fit_files.h"
#include "fit/run_residual.h"

namespace unrig {

/// What is known of the parameters before the run is corrected.
///
/// Rig parameters come from the fit with their covariance. Where the run took part in that fit they are `held`: its data are in them already, and for
/// given rig parameters the rest follows from the run alone. Otherwise they are `free` with the fit as prior, so that the run may still improve them.
/// A rig parameter that the fit could not determine is uncertain by its whole value. The run's own parameters (slope and others) are free without prior.
///
/// Amplitudes of the circulation: each normal around zero with standard deviation `amplitude`, chosen by evidence.
struct Prior {
  Eigen::VectorXd mean;
  std::vector<Eigen::Index> free, held, amplitudes;  ///< indices into theta
  Eigen::MatrixXd rig;        ///< rows over theta: sqrt(precision) of the free rig parameters
  Eigen::MatrixXd held_root;  ///< square root of the covariance of the held ones
  double amplitude = 0.5;

  Eigen::MatrixXd regularisation() const;  ///< rows over theta: sqrt(precision) of the amplitudes
  Eigen::MatrixXd rows() const;            ///< both
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

/// The step to the least of chi-square and prior of the model linearised at `e`, over the free parameters; zero for the others.
Eigen::VectorXd gauss_newton_step(const RunResidual::Evaluation& e, const Prior& prior, const Eigen::VectorXd& theta);

/// A search for the best theta, and the prior that it was found with.
struct Search {
  Prior prior;
  RunResidual::Solution solution;
  RunResidual::Evaluation evaluation;  ///< there
  double determined = 0;               ///< amplitudes, by the data
};

/// Gauss-Newton with halved steps over the free parameters until the linear model promises less than `enough` of chi-square. `learn`: the weight of the
/// regularisation follows the evidence at every step.
Search minimise(const RunResidual& residual, Prior prior, const Eigen::VectorXd& theta, double enough, bool learn);

}  // namespace unrig
