#include "fit/propose/fitted_explanation.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "fit/effect_option.h"
#include "fit/fit_description.h"
#include "fit/search/effect_search.h"
#include "fit/solver/gauss_newton.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Whether one more run may move it: parameters of effects that the runs at hand leave open too.
bool may_move(const JointProblem& joint, const Unknown& u) { return !u.held || !joint.parameter(u).effect.empty(); }

const Unknown* find(const std::vector<Unknown>& unknowns, Index parameter, int run) {
  const auto found = std::find_if(unknowns.begin(), unknowns.end(), [&](const Unknown& u) { return u.parameter == parameter && u.run == run; });
  return found == unknowns.end() ? nullptr : &*found;
}

/// Information on the unknowns that all runs share, and which parameters they are.
MatrixXd information_in(const JointProblem& joint, std::vector<Index>& parameters) {
  const JointProblem::Linearisation lin = joint.linearise();
  std::vector<std::size_t> shared, own;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
    if (const Unknown& u = joint.unknowns()[i]; may_move(joint, u)) (u.run < 0 ? shared : own).push_back(i);
  MatrixXd j = lin.jacobian(Eigen::all, shared);
  if (!own.empty()) {
    const MatrixXd k = lin.jacobian(Eigen::all, own);
    j -= k * Eigen::ColPivHouseholderQR<MatrixXd>(k).solve(j);
  }
  MatrixXd h = j.transpose() * j;
  parameters.clear();
  for (std::size_t i = 0; i < shared.size(); ++i) {
    const Unknown& u = joint.unknowns()[shared[i]];
    parameters.push_back(u.parameter);
    const double open = ignorance(joint.parameter(u), u.value);
    if (open > 0) h(static_cast<Index>(i), static_cast<Index>(i)) += 1 / (open * open);
  }
  return h;
}

}  // namespace

FittedExplanation::FittedExplanation(const Explanation& explanation, const Rivals& rivals, const std::function<void(const std::string&)>& progress) : explanation_(explanation) {
  problem_.rig = rivals.rig;
  problem_.runs = rivals.runs;
  problem_.circulation = rivals.circulation;
  problem_.effects = explanation.effects;
  problem_.progress = progress;
  for (const Law& law : explanation.laws) {
    add_law(problem_.rig, law);
    problem_.effects.push_back(law.id());
  }
  refuse_idle("the diagnosis", problem_.effects, problem_.rig, problem_.runs);
  const auto model = std::make_shared<const AeroelasticModel>(model_of(problem_.rig, problem_.runs, problem_.circulation, problem_.effects));
  arrival_ = std::make_unique<Arrival>(problem_.effects.empty() ? arrive(problem_, model) : arrive_at_effects(problem_));
  no_answer_ = describe_fit(*arrival_, problem_, Settle::all).no_answer;
}

double FittedExplanation::log_noise() const {
  double sum = 0;
  for (std::size_t r = 0; r < joint().runs().size(); ++r) {
    const RunResidual& run = joint().runs()[r];
    const double samples = static_cast<double>(run.observations()), left = run.evaluate(joint().theta(r), Partials::none).chi2 / static_cast<double>(run.degrees_of_freedom());
    sum += samples * (std::log(run.noise(0)) + 0.5 * std::log(left));
  }
  return sum;
}

void FittedExplanation::settle(const FittedExplanation& reference) {
  for (std::size_t r = 0; r < joint().runs().size(); ++r) {
    const RunResidual& known = reference.joint().runs()[r];
    if (&reference != this) {
      joint().runs()[r].keep_noise_of(known);
      continue;
    }
    RunResidual& run = joint().runs()[r];
    run.temper(1);
    const double left = run.evaluate(joint().theta(r), Partials::none).chi2 / static_cast<double>(run.degrees_of_freedom());
    run.temper(std::sqrt(std::max(1.0, left)));
  }
  solve(*arrival_);
  uncertainty_ = estimate_uncertainty(joint());
  chi2_ = joint().chi2();
  information_ = information_in(joint(), shared_);
}

bool FittedExplanation::adopt(const std::vector<Unknown>& better) {
  const std::vector<Unknown> before = joint().unknowns();
  for (Unknown& u : joint().unknowns())
    if (const Unknown* known = find(better, u.parameter, u.run)) u.value = known->value, u.held = known->held;
  solve(*arrival_);
  const double chi2 = joint().chi2();
  if (!(chi2 < chi2_ - clearly_less)) {
    joint().unknowns() = before;
    return false;
  }
  chi2_ = chi2;
  uncertainty_ = estimate_uncertainty(joint());
  information_ = information_in(joint(), shared_);
  return true;
}

