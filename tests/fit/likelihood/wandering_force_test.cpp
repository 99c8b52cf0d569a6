// Runs in which a force wanders: the vortex street of a stalled section, whose line has a width.

#include "fit/likelihood/wandering_force.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/effects/process_noise.h"
#include "fit/likelihood/readings_noise.h"
#include "tests/fit/run_cases.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using namespace run_cases;

/// A step from 23 degrees, whose section sheds.
struct Stalled {
  Case c;
  AeroelasticModel model;
  VectorXd theta;

  explicit Stalled(Case of) : c(std::move(of)), model(c.model->with_effects({"vortex-shedding"})), theta(model.start_values()) {
    for (Channel& channel : c.run.channels)
      if (channel.name == "alpha") channel.value.array() += 0.36;
    theta.head(c.theta.size()) = c.theta;
    set("bandwidth", 0.05);
    set("wander", 1e-4);
  }
  Index index(const std::string& name) const { return model.index("vortex-shedding." + name); }
  void set(const std::string& name, double value) { theta[index(name)] = value; }
  RunResidual residual() const { return {model, c.run, c.windows}; }
};

RunResidual coloured(const Stalled& s) {
  RunResidual run = s.residual();
  const double variance = run.sigma(0) * run.sigma(0);
  run.set_colours(s.theta, {NoiseColour{VectorXd::Constant(1, 8.0), VectorXd::Constant(1, 2 * variance), variance}});
  return run;
}

TEST(WanderingForce, HasTheSlopesOfChiSquare) {
  for (const bool whole : {true, false})
    for (const bool colour : {false, true}) {
      const Stalled s(whole ? step(1) : damaged(step(1)));
      const RunResidual run = colour ? coloured(s) : s.residual();
      const RunResidual::Evaluation e = run.evaluate(s.theta, Partials::all);
      EXPECT_NEAR(e.residual.squaredNorm() / run.solve(s.theta).chi2, 1, 1e-9);
      for (Index j = 0; j < s.theta.size(); ++j) {
        const std::string& name = s.model.parameters()[static_cast<std::size_t>(j)].name;
        const double sensitivity = e.jacobian.col(j).norm();
        if (name.starts_with("vortex-shedding")) {
          EXPECT_GT(sensitivity, 0) << name;
        }
        if (!(sensitivity > 0)) continue;
        const auto chi2 = [&](double h) { return MatrixXd::Constant(1, 1, run.evaluate(s.theta + h * VectorXd::Unit(s.theta.size(), j), Partials::none).chi2).eval(); };
        const double h = std::min(0.02 * std::abs(s.theta[j]), 0.03 * std::sqrt(e.chi2) / sensitivity);
        EXPECT_TRUE(test::is_slope(chi2, MatrixXd::Constant(1, 1, 2 * e.jacobian.col(j).dot(e.residual)), h, 1e-10)) << s.c.name << (colour ? ", coloured, " : ", ") << name;
      }
    }
}

/// Without width or kicks it is the tone that a force without noise makes.
TEST(WanderingForce, OfNoWidthIsATone) {
  Stalled s(step(1));
  s.set("bandwidth", 0), s.set("wander", 0);
  const RunResidual run = s.residual();
  const RunResidual::Evaluation tone = run.evaluate(s.theta, Partials::none);
  s.set("bandwidth", 1e-9), s.set("wander", 1e-10);
  const RunResidual::Evaluation nearly = run.evaluate(s.theta, Partials::none);
  EXPECT_NEAR(nearly.chi2 / tone.chi2, 1, 1e-4);
  EXPECT_LT((tone.linear - nearly.linear).norm(), 1e-4 * tone.linear.norm());
}

/// The prediction and what is left of it are one sum, and c follows theta in both.
TEST(WanderingForce, IsForeseenFromTheReadingsBefore) {
  const Stalled s(step(1));
  for (const bool colour : {false, true}) {
    const RunResidual run = colour ? coloured(s) : s.residual();
    const RunResidual::Prediction p = run.predict(s.theta);
    const VectorXd left = run.run().channel("gauge").value - p.output.col(0);
    const VectorXd standard = standardised_readings(run, s.theta, left).col(0), residual = run.sensitivity(s.theta).channels[0].residual;
    EXPECT_LT((standard - residual).norm(), 1e-8 * residual.norm());
    if (!colour) {
      EXPECT_LT((left.cwiseProduct(run.channel_weight(0)) - residual).norm(), 1e-8 * residual.norm());
    }
  }
}

/// Twelve seconds of a section at 25 degrees that sheds with one size and a phase that walks: a sine whose argument is summed up, on the strips.
unrig::Run shedding_run(const AeroelasticModel& bare, double strouhal, double walk) {
  constexpr Index n = 3000;
  unrig::Run run = empty_run(RunKind::step, 0.6, dt);
  add_channel(run, "alpha", VectorXd::Constant(n, 0.4363) + white_noise(n, 1.7e-4, 7), "rad");
  Conditions ports = conditions_of(run);
  ports.prescribed_pitch = false;
  ports.force = ports.mount = ports.ports = true;
  const LinearSystem system = bare.system(ports, bare.start_values(), {"gauge"});
  const auto strips = static_cast<Index>(bare.rig().submerged.size());
  const double frequency = strouhal * 0.6 / (2 * bare.rig().semichord() * std::sin(0.4363));
  const VectorXd kicks = white_noise(n + 1, walk * std::sqrt(dt), 12);
  MatrixXd input = MatrixXd::Zero(n + 1, system.B.cols());
  double phase = 1;
  for (Index k = 0; k <= n; ++k) {
    input.row(k).segment(3, strips).setConstant(std::sin(phase) / static_cast<double>(strips));
    phase += 2 * pi * frequency * dt + kicks[k];
  }
  const MatrixXd clean = drive(system, exact_step(system, dt), DualMatrix(MatrixXd::Zero(system.states(), 1)), n, {}, input, Partials::none).output;
  add_channel(run, "gauge", clean.col(0) + white_noise(n, 0.03, 8));
  return run;
}

