#pragma once
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "fit/search/arrival.h"
#include "fit/search/decays_first.h"
#include "fit/search/screening.h"
#include "fit/search/search_numbers.h"

namespace unrig {

/// A set of effects, fitted.
struct Trial {
  std::vector<std::string> effects;
  Arrival arrival;
  double promised_left = INFINITY;  ///< chi-square that one linear step promised to leave, at the noise levels of the time
  double score = 0;               ///< share of what a step without its last effect leaves, that was promised to go; 0 where none was added
  std::vector<double> variance = {};   ///< per run: residual power over noise power
  std::vector<double> samples = {};    ///< per run: as many of them as the residual's colour leaves independent
  std::vector<double> angle_variance = {}, angle_samples = {};  ///< the same of the angle, where the motion is estimated; no samples elsewhere
  double variables = 0;           ///< each as what it costs the evidence over the logarithm of all samples: 1, or what a run tells of less (left_of_runs)
  DecaysLeft decays = {INFINITY, true};  ///< what fit_decays left of them; infinite: not asked
  bool ruled_out = false;         ///< by the free decays: the other runs were not searched
  bool is_settled = false;        ///< at its least chi-square, further than a search among many goes (settle)

  double reduced_chi2() const;    ///< over all runs, in units of the noise
  /// Residual power above the noise, over the noise; a run that is left with less than its noise makes up for no other.
  double excess() const;
};

inline bool leaves_nothing(const Trial& trial) { return trial.reduced_chi2() < explained; }

/// Sets what a trial leaves of each run, as it stands.
void measure(Trial& trial);

/// Whether any of the runs counts for nothing (RunResidual::set_aside).
bool any_aside(const JointProblem& joint);

/// Whether nonlinear effects are at work in any of the runs.
bool nonlinear(const Trial& trial);
/// Whether an effect is such a law in any of them; and whether the last one is.
bool is_a_law(const std::string& id, const JointProblem& joint);
bool brings_a_law(const Trial& trial);

/// Whether an effect is a signal with amplitudes of its own in each run, which take a share of anything that lies at its frequencies.
bool is_a_signal(const std::string& id, const JointProblem& joint);

/// -2 ln likelihood of the gauge with each run's own variance, and of the angle where both explain the run, of parameters about which something is known beside the runs (Parameter::known_to), plus ln(samples) per variable, of `a` less that of `b`
/// (G. Schwarz, Annals of Statistics 6 (1978) 461). Samples of the gauge count by the colour of the better of the two.
double bic_difference(const Trial& a, const Trial& b);
/// The same without what variables cost: -2 ln likelihood.
double deviance_difference(const Trial& a, const Trial& b);

/// The best fit with nothing missing.
Trial fit_baseline(const FitProblem& problem);

/// `effects`, those of base and one or more: where their search begins, and as score what one linear step from `base` would remove. `screening`: of base.
Trial screened(const FitProblem& problem, const Screening& screening, const Trial& base, const std::vector<std::string>& effects);

/// The same of each of `ids` beside `base`, in their order.
std::vector<Trial> screened_beside(const FitProblem& problem, const Trial& base, const std::vector<std::string>& ids);

/// Whether what a law promises to first order could be decisive among the samples of `base`; of a base far from the noise always: a step says little there.
bool may_be_seen(const Trial& screened, const Trial& base);

/// Holds the unknowns of a screened trial that its runs do not determine: ready to be fitted. False where the model does not stay finite, which tells nothing.
bool hold_undetermined(Trial& trial);

/// Both.
Trial prepare(const FitProblem& problem, const Screening& screening, const Trial& base, const std::vector<std::string>& effects);
Trial prepare(const FitProblem& problem, const Trial& base, const std::vector<std::string>& effects);

/// Residual power over noise power of the runs whose motion is not estimated.
double left_of_decays(const Trial& trial);

/// Whether following the model takes several steps a sample (freeplay): then free decays tell whether the law is worth following the other runs.
bool decays_decide(const Trial& trial);

/// Of decays that are set aside: what is left of them where their laws are trusted to within some per cent, all unknowns held (fit/search/decays_first.h).
void judge_decays(Trial& trial);

/// Of a prepared trial whose last effect is nonlinear: theta from the free decays alone (fit/search/decays_first.h), where there are any that
/// `base` does not follow. False where the effect leaves more than half of the excess that `base` leaves of them: the other runs are not worth the search. `from_here`: its start is an estimate.
bool fit_decays_first(Trial& trial, const Trial& base, bool from_here = false);

/// Fits everything, in full where that leaves less than `least`, once fit_decays_first has told theta.
void follow_further(Trial& trial, double least, const Goal& goal = {});

/// Fits a prepared trial whose last effect is nonlinear: by the free decays first, then everything, in full where that leaves less than `least`; runs that are driven from first guesses, and
/// where these leave more than half of what `base` does along trajectories that trust the law more and more, as free decays. False where the free decays speak against it.
/// `goal`: beyond whose reach no more is fitted.
bool follow_nonlinear(const FitProblem& problem, Trial& trial, const Trial& base, double least, const Goal& goal = {});

/// The fit of a problem with its effects at work, by the road that a diagnosis takes to them: the best fit with nothing missing, the linear effects together, the nonlinear
/// ones one after the other, and all over again from first guesses where they leave more than the noise.
Arrival arrive_at_effects(const FitProblem& problem);

/// Fits a prepared trial with everything free, while the weights of the runs return to those of their noise, in so many rounds.
void fit_fully(Trial& trial, int rounds);

/// Goes on to the least chi-square.
void settle(Trial& trial);

/// One set after the other with an effect fewer, of which the evidence is not decisively less: what the others made superfluous is taken away, the last effect too, by way of which they may have come to a minimum that they had
/// missed. None where nothing is superfluous.
std::vector<Trial> taken_away(const FitProblem& problem, const Trial& trial);

/// Leaves out those terms of its effects (Effect::terms) without which the evidence is no less, held at no amplitude.
void leave_out_terms(Trial& trial);

/// Follows its nonlinear laws in so many times the steps that they ask for, and fits again.
void follow_finer(Trial& trial, Eigen::Index times);

/// With a law at work that leaves something near the noise: the same followed in finer steps, where these leave less than half of it. What coarse steps make of a sharp law is no effect; where they are
/// not what is missing, they would only make everything after it dearer.
Trial in_finer_steps(const Trial& trial);

/// The same all over again from first guesses, with windows that grow from a few periods: for effects without which the rig's parameters go far astray. Keeps the better.
void fit_from_first_guesses(const FitProblem& problem, Trial& trial);

}  // namespace unrig
