#include "fit/decays_first.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/in_parallel.h"
#include "fit/least_squares.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

bool is_decay(const RunResidual& run) { return run.motion().unknowns() == 0; }

/// The decays of a joint problem as least squares in theta and c. Unknowns: those of the joint problem that are free, then c of each decay.
class Decays {
 public:
  explicit Decays(JointProblem& joint) : joint_(joint) {
    for (std::size_t r = 0; r < joint.runs().size(); ++r)
      if (is_decay(joint.runs()[r])) decays_.push_back(r);
    for (std::size_t i = 0; i < joint.unknowns().size(); ++i) {
      const Unknown& u = joint.unknowns()[i];
      if (!u.held && (u.run < 0 || is_decay(joint.runs()[static_cast<std::size_t>(u.run)]))) free_.push_back(i);
    }
    for (const std::size_t i : free_) {
      const Unknown& u = joint.unknowns()[i];
      const Parameter& p = joint.parameter(u);
      problem_.unknowns.push_back({joint.name(u), u.value, p.lower, p.upper, false, 0});
    }
    for (const std::size_t r : decays_) add(r);
  }

  Index longest() const {
    Index most = 0;
    for (const RunResidual& run : runs_) most = std::max(most, run.run().samples());
    return most;
  }
  Index shortest() const {
    Index least = 0;
    for (const RunResidual& run : runs_) least = std::max(least, 2 * run.linear_unknowns());
    return least;
  }

  /// Over records that grow from `from` to `to` samples; returns chi-square over the last.
  double grow(Index from, Index to) {
    LeastSquaresOptions options;
    options.effort = LeastSquaresOptions::Effort::once;
    options.precision = 0.5;
    options.relative_change = 1e-3;
    options.iterations = 8;
    constexpr double growth = 1.5;
    for (auto samples = from; samples < to; samples = static_cast<Index>(growth * static_cast<double>(samples))) search(samples, options, true);
    const bool whole = to >= longest();
    if (whole) options.iterations = 30;
    search(to, options, !whole);
    return chi2();
  }

  /// chi-square over the degrees of freedom of the whole records; theta and c go back to the joint problem.
  double settle() {
    samples_ = longest();
    const double left = chi2();
    for (std::size_t i = 0; i < free_.size(); ++i) joint_.unknowns()[free_[i]].value = problem_.unknowns[i].value;
    double freedom = -static_cast<double>(free_.size());
    for (std::size_t d = 0; d < decays_.size(); ++d) {
      VectorXd c(runs_[d].linear_unknowns());
      for (Index k = 0; k < c.size(); ++k) c[k] = problem_.unknowns[first_c_[d] + static_cast<std::size_t>(k)].value;
      joint_.runs()[decays_[d]].start_from(c);
      freedom += static_cast<double>(runs_[d].degrees_of_freedom());
    }
    return left / std::max(1.0, freedom);
  }

 private:
  double chi2() const {
    const LeastSquaresPoint point = try_values(problem_, problem_.values());
    return point.finite ? point.chi2() : INFINITY;
  }

  void search(Index samples, const LeastSquaresOptions& options, bool prior) {
    samples_ = samples;
    LeastSquaresProblem problem = problem_;
    for (std::size_t i = 0; prior && i < free_.size(); ++i) problem.terms.push_back(weak_prior(i, problem.unknowns[i]));
    const LeastSquaresResult result = solve_least_squares(problem, options);
    if (result.point.finite) take(result.point, problem_);
  }

  void add(std::size_t r) {
    const std::size_t d = runs_.size();
    runs_.push_back(joint_.runs()[r]);
    RunResidual& run = runs_.back();
    run.temper(1);
    const VectorXd theta = joint_.theta(r), c = run.solve(theta).linear;
    first_c_.push_back(problem_.unknowns.size());
    for (Index k = 0; k < c.size(); ++k) problem_.unknowns.push_back({run.run().file, std::isfinite(c[k]) ? c[k] : 0, -INFINITY, INFINITY, false, 0});
    ResidualTerm term;
    std::vector<Index> parameters;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const Unknown& u = joint_.unknowns()[free_[i]];
      if (u.run >= 0 && u.run != static_cast<int>(r)) continue;
      term.unknowns.push_back(i);
      parameters.push_back(u.parameter);
    }
    run.differentiate_only(parameters);
    const auto count = static_cast<Index>(parameters.size());
    for (Index k = 0; k < c.size(); ++k) term.unknowns.push_back(first_c_[d] + static_cast<std::size_t>(k));
    term.size = theta.size() + c.size() + 1;
    term.evaluate = [this, d, parameters, count, start = theta](const VectorXd& values, VectorXd& residual, MatrixXd* jacobian) {
      VectorXd at = start;
      at(parameters) = values.head(count);
      const RunResidual::SideBySide s = runs_[d].side_by_side(at, values.tail(values.size() - count), samples_, jacobian == nullptr ? Partials::none : Partials::all);
      if (!std::isfinite(s.chi2)) return false;
      if (jacobian == nullptr) {
        residual[0] = std::sqrt(s.chi2);
        return true;
      }
      residual.head(s.residual.size()) = s.residual;
      jacobian->topLeftCorner(s.in_theta.rows(), count) = s.in_theta(Eigen::all, parameters);
      jacobian->topRightCorner(s.in_c.rows(), s.in_c.cols()) = s.in_c;
      return true;
    };
    problem_.terms.push_back(std::move(term));
  }

  JointProblem& joint_;
  std::vector<std::size_t> decays_, free_;
  std::vector<RunResidual> runs_;
  std::vector<std::size_t> first_c_;
  LeastSquaresProblem problem_;
  Index samples_ = 0;
};

}  // namespace

bool has_decays(const JointProblem& joint) { return std::any_of(joint.runs().begin(), joint.runs().end(), is_decay); }

double fit_decays(JointProblem& joint, const std::string& id) {
  std::vector<JointProblem> starts;
  for (const double factor : {1.0, 0.2, 5.0}) {
    starts.push_back(joint);
    for (Unknown& u : starts.back().unknowns())
      if (const Parameter& p = joint.parameter(u); p.name.starts_with(id + ".")) {
        u.value = std::clamp(factor * u.value, p.lower, p.upper);
        break;
      }
  }
  std::vector<std::unique_ptr<Decays>> decays(starts.size());
  std::vector<double> early(starts.size());
  constexpr Index part = 8;
  const auto early_samples = [](const Decays& d) { return std::max(d.shortest(), d.longest() / part); };
  in_parallel(starts.size(), [&](std::size_t i) {
    decays[i] = std::make_unique<Decays>(starts[i]);
    early[i] = decays[i]->grow(decays[i]->shortest(), early_samples(*decays[i]));
  });
  std::vector<std::size_t> order{0, 1, 2};
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return early[a] < early[b]; });
  constexpr double followed = 1.5, hopeless = 20;
  double least = INFINITY;
  for (const std::size_t i : order) {
    decays[i]->grow(early_samples(*decays[i]), decays[i]->longest());
    const double left = decays[i]->settle();
    if (left < least) joint = starts[i];
    least = std::min(least, left);
    if (least < followed || least > hopeless) break;
  }
  return least;
}

}  // namespace unrig
