#pragma once
#include <string>
#include <vector>

#include "fit/likelihood/joint_problem.h"
#include "fit/likelihood/noise_colour.h"

namespace unrig {

/// Whether any of the runs is a free decay or is driven by what is measured: its motion is not estimated.
bool has_decays(const JointProblem& joint);

/// Whether every run is driven by a force that was measured: where such a run is does not depend on where it began, and a search that grows along the record does not lose its way.
bool all_driven(const JointProblem& joint);

/// Whether following the model takes several steps a sample in any of the runs (freeplay).
bool takes_small_steps(const JointProblem& joint);

/// What a fit leaves of the decays.
struct DecaysLeft {
  double chi2 = 0;       ///< over the degrees of freedom, at the noise levels themselves
  bool exactly = false;  ///< by the model itself; else chi2 is J over the samples of laws trusted to within 2.5 % of the force that is missed, infinite if not worth it
  std::vector<ChannelColour> noise = {};  ///< its colour, where the model itself leaves no more than that of most decays; empty: white, or more than noise
};

/// Fits the runs of `joint` whose motion is not estimated, with the nonlinear effect `id` at work, and leaves what it finds in `joint`. With a strong nonlinearity
/// chi-square has minima everywhere, because a small error of theta grows along the record. So theta and the trajectories are first searched side by side with
/// laws that are trusted more and more (fit/search/law_smoother.h), from the present size of the effect (its first parameter) and from the first values of parameters that
/// have gone astray; from there theta and the linear unknowns c are searched side by side with the model itself. Where that does not follow the decays, once more from
/// a smaller and a larger size. A large trajectory that crosses the corners of a law for seconds tells errors of theta from each other as little as chance does, and has least chi-squares
/// everywhere: of the ways to a law that takes small steps the one that leaves least is kept, and where it leaves one of the decays above its noise, which may have a colour, the law is asked what it leaves
/// when it is trusted to within some per cent; that holds where it is the noise, or where the model itself leaves more than half as much again.
/// `from_here`: the start is an estimate, other sizes are not tried; nor are they of an effect that acts in none of the decays.
DecaysLeft fit_decays(JointProblem& joint, const std::string& id, bool from_here = false);

/// Free decays beside unknown accelerations of every coordinate.
struct BesideUnknownForces {
  JointProblem joint;                   ///< parameters at which the decays ask for the least of them
  std::vector<Eigen::MatrixXd> states;  ///< per run: those of the model that the readings ask for, n x samples; empty of runs whose motion is estimated
};
/// From the parameters of `joint` or, where they have gone astray, from the rig's first values. `levels`: of trust in laws at work, each three times the one before.
BesideUnknownForces beside_unknown_forces(const JointProblem& joint, int levels = 1);

/// What laws that are trusted to within 2.5 % of the force that is missed leave of the decays: J over the samples, at the joint problem's theta.
double left_as_trusted(const JointProblem& joint);

}  // namespace unrig