int FittedExplanation::variables() const {
  int count = 0;
  for (const RunResidual& run : joint().runs()) count += static_cast<int>(run.linear_unknowns());
  for (const Unknown& u : joint().unknowns()) count += u.held ? 0 : 1;
  return count;
}

VectorXd FittedExplanation::drawn_theta(const CandidateRun& candidate, std::mt19937_64& random) const {
  VectorXd theta = this->theta(candidate);
  const MatrixXd covariance = uncertainty_.covariance();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(covariance);
  std::normal_distribution<double> normal;
  VectorXd draw(covariance.rows());
  for (Index k = 0; k < draw.size(); ++k) draw[k] = normal(random) * std::sqrt(std::max(0.0, eigen.eigenvalues()[k]));
  const VectorXd off = eigen.eigenvectors() * draw;
  for (std::size_t k = 0; k < uncertainty_.free.size(); ++k) {
    const Unknown& u = joint().unknowns()[static_cast<std::size_t>(uncertainty_.free[k])];
    if (u.run >= 0 && u.run != static_cast<int>(candidate.like)) continue;
    const auto [lower, upper] = bounds_at(model(), u.parameter, u.value);
    theta[u.parameter] = std::clamp(theta[u.parameter] + off[static_cast<Index>(k)], lower, upper);
  }
  return theta;
}

std::vector<Index> FittedExplanation::own(std::size_t run) const {
  std::vector<Index> parameters;
  for (const Unknown& u : joint().unknowns())
    if (u.run == static_cast<int>(run) && may_move(joint(), u)) parameters.push_back(u.parameter);
  return parameters;
}

FittedExplanation::Refit FittedExplanation::search(std::vector<RunResidual> all, const std::vector<Unknown>& start) const {
  JointProblem with(model(), std::move(all));
  for (Unknown& u : with.unknowns())
    if (const Unknown* known = find(start, u.parameter, u.run)) u = *known, u.held = !may_move(joint(), *known);
  JointProblem::SolveOptions options;
  options.iterations = 60;
  options.precision = 0.1;  // standard errors: a hundredth of chi-square
  options.most_evaluations = 100;
  const JointProblem::Summary summary = with.solve(options);
  bool arrived = summary.converged && std::isfinite(summary.chi2);
  if (!arrived && std::isfinite(summary.chi2)) {  // along what hardly matters a search goes on for long
    constexpr double hardly = 0.3;                // standard errors: less than a tenth of chi-square
    const LeastSquaresProblem squares = with.least_squares();
    arrived = standing(squares, linearise(squares, squares.values())).step_left < hardly;
  }
  return {arrived, summary.chi2 - chi2_, with.unknowns()};
}

FittedExplanation::Refit FittedExplanation::refit(const RunResidual& added, std::size_t like, const std::vector<Unknown>& start) const {
  std::vector<RunResidual> all = joint().runs();
  all.push_back(added);
  if (!start.empty()) return search(std::move(all), start);
  std::vector<Unknown> unknowns = joint().unknowns();
  for (Unknown u : joint().unknowns()) {
    if (u.run != static_cast<int>(like)) continue;
    u.run = static_cast<int>(joint().runs().size());
    unknowns.push_back(u);
  }
  return search(std::move(all), unknowns);
}

FittedExplanation::Refit FittedExplanation::refit_anew(const RunResidual& added, const Run& as_read) const {
  FitProblem problem = problem_;
  problem.progress = nullptr;
  problem.runs.push_back(as_read);
  const Arrival anew = problem.effects.empty() ? arrive(problem, std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation))) : arrive_at_effects(problem);
  if (anew.model->parameters().size() != model().parameters().size()) return {};  // the added run asks for more modes
  std::vector<RunResidual> all = joint().runs();
  all.push_back(added);
  for (std::size_t r = 0; r < all.size(); ++r)
    if (anew.joint.runs()[r].linear_unknowns() == all[r].linear_unknowns()) all[r].start_from(anew.joint.runs()[r]);
  std::vector<Unknown> unknowns = anew.joint.unknowns();
  for (Unknown& u : unknowns)  // what the runs at hand do not determine of the rig stays held
    if (const Unknown* known = find(joint().unknowns(), u.parameter, u.run); known && !may_move(joint(), *known)) u = *known;
  return search(std::move(all), unknowns);
}

}  // namespace unrig
