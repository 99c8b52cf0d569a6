#include "fit/givens/number_parameters.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <memory>
#include <utility>

#include "core/effects/effect.h"
#include "fit/givens/inexact_uncertainty.h"
#include "fit/givens/stated_numbers.h"
#include "fit/givens/system_slopes.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Independent directions of z, of standard deviation 1, that the runs tell better than what is known of them.
MatrixXd told_directions(Arrival at, const StatedNumbers& numbers) {
  for (RunResidual& run : at.joint.runs()) run.temper(1);
  const NumberSlopes slopes = number_slopes(at, numbers, VectorXd::Zero(numbers.deviations()));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(told_of_deviations(joint_information(at.joint, slopes), numbers.deviations()));
  const auto told = (eigen.eigenvalues().array() > 1).count();
  return eigen.eigenvectors().rightCols(told);
}

/// The bases that models of a beam may have: its own, and that of effects that enrich it.
std::vector<Basis> bases_of(const FitProblem& problem) {
  std::vector<Basis> bases{model_of(problem.rig, problem.runs, problem.circulation).basis()};
  if (problem.rig.is_modal()) return bases;
  for (const Effect& e : effects())
    if (e.enriches_basis) bases.push_back(model_of(problem.rig, problem.runs, problem.circulation, {e.id}).basis());
  return bases;
}

std::vector<SystemSlope> along(const MatrixXd& directions, const std::vector<NumberSlope>& slopes) {
  std::vector<SystemSlope> sums;
  for (const auto& direction : directions.colwise()) {
    SystemSlope sum{0 * slopes.front().A, 0 * slopes.front().B, 0 * slopes.front().C, 0 * slopes.front().D};
    for (Index k = 0; k < direction.size(); ++k) {
      const NumberSlope& slope = slopes[static_cast<std::size_t>(k)];
      sum.A += direction[k] * slope.A;
      sum.B += direction[k] * slope.B;
      sum.C += direction[k] * slope.C;
      sum.D += direction[k] * slope.D;
    }
    sums.push_back(std::move(sum));
  }
  return sums;
}

/// The run of the fit whose parameters a run that took no part most likely has: the first in a stream, or at rest.
std::size_t most_alike(const JointProblem& fit, const Run& run) {
  for (std::size_t r = 0; r < fit.runs().size(); ++r)
    if ((fit.runs()[r].run().speed > 0) == (run.speed > 0)) return r;
  return 0;
}

}  // namespace

FilesToFit with_numbers_as_parameters(const FitProblem& stated, const std::vector<Run>& heldout, Arrival exact) {
  back_to_the_rig(exact.joint, 2);
  FilesToFit files{stated, heldout, told_directions(exact, StatedNumbers(stated.rig, stated.runs))};
  files.problem.rig.givens = nullptr;
  files.problem.rig.deviations = files.directions.cols();
  std::vector<Run> all = stated.runs;
  all.insert(all.end(), heldout.begin(), heldout.end());
  const StatedNumbers numbers(stated.rig, all);  // errors of runs that took no part stand behind the others
  MatrixXd directions = MatrixXd::Zero(numbers.deviations(), files.directions.cols());
  directions.topRows(files.directions.rows()) = files.directions;
  const VectorXd as_stated = VectorXd::Zero(numbers.deviations());
  const std::vector<Basis> bases = bases_of(files.problem);
  for (std::size_t r = 0; r < all.size(); ++r) {
    const bool fitted = r < stated.runs.size();
    const std::size_t like = fitted ? r : most_alike(exact.joint, all[r]);
    auto slopes = std::make_shared<DeviationSlopes>();
    for (const Basis& basis : bases) {
      const SystemSlopes system(SystemSlopes::Of::rig, exact.joint, like, basis, numbers, as_stated, r, fitted ? exact.joint.runs()[r].conditions() : conditions_of(all[r]), false);
      slopes->outputs = system.outputs();
      slopes->by_states[system.states()] = along(directions, system.all());
    }
    Run& run = fitted ? files.problem.runs[r] : files.heldout[r - stated.runs.size()];
    run.givens = nullptr;
    run.deviations = std::move(slopes);
  }
  return files;
}

VectorXd deviations_at(const FilesToFit& files, const JointProblem& fit) {
  VectorXd along = VectorXd::Zero(files.directions.cols());
  Index next = 0;
  for (const Unknown& u : fit.unknowns())
    if (std::isfinite(fit.parameter(u).known_to)) along[next++] = u.value;
  return files.directions * along;
}

}  // namespace unrig
