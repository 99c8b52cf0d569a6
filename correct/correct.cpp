#include "correct/correct.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <set>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/effects/effect.h"
#include "core/numerics/in_parallel.h"
#include "core/model/indicial_table.h"
#include "core/law/law_effect.h"
#include "core/model/rigid_load.h"
#include "core/model/run_inputs.h"
#include "core/run/run_limits.h"
#include "correct/estimate/how_far_to_trust.h"
#include "correct/segments/beyond_noise.h"
#include "correct/segments/inexact_load.h"
#include "correct/segments/knots.h"
#include "correct/segments/laws_in_legs.h"
#include "correct/segments/load_in_legs.h"
#include "correct/estimate/noise_choice.h"
#include "correct/estimate/prior.h"
#include "correct/long_motion/restless_correction.h"
#include "correct/segments/run_in_legs.h"
#include "correct/estimate/uncertainty_budget.h"
#include "fit/likelihood/explained.h"
#include "fit/likelihood/run_residual.h"
#include "fit/likelihood/share_followed.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Amplitudes with which the rates come nearest to Wagner's function: where the search starts, not what it is held to.
VectorXd wagner_amplitudes(const VectorXd& rates, double semichords) {
  constexpr Index points = 60;
  const VectorXd s = (VectorXd::LinSpaced(points, 0, 1) * std::log(semichords / 0.02)).array().exp() * 0.02;
  return nearest_amplitudes(rates, s, s.unaryExpr(&wagner_exact));
}

void check(const CorrectProblem& problem) {
  const Run& run = problem.run;
  if (problem.rig.is_modal()) throw InputError({problem.rig.file, 0}, "a rig known only as modes", "wanted a rig with a section and strips", "Describe the section: without it there is no load to separate.");
  run.channel("alpha");
  if (!(run.speed > 0)) throw InputError({run.file, 0}, "speed 0", "wanted a run in a stream", "Circulation needs a stream; free decays are for `unrig fit`.");
  check_what_drives(run);
  check_reading_changes(run, "gauge");
  const Rig& rig = problem.rig;
  if (rig.gauge_element > 0 && std::none_of(rig.submerged.begin(), rig.submerged.end(), [&](int element) { return element > rig.gauge_element; }))
    throw InputError({rig.file, 0}, "no submerged element outboard of the gauge", "wanted a section that loads the gauge", "Correct [section] elements or the gauge's element in the rig file.");
  if (problem.imposed.monotone && problem.imposed.at_step.value_or(0) > 1)
    throw InputError({run.file, 0}, fmt::format("a response that starts at {:g} and never falls", *problem.imposed.at_step), "wanted a start of at most 1, which is its limit", "");
}

/// The effects of the fit, but those that are part of the load: the free build-up of circulation stands in their place.
std::vector<std::string> effects_of_the_rig(const FittedRig& fit) {
  std::vector<std::string> ids;
  std::copy_if(fit.effects.begin(), fit.effects.end(), std::back_inserter(ids), [rig = with_laws({}, fit)](const std::string& id) { return !effect(rig, id).in_the_load; });
  return ids;
}

/// The fit's modes, which the rig must have.
Basis basis_of(const CorrectProblem& problem) try {
  if (problem.fit.normal_modes > 0) return make_basis(problem.rig, problem.fit.normal_modes, problem.fit.torsion_modes);
  return make_basis(problem.rig, 0.5 / problem.run.dt, problem.run.density);
} catch (const std::invalid_argument& e) {
  throw InputError({problem.fit.file, 0}, e.what(), "wanted a fit of the rig " + problem.rig.file, "Fit this rig to its free decays and steps first.");
}

/// The coupled model with a free build-up of circulation.
AeroelasticModel free_model(const CorrectProblem& problem, double semichords) {
  const Run& run = problem.run;
  constexpr double beyond_the_record = 5;  // slower rates: what the limit still hides at its end
  const VectorXd rates = spread_rates(beyond_the_record * semichords);
  const Basis basis = basis_of(problem);
  const AeroelasticModel model =
      AeroelasticModel(with_laws(problem.rig, problem.fit), basis, {"free", wagner_amplitudes(rates, semichords), rates}, AeroelasticModel::Circulation::free).with_effects(effects_of_the_rig(problem.fit));
  check_is_fit_of(model, problem.fit, run.file);
  return model;
}

