#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "fit/likelihood/run_residual.h"

namespace unrig {

/// One state of the rig over a run, as a fit sees it.
struct RunState {
  std::string name;       ///< "displacement", "velocity", "twist", "twist rate", "angle", "angular rate"
  Eigen::VectorXd value;  ///< one per sample
};

/// Displacement and velocity of the first normal mode at the element that the dead weights hung at [m, m/s] (modal rigs: of the first mode, in its own
/// coordinate), twist and twist rate of the first torsional mode [rad, rad/s], and of runs whose shaft is moved the angle from its first value and its rate. From
/// motion, start and inputs that the fit found. Of models without nonlinear effects.
std::vector<RunState> run_states(const RunResidual& run, const RunResidual::Prediction& p, const Eigen::VectorXd& theta);

/// On which state what is left of a run depends: the one under whose largest absolute values (a third of the samples) most of the excess lies.
struct StateDependence {
  std::string state;
  double share = 0;      ///< of the excess of power over the noise; a third where it does not depend on the state
  double standard = 0;   ///< standard deviation of that share under white noise and no dependence
  double follows = 0;    ///< correlation of residual and state: near 1 (-1) where it goes with (against) it, near 0 where it does not know its sign
};

/// `left`: residual in units of its noise, 0 where left out. None where no state holds more than a third by five standard deviations.
std::optional<StateDependence> depends_on(const std::vector<RunState>& states, const Eigen::VectorXd& left);

/// "71 % of it while the velocity is in its upper third, and it goes with it".
std::string sentence(const StateDependence& d);

}  // namespace unrig
