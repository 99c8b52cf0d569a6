#include "fit/likelihood/input_noise.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/run/motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Standard deviation within each block; not a number where less than half of it is there.
std::vector<double> spread_of_blocks(const VectorXd& x, Index block) {
  std::vector<double> spreads;
  for (Index first = 0; first + block <= x.size(); first += block) {
    double sum = 0, squares = 0, count = 0;
    for (const double v : x.segment(first, block))
      if (std::isfinite(v)) sum += v, squares += v * v, ++count;
    const double mean = sum / count;
    spreads.push_back(2 * count >= static_cast<double>(block) ? std::sqrt(std::max(0.0, squares / count - mean * mean)) : std::nan(""));
  }
  return spreads;
}

/// Noise of the measured force and of the mount's measured or derived motion, each an independent source.
class Builder {
 public:
  explicit Builder(Index inputs) : inputs_(inputs) {
    model_.phi = model_.start = MatrixXd::Zero(0, 0);
    model_.gamma = MatrixXd::Zero(0, 0);
    model_.h = MatrixXd::Zero(inputs, 0);
    model_.j = MatrixXd::Zero(inputs, 0);
  }
  /// A source that drives inputs by j, and states of its own by gamma, which drive them by h.
  void add(const MatrixXd& phi, const VectorXd& gamma, const MatrixXd& h, const VectorXd& j, const MatrixXd& start) {
    const Index more = phi.rows(), sources = model_.j.cols();
    const auto grown = [](const MatrixXd& m, Index rows, Index cols) {
      MatrixXd larger = MatrixXd::Zero(m.rows() + rows, m.cols() + cols);
      larger.topLeftCorner(m.rows(), m.cols()) = m;
      return larger;
    };
    model_.phi = grown(model_.phi, more, more);
    model_.phi.bottomRightCorner(more, more) = phi;
    model_.start = grown(model_.start, more, more);
    model_.start.bottomRightCorner(more, more) = start;
    model_.gamma = grown(model_.gamma, more, 1);
    model_.gamma.col(sources).tail(more) = gamma;
    model_.h = grown(model_.h, 0, more);
    model_.h.rightCols(more) = h;
    model_.j = grown(model_.j, 0, 1);
    model_.j.col(sources) = j;
  }
  void add_white(Index input, double level) {
    if (level > 0) add(MatrixXd(0, 0), VectorXd(0), MatrixXd(inputs_, 0), level * VectorXd::Unit(inputs_, input), MatrixXd(0, 0));
  }
  /// Velocity v is measured, acceleration (v_{k+1} - v_{k-1}) / 2 dt: e is the noise of v one sample ahead, the states are the last two.
  void add_differentiated(Index velocity, Index acceleration, double level, double dt) {
    if (!(level > 0)) return;
    const MatrixXd phi{{0, 0}, {1, 0}};
    MatrixXd h = MatrixXd::Zero(inputs_, 2);
    h(velocity, 0) = level;
    h(acceleration, 1) = -level / (2 * dt);
    add(phi, VectorXd{{1, 0}}, h, level / (2 * dt) * VectorXd::Unit(inputs_, acceleration), MatrixXd::Identity(2, 2));
  }
  /// Acceleration a is measured, velocity its sum by the trapezoidal rule: the states are the last a and the last v.
  void add_integrated(Index velocity, Index acceleration, double level, double dt) {
    if (!(level > 0)) return;
    const MatrixXd phi{{0, 0}, {dt / 2, 1}};
    MatrixXd h = MatrixXd::Zero(inputs_, 2);
    h(velocity, 0) = level * dt / 2;
    h(velocity, 1) = level;
    VectorXd j = VectorXd::Zero(inputs_);
    j[velocity] = level * dt / 2;
    j[acceleration] = level;
    add(phi, VectorXd{{1, dt / 2}}, h, j, MatrixXd::Zero(2, 2));
  }
  InputNoiseModel model_;

 private:
  Index inputs_;
};

}  // namespace