/// The best theta with noise levels, roughness of the motion and weight of the regularisation learned on the way.
Search estimate(RunInLegs& legs, const Prior& prior, const VectorXd& start, const std::vector<ChannelColour>& expected) {
  constexpr double roughly = 1, well = 1e-3;  // of a chi-square whose own scatter is some tens
  legs.differentiate_only(prior.free);
  VectorXd theta = start;
  if (RunResidual& whole = legs.residual(0); legs.size() == 1 && whole.find_linear(theta)) {  // dry friction that lets go at another time is another minimum: the motion as the angle says, before the gauge has its full say
    for (const double softer : {30.0, 10.0, 3.0}) {
      whole.temper(softer);
      theta = minimise(whole, prior, theta, roughly, false).solution.theta;
    }
    whole.temper(1);
  }
  theta = minimise(searched(legs), prior, theta, roughly, false).solution.theta;
  legs.learn_noise_and_motion(theta);
  Search search = minimise(searched(legs), prior, theta, well, true);
  choose_colour(legs, search, expected, well);
  return search;
}

/// The best theta with that imposed on the response, from the best without it; the weight of the regularisation stays.
Search constrained(RunInLegs& legs, const Search& best, const Imposed& imposed, const AeroelasticModel& model, const VectorXd& semichords) {
  constexpr double well = 1e-3;
  Search search = minimise(searched(legs), impose(best.prior, imposed, model, semichords), best.solution.theta, well, false);
  search.determined = best.determined;
  return search;
}

/// Samples at which standard deviations are computed: those of a moving shaft, no more than some thousand, and ever fewer while it rests.
std::vector<Index> chosen_samples(const MotionBasis& motion) {
  constexpr Index most = 3000;
  constexpr double sparser = 1.0 / 32;  // linear interpolation of a decaying exponential over it: 1e-4
  Index moving = 0;
  for (const Interval& active : motion.active()) moving += active.length();
  const Index stride = 1 + moving / most;
  std::vector<Index> samples;
  Index at = 0;
  const auto rest_until = [&](Index end) {
    for (Index since = 0; at + since < end; since += 1 + static_cast<Index>(sparser * static_cast<double>(since))) samples.push_back(at + since);
    if (at < end && samples.back() != end - 1) samples.push_back(end - 1);
    at = std::max(at, end);
  };
  for (const Interval& active : motion.active()) {
    rest_until(active.first);
    for (; at < active.last; at += stride) samples.push_back(at);
    at = active.last;
  }
  rest_until(motion.samples());
  if (samples.back() != motion.samples() - 1) samples.push_back(motion.samples() - 1);
  return samples;
}

MatrixXd interpolated(const MatrixXd& value, const std::vector<Index>& at, Index samples) {
  MatrixXd all(samples, value.cols());
  for (std::size_t i = 0; i + 1 < at.size(); ++i)
    for (Index k = at[i]; k <= at[i + 1]; ++k) {
      const double share = static_cast<double>(k - at[i]) / static_cast<double>(at[i + 1] - at[i]);
      const auto j = static_cast<Index>(i);
      all.row(k) = (1 - share) * value.row(j) + share * value.row(j + 1);
    }
  return all;
}

/// Where the rigid rig goes on from behind a leg, with its motion following theta.
RigidLoad::State going_on(const RigidLoad& load, const MatrixXd& linear_slope) {
  MatrixXd by_theta = load.behind.by_motion * linear_slope.topRows(load.behind.by_motion.cols());
  if (load.behind.by_theta.size() > 0) by_theta += load.behind.by_theta;
  return {load.behind.value, {}, std::move(by_theta)};
}

/// A load of one leg with its standard deviations in their place in the record; returns the length of its curve.
double place_load(const RunResidual& residual, const UncertaintyBudget& budget, const Interval& samples, const VectorXd& value, const MatrixXd& by_theta, const MatrixXd& by_motion,
                  const std::vector<Index>& at, CorrectedLoad& load) {
  MatrixXd by_c = MatrixXd::Zero(by_motion.rows(), residual.linear_unknowns());
  by_c.leftCols(by_motion.cols()) = by_motion;
  by_c.col(residual.first_offset()).setConstant(steady_per_reading(residual.model().rig()));
  const UncertaintyBySource u = budget.of(by_theta, by_c);
  load.value.segment(samples.first, samples.length()) = value;
  const MatrixXd by_source = interpolated(u.by_source, at, value.size());
  load.by_source.middleRows(samples.first, samples.length()) = by_source;
  load.std.segment(samples.first, samples.length()) = by_source.rowwise().norm();
  return u.length;
}

