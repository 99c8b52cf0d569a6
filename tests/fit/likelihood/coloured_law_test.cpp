// Runs whose model has a nonlinear law, in noise that has a colour.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/fit/run_cases.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using namespace run_cases;

/// Twice as much noise below 8 Hz as white noise, in units of the run's own.
RunResidual::Colours colours_of(const RunResidual& run) {
  const double variance = run.sigma(0) * run.sigma(0);
  return {NoiseColour{VectorXd::Constant(1, 8.0), VectorXd::Constant(1, 2 * variance), variance}};
}

struct Both {
  Case c;
  AeroelasticModel with_law;
  VectorXd theta;

  explicit Both(Case of) : c(std::move(of)), with_law(c.model->with_effects({"cubic-stiffness"})), theta(with_law.start_values()) {
    theta.head(c.theta.size()) = c.theta;
    for (Index k : {40, 41, 90}) c.run.channels.back().value[k] = nan;
  }
  RunResidual coloured(const AeroelasticModel& model, const VectorXd& at) const {
    RunResidual run(model, c.run, c.windows);
    run.search_linear_to(1e-7);
    run.set_colours(at, colours_of(run));
    return run;
  }
};

std::vector<Both> cases() {
  std::vector<Both> all;
  all.emplace_back(pluck({"gauge"}));
  all.emplace_back(step(1));
  return all;
}

/// A law of size zero takes the nonlinear road to where the linear one leads.
TEST(ColouredLaw, OfNoSizeChangesNothing) {
  for (const Both& both : cases()) {
    const RunResidual linear = both.coloured(*both.c.model, both.c.theta), bent = both.coloured(both.with_law, both.theta);
    const RunResidual::Evaluation a = linear.evaluate(both.c.theta, Partials::all), b = bent.evaluate(both.theta, Partials::all);
    EXPECT_NEAR(b.chi2 / a.chi2, 1, 1e-7) << both.c.name;
    ASSERT_EQ(a.linear.size(), b.linear.size());
    EXPECT_LT((linear.linear_factor(linear.solve(both.c.theta)) * (a.linear - b.linear)).norm(), 1e-4) << both.c.name << ": in standard errors";
    const Index shared = both.c.theta.size();
    const MatrixXd information = a.jacobian.transpose() * a.jacobian, its = (b.jacobian.transpose() * b.jacobian).topLeftCorner(shared, shared);
    for (Index i = 0; i < shared; ++i)
      for (Index j = 0; j < shared; ++j) {
        const double scale = std::sqrt(information(i, i) * information(j, j));
        EXPECT_NEAR(its(i, j), information(i, j), 1e-5 * scale) << both.c.name << ", " << i << ", " << j;
      }
    const RunResidual::Prediction p = linear.predict(both.c.theta), q = bent.predict(both.theta);
    EXPECT_LT((p.output - q.output).norm(), 1e-6 * p.output.norm()) << both.c.name;
    const RunResidual::Sensitivity s = linear.sensitivity(both.c.theta), t = bent.sensitivity(both.theta);
    EXPECT_LT((s.channels[0].slope - t.channels[0].slope.leftCols(shared)).norm(), 1e-5 * s.channels[0].slope.norm()) << both.c.name;
    EXPECT_LT((s.channels[0].residual - t.channels[0].residual).norm(), 1e-5 * s.channels[0].residual.norm()) << both.c.name;
  }
}

TEST(ColouredLaw, HasTheSlopesOfChiSquare) {
  for (Both& both : cases()) {


    const RunResidual linear = both.coloured(both.with_law, both.theta);
    const double without = linear.evaluate(both.theta, Partials::none).chi2;
    double& coefficient = both.theta[both.with_law.index("cubic-stiffness.coefficient")];
    for (coefficient = 1; std::abs(linear.evaluate(both.theta, Partials::none).chi2 - without) < 0.3 * without;) coefficient *= 2;  // a law that shows
    const RunResidual run = both.coloured(both.with_law, both.theta);
    const RunResidual::Evaluation e = run.evaluate(both.theta, Partials::all);
    ASSERT_TRUE(std::isfinite(e.chi2)) << both.c.name;
    for (const Index j : {both.with_law.index("normal.stiffness_scale"), both.with_law.index("normal.damping_ratio"), both.with_law.index("cubic-stiffness.coefficient")}) {
      const auto chi2 = [&](double h) { return MatrixXd::Constant(1, 1, run.evaluate(both.theta + h * VectorXd::Unit(both.theta.size(), j), Partials::none).chi2).eval(); };
      const double sensitivity = e.jacobian.col(j).norm();
      ASSERT_GT(sensitivity, 0) << both.c.name << ", " << both.with_law.parameters()[static_cast<std::size_t>(j)].name;
      const double h = std::min(0.1 * std::abs(both.theta[j]), 0.03 * std::sqrt(e.chi2) / sensitivity);
      EXPECT_TRUE(test::is_slope(chi2, MatrixXd::Constant(1, 1, 2 * e.jacobian.col(j).dot(e.residual)), h, 1e-10)) << both.c.name << ", " << both.with_law.parameters()[static_cast<std::size_t>(j)].name;
    }
  }
}

/// Both unknowns side by side say what the one with c eliminated says.
TEST(ColouredLaw, SideBySideIsTheSameSum) {
  const Both both(pluck({"gauge"}));
  const RunResidual run = both.coloured(both.with_law, both.theta);
  const RunResidual::Evaluation e = run.evaluate(both.theta, Partials::all);
  const RunResidual::SideBySide there = run.side_by_side(both.theta, e.linear, both.c.run.samples(), Partials::all);
  EXPECT_NEAR(there.chi2 / e.chi2, 1, 1e-9);
  EXPECT_NEAR(there.residual.squaredNorm() / e.chi2, 1, 1e-9);
  EXPECT_LT((there.in_c.transpose() * there.residual).norm(), 1e-4 * there.in_c.norm() * there.residual.norm()) << "c is where the sum is least";
  VectorXd off = e.linear;
  const Index noise = run.first_offset() - 1;  // the filter's own state stands last before the offsets
  const auto chi2 = [&](double h) {
    off[noise] = e.linear[noise] + h;
    return MatrixXd::Constant(1, 1, run.side_by_side(both.theta, off, both.c.run.samples(), Partials::none).chi2).eval();
  };
  const double h = 1 / there.in_c.col(noise).norm();
  EXPECT_NEAR(chi2(h)(0, 0) - e.chi2, 1, 1e-5) << "a quadratic of that curvature";
}

}  // namespace
}  // namespace unrig