double noise_where_quiet(const VectorXd& input) {
  constexpr Index block = 64;
  constexpr double alike = 2, loud = 10;
  const std::vector<double> spreads = spread_of_blocks(input, block);
  double quietest = std::numeric_limits<double>::infinity(), loudest = 0;
  for (const double s : spreads)
    if (std::isfinite(s)) quietest = std::min(quietest, s), loudest = std::max(loudest, s);
  if (!(quietest > 0) || loudest < loud * quietest) return 0;
  VectorXd quiet = VectorXd::Constant(input.size(), std::nan(""));
  for (std::size_t b = 0; b < spreads.size(); ++b)
    if (spreads[b] < alike * quietest) quiet.segment(static_cast<Index>(b) * block, block) = input.segment(static_cast<Index>(b) * block, block);
  constexpr double chance = 0.06;  // as in RunResidual::settle_noise
  const double third = noise_level(quiet, 3), first = noise_level(quiet, 1);
  return first < (1 + chance) * third ? first : third;
}

std::optional<InputNoiseModel> noise_of_inputs(const Run& run, const Conditions& conditions) {
  const Index force = conditions.force ? 1 : 0, inputs = force + (conditions.mount ? 2 : 0);
  Builder builder(inputs);
  if (conditions.force) builder.add_white(0, noise_where_quiet(run.channel("force").value));
  if (conditions.mount) {
    const Channel *velocity = run.find("mount_velocity"), *acceleration = run.find("mount_acceleration");
    const Index v = force, a = force + 1;
    if (velocity && acceleration) {
      builder.add_white(v, noise_where_quiet(velocity->value));
      builder.add_white(a, noise_where_quiet(acceleration->value));
    } else if (velocity) {
      builder.add_differentiated(v, a, noise_where_quiet(velocity->value), run.dt);
    } else {
      builder.add_integrated(v, a, noise_where_quiet(acceleration->value), run.dt);
    }
  }
  if (builder.model_.j.cols() == 0) return std::nullopt;
  return builder.model_;
}

InputNoise::InputNoise(const LinearSystem& system, const ExactStep& step, const InputNoiseModel& inputs, const MatrixXd& weight) : inputs_(inputs) {
  // x_{k+1} = F x_k + G0 n_k + G1 n_{k+1} with x - G1 n as the state, so that only n_k drives it; at first, with x = 0, that state is 0 and n_0 drives it by G0 alone.
  const Index n = system.states(), s = inputs.phi.rows(), channels = system.C.rows(), measured = inputs.j.rows();
  const MatrixXd &f = step.transition.value, now = step.input0.value.leftCols(measured), ahead = step.input1.value.leftCols(measured), at_once = system.D.value.leftCols(measured);
  struct Noise {
    MatrixXd transition, observe, process, across, direct;
    Drive drive;
  };
  const auto noise_of = [&](const MatrixXd& push, const MatrixXd& feel) {
    Noise noise{MatrixXd(n + s, n + s), MatrixXd(channels, n + s), {}, {}, {}, {}};
    noise.transition << f, push * inputs.h, MatrixXd::Zero(s, n), inputs.phi;
    noise.observe << system.C.value, feel * inputs.h;
    MatrixXd drive(n + s, inputs.j.cols());
    drive << push * inputs.j, inputs.gamma;
    const MatrixXd read = feel * inputs.j;
    noise.process = drive * drive.transpose(), noise.across = drive * read.transpose(), noise.direct = read * read.transpose();
    noise.drive = {drive, read};
    return noise;
  };
  const Noise first = noise_of(now, at_once), later = noise_of(f * ahead + now, system.C.value * ahead + at_once);
  transition_ = later.transition;
  observe_ = later.observe;
  first_ = first.drive, later_ = later.drive;

  MatrixXd known = MatrixXd::Zero(n + s, n + s);  // covariance of the state, given the readings so far
  known.bottomRightCorner(s, s) = inputs.start;
  MatrixXd alone = known;                         // without any
  variance_ = VectorXd::Zero(channels);
  bool settled = false;
  constexpr double rounding = 1e-12;
  for (Index k = 0; k < weight.rows(); ++k) {
    const Noise& noise = k == 0 ? first : later;
    variance_ += (noise.observe * alone * noise.observe.transpose() + noise.direct).diagonal() / static_cast<double>(weight.rows());
    alone = noise.transition * alone * noise.transition.transpose() + noise.process;
    if (settled && weight.row(k) == weight.row(k - 1)) {
      which_.push_back(gains_.size() - 1);
    } else {
      Gain g;
      for (Index c = 0; c < channels; ++c)
        if (weight(k, c) > 0) g.present.push_back(c);
      const auto count = static_cast<Index>(g.present.size());
      const MatrixXd observe = noise.observe(g.present, Eigen::all);
      MatrixXd covariance = observe * known * observe.transpose() + noise.direct(g.present, g.present);
      covariance.diagonal() += VectorXd(weight.row(k)(g.present)).cwiseAbs2().cwiseInverse();
      const Eigen::LLT<MatrixXd> root(covariance);
      g.inverse_root = root.matrixL().solve(MatrixXd::Identity(count, count));
      g.gain = root.solve(MatrixXd(noise.transition * known * observe.transpose() + noise.across(Eigen::all, g.present)).transpose()).transpose();
      MatrixXd next = noise.transition * known * noise.transition.transpose() + noise.process - g.gain * covariance * g.gain.transpose();
      next = 0.5 * (next + next.transpose()).eval();
      settled = k > 0 && (next - known).norm() <= rounding * next.norm();
      known = std::move(next);
      gains_.push_back(std::move(g));
      which_.push_back(gains_.size() - 1);
    }
    log_determinant_ -= 2 * gains_.back().inverse_root.diagonal().array().log().sum();
  }
}

