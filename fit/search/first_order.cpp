#include "fit/search/first_order.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

LinearStep linear_step(const MatrixXd& columns, const VectorXd& r) {
  LinearStep step{VectorXd::Zero(columns.cols()), r.squaredNorm()};
  std::vector<Index> some;
  for (Index k = 0; k < columns.cols(); ++k)
    if (columns.col(k).norm() > 0) some.push_back(k);
  if (some.empty()) return step;
  MatrixXd j = columns(Eigen::all, some);
  const VectorXd length = j.colwise().norm();
  j = j * length.cwiseInverse().asDiagonal();
  const VectorXd x = Eigen::ColPivHouseholderQR<MatrixXd>(j).solve(r);
  step.x(some) = x.cwiseQuotient(length);
  step.left = (r - j * x).squaredNorm();
  return step;
}

FirstOrder::FirstOrder(const JointProblem& joint) : joint_(joint) {
  std::vector<std::unique_ptr<RunResidual::FirstOrder>> runs(joint.runs().size());
  in_parallel(runs.size(), [&](std::size_t r) { runs[r] = std::make_unique<RunResidual::FirstOrder>(joint.runs()[r], joint.theta(r)); });
  for (std::size_t r = 0; r < runs.size(); ++r) {
    runs_.push_back(std::move(*runs[r]));
    if (runs_[r].known() && !joint.runs()[r].is_aside()) chi2_ += runs_[r].left().squaredNorm();
  }
}

bool FirstOrder::known() const {
  return std::all_of(runs_.begin(), runs_.end(), [](const RunResidual::FirstOrder& run) { return run.known(); });
}

FirstOrder::Promise FirstOrder::promise(const JointProblem& with, const std::string& id) const {
  const auto is_own = [&](const Unknown& u) { return with.parameter(u).name.starts_with(id + "."); };
  std::vector<Index> own;  // parameters
  for (const Unknown& u : with.unknowns())
    if (is_own(u) && std::find(own.begin(), own.end(), u.parameter) == own.end()) own.push_back(u.parameter);
  constexpr double faint = 1e-3;  // of where its size stands: a force on trajectories that it hardly bends; not 0, where the shape of a law has no slope
  const auto theta_of = [&](std::size_t r) {
    VectorXd theta = with.theta(r);
    if (own.empty()) return theta;
    const Parameter& size = with.model().parameters()[static_cast<std::size_t>(own.front())];
    theta[own.front()] = std::clamp(faint * theta[own.front()], size.lower, size.upper);
    return theta;
  };
  const auto known = static_cast<Index>(joint_.unknowns().size()), further = known + static_cast<Index>(with.unknowns().size());
  Promise promise{-INFINITY, 0};
  std::vector<VectorXd> begins(runs_.size());  // of states that only `with` has
  constexpr int steps = 2;  // a signal's shape has no slope before its amplitude is told
  for (int i = 0; i < steps; ++i) {
    std::vector<RunResidual::FirstOrder::Beside> of_run(runs_.size());
    std::vector<Index> states(runs_.size(), 0);
    Index rows = 0, columns = further;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const RunResidual& run = with.runs()[r];
      if (run.is_aside()) continue;
      if (effect(with.model().rig(), id).acts(with.model().rig(), run.conditions())) {
        of_run[r] = runs_[r].beside(run, theta_of(r), own, begins[r]);
        if (!of_run[r].left.allFinite()) return i == 0 ? Promise{-INFINITY, 0} : promise;
        states[r] = of_run[r].slopes.cols() - runs_[r].slopes().cols() - static_cast<Index>(own.size());
      } else {
        of_run[r] = {runs_[r].slopes(), runs_[r].left()};
      }
      if (i == 0) promise.largest_argument = std::max(promise.largest_argument, of_run[r].largest_argument);
      rows += of_run[r].left.size();
      columns += states[r];
    }
    MatrixXd slopes = MatrixXd::Zero(rows, columns);  // [unknowns of the fit | those of `with` that are the effect's own | states, run by run]
    VectorXd left(rows);
    Index row = 0, column = further;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      const auto& [s, l, argument] = of_run[r];
      const Index parameters = runs_[r].slopes().cols();
      const auto belongs = [&](const Unknown& u) { return !u.held && (u.run < 0 || u.run == static_cast<int>(r)); };
      const auto put = [&](Index where, Index from) { slopes.col(where).segment(row, l.size()) = s.col(from); };
      if (l.size() == 0) continue;
      for (Index k = 0; k < known; ++k)
        if (const Unknown& u = joint_.unknowns()[static_cast<std::size_t>(k)]; belongs(u)) put(k, u.parameter);
      for (Index k = known; k < further && s.cols() > parameters; ++k)
        if (const Unknown& u = with.unknowns()[static_cast<std::size_t>(k - known)]; is_own(u) && belongs(u)) put(k, parameters + (std::find(own.begin(), own.end(), u.parameter) - own.begin()));
      for (Index k = 0; k < states[r]; ++k) put(column++, parameters + static_cast<Index>(own.size()) + k);
      left.segment(row, l.size()) = l;
      row += l.size();
    }
    const LinearStep step = linear_step(slopes, left);
    promise.share = std::max(promise.share, 1 - step.left / chi2_);
    if (columns == further) break;
    column = further;
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      begins[r] = step.x.segment(column, states[r]);
      column += states[r];
    }
  }
  return promise;
}

}  // namespace unrig
