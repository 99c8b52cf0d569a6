#pragma once
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/model/run_inputs.h"
#include "fit/likelihood/run_residual.h"
#include "tests/support/sample_data.h"

// Runs of every kind, simulated with small noise, and their least-squares problem without any economy.

namespace unrig::run_cases {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;
using Windows = std::vector<MotionBasis::Window>;

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

inline VectorXd white_noise(Index samples, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, sigma);
  return VectorXd::NullaryExpr(samples, [&] { return normal(engine); });
}

/// A model, a run of it that was never recorded, and theta off the truth.
struct Case {
  std::string name;
  std::unique_ptr<AeroelasticModel> model;
  unrig::Run run;
  Windows windows;
  VectorXd theta;

  RunResidual residual(RunOptions options = {}) const { return {*model, run, windows, options}; }
};

inline void add_channel(unrig::Run& run, const std::string& name, const VectorXd& value, const std::string& unit = "N") {
  run.channels.push_back({name, unit, unit, 1, value, 0});
}

/// Fills in the fitted channels: the model at `truth`, from a state that moves, and noise of a thousandth of it.
inline void simulate(Case& c, const VectorXd& truth, const std::vector<std::string>& channels, const VectorXd& motion) {
  const Conditions conditions = conditions_of(c.run);
  const LinearSystem system = c.model->system(conditions, truth, channels);
  const ExactStep step = exact_step(system, c.run.dt);
  VectorXd start = VectorXd::Zero(system.states());
  if (c.run.kind != RunKind::step) start.head(system.coordinates) = white_noise(system.coordinates, 0.01, 5);
  VectorXd jerk;
  if (motion.size() > 0) jerk = motion_of(motion, c.run.dt).jerk;
  const MatrixXd clean = drive(system, step, DualMatrix(MatrixXd(start)), c.run.samples(), jerk, run_inputs(c.run, conditions), Partials::none).output;
  for (std::size_t k = 0; k < channels.size(); ++k) {
    const VectorXd y = clean.col(static_cast<Index>(k));
    add_channel(c.run, channels[k], (y + white_noise(y.size(), 1e-3 * y.norm() / std::sqrt(static_cast<double>(y.size())), 6)).array() + 0.3);
  }
}

inline unrig::Run empty_run(RunKind kind, double speed, double dt) {
  unrig::Run run;
  run.file = "synthetic.csv";
  run.kind = kind;
  run.density = 998.2;
  run.speed = speed;
  run.dt = dt;
  return run;
}

inline Sensor sensor(const std::string& column, SensorKind reads, int element) {
  Sensor s;
  s.column = column;
  s.reads = reads;
  s.element = element;
  return s;
}

inline Rig seed_rig() {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.sensors = {sensor("tip", SensorKind::acceleration, 17), sensor("twist", SensorKind::twist, 13)};
  return rig;
}

inline Rig modal_rig() {
  Rig rig;
  rig.name = "two modes";
  rig.modal = {{1.5, 7, 0.01, 1000, "N"}, {0.4, 31, 0.03, -200, "N"}};
  return rig;
}