/// Both loads over the whole record. `budget_of`: of a leg.
void set_loads(const RunInLegs& legs, const std::vector<RunResidual::Evaluation>& by_leg, const std::function<UncertaintyBudget(std::size_t leg)>& budget_of, const VectorXd& theta, CorrectResult& result) {
  const Index n = legs.samples(legs.size() - 1).last;
  for (CorrectedLoad* load : {&result.circulatory, &result.normal_force}) *load = {VectorXd(n), VectorXd(n), MatrixXd(n, sources), {}, 0, {}, {}};
  std::vector<RigidLoad::State> from(1);
  for (std::size_t p = 0; p + 1 < legs.size(); ++p) from.push_back(going_on(load_at(legs.residual(p), theta, by_leg[p].linear, {0}, from[p]), by_leg[p].linear_slope));
  VectorXd circulatory(legs.size()), normal_force(legs.size());  // lengths of their curves
  in_parallel(legs.size(), [&](std::size_t p) {
    const RunResidual& residual = legs.residual(p);
    const UncertaintyBudget budget = budget_of(p);
    const std::vector<Index> at = chosen_samples(residual.motion());
    const RigidLoad load = load_at(residual, theta, by_leg[p].linear, at, from[p]);
    circulatory[static_cast<Index>(p)] = place_load(residual, budget, legs.samples(p), load.circulatory, load.circulatory_by_theta, load.circulatory_by_motion, at, result.circulatory);
    normal_force[static_cast<Index>(p)] = place_load(residual, budget, legs.samples(p), load.normal_force, load.normal_force_by_theta, load.normal_force_by_motion, at, result.normal_force);
  });
  result.circulatory.simultaneous = simultaneous_factor_of_length(circulatory.sum());
  result.normal_force.simultaneous = simultaneous_factor_of_length(normal_force.sum());
}

/// What an error of the calibration does where a run is in legs, which hand it on to each other.
void add_calibration(const RunInLegs& legs, const std::vector<RunResidual::Evaluation>& by_leg, const std::vector<VectorXd>& answers, const VectorXd& theta, CorrectResult& result) {
  constexpr double small = 1e-3;
  std::vector<VectorXd> c;
  for (std::size_t p = 0; p < legs.size(); ++p) c.push_back(by_leg[p].linear + small * answers[p].tail(by_leg[p].linear.size()));
  const auto [circulatory, normal_force] = loads_at(legs, theta + small * answers.front().head(theta.size()), c);
  const auto add = [&](const VectorXd& there, CorrectedLoad& load) {
    load.by_source.col(static_cast<Index>(Source::calibration)) = result.calibration_uncertainty / small * (there - load.value).cwiseAbs();
    load.std = load.by_source.rowwise().norm();
  };
  add(circulatory, result.circulatory);
  add(normal_force, result.normal_force);
}

/// The answers at half and at twice the weight of the regularisation, by one step from the best.
void vary_weight(const RunInLegs& legs, const std::vector<RunResidual::Evaluation>& by_leg, const Search& best, const AeroelasticModel& model, CorrectResult& result) {
  const VectorXd& theta = best.solution.theta;
  for (const bool half : {true, false}) {
    Prior prior = best.prior;
    prior.amplitude *= half ? std::sqrt(2.0) : std::sqrt(0.5);
    const VectorXd move = gauss_newton_step(best.evaluation, prior, theta);
    std::vector<VectorXd> c;
    for (const RunResidual::Evaluation& e : by_leg) c.push_back(e.linear + e.linear_slope * move);
    std::tie(half ? result.circulatory.half_weight : result.circulatory.twice_weight, half ? result.normal_force.half_weight : result.normal_force.twice_weight) = loads_at(legs, theta + move, c);
    (half ? result.indicial.half_weight : result.indicial.twice_weight) = indicial_values(model, theta + move, result.indicial.semichords);
  }
}