MatrixXd InputNoise::whitened(const MatrixXd& rows) const {
  const Index channels = observe_.rows(), samples = rows.rows() / channels;
  MatrixXd white = MatrixXd::Zero(rows.rows(), rows.cols()), state = MatrixXd::Zero(transition_.rows(), rows.cols()), now(channels, rows.cols());
  for (Index k = 0; k < samples; ++k) {
    const Gain& g = gains_[which_[static_cast<std::size_t>(k)]];
    for (Index c = 0; c < channels; ++c) now.row(c) = rows.row(c * samples + k);
    now.noalias() -= observe_ * state;
    state = (transition_ * state).eval();
    if (g.present.empty()) continue;
    const MatrixXd innovation = now(g.present, Eigen::all), standard = g.inverse_root * innovation;
    state.noalias() += g.gain * innovation;
    for (std::size_t i = 0; i < g.present.size(); ++i) white.row(g.present[i] * samples + k) = standard.row(static_cast<Index>(i));
  }
  return white;
}

MatrixXd InputNoise::most_probable(const VectorXd& white) const {
  // Sources e with covariance 1 and readings y = G e + own noise: the most probable e is G^T W y, W the inverse covariance of the readings. Both transposed maps run backward
  // (A. E. Bryson and M. Frazier, 1963); their adjoint states are each other's negative.
  const Index channels = observe_.rows(), samples = white.size() / channels, states = transition_.rows(), s = inputs_.phi.rows(), sources = inputs_.j.cols();
  MatrixXd source(sources, samples);
  VectorXd adjoint = VectorXd::Zero(states), weighted(channels);
  for (Index k = samples - 1; k >= 0; --k) {
    const Gain& g = gains_[which_[static_cast<std::size_t>(k)]];
    weighted.setZero();
    if (!g.present.empty()) {
      VectorXd standard(static_cast<Index>(g.present.size()));
      for (std::size_t i = 0; i < g.present.size(); ++i) standard[static_cast<Index>(i)] = white[g.present[i] * samples + k];
      weighted(g.present) = g.inverse_root.transpose() * standard - g.gain.transpose() * adjoint;
    }
    const Drive& drive = k == 0 ? first_ : later_;
    source.col(k) = drive.reading.transpose() * weighted + drive.state.transpose() * adjoint;
    adjoint = (transition_.transpose() * adjoint + observe_.transpose() * weighted).eval();
  }
  MatrixXd noise = MatrixXd::Zero(samples + 1, inputs_.j.rows());
  VectorXd state = inputs_.start * adjoint.tail(s);
  for (Index k = 0; k < samples; ++k) {
    noise.row(k) = (inputs_.h * state + inputs_.j * source.col(k)).transpose();
    state = (inputs_.phi * state + inputs_.gamma * source.col(k)).eval();
  }
  return noise;
}

}  // namespace unrig