TEST(WanderingForce, FindsTheLineOfAPhaseThatWalks) {
  constexpr double strouhal = 0.19, walk = 0.8;
  const auto bare = beam_model();
  const AeroelasticModel model = bare->with_effects({"vortex-shedding"});
  const unrig::Run run = shedding_run(*bare, strouhal, walk);
  RunResidual residual(model, run, {});
  const double white = residual.sigma(0);
  VectorXd theta = model.start_values();
  const Index first = model.index("vortex-shedding.strouhal");
  MatrixXd information;
  for (int i = 0; i < 40; ++i) {
    settle_wandering(residual, theta);
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    const MatrixXd slope = e.jacobian.middleCols(first, 3);
    information = slope.transpose() * slope;
    const VectorXd step = information.ldlt().solve(slope.transpose() * e.residual);
    for (Index k = 0; k < 3; ++k) {
      const Parameter& p = model.parameters()[static_cast<std::size_t>(first + k)];
      theta[first + k] = std::clamp(theta[first + k] - 0.5 * step[k], std::max(p.lower, 0.5 * theta[first + k]), std::min(p.upper, 2 * theta[first + k]));
    }
  }
  const MatrixXd covariance = information.inverse();
  EXPECT_NEAR(theta[first], strouhal, 4 * std::sqrt(covariance(0, 0)));
  EXPECT_LT(std::sqrt(covariance(0, 0)), 0.1 * strouhal) << "a line that is found";
  // One size and a phase that walks: the kicks have half of (size walk)^2 in each direction.
  const double pressure = 0.5 * 998.2 * 0.6 * 0.6 * 2 * model.rig().semichord() * model.rig().strip_length * static_cast<double>(model.rig().submerged.size());
  const double omega = 2 * pi * strouhal * 0.6 / (2 * model.rig().semichord() * std::sin(0.4363));
  EXPECT_NEAR(theta[first + 2] / (walk / std::sqrt(2) / (pressure * std::sqrt(omega))), 1, 0.25);
  EXPECT_NEAR(residual.solve(theta).chi2 / static_cast<double>(residual.degrees_of_freedom()), 1, 0.1);
  EXPECT_LT(residual.sigma(0), 2 * white);
  // A steady tone of any frequency nearby leaves much.
  VectorXd tone = theta;
  tone[first + 1] = tone[first + 2] = 0;
  double least = INFINITY;
  for (tone[first] = 0.8 * strouhal; tone[first] < 1.2 * strouhal; tone[first] += 0.01 * strouhal) least = std::min(least, RunResidual(model, run, {}).solve(tone).chi2);
  EXPECT_GT(least, 20 * static_cast<double>(residual.degrees_of_freedom()));
}

/// Innovations and their variance are those of the whole covariance, once the filter's start is forgotten. Nothing of the filter is in it: every reading is a sum over all kicks before it.
TEST(WanderingForce, SaysWhatTheWholeCovarianceSays) {
  Stalled s(step(1));
  s.theta[s.model.index("normal.damping_ratio")] = 0.2;  // a rig that forgets
  s.set("wander", 0.01);
  const Conditions conditions = conditions_of(s.c.run);
  const std::vector<std::string> channels{"gauge"};
  const LinearSystem system = s.model.system(conditions, s.theta, channels);
  const ExactStep exact = exact_step(system, dt);
  const MatrixXd kick = std::sqrt(dt) * process_noise(s.model, conditions, s.theta, channels, system)->value;
  constexpr Index n = 1200, compared = 200;
  constexpr double sigma = 0.03;
  MatrixXd response(n, kick.cols());  // of the reading, so many samples after a kick
  MatrixXd state = exact.transition.value * kick;
  response.row(0).setZero();
  for (Index k = 1; k < n; ++k) {
    response.row(k) = system.C.value * state;
    state = exact.transition.value * state;
  }
  MatrixXd all = MatrixXd::Zero(n, n * kick.cols());
  for (Index i = 0; i < n; ++i) all.block(i, i * kick.cols(), n - i, kick.cols()) = response.topRows(n - i);
  const Eigen::LLT<MatrixXd> root(all * all.transpose() + sigma * sigma * MatrixXd::Identity(n, n));
  const VectorXd readings = all * white_noise(all.cols(), 1, 3) + white_noise(n, sigma, 4), white = root.matrixL().solve(readings);
  ExactStep filtered = exact;
  const WanderingForce filter(*process_noise(s.model, conditions, s.theta, channels, system), VectorXd::Constant(1, sigma), system, readings, Partials::none, filtered);
  EXPECT_GT(filter.sigma(0), 1.05 * sigma) << "a force that shows";
  EXPECT_NEAR(filter.sigma(0), MatrixXd(root.matrixL())(n - 1, n - 1), 1e-6 * sigma);
  EXPECT_LT((filter.readings().col(0).tail(compared) / filter.sigma(0) - white.tail(compared)).norm(), 1e-4 * white.tail(compared).norm());
}

}  // namespace
}  // namespace unrig