/// What is left of the gauge's readings; where the angle has made its first 0.3 %, and where it ends.
void describe_motion(const RunInLegs& legs, const VectorXd& theta, const Run& run, CorrectResult& result) {
  VectorXd angle(run.samples());
  double level = 0;
  result.unexplained = result.gauge;
  for (std::size_t p = 0; p < legs.size(); ++p) {
    const RunResidual::Prediction prediction = legs.residual(p).predict(theta);
    const Interval& s = legs.samples(p);
    result.unexplained.segment(s.first, s.length()) -= prediction.output.col(0);
    angle.segment(s.first, s.length()) = prediction.motion.angle.array() + level;
    level = angle[s.last - 1];
  }
  Index first = 0;
  while (first + 1 < angle.size() && std::abs(angle[first]) < 3e-3 * angle.cwiseAbs().maxCoeff()) ++first;
  result.step = level;
  result.onset = run.time(first);
}

std::string coloured(const Run& run, const std::string& channel, const NoiseColour& colour) {
  return fmt::format("{}: the noise of {} is coloured: {:.3g} {} in all (r.m.s.), {:.3g} white. Load and band allow for it. If the instrument cannot make so much, something is missing from the rig of the fit: `unrig diagnose` looks "
                     "for it.",
                     run.file, channel, std::sqrt(colour.variance()), run.channel(channel).unit, std::sqrt(colour.white));
}

std::string other_readings(const CorrectProblem& problem) {
  return fmt::format("{}: other readings or conditions than those that {} was fitted to; the band takes them for the fitted ones. Fit again, or give the new recording another name.", problem.run.file, problem.fit.file);
}

void describe_run(const CorrectProblem& problem, CorrectResult& result) {
  const Run& run = problem.run;
  const Rig& rig = problem.rig;
  result.file = run.file;
  result.start = run.start;
  result.dt = run.dt;
  result.semichords_per_second = run.speed / rig.semichord();
  result.force_per_coefficient = run.density * run.speed * run.speed * rig.semichord() * rig.strip_length * static_cast<double>(rig.submerged.size());
  result.gauge = run.channel("gauge").value;
  result.calibration_uncertainty = problem.calibration_uncertainty > 0 ? problem.calibration_uncertainty : rig.calibration_uncertainty;
  result.imposed = problem.imposed;
  result.warnings = run.warnings;
  if (problem.fit.had_other_readings(run, problem.rig)) result.warnings.push_back(other_readings(problem));
}

/// Behind shorter ones the slope of a step of `sample_data/campaigns/null` that was cut was three of its standard deviations off and more; from 3.2 on one at most.
constexpr double shortest_response = 3;  // semichords

std::string too_short_for_a_limit(const Run& run, double semichords) {
  return fmt::format("{}: the record ends {:.2g} semichords after the shaft sets out. It says what the load is there, but not how much of that is the slope and how much the response: both are "
                     "extrapolated, with errors that are too small. Record {:g} semichords or more.",
                     run.file, semichords, shortest_response);
}

std::string fit_leaves(const CorrectProblem& problem, const std::set<std::string>& runs) {
  return fmt::format("{}: {} does not explain {}. What it leaves of their readings would read as a load here, and widens the band. `unrig diagnose` looks for what is missing.", problem.run.file, problem.fit.file,
                     fmt::join(runs, ", "));
}

std::string fit_leaves_unheeded(const CorrectProblem& problem) {
  return fmt::format("{}: {} does not explain all of its runs. The band of a run that is followed in parts or without a rest does not allow for what it leaves of them. `unrig diagnose` looks for what is missing.",
                     problem.run.file, problem.fit.file);
}

/// Samples behind the onset.
Index first_behind_onset(const CorrectResult& result) { return std::clamp<Index>(static_cast<Index>((result.onset - result.start) / result.dt), 0, result.gauge.size() - 1); }

/// Share of the gauge's variance that the model follows.
double gauge_followed(const Run& run, const CorrectResult& result) {
  const Channel* weight = run.find("weight");
  VectorXd counts(result.gauge.size());
  for (Index k = 0; k < counts.size(); ++k) counts[k] = std::isfinite(result.gauge[k]) && (!weight || weight->value[k] > 0) ? 1 : 0;
  return share_followed(result.gauge, result.gauge - result.unexplained, counts);
}

/// 95 % band of the circulatory load over what that changes by, r.m.s. behind the onset.
double band_over_change(const CorrectResult& result) {
  const CorrectedLoad& load = result.circulatory;
  const Index first = first_behind_onset(result), count = load.value.size() - first;
  constexpr double usual = 1.96;
  return usual * load.std.tail(count).norm() / (load.value.tail(count).array() - load.value[0]).matrix().norm();
}

