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

/// The force of every form, evaluated on the states that the readings ask for (the smoother of an unknown force, fit/force/missing_force.h), is sent through the linear rig onto the readings, and its coefficient is the
/// regression of the innovations
///
///   e_k(readings) = sum over shifts a e_k(force of shift) + sum over initial states + c e_k(force of the form)
///
/// of the Kalman filter of that unknown force, whose density q is then smaller by as much as the likelihood asks for: linear in the record and in all that is looked for. Torsion and normal mode each through their own port.
/// Forms that act on lift are not looked at. Laws at work in `beside` are left out of the rig. One per form, in their order.
std::vector<Screened> screen(const std::vector<Form>& forms, const BesideUnknownForces& beside);

}  // namespace unrig
