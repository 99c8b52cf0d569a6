#include "fit/likelihood/wandering_force.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/numerics/product.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// States that noise on some reaches through the transition; the others follow none of them.
std::vector<Index> reached_by(const MatrixXd& noise, const MatrixXd& transition) {
  std::vector<char> reached(static_cast<std::size_t>(noise.rows()), 0);
  std::vector<Index> waiting;
  const auto reach = [&](Index i) {
    if (reached[static_cast<std::size_t>(i)]) return;
    reached[static_cast<std::size_t>(i)] = 1;
    waiting.push_back(i);
  };
  for (Index i = 0; i < noise.rows(); ++i)
    if (!noise.row(i).isZero(0)) reach(i);
  while (!waiting.empty()) {
    const Index j = waiting.back();
    waiting.pop_back();
    for (Index i = 0; i < transition.rows(); ++i)
      if (transition(i, j) != 0) reach(i);
  }
  std::vector<Index> states;
  for (Index i = 0; i < noise.rows(); ++i)
    if (reached[static_cast<std::size_t>(i)]) states.push_back(i);
  return states;
}

constexpr int most_doublings = 60;
constexpr double rounding = 1e-14;

/// P of the steady filter, by doubling (B. D. O. Anderson, Int. J. Control 28 (1978) 295).
MatrixXd steady_covariance(const MatrixXd& transition, const MatrixXd& observe, const VectorXd& variance, const MatrixXd& process) {
  const Index n = transition.rows();
  MatrixXd a = transition.transpose(), g = observe.transpose() * variance.cwiseInverse().asDiagonal() * observe, h = process;
  for (int i = 0; i < most_doublings; ++i) {
    const Eigen::PartialPivLU<MatrixXd> w(MatrixXd::Identity(n, n) + product(g, h));
    const MatrixXd wa = w.solve(a), wg = w.solve(g);
    const MatrixXd more = product(product(a.transpose(), h), wa);
    add_product(product(a, wg), a.transpose(), g);
    a = product(a, wa);
    h += more;
    h = 0.5 * (h + h.transpose()).eval();
    g = 0.5 * (g + g.transpose()).eval();
    if (more.norm() <= rounding * h.norm()) break;
  }
  return h;
}

/// X with X = F X F^T + M.
MatrixXd lyapunov(MatrixXd f, MatrixXd m) {
  for (int i = 0; i < most_doublings; ++i) {
    const MatrixXd more = product(product(f, m), f.transpose());
    m += more;
    if (more.norm() <= rounding * m.norm()) break;
    f = product(f, f);
  }
  return m;
}

}  // namespace

WanderingForce::WanderingForce(const DualMatrix& noise, const VectorXd& sigma, const LinearSystem& system, const MatrixXd& readings, Partials partials, ExactStep& step) {
  const Index n = step.transition.rows(), channels = system.C.rows(), samples = readings.rows();
  const DualMatrix kicks = std::sqrt(step.dt) * (step.transition * noise.grown(n, noise.cols()));
  reached_ = reached_by(kicks.value, step.transition.value);
  const auto m = static_cast<Index>(reached_.size());
  transition_ = step.transition.value(reached_, reached_);
  const MatrixXd observe = system.C.value(Eigen::all, reached_), drive = kicks.value(reached_, Eigen::all);
  const MatrixXd known = steady_covariance(transition_, observe, sigma.cwiseAbs2(), drive * drive.transpose());
  MatrixXd innovation = observe * known * observe.transpose();
  innovation.diagonal() += sigma.cwiseAbs2();
  sigma_ = innovation.diagonal().cwiseSqrt();
  const Eigen::PartialPivLU<MatrixXd> inverse(innovation.transpose());
  const auto over_innovation = [&](const MatrixXd& rows) -> MatrixXd { return inverse.solve(rows.transpose()).transpose(); };
  gain_ = over_innovation(transition_ * known * observe.transpose());
  const MatrixXd closed = transition_ - gain_ * observe;

  const Index parameters = partials == Partials::all ? std::max({step.transition.parameters(), system.C.parameters(), noise.parameters()}) : 0;
  DualMatrix gain(MatrixXd::Zero(n, channels), parameters);
  gain.value(reached_, Eigen::all) = gain_;
  std::vector<Moved> moved;
  for (Index j = 0; j < parameters && m > 0; ++j) {
    if (!step.transition.depends_on(j) && !system.C.depends_on(j) && !kicks.depends_on(j)) continue;
    const MatrixXd da = step.transition.depends_on(j) ? MatrixXd(step.transition.d(j)(reached_, reached_)) : MatrixXd::Zero(m, m);
    const MatrixXd dc = system.C.depends_on(j) ? MatrixXd(system.C.d(j)(Eigen::all, reached_)) : MatrixXd::Zero(channels, m);
    MatrixXd half = product(product(da - gain_ * dc, known), closed.transpose());  // the gain itself is where P is stationary
    if (kicks.depends_on(j)) half += kicks.d(j)(reached_, Eigen::all) * drive.transpose();
    const MatrixXd dp = lyapunov(closed, half + half.transpose());
    const MatrixXd across = observe * known * dc.transpose(), ds = across + across.transpose() + observe * dp * observe.transpose();
    const MatrixXd dk = over_innovation(da * known * observe.transpose() + transition_ * (dp * observe.transpose() + known * dc.transpose()) - gain_ * ds);
    MatrixXd all = MatrixXd::Zero(n, channels);
    all(reached_, Eigen::all) = dk;
    gain.add_partial(j, all);
    moved.push_back({j, da - gain_ * dc - dk * observe, dk, dc});
  }

  readings_.resize(samples, channels);
  raised_.assign(static_cast<std::size_t>(channels), MatrixXd(samples, channels));
  slopes_.resize(static_cast<std::size_t>(parameters));
  for (const Moved& one : moved) slopes_[static_cast<std::size_t>(one.parameter)].resize(samples, channels * (1 + channels));
  filter(readings, closed, observe, moved);

  step.transition = step.transition - gain * system.C;
  if (system.D.cols() > 0 && step.input0.cols() == system.D.cols()) step.input0 = step.input0 - gain * system.D;
  if (partials == Partials::none)
    for (DualMatrix* changed : {&step.transition, &step.input0}) changed->partial.clear();
}