/// Why load and response say nothing; empty where they do.
std::string nothing_said(const Run& run, bool explained, double band, const CorrectResult& result) {
  constexpr double half = 0.5, clearly = 3;  // of the variance; standard deviations
  if (!std::isfinite(result.reduced_chi2) || !result.circulatory.std.allFinite())
    return fmt::format("{}: with the rig of the fit the model has no finite answer to this motion. It is not this rig's fit, or a parameter of it is absurd.", run.file);
  if (const double followed = gauge_followed(run, result); followed < half && (!explained || !(std::abs(result.slope) > clearly * result.slope_std)))
    return fmt::format("{}: the model follows {:.0f} % of the gauge's variance. The gauge does not answer to the motion of the shaft, or the rig of the fit is another one. Look at the recording.", run.file,
                       100 * std::max(0.0, followed));
  if (!explained && !(band < 1))
    return fmt::format("{}: what is left of gauge and angle (reduced chi-square {:.3g}) may move the load by {:.2g} times of what it changes by. Look at the recording, or ask `unrig diagnose` what the rig lacks.", run.file,
                       result.reduced_chi2, band);
  return "";
}

/// `widened`: by how much more than as noise what is left widens the band; `band`: what band_over_change says of what this run itself is left with.
void look_at_what_is_left(const Run& run, Index degrees_of_freedom, double widened, double band, CorrectResult& result) {
  const bool explained = result.reduced_chi2 <= most_of_noise(degrees_of_freedom);
  if (result.reduced_chi2 < least_of_noise(degrees_of_freedom))
    result.warnings.push_back(fmt::format("{}: gauge and angle are explained to a reduced chi-square of {:.3g}, better than their noise allows. A converter is coarser than the noise, or wrong readings have raised that: look "
                                          "at the recording.",
                                          run.file, result.reduced_chi2));
  if (!explained) {  // nor where it is not a number
    const std::string wider = widened > 1 ? fmt::format("It goes on for longer than a sample and moves the load by {:.2g} times what noise of its size would. The band is as much wider.", widened) : "The band is widened as if what is left were noise.";
    result.warnings.push_back(fmt::format("{}: gauge and angle are explained to a reduced chi-square of {:.3g} only. Something is missing from the rig of the fit, or it is another rig's: `unrig diagnose` looks "
                                          "for it. {}",
                                          run.file, result.reduced_chi2, wider));
  }
  if (result.no_answer.empty()) result.no_answer = nothing_said(run, explained, band, result);
}

/// Knots so far apart that what a nonlinear force does to a long motion is hardly in the load; the acceleration of an oscillation is off by (omega h)^2 / 12.
constexpr Index farthest_at_all = 8;

bool hardly_rests(const Run& run, const Windows& windows) {
  constexpr double most = 0.5;
  Index moving = 0;
  for (const MotionBasis::Window& w : windows) moving += w.knots.length();
  return static_cast<double>(moving) > most * static_cast<double>(run.samples());
}

std::string knots_too_far_apart(const Run& run, const Windows& windows) {
  const Index stride = windows.front().stride;
  return fmt::format("{}: the fit names a nonlinear force, and the shaft moves for so long in all that the {} knots of its motion lie {} samples apart ({:.3g} ms). What it does faster is missing from the load, and the "
                     "band is too narrow while it moves. Correct the run in parts in which it moves for at most {} samples.",
                     run.file, most_knots_to_fit, stride, 1e3 * static_cast<double>(stride) * run.dt, most_moving(windows));
}

/// Whether every fitted channel has half of its readings there.
bool is_read(const Run& run, const std::vector<std::string>& channels, const Interval& samples) {
  const Channel* weight = run.find("weight");
  const auto reads = [&](const std::string& channel) {
    const VectorXd& value = run.channel(channel).value;
    Index count = 0;
    for (Index k = std::max<Index>(0, samples.first); k < std::min(run.samples(), samples.last); ++k) count += std::isfinite(value[k]) && (!weight || weight->value[k] > 0) ? 1 : 0;
    return 2 * count >= samples.length();
  };
  return reads("alpha") && std::all_of(channels.begin(), channels.end(), reads);
}

