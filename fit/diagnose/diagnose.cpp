#include "fit/diagnose/diagnose.h"

#include "core/rig/fingerprint.h"
#include "fit/diagnose/as_given.h"
#include "fit/diagnose/diagnosis_search.h"
#include "fit/givens/inexact_rig.h"
#include "fit/likelihood/run_order.h"

namespace unrig {
namespace {

using Eigen::Index;

/// `numbers_known`: what their files state of their uncertainty has been allowed for.
Diagnosis search(const DiagnoseProblem& problem, bool numbers_known = false) {
  DiagnosisSearch search(problem, numbers_known);
  search.ask_about_noise();
  search.ask_about_description();
  search.try_without_a_law();
  search.look_for_a_law();
  search.look_for_effects();
  search.weigh_description();
  search.look_for_the_law_of_what_remains();
  return search.told();
}

/// A fit to numbers that are taken for known from here on: the ones that the fit with nothing missing found. Its recordings are those of the files.
void describe_numbers(const DiagnoseProblem& problem, const std::vector<FittedGiven>& numbers, FitResult& fit) {
  if (fit.parameters.empty()) return;
  for (std::size_t r = 0; r < fit.runs.size(); ++r) fit.runs[r].fingerprint = fingerprint(problem.runs[r], problem.rig);
  fit.rig_fingerprint = fingerprint(problem.rig);
  const auto parameters = static_cast<Index>(fit.parameters.size()), count = static_cast<Index>(numbers.size());
  Eigen::VectorXd deviation(parameters);
  for (Index i = 0; i < parameters; ++i) {
    const double error = fit.parameters[static_cast<std::size_t>(i)].std_error;
    deviation[i] = std::isfinite(error) ? error : 0;
  }
  fit.givens = numbers;
  for (FittedGiven& g : fit.givens) g.std_error = 0;
  fit.joint_covariance = Eigen::MatrixXd::Zero(parameters + count, parameters + count);
  fit.joint_covariance.topLeftCorner(parameters, parameters) = deviation.asDiagonal() * fit.correlation * deviation.asDiagonal();
  fit.warnings.push_back("the numbers that state their uncertainty stand at what the fit with nothing missing made of them; standard errors are those with these numbers known");
}

/// Of a rig or of runs that state uncertainties: with the numbers that fit the runs best, nothing missing, within what is stated. What they explain is not looked for.
Diagnosis diagnose_inexact(const DiagnoseProblem& problem) {
  FitProblem stated;
  stated.rig = problem.rig;
  stated.runs = problem.runs;
  stated.circulation = problem.circulation;
  stated.progress = problem.progress;
  Arrival arrival = arrive(stated, std::make_shared<const AeroelasticModel>(model_of(stated.rig, stated.runs, stated.circulation)));
  InexactRig inexact(stated);
  inexact.search(arrival);
  DiagnoseProblem at = problem;
  at.rig = inexact.rig();
  at.runs = inexact.runs();
  at.rig.givens = nullptr;
  for (Run& run : at.runs) run.givens = nullptr;
  const std::vector<FittedGiven> numbers = inexact.numbers();
  Diagnosis d = search(at, true);
  for (FitResult* fit : {&d.before, &d.after}) describe_numbers(problem, numbers, *fit);
  return d;
}

Diagnosis diagnose_in_order(const DiagnoseProblem& problem) { return states_errors(problem.rig, problem.runs) ? diagnose_inexact(problem) : search(problem); }

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const std::vector<std::size_t> order = order_of_search(problem.runs);
  if (is_as_given(order)) return diagnose_in_order(problem);
  DiagnoseProblem ordered = problem;
  ordered.runs = in_order(problem.runs, order);
  Diagnosis d = diagnose_in_order(ordered);
  tell_as_given(GivenOrder(problem.runs), problem.runs.size(), d);
  return d;
}

}  // namespace unrig
