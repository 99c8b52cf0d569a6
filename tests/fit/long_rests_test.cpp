#include <gtest/gtest.h>

#include <utility>

#include "fit/likelihood/run_linearised.h"
#include "tests/fit/run_cases.h"

// Rests that go on for long after everything has died out: RunResidual looks at them in few numbers.

namespace unrig::run_cases {
namespace {

/// Two steps with long rests behind them, over which nothing is left but a slow decay.
Case long_rests(Index length) {
  Case c{"long rests", beam_model(), empty_run(RunKind::step, 0.6, dt), {{{40, 64}, 1}, {{length / 2, length / 2 + 18}, 1}}, {}};
  const MotionBasis basis(length, c.windows);
  VectorXd u = VectorXd::Zero(basis.unknowns());
  for (Index j = 0; j < basis.unknowns(); ++j) u[j] = j < 25 ? 0.026 * std::min(1.0, static_cast<double>(j) / 20) : -0.01 * std::min(1.0, static_cast<double>(j - 25) / 12);
  const VectorXd motion = basis.coefficients(u);
  add_channel(c.run, "alpha", (motion_of(motion, dt).angle + white_noise(length, 1.7e-4, 7)).array() + 0.04, "rad");
  simulate(c, c.model->start_values(), {"gauge"}, motion);
  c.theta = off(c.model->start_values());
  return c;
}

/// Some readings missing, some of little weight.
Case with_uneven_weights(Case c) {
  c.name += ", uneven weights";
  const Index length = c.run.samples();
  add_channel(c.run, "weight", VectorXd::NullaryExpr(length, [](Index k) { return k % 5000 < 40 ? 0.25 : 1; }), "1");
  for (Channel& channel : c.run.channels)
    if (channel.name == "gauge")
      for (Index k = 300; k < length; k += 1700) channel.value[k] = nan;
  return c;
}

/// A free decay until long after it has died out.
Case long_pluck(Index length) {
  Case c{"long pluck", beam_model(), empty_run(RunKind::pluck, 0.6, dt), {}, {}};
  add_channel(c.run, "note", VectorXd::Zero(length));
  simulate(c, c.model->start_values(), {"gauge", "twist"}, {});
  c.theta = off(c.model->start_values());
  return c;
}

/// Samples at rest that are looked at one by one, and those in stretches that polynomials stand for.
std::pair<Index, Index> one_by_one_and_together(const RunResidual& residual, const VectorXd& theta) {
  Index each = 0, together = 0;
  const RunResidual::Solution solution = residual.solve(theta);
  for (const run_rows::Block& block : solution.model->blocks) {
    if (block.moving) continue;
    for (Index first = block.samples.first; first < block.samples.last; first += rest_rows::stretch_samples) {
      const Interval stretch{first, std::min(first + rest_rows::stretch_samples, block.samples.last)};
      (block.is_smooth(stretch) ? together : each) += stretch.length();
    }
  }
  return {each, together};
}

std::vector<Case> long_cases() {
  std::vector<Case> cases;
  cases.push_back(long_rests(16000));
  cases.push_back(with_uneven_weights(long_rests(16000)));
  cases.push_back(long_pluck(14000));
  return cases;
}

TEST(LongRests, GiveWhatEverySampleWouldGive) {
  for (const Case& c : long_cases()) {
    const RunResidual residual = c.residual();
    ASSERT_GT(one_by_one_and_together(residual, c.theta).second, 4000) << c.name;
    const Dense dense = brute_force(c, residual);
    const RunResidual::Evaluation e = residual.evaluate(c.theta, Partials::none);
    // As for short records; the dense problem's own round-off grows with its rows.
    EXPECT_NEAR(e.chi2 / dense.chi2, 1, 1e-9) << c.name;
    EXPECT_LT((dense.columns * (e.linear - dense.solution)).norm(), 5e-6 * std::sqrt(dense.chi2)) << c.name;
  }
}

TEST(LongRests, HaveTheSlopesOfEverySample) {
  for (const Case& c : long_cases()) {
    const RunResidual residual = c.residual();
    const RunResidual::Evaluation e = residual.evaluate(c.theta, Partials::all);
    const RunResidual::Sensitivity each = residual.sensitivity(c.theta);  // sample by sample
    MatrixXd information = MatrixXd::Zero(c.theta.size(), c.theta.size());
    VectorXd gradient = VectorXd::Zero(c.theta.size());
    for (const auto& channel : each.channels) {
      information += channel.slope.transpose() * channel.slope;
      gradient -= channel.slope.transpose() * channel.residual;
    }
    const VectorXd scale = information.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
    const MatrixXd off = scale.asDiagonal() * (e.jacobian.transpose() * e.jacobian - information) * scale.asDiagonal();
    EXPECT_LT(off.cwiseAbs().maxCoeff(), 1e-8) << c.name;  // round-off of the elimination, as for chi-square
    EXPECT_LT((scale.asDiagonal() * (e.jacobian.transpose() * e.residual - gradient)).norm(), 1e-8 * std::sqrt(e.chi2)) << c.name;
  }
}

TEST(LongRests, CostNoMoreSamplesThanShorterOnes) {
  const Case shorter = long_pluck(20000), longer = long_pluck(80000);
  const auto [each, together] = one_by_one_and_together(shorter.residual(), shorter.theta);
  const auto [each_longer, together_longer] = one_by_one_and_together(longer.residual(), longer.theta);
  EXPECT_LT(each_longer, each + 2 * 2 * rest_rows::stretch_samples) << "two channels, and the broken stretch at the end";
  EXPECT_GT(together_longer, together + 2 * 58000);
}

TEST(LongRests, LeaveTheShaftWhereItStands) {
  const Index length = 60000;
  const Case c = long_rests(length);
  const RunResidual::Prediction p = c.residual().predict(c.theta);
  const VectorXd gauge = p.output.col(0);
  // Over the last 60 s nothing moves but rounding; a rate left over from the spline would add up.
  EXPECT_NEAR(gauge[length - 1], gauge[length - 15000], 1e-9 * (gauge[length / 2 - 1] - gauge[0]));
}

}  // namespace
}  // namespace unrig::run_cases