/// The legs in which the run is followed; none where it is followed from sample to sample. Both are for linear rigs: beside a nonlinear force the motion has as many knots as a fit may have, and is told where these are
/// too few.
std::vector<Windows> legs_to_follow(const AeroelasticModel& model, const Run& run, const VectorXd& theta, const Windows& windows, std::vector<std::string>& warnings) {
  if (windows.front().stride == 1) return {windows};
  const Conditions conditions = conditions_of(run);
  const std::vector<std::string> channels = model.output_channels(run);
  const LinearSystem system = model.system(conditions, theta, channels);
  if (system.feedback.empty()) {
    if (!too_far_apart(windows)) return {windows};
    constexpr Index fewest = 100;          // samples of a rest: a quarter of them before the next motion, for its level
    constexpr double shortest_rest = 4;  // semichords
    const Index rest = std::max(fewest, static_cast<Index>(shortest_rest * model.rig().semichord() / run.speed / run.dt));
    const bool can_be_cut = system.exogenous.empty() && run_inputs(run, conditions).cols() == 0;
    return can_be_cut ? legs_of(windows, rest, [&](const Interval& samples) { return is_read(run, channels, samples); }) : std::vector<Windows>{};
  }
  const Windows closer = with_most_knots(windows);
  if (!too_far_apart(closer)) return {closer};
  constexpr Index most_at_all = farthest_at_all * most_knots_to_fit;
  if (closer.front().stride > farthest_at_all && hardly_rests(run, closer))
    throw NoAnswer(fmt::format("{}: the shaft moves nearly all the time, for longer than {} samples, and the fit names a nonlinear force. Such a motion is followed by {} knots, which lie too far apart here: "
                               "correct the run in parts of at most {} samples that begin at rest",
                               run.file, most_at_all, most_knots_to_fit, most_at_all));
  warnings.push_back(knots_too_far_apart(run, closer));
  return {closer};
}