/// Readings, each of them raised by 1, and the slopes of both, some samples at a time: all that are driven at once are one product.
void WanderingForce::filter(const MatrixXd& readings, const MatrixXd& closed, const MatrixXd& observe, const std::vector<Moved>& moved) {
  constexpr Index at_a_time = 64;
  const Index m = closed.rows(), channels = readings.cols(), each = 1 + channels, slopes = each * static_cast<Index>(moved.size());
  MatrixXd state = MatrixXd::Zero(m, each), next(m, each), slope = MatrixXd::Zero(m, slopes), next_slope(m, slopes), seen(channels, slopes);
  for (Index first = 0; first < readings.rows(); first += at_a_time) {
    const Index count = std::min(at_a_time, readings.rows() - first);
    MatrixXd now(channels, each * count), states(m, each * count), forced(m, each * count), moves(m, slopes * count), sees(channels, slopes * count);
    for (Index k = 0; k < count; ++k) now.middleCols(k * each, each) << readings.row(first + k).transpose(), MatrixXd::Identity(channels, channels);
    const MatrixXd driven = gain_ * now;
    for (Index k = 0; k < count; ++k) {
      states.middleCols(k * each, each) = state;
      set_product(closed, state, next);
      next += driven.middleCols(k * each, each);
      state.swap(next);
    }
    const MatrixXd innovation = now - observe * states;
    for (Index k = 0; k < count; ++k) {
      readings_.row(first + k) = innovation.col(k * each).transpose();
      for (Index c = 0; c < channels; ++c) raised_[static_cast<std::size_t>(c)].row(first + k) = innovation.row(c).segment(k * each + 1, channels);
    }
    for (std::size_t i = 0; i < moved.size(); ++i) {
      forced.noalias() = moved[i].gain * now;
      add_product(moved[i].closed, states, forced);
      const MatrixXd sees_of_it = moved[i].observe * states;
      for (Index k = 0; k < count; ++k) {
        const Index at = k * slopes + static_cast<Index>(i) * each;
        moves.middleCols(at, each) = forced.middleCols(k * each, each);
        sees.middleCols(at, each) = sees_of_it.middleCols(k * each, each);
      }
    }
    for (Index k = 0; k < count && slopes > 0; ++k) {
      seen.noalias() = observe * slope;
      seen += sees.middleCols(k * slopes, slopes);
      for (std::size_t i = 0; i < moved.size(); ++i) slopes_[static_cast<std::size_t>(moved[i].parameter)].row(first + k) = -seen.middleCols(static_cast<Index>(i) * each, each).reshaped().transpose();
      set_product(closed, slope, next_slope);
      next_slope += moves.middleCols(k * slopes, slopes);
      slope.swap(next_slope);
    }
  }
}

VectorXd WanderingForce::slope(Index j, Index channel, const VectorXd& offset) const {
  const auto index = static_cast<std::size_t>(j);
  if (index >= slopes_.size() || slopes_[index].size() == 0) return {};
  const Index channels = readings_.cols();
  VectorXd slope = slopes_[index].col(channel);
  for (Index c = 0; c < channels; ++c) slope -= offset[c] * slopes_[index].col((1 + c) * channels + channel);
  return slope;
}

MatrixXd WanderingForce::foreseen(const MatrixXd& innovations, const MatrixXd& observe) const {
  MatrixXd own = MatrixXd::Zero(observe.rows(), static_cast<Index>(reached_.size()));
  for (std::size_t i = 0; i < reached_.size(); ++i)
    if (reached_[i] < observe.cols()) own.col(static_cast<Index>(i)) = observe.col(reached_[i]);
  MatrixXd read(innovations.rows(), observe.rows());
  VectorXd state = VectorXd::Zero(transition_.rows());
  for (Index k = 0; k < innovations.rows(); ++k) {
    read.row(k) = (own * state).transpose();
    state = (transition_ * state + gain_ * innovations.row(k).transpose()).eval();
  }
  return read;
}

}  // namespace unrig
