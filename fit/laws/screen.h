#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/laws/dictionary.h"
#include "fit/search/decays_first.h"

namespace unrig {

/// How well a form explains free decays beside a linear rig whose stiffness, damping and mass may change.
struct Screened {
  Eigen::VectorXd start;  ///< parameters of the form; its coefficient estimated, its shape the best of its starts
  double deviance = 0;    ///< -2 ln likelihood of the decays, but for a constant
  double gain = 0;        ///< twice the log likelihood beyond that without a law; 0 where the form was not looked at, or its coefficient lies where it may not be
};

/// Every form at each of its shapes, its coefficients as the regression on the decays has them (law_regression.h); normal mode and torsion each through their own port. Forms that act on lift are not looked at.
/// One per form, in their order.
std::vector<Screened> screen(const std::vector<Form>& forms, const BesideUnknownForces& beside);

}  // namespace unrig