/// `numbers`: of a rig or run that states uncertainties, at whose numbers `problem` stands; null where nothing is stated.
CorrectResult correct_at(const CorrectProblem& problem, const FittedNumbers* numbers) {
  check(problem);
  const Run& run = problem.run;
  CorrectResult result;
  describe_run(problem, result);

  const Windows windows = generous_windows(run);
  if (windows.empty()) throw NoAnswer(fmt::format("{}: the angle does not move by more than its noise; nothing can be said about how circulation builds up", run.file));
  const VectorXd& alpha = run.channel("alpha").value;
  const auto onset = static_cast<double>(moving(alpha, noise_level(alpha)).front().first);
  const double length = (static_cast<double>(run.samples()) - onset) * run.dt * result.semichords_per_second;
  const AeroelasticModel model = free_model(problem, length);
  const VectorXd start = theta_for(model, problem.fit, run.file, conditions_of(run).onset_angle);
  const Prior prior = prior_of(model, problem.fit, start, run.file);
  if (length < shortest_response) result.warnings.push_back(too_short_for_a_limit(run, length));
  const std::vector<Windows> windows_by_leg = legs_to_follow(model, run, start, windows, result.warnings);
  if (windows_by_leg.empty()) {
    correct_restless({model, run, prior, start, length, steady_per_reading(problem.rig), problem.imposed}, result);
    if (numbers) result.warnings.push_back(fmt::format("{}: the shaft hardly ever rests; the band of such a run does not allow for the uncertainties that rig file and run state.", run.file));
    if (!problem.fit.left.empty()) result.warnings.push_back(fit_leaves_unheeded(problem));
    warn_of_laws_unheeded(model, run, result.warnings);
    look_at_what_is_left(run, 2 * run.samples(), 1, band_over_change(result), result);
    return result;
  }

  RunInLegs legs(model, run, windows_by_leg);
  legs.residual(0).follow_in(problem.fit.law_steps);
  const Search free = estimate(legs, prior, start, problem.fit.noise_colour);
  const Search best = problem.imposed.any() ? constrained(legs, free, problem.imposed, model, response_semichords(length)) : free;
  const VectorXd& theta = best.solution.theta;
  refuse_beyond_learnt(legs, theta, problem.beyond, result.warnings);

  legs.differentiate_only({});
  RunInLegs::Together together;
  const auto look_at = [&](const Search& search) {
    together = legs.look_at(search.solution, search.prior, result.calibration_uncertainty > 0);
    result.reduced_chi2 = together.all.chi2 / static_cast<double>(legs.degrees_of_freedom() - static_cast<Index>(search.prior.free.size()));
  };
  BeyondNoise beyond_noise;
  const auto own_budget = [&](std::size_t leg, const Prior& by, double calibration) { return legs.budget(leg, together, by, calibration, beyond_noise.own * std::sqrt(std::max(1.0, result.reduced_chi2))); };
  const auto budget_of = [&](std::size_t leg, const Prior& by, double calibration) {
    UncertaintyBudget budget = own_budget(leg, by, calibration);
    if (beyond_noise.of_fit.size() > 0) budget.add(Source::gauge, beyond_noise.of_fit);
    return budget;
  };
  if (problem.imposed.any()) {
    look_at(free);
    result.indicial = indicial_response(model, free.solution.theta, budget_of(0, free.prior, result.calibration_uncertainty), length, result.semichords_per_second);
  }
  look_at(best);
  if (legs.size() == 1) beyond_noise = moved_beyond_noise(legs.residual(0), together.all, best.prior, theta, result.reduced_chi2, problem.fit, chosen_samples(legs.residual(0).motion()));
  const UncertaintyBudget of_theta = budget_of(0, best.prior, result.calibration_uncertainty);
  const std::vector<RunResidual::Evaluation>& by_leg = legs.by_leg(best.solution);

  const bool in_legs = legs.size() > 1;
  const auto set_loads_by = [&](const std::function<UncertaintyBudget(std::size_t leg)>& budget) { set_loads(legs, by_leg, budget, theta, result); };
  if (in_legs) set_loads_by([&](std::size_t leg) { return own_budget(leg, best.prior, 0); });
  else if (beyond_noise.of_fit.size() > 0) set_loads_by([&](std::size_t) { return own_budget(0, best.prior, result.calibration_uncertainty); });
  else set_loads_by([&](std::size_t) { return of_theta; });
  const double own_band = band_over_change(result);
  if (beyond_noise.of_fit.size() > 0) set_loads_by([&](std::size_t) { return of_theta; });
  if (in_legs && result.calibration_uncertainty > 0) add_calibration(legs, by_leg, together.answer_to_reading, theta, result);
  IndicialResponse response = indicial_response(model, theta, of_theta, length, result.semichords_per_second);
  if (problem.imposed.any()) response.take_tests_of(result.indicial);
  result.indicial = response;
  vary_weight(legs, by_leg, best, model, result);
  describe_motion(legs, theta, run, result);

  result.noise = legs.residual(0).noise(0);
  if (const NoiseColour* colour = legs.residual(0).colour(0)) result.warnings.push_back(coloured(run, legs.residual(0).channels().front(), *colour));
  const Index slope = model.index("normal_force_slope");
  result.slope = theta[slope];
  result.slope_std = of_theta.root().row(slope).norm();
  result.prior_amplitude = best.prior.amplitude;
  result.determined = best.determined;
  result.amplitudes = static_cast<Index>(best.prior.amplitudes.size());
  result.in_fit = !best.prior.held.empty();
  if (numbers) add_numbers({legs, model, best, *numbers, result.indicial.semichords}, result);
  if (in_legs && !problem.fit.left.empty()) result.warnings.push_back(fit_leaves_unheeded(problem));
  if (!beyond_noise.unexplained.empty()) result.warnings.push_back(fit_leaves(problem, beyond_noise.unexplained));
  look_at_what_is_left(run, legs.degrees_of_freedom(), beyond_noise.own, own_band, result);
  return result;
}

/// Times as they were recorded.
void take_recorded_times(const Run& recorded, const Run& corrected, CorrectResult& result) {
  result.onset *= recorded.dt / corrected.dt;
  result.start = recorded.start;
  result.dt = recorded.dt;
}

}  // namespace

CorrectResult correct(const CorrectProblem& problem) {
  const FittedNumbers numbers(problem.fit, problem.rig, problem.run);
  if (!numbers.any()) return correct_at(problem, nullptr);
  refuse_other_rig(problem.rig, problem.fit);
  CorrectProblem at = problem;
  at.rig = numbers.rig();
  at.run = numbers.run();
  at.fit = numbers.with_numbers_known();
  at.fit.rig_fingerprint.clear();  // compared above: rig and run stand at other numbers from here on
  at.fit.fingerprints.clear();
  CorrectResult result = correct_at(at, &numbers);
  take_recorded_times(problem.run, at.run, result);
  if (problem.fit.had_other_readings(problem.run, problem.rig)) result.warnings.push_back(other_readings(problem));
  result.warnings.insert(result.warnings.end(), numbers.warnings().begin(), numbers.warnings().end());
  return result;
}

}  // namespace unrig
