#include "correct/segments/inexact_load.h"

#include <cmath>
#include <tuple>

#include "core/numerics/in_parallel.h"
#include "correct/estimate/indicial_response.h"
#include "correct/segments/load_in_legs.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What a correction comes to.
struct Answer {
  VectorXd circulatory, normal_force, indicial;
  double slope = 0, at_step = 0, force_per_coefficient = 0;
};

Answer operator-(const Answer& a, const Answer& b) {
  return {a.circulatory - b.circulatory, a.normal_force - b.normal_force, a.indicial - b.indicial, a.slope - b.slope, a.at_step - b.at_step, a.force_per_coefficient - b.force_per_coefficient};
}

double force_per_coefficient(const Rig& rig, const Run& run) {
  return run.density * run.speed * run.speed * rig.semichord() * rig.strip_length * static_cast<double>(rig.submerged.size());
}

/// The answer of a run one Gauss-Newton step from theta; `beside`: a part of the step that is not of interest.
Answer answer_of(RunInLegs& legs, const AeroelasticModel& model, const Run& run, const Prior& prior, const VectorXd& theta, const VectorXd& beside, const VectorXd& semichords, VectorXd* step) {
  const RunResidual::Solution solution = legs.solve(theta);
  const VectorXd move = gauss_newton_step(legs.differentiate(solution), prior, theta) - beside;
  if (step) *step = move;
  const VectorXd used = step ? VectorXd::Zero(move.size()) : move;
  std::vector<VectorXd> c;
  for (const RunResidual::Evaluation& e : legs.by_leg(solution)) c.push_back(e.linear + e.linear_slope * used);
  const VectorXd there = theta + used;
  Answer answer;
  std::tie(answer.circulatory, answer.normal_force) = loads_at(legs, there, c);
  answer.indicial = indicial_values(model, there, semichords);
  answer.slope = there[model.index("normal_force_slope")];
  answer.at_step = indicial_values(model, there, VectorXd::Zero(1))[0];
  answer.force_per_coefficient = force_per_coefficient(model.rig(), run);
  return answer;
}

/// How the answer changes along one direction, per standard deviation.
Answer change_along(const FinishedCorrection& done, const FittedNumbers::Direction& direction, const std::vector<Index>& parameter_of, const Answer& here, const VectorXd& beside) {
  constexpr double small = 0.01;
  const Basis& basis = done.model.basis();
  const Rig rig = done.numbers.rig(small * direction.off);
  const Run run = done.numbers.run(small * direction.off);
  const AeroelasticModel model =
      AeroelasticModel(rig, make_basis(rig, basis.normal_modes, basis.torsion_modes), done.model.circulation(), AeroelasticModel::Circulation::free).with_effects(done.model.effect_ids());
  VectorXd move = VectorXd::Zero(done.best.solution.theta.size());
  for (std::size_t i = 0; i < parameter_of.size(); ++i)
    if (parameter_of[i] >= 0) move[parameter_of[i]] = small * direction.parameters[static_cast<Index>(i)];
  Prior prior = done.best.prior;
  prior.known_value += prior.known * move;
  RunInLegs legs = done.legs.held_against(model, run);
  const Answer there = answer_of(legs, model, run, prior, done.best.solution.theta + move, beside, done.semichords, nullptr);
  Answer change = there - here;
  for (VectorXd* part : {&change.circulatory, &change.normal_force, &change.indicial}) *part /= small;
  for (double* part : {&change.slope, &change.at_step, &change.force_per_coefficient}) *part /= small;
  return change;
}

/// Returns what the changes come to.
VectorXd widen(const MatrixXd& changes, VectorXd& std, MatrixXd& by_source) {
  auto rig = by_source.col(static_cast<Index>(Source::rig));
  rig = (rig.array().square() + changes.rowwise().squaredNorm().array()).sqrt().matrix().eval();
  std = by_source.rowwise().norm();
  return changes.rowwise().norm();
}

}  // namespace

void add_numbers(const FinishedCorrection& done, CorrectResult& result) {
  const auto& directions = done.numbers.directions();
  const auto count = static_cast<Index>(directions.size());
  const Run run = done.numbers.run();
  VectorXd beside;
  const Answer here = answer_of(done.legs, done.model, run, done.best.prior, done.best.solution.theta, VectorXd::Zero(done.best.solution.theta.size()), done.semichords, &beside);
  const std::vector<Index> parameter_of = done.numbers.places_of_parameters(done.model, result.file);
  std::vector<Answer> changes(directions.size());
  in_parallel(directions.size(), [&](std::size_t k) { changes[k] = change_along(done, directions[k], parameter_of, here, beside); });

  const auto columns = [&](VectorXd Answer::* part) {
    MatrixXd all((here.*part).size(), count);
    for (Index k = 0; k < count; ++k) all.col(k) = changes[static_cast<std::size_t>(k)].*part;
    return all;
  };
  const auto row = [&](double Answer::* part) {
    Eigen::RowVectorXd all(count);
    for (Index k = 0; k < count; ++k) all[k] = changes[static_cast<std::size_t>(k)].*part;
    return all;
  };
  const MatrixXd normal_force = columns(&Answer::normal_force), indicial = columns(&Answer::indicial);
  const Eigen::RowVectorXd slope = row(&Answer::slope), force = row(&Answer::force_per_coefficient);
  const MatrixXd coefficient = (normal_force - here.normal_force * force / here.force_per_coefficient) / here.force_per_coefficient;
  result.coefficient_std = ((result.normal_force.std / here.force_per_coefficient).array().square() + coefficient.rowwise().squaredNorm().array()).sqrt();
  result.circulatory.of_givens = widen(columns(&Answer::circulatory), result.circulatory.std, result.circulatory.by_source);
  result.normal_force.of_givens = widen(normal_force, result.normal_force.std, result.normal_force.by_source);
  widen(indicial, result.indicial.uncertainty.std, result.indicial.uncertainty.by_source);
  const MatrixXd per_radian = here.slope * indicial + here.indicial * slope;
  result.indicial.per_radian_std = (result.indicial.per_radian_std.array().square() + per_radian.rowwise().squaredNorm().array()).sqrt().matrix().eval();
  result.indicial.at_step_std = std::hypot(result.indicial.at_step_std, row(&Answer::at_step).norm());
  result.slope_std = std::hypot(result.slope_std, slope.norm());
}

}  // namespace unrig