inline std::unique_ptr<AeroelasticModel> beam_model() {
  const Rig rig = seed_rig();
  return std::make_unique<AeroelasticModel>(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
}

inline std::unique_ptr<AeroelasticModel> modal_model() { return std::make_unique<AeroelasticModel>(modal_rig(), Basis{}, wagner(Wagner::jones)); }

inline VectorXd off(const VectorXd& truth) {
  VectorXd theta = truth;
  for (Index j = 0; j < theta.size(); ++j) theta[j] *= j % 2 == 0 ? 1.02 : 0.97;
  return theta;
}

inline constexpr Index samples = 260;
inline constexpr double dt = 0.004;

inline Case pluck(const std::vector<std::string>& channels) {
  Case c{"pluck", beam_model(), empty_run(RunKind::pluck, 0, dt), {}, {}};
  add_channel(c.run, "note", VectorXd::Zero(samples));
  simulate(c, c.model->start_values(), channels, {});
  c.theta = off(c.model->start_values());
  return c;
}

/// A step of 1.5 degrees within 40 ms and a smaller one back, angle noise of 0.01 degrees; splines on every `stride`-th sample.
inline Case step(Index stride) {
  Case c{"step, stride " + std::to_string(stride), beam_model(), empty_run(RunKind::step, 0.6, dt), {{{40, 64}, stride}, {{140, 158}, stride}}, {}};
  const MotionBasis basis(samples, c.windows);
  VectorXd u(basis.unknowns());
  Index j = 0;
  for (const auto& window : c.windows) {
    const bool first = window.knots.first == 40;
    for (Index knot = window.knots.first; knot <= window.knots.last; knot += stride) {
      const double s = std::clamp(static_cast<double>(knot - window.knots.first - 8) / 8, 0.0, 1.0);
      u[j++] = (first ? 0.026 : -0.01) * s * s * (3 - 2 * s);
    }
  }
  EXPECT_EQ(j, basis.unknowns());
  const VectorXd motion = basis.coefficients(u);
  add_channel(c.run, "alpha", (motion_of(motion, dt).angle + white_noise(samples, 1.7e-4, 7)).array() + 0.04, "rad");
  simulate(c, c.model->start_values(), {"gauge"}, motion);
  c.theta = off(c.model->start_values());
  return c;
}

/// A shaft that hardly rests: a motion of many knots.
inline Case restless(Index stride) {
  Case c{"restless, stride " + std::to_string(stride), beam_model(), empty_run(RunKind::step, 0.6, dt), {{{20, 212}, stride}}, {}};
  const MotionBasis basis(samples, c.windows);
  VectorXd u(basis.unknowns());
  for (Index j = 0; j < u.size(); ++j) {
    const double knot = static_cast<double>(j * stride), begins = std::min(1.0, knot / 40);
    u[j] = 0.02 * begins * begins * (3 - 2 * begins) * (std::sin(0.11 * knot) + 0.5 * std::sin(0.17 * knot + 1));
  }
  const VectorXd motion = basis.coefficients(u);
  add_channel(c.run, "alpha", (motion_of(motion, dt).angle + white_noise(samples, 1.7e-4, 7)).array() + 0.04, "rad");
  simulate(c, c.model->start_values(), {"gauge"}, motion);
  c.theta = off(c.model->start_values());
  return c;
}

inline Case forced() {
  Case c{"forced", modal_model(), empty_run(RunKind::forced, 0, dt), {}, {}};
  add_channel(c.run, "force", white_noise(samples, 1, 8));
  simulate(c, c.model->start_values(), {"gauge"}, {});
  c.theta = off(c.model->start_values());
  return c;
}

inline Case moved(bool beam) {
  Case c{beam ? "moved beam" : "moved modes", beam ? beam_model() : modal_model(), empty_run(RunKind::moved, 0, dt), {}, {}};
  VectorXd velocity(samples);
  for (Index k = 0; k < samples; ++k) velocity[k] = 0.1 * std::sin(2 * pi * 5 * dt * static_cast<double>(k)) + 0.02 * std::sin(2 * pi * 23 * dt * static_cast<double>(k));
  add_channel(c.run, "mount_velocity", velocity, "m/s");
  simulate(c, c.model->start_values(), {"gauge"}, {});
  c.theta = off(c.model->start_values());
  return c;
}

/// Weights, missing readings and a spike.
inline Case damaged(Case c) {
  c.name += ", damaged";
  VectorXd weight = VectorXd::Ones(samples);
  weight.segment(20, 9).setZero();
  weight.segment(90, 30).setConstant(0.25);
  add_channel(c.run, "weight", weight, "1");
  for (Channel& channel : c.run.channels) {
    if (channel.name == "gauge") channel.value[33] = channel.value[52] = channel.value[200] = nan;
    if (channel.name != "alpha") continue;
    channel.value[15] = channel.value[55] = nan;
    channel.value[110] += 0.01;
  }
  return c;
}

inline std::vector<Case> every_case() {
  std::vector<Case> cases;
  cases.push_back(pluck({"gauge"}));
  cases.push_back(pluck({"gauge", "tip", "twist"}));
  cases.push_back(step(1));
  cases.push_back(step(2));
  cases.push_back(restless(1));
  cases.push_back(restless(2));
  cases.push_back(forced());
  cases.push_back(moved(false));
  cases.push_back(moved(true));
  cases.push_back(damaged(pluck({"gauge", "twist"})));
  cases.push_back(damaged(step(1)));
  cases.push_back(damaged(restless(1)));
  return cases;
}

/// The same least-squares problem without any economy: one row per reading, one column per linear unknown, each column a simulation of its own.
struct Dense {
  MatrixXd columns;
  VectorXd right, solution;
  double chi2 = 0;
};

inline Dense brute_force(const Case& c, const RunResidual& residual) {
  const Conditions& conditions = residual.conditions();
  const LinearSystem system = c.model->system(conditions, c.theta, residual.channels());
  const ExactStep exact = exact_step(system, c.run.dt);
  const Index n = c.run.samples(), channels = static_cast<Index>(residual.channels().size()), motion = residual.motion().unknowns();
  const Index free = c.run.kind == RunKind::step ? 0 : system.free_states();
  const auto output = [&](const VectorXd& start, const VectorXd& jerk, const MatrixXd& input) {
    return drive(system, exact, DualMatrix(MatrixXd(start)), n, jerk, input, Partials::none).output;
  };
  // A shaft at rest does not turn on with the rounding of its acceleration: its states are set where each window ends.
  const auto moved = [&](const Motion& m) {
    MatrixXd y(n, channels);
    DualMatrix state(MatrixXd::Zero(system.states(), 1));
    Index at = 0;
    const auto until = [&](Index end) {
      const Response response = drive(system, exact, state, end - at, m.jerk.segment(at, end - at), {}, Partials::none);
      y.middleRows(at, end - at) = response.output;
      state = response.end;
      at = end;
    };
    const std::vector<Interval> active = residual.motion().active();
    for (std::size_t i = 0; i < active.size(); ++i) {
      if (i + 1 < active.size() && active[i + 1].first < active[i].last) continue;
      until(active[i].last);
      if (at < n) state.value.block(system.motion, 0, 3, 1) << m.angle[at], 0, 0;
    }
    if (at < n) until(n);
    return y;
  };
  const VectorXd rest = VectorXd::Zero(system.states());
  const MatrixXd known = output(rest, {}, run_inputs(c.run, conditions));
  const bool angle = motion > 0;

  Dense d;
  d.columns = MatrixXd::Zero(n * (channels + (angle ? 1 : 0)), motion + free + channels + (angle ? 1 : 0));
  d.right = VectorXd::Zero(d.columns.rows());
  const auto put = [&](Index column, const MatrixXd& y) { d.columns.col(column).head(n * channels) = y.reshaped(); };
  for (Index j = 0; j < motion; ++j) {
    const Motion m = motion_of(residual.motion().coefficients(VectorXd::Unit(motion, j)), c.run.dt);
    put(j, moved(m));
    d.columns.col(j).tail(n) = m.angle;
  }
  for (Index j = 0; j < free; ++j) put(motion + j, output(VectorXd::Unit(system.states(), j), {}, {}));
  for (Index k = 0; k < channels; ++k) {
    d.columns.col(motion + free + k).segment(n * k, n).setOnes();
    d.right.segment(n * k, n) = c.run.channel(residual.channels()[static_cast<std::size_t>(k)]).value - known.col(k);
  }
  if (angle) {
    d.columns.col(d.columns.cols() - 1).tail(n).setOnes();
    d.right.tail(n) = c.run.channel("alpha").value;
  }
  VectorXd weight(d.columns.rows());
  for (Index k = 0; k < channels; ++k) weight.segment(n * k, n) = residual.channel_weight(static_cast<std::size_t>(k));
  if (angle) weight.tail(n) = residual.angle_weight();
  d.right = d.right.unaryExpr([](double y) { return std::isfinite(y) ? y : 0.0; }).cwiseProduct(weight);
  d.columns = weight.asDiagonal() * d.columns;
  const VectorXd scale = d.columns.colwise().norm().cwiseInverse();
  d.solution = scale.cwiseProduct((d.columns * scale.asDiagonal()).colPivHouseholderQr().solve(d.right));
  d.chi2 = (d.right - d.columns * d.solution).squaredNorm();
  return d;
}

}  // namespace unrig::run_cases
