#include "correct/estimate/misfit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "correct/estimate/prior.h"
#include "correct/estimate/uncertainty_budget.h"
#include "correct/segments/knots.h"
#include "tests/correct/recorded_run.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double one_step(double t) { return 1.3 * test::soft((t - 1) / 0.04); }

/// A run at rest around a step, near the least chi-square.
struct Corrected {
  test::Recorded recorded = test::record(&one_step, 3000);
  AeroelasticModel model = test::free_circulation();
  VectorXd theta = theta_for(model, test::null_fit(), "");
  RunResidual residual{model, recorded.run, generous_windows(recorded.run)};
  RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
  RunResidual::Sensitivity sensitivity = residual.sensitivity(theta);
  MatrixXd root = theta_root(e, prior_of(model, test::null_fit(), theta, recorded.run.file));

  MatrixXd covariance(const std::function<double(const std::string&, double)>& density) const {
    const MatrixXd columns = disturbance_root(residual, sensitivity, e, root, density);
    return columns * columns.transpose();
  }
};

/// A flat density is white noise: what it does to theta is C J' J C, J the slopes of the readings, times its variance over theirs; and to the first offset what each reading does to that.
TEST(DisturbanceRoot, OfAFlatDensityIsWhiteNoise) {
  const Corrected c;
  const double part = 0.3, white = 2 * c.recorded.run.dt * std::pow(c.residual.sigma(0), 2);
  const MatrixXd found = c.covariance([&](const std::string& channel, double) { return channel == "gauge" ? part * white : 0; });
  // With C = R R' from the inside out: J R is of order one, while C (J' J) C loses five digits more to cancellation.
  const MatrixXd by_reading = c.sensitivity.channels[0].slope * c.root;
  const MatrixXd wanted = part * c.root * (by_reading.transpose() * by_reading) * c.root.transpose();
  const Index thetas = c.theta.size();
  EXPECT_LT((found.topLeftCorner(thetas, thetas) - wanted).norm(), 1e-9 * wanted.norm());
  const Index offset = thetas + c.residual.first_offset();
  const VectorXd into = c.sensitivity.channels[0].into_offset + by_reading * (c.root.transpose() * c.e.linear_slope.row(c.residual.first_offset()).transpose());
  EXPECT_NEAR(found(offset, offset), part * into.squaredNorm(), 1e-9 * found(offset, offset));
}

/// Slow disturbances read as a load and fast ones average out.
TEST(DisturbanceRoot, SlowOnesMoveTheSlopeMost) {
  const Corrected c;
  const Index slope = c.model.index("normal_force_slope");
  const auto up_to = [&](double corner) { return c.covariance([&](const std::string&, double f) { return f < corner ? 1 / corner : 0; })(slope, slope); };
  EXPECT_GT(up_to(1), 10 * up_to(100));  // of the same variance
  EXPECT_EQ(c.covariance([](const std::string&, double) { return 0.0; }).norm(), 0);
}

}  // namespace
}  // namespace unrig
