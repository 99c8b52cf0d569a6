#include "fit/diagnose/rig_description.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/rig/default_errors.h"
#include "fit/diagnose/selection.h"
#include "fit/givens/inexact_rig.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Runs that took no part, with the errors that all runs share.
std::vector<Run> moved_heldout(const DiagnoseProblem& problem, const FitProblem& errors, const VectorXd& z) {
  std::vector<Run> all = errors.runs, moved;
  for (const Run& run : problem.heldout) {
    all.push_back(run);
    if (!states_errors(problem.rig, problem.runs)) all.back().givens = std::make_shared<const Givens>(usual_errors(run));
  }
  const StatedNumbers numbers(errors.rig, all);
  VectorXd known = VectorXd::Zero(numbers.deviations());
  known.head(z.size()) = z;
  for (std::size_t i = errors.runs.size(); i < all.size(); ++i) {
    moved.push_back(numbers.run_at(i, known));
    moved.back().givens = nullptr;
  }
  return moved;
}

/// How a rig file or a head states such an error: "mass.std_percent = 1.4".
std::string statement(const FittedGiven& given) {
  const std::string of_array = given.name.substr(0, given.name.find('['));
  const std::string key = of_array.substr(of_array.find('.') + 1);
  const double per_cent = 100 * given.stated_std / std::abs(given.stated);
  if (!given.run.empty() || of_array == given.name) return fmt::format("{}{}_std_percent = {:.2g}", given.run.empty() ? "" : "# ", key, per_cent);
  if (key == "station") return fmt::format("{}.std = \"{:.2g} {}\"", key, given.stated_std, given.unit);
  return fmt::format("{}.std_percent = {:.2g}", key, per_cent);
}

double load_of(const FitProblem& problem, const FitResult& fit, const Run& run) {
  for (const FittedParameter& p : fit.parameters)
    if (p.name == "normal_force_slope" && p.run == run.file) return p.value * run.density * run.speed * run.speed * problem.rig.chord * problem.rig.strip_length;
  return 0;
}

/// In coloured noise most of what white noise does not explain is no mismatch: where noise explains what the promised step leaves, the numbers are asked for in that noise.
std::optional<RigDescription> in_the_noise_behind_a_step(const DiagnoseProblem& problem, const Trial& from, InexactRig& inexact, const Arrival& arrival) {
  Trial stepped = from;
  try {
    stepped.arrival = inexact.after_the_promised_step(arrival);
  } catch (const std::invalid_argument&) {  // no rig has such numbers
    return {};
  }
  measure(stepped);
  if (!explained_by_noise(stepped)) return {};
  Trial in_its_noise = from;
  take_noise_of(in_its_noise, stepped);
  std::optional<RigDescription> description = describe_rig(problem, in_its_noise);
  if (description) description->from = std::move(in_its_noise);
  return description;
}

}  // namespace

FitProblem with_errors_of_files(const DiagnoseProblem& problem) {
  FitProblem errors;
  errors.rig = problem.rig;
  errors.runs = problem.runs;
  errors.circulation = problem.circulation;
  errors.progress = problem.progress;
  if (states_errors(problem.rig, problem.runs)) return errors;
  errors.rig.givens = std::make_shared<const Givens>(usual_errors(problem.rig));
  for (Run& run : errors.runs) run.givens = std::make_shared<const Givens>(usual_errors(run));
  return errors;
}

MissingEffect as_missing(std::vector<FittedGiven> numbers) {
  constexpr std::size_t most = 5;
  const auto shift = [](const FittedGiven& given) { return std::abs(given.value - given.stated) / given.stated_std; };
  std::stable_sort(numbers.begin(), numbers.end(), [&](const FittedGiven& a, const FittedGiven& b) { return shift(a) > shift(b); });
  MissingEffect missing{rig_description_id, 0, "the rig file or a run's head is off", "", {}, ""};
  std::set<std::string> named;  // the runs share the errors of their heads
  std::vector<std::string> statements;
  for (const FittedGiven& given : numbers) {
    if (missing.parameters.size() == most || (!missing.parameters.empty() && shift(given) < 1)) break;
    if (!named.insert(given.name).second) continue;
    FittedParameter p;
    p.name = given.name;
    p.unit = given.unit;
    p.run = given.run;
    p.value = given.value;
    p.std_error = given.std_error;
    p.start = given.stated;
    missing.parameters.push_back(std::move(p));
    if (const std::string how = statement(given); std::find(statements.begin(), statements.end(), how) == statements.end()) statements.push_back(how);
  }
  missing.advice = fmt::format("Measure these again, or state how well they are known ({}): fit, correct and diagnose then find them with the rest", fmt::join(statements, "; "));
  return missing;
}

double change_of_load(const FitProblem& from, const FitResult& before, const FitProblem& to, const FitResult& after) {
  double sum = 0, count = 0;
  for (std::size_t r = 0; r < from.runs.size(); ++r) {
    const double was = load_of(from, before, from.runs[r]), is = load_of(to, after, to.runs[r]);
    if (was != 0 && is != 0) sum += 100 * (is / was - 1), ++count;
  }
  return count > 0 ? sum / count : 0;
}

std::optional<RigDescription> describe_rig(const DiagnoseProblem& problem, const Trial& from, double least) {
  if (problem.progress) problem.progress("looking at the rig's description");
  FitProblem errors = with_errors_of_files(problem);
  errors.effects = from.effects;
  errors.rig.laws = from.arrival.model->rig().laws;
  InexactRig inexact(errors);
  Arrival arrival = from.arrival;
  double freedom = 0;
  for (RunResidual& run : arrival.joint.runs()) {
    run.temper(1);
    freedom += static_cast<double>(run.degrees_of_freedom());
  }
  const double gain = inexact.promises(arrival), promised = gain / (arrival.joint.chi2() - freedom);
  // Near the noise the excess is uncertain by chance as much: chi-square by sqrt(2 n).
  constexpr double by_chance = 2;
  const double left = arrival.joint.chi2() - gain, noise = from.effects.empty() ? explained * freedom : freedom + by_chance * std::sqrt(2 * freedom);
  const bool is_near = from.effects.empty() || leaves_nothing(from), comes_to_it = is_near && gain > decisive && left < noise;
  if (!(promised > least) && !comes_to_it) return gain > decisive && !has_colour(arrival.joint) ? in_the_noise_behind_a_step(problem, from, inexact, arrival) : std::nullopt;

  constexpr double worth_a_step = 0.01;  // of what is left: numbers that explain it are found in steps that promise far more
  inexact.search(arrival, worth_a_step);
  auto moved = std::make_shared<FitProblem>();
  moved->rig = inexact.rig();
  moved->runs = inexact.runs();
  moved->circulation = errors.circulation;
  moved->rig.givens = nullptr;
  for (Run& run : moved->runs) run.givens = nullptr;
  RigDescription description{moved, moved_heldout(problem, errors, inexact.deviations()), fit_baseline(*moved), promised, arrival.joint.chi2() / freedom, inexact.cost_of_deviations(arrival), inexact.numbers(), inexact.deviations(), {}};
  take_noise_of(description.trial, from);
  const Eigen::MatrixXd& spread = inexact.stated_numbers().spread();
  const Eigen::MatrixXd covariance = spread * inexact.uncertainty(arrival).of_deviations * spread.transpose();
  for (std::size_t i = 0; i < description.numbers.size(); ++i) description.numbers[i].std_error = std::sqrt(covariance(static_cast<Index>(i), static_cast<Index>(i)));
  return description;
}

}  // namespace unrig
