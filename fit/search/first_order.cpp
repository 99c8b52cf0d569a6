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
  for (auto& run : runs) runs_.push_back(std::move(*run));
  if (!known()) return;
  std::vector<Beside> alone(runs_.size());
  for (std::size_t r = 0; r < runs_.size(); ++r)
    if (!joint.runs()[r].is_aside()) alone[r] = {runs_[r].slopes(), runs_[r].left()};
  left_ = step({}, {}, alone).left;
}

bool FirstOrder::known() const {
  for (std::size_t r = 0; r < runs_.size(); ++r)
    if (!joint_.runs()[r].is_aside() && !runs_[r].known()) return false;
  return true;
}

/// Run by run, with the effect at next to nothing where it acts; nothing of runs that are set aside.
std::vector<FirstOrder::Beside> FirstOrder::beside(const JointProblem& with, const std::string& id, const std::vector<Index>& own, const std::vector<VectorXd>& begins) const {
  constexpr double faint = 1e-3;  // of where its size stands: a force on trajectories that it hardly bends; not 0, where the shape of a law has no slope
  std::vector<Beside> rows(runs_.size());
  in_parallel(runs_.size(), [&](std::size_t r) {
    const RunResidual& run = with.runs()[r];
    if (run.is_aside() || joint_.runs()[r].is_aside()) return;
    if (!effect(with.model().rig(), id).acts(with.model().rig(), run.conditions())) {
      rows[r] = {runs_[r].slopes(), runs_[r].left()};
      return;
    }
    VectorXd theta = with.theta(r);
    if (!own.empty() && !effect(with.model().rig(), id).frequency) {  // that of a tone is where its states begin
      const Parameter& size = with.model().parameters()[static_cast<std::size_t>(own.front())];
      theta[own.front()] = std::clamp(faint * theta[own.front()], size.lower, size.upper);
    }
    rows[r] = runs_[r].beside(run, theta, own, begins[r]);
  });
  return rows;
}

/// How many states the other model has beside this one's in a run.
Index FirstOrder::further_states(std::size_t run, const std::vector<Index>& own, const Beside& rows) const {
  const Index known = runs_[run].slopes().cols();
  return rows.slopes.cols() > known ? rows.slopes.cols() - known - static_cast<Index>(own.size()) : 0;
}

/// In [unknowns of the fit | the effect's own | further states, run by run].
LinearStep FirstOrder::step(const std::vector<Unknown>& of_effect, const std::vector<Index>& own, const std::vector<Beside>& rows) const {
  const auto known = static_cast<Index>(joint_.unknowns().size());
  const auto is_known = [&](const Unknown& u) { return std::isfinite(joint_.parameter(u).known_to); };
  Index height = std::count_if(joint_.unknowns().begin(), joint_.unknowns().end(), [&](const Unknown& u) { return !u.held && is_known(u); }), column = known + static_cast<Index>(of_effect.size()), width = column;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    height += rows[r].left.size();
    width += further_states(r, own, rows[r]);
  }
  MatrixXd slopes = MatrixXd::Zero(height, width);
  VectorXd left(height);
  Index row = 0;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const Index parameters = runs_[r].slopes().cols(), length = rows[r].left.size(), states = further_states(r, own, rows[r]);
    if (length == 0) continue;
    const auto put = [&](Index where, Index from) { slopes.col(where).segment(row, length) = rows[r].slopes.col(from); };
    const auto is_free_here = [&](const Unknown& u) { return !u.held && (u.run < 0 || u.run == static_cast<int>(r)); };
    for (Index k = 0; k < known; ++k)
      if (const Unknown& u = joint_.unknowns()[static_cast<std::size_t>(k)]; is_free_here(u)) put(k, u.parameter);
    const bool acts = rows[r].slopes.cols() > parameters;
    for (std::size_t k = 0; k < of_effect.size(); ++k)
      if (acts && is_free_here(of_effect[k])) put(known + static_cast<Index>(k), parameters + (std::find(own.begin(), own.end(), of_effect[k].parameter) - own.begin()));
    for (Index k = 0; k < states; ++k) put(column++, parameters + static_cast<Index>(own.size()) + k);
    left.segment(row, length) = rows[r].left;
    row += length;
  }
  for (Index k = 0; k < known; ++k) {
    const Unknown& u = joint_.unknowns()[static_cast<std::size_t>(k)];
    if (u.held || !is_known(u)) continue;
    const Parameter& p = joint_.parameter(u);
    slopes(row, k) = 1 / p.known_to;
    left[row++] = (p.start - u.value) / p.known_to;
  }
  return linear_step(slopes, left);
}

FirstOrder::Promise FirstOrder::promise(const JointProblem& with, const std::string& id) const {
  std::vector<Unknown> of_effect;
  std::vector<Index> own;  // their parameters, each once
  for (const Unknown& u : with.unknowns()) {
    if (with.parameter(u).effect != id) continue;
    of_effect.push_back(u);
    if (std::find(own.begin(), own.end(), u.parameter) == own.end()) own.push_back(u.parameter);
  }
  Promise promise;
  std::vector<VectorXd> begins(runs_.size());  // of states that only `with` has
  constexpr int steps = 2;  // the shape of a signal has no slope before its amplitude is told
  for (int i = 0; i < steps; ++i) {
    const std::vector<Beside> rows = beside(with, id, own, begins);
    if (std::any_of(rows.begin(), rows.end(), [](const Beside& run) { return !run.left.allFinite(); })) break;
    const LinearStep to = step(of_effect, own, rows);
    promise.left = std::min(promise.left, to.left);
    Index column = static_cast<Index>(joint_.unknowns().size() + of_effect.size());
    const bool has_states = to.x.size() > column;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (i == 0) promise.largest_argument = std::max(promise.largest_argument, rows[r].largest_argument);
      const Index states = further_states(r, own, rows[r]);
      begins[r] = to.x.segment(column, states);
      column += states;
    }
    if (!has_states) break;
  }
  return promise;
}

}  // namespace unrig
