#pragma once
#include <memory>
#include <vector>

#include "core/effects/effect.h"
#include "core/law/law.h"
#include "fit/search/decays_first.h"

namespace unrig {

/// A formula of the dictionary, put to the sizes of these runs.
struct Form {
  Law law;                             ///< its scales are what the runs reach, so that coefficients are forces
  std::vector<Eigen::VectorXd> starts; ///< of its parameters: a small force of either sign, and what shapes it may have
  std::string listed = {};             ///< id of the effect that it is, which goes by that; empty: of none
  std::vector<Eigen::Index> listed_order = {};  ///< places of its parameters in the order in which that effect has them
  std::vector<Eigen::Index> stays = {};  ///< places of parameters whose change the rig's own damping makes good: no record prefers one of their values, and small ones ask for a damping below zero
  double per_coefficient = 1;          ///< what that effect has for its first parameter, over the law's
};

/// How far the runs of a fit take the states that a law may look at: largest absolute values.
struct Reach {
  double x = 0, v = 0;               ///< m, m/s; of the first normal mode (run_states)
  double a = 0;                      ///< m/s^2: v^2 / x, what a sine has
  double twist = 0, twist_rate = 0;  ///< rad, rad/s
  double alpha = 0;                  ///< rad, effective angle of attack, that of the shaft taken for it
  double seconds = 0;                ///< of the longest run
  double force = 0;                  ///< N, or N/kg^0.5 of a rig of modes: what holds x, stiffness times x
  double moment = 0;                 ///< N m, what holds the twist
};
Reach reach_of(const BesideUnknownForces& beside);

/// Formulas that a missing force may have (correct/manual/laws.md): powers of displacement, velocity and twist with a free exponent, even ones too; springs with a gap, on one side and on both; saturation, a sine, a
/// pull across two gaps; damping that grows or falls with amplitude; dry friction, with Stribeck's decrease; hysteresis of Bouc and Wen (Dahl's with b = 0), a Maxwell element; mass that changes with amplitude; stiffness and damping that change with time,
/// angle or speed; lift that bends; last, curves without a formula of their own. Those that nothing in these runs would move are left out.
std::vector<Form> dictionary(const Rig& rig, const Reach& reach);
/// Ids of the effects of the list that its forms are.
std::vector<std::string> listed_forms();
/// Laws of the list as formulas: those, and cubic stiffness and damping and a gap in the torsional drive, which a line of the dictionary has with a free exponent or not at all.
std::vector<Form> laws_of_the_list(const Rig& rig, const Reach& reach);
/// Parameters of the effect that a form of the list is, where its own stand here; those that it lacks where they start.
Eigen::VectorXd as_listed(const Form& form, const Eigen::VectorXd& own);

/// Parameters in which the force of a law of the dictionary is linear: those called c, c2 ... , f and k.
std::vector<Eigen::Index> coefficients_of(const Law& law);

/// Shapes that a form may have, at its first coefficients: exponents, corners and times over the range in which they matter; coarse where slopes in them tell the rest. `first`: corners alone, beyond which a run
/// may hardly go, so that slopes at another say nothing of it.
enum class Grid { first, coarse, fine };
std::vector<Eigen::VectorXd> shapes_of(const Form& form, Grid grid);

/// To three digits: what a user reads need not have more, and it is a start.
double rounded(double value);

/// The form as an effect of a rig, with its starts.
std::shared_ptr<const Effect> as_effect(const Form& form);

}  // namespace unrig
