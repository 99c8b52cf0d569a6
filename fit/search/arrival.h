#pragma once
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "fit/fit.h"
#include "fit/likelihood/joint_problem.h"

namespace unrig {

/// A joint fit on its way from first guesses to the least chi-square.
struct Arrival {
  std::shared_ptr<const AeroelasticModel> model;
  std::vector<std::vector<MotionBasis::Window>> windows;  ///< of the motion, per run
  JointProblem joint;
  int evaluations = 0;
  bool converged = false;
  std::string message = {};

  double reduced_chi2() const;
};

/// How much work an arrival is worth.
struct ArrivalEffort {
  bool other_starts = true;  ///< where the record stays unexplained, once more from stiffnesses around the first guess
  int iterations = 50;       ///< over the whole record
  double precision = 0.01;   ///< standard errors; how near the least chi-square is near enough
  int evaluations = 400;     ///< of the model with its derivatives, of one search
};

/// From the problem's start values to the whole record by way of windows that grow from a few periods. The effects of the problem are left out.
Arrival arrive(const FitProblem& problem, const std::shared_ptr<const AeroelasticModel>& model, const ArrivalEffort& effort = {});

/// A fit of these runs over the first `horizon` samples (0: all), at the model's start values.
JointProblem make_joint(const AeroelasticModel& model, const std::vector<Run>& runs, const std::vector<std::vector<MotionBasis::Window>>& windows, Eigen::Index horizon);

/// Gives the unknowns of these names these values. Throws InputError for a value that is out of range.
void set_starts(JointProblem& joint, const std::map<std::string, double>& starts);

/// All the way from first guesses with the effects of `model` at work from the first window on; those start from the values that `like` has for them.
Arrival arrive_with_effects(const FitProblem& problem, const Arrival& like, const ArrivalEffort& effort = {});

/// Searches the least chi-square from where the fit stands.
JointProblem::Summary solve(Arrival& arrival, const JointProblem::SolveOptions& options = {});

/// Noise levels from what the model leaves, spikes, and windows of the motion that the gauge asks to be wider; solves again after each.
void refine(Arrival& arrival, const FitProblem& problem);

/// Of a beam rig some of whose runs are left with more than chance leaves of their noise: once more from stiffnesses of torsion and of the normal modes a third lower and a half higher. One mode
/// may have taken a resonance of another, beside which its own is small.
void look_elsewhere(Arrival& arrival);


/// A fit that cannot follow leaves parameters far from the truth: the rig's own that are further than `factor` from their first values, or than so many standard deviations of what is known of them, go back there. Whether any did.
/// A parameter of a single run (the normal-force slope, which falls to half in stall) stays.
bool back_to_the_rig(JointProblem& joint, double factor);

/// The unknowns that belong to effect `id`.
std::vector<Unknown*> unknowns_of(JointProblem& joint, const std::string& id);

}  // namespace unrig
