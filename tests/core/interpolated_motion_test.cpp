#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/run/motion.h"
#include "core/propagate/response.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A motion from rest: (t^2/2) exp(-t), and its derivatives.
double angle(double t) { return 0.5 * t * t * std::exp(-t); }
double acceleration(double t) { return (1 - 2 * t + 0.5 * t * t) * std::exp(-t); }

Motion sampled(double dt, double until) {
  VectorXd samples(static_cast<Index>(until / dt + 0.5) + 1);
  for (Index k = 0; k < samples.size(); ++k) samples[k] = 0.3 + angle(dt * static_cast<double>(k));
  return interpolated_motion(samples, dt);
}

TEST(InterpolatedMotion, PassesThroughItsSamplesFromRest) {
  const double dt = 0.1;
  const Motion m = sampled(dt, 5);
  EXPECT_NEAR(m.rate[0], 0, 1e-16) << "round-off of the first slope";
  EXPECT_EQ(m.angle[0], 0) << "deviation from the first sample";
  for (Index k = 0; k + 1 < m.angle.size(); ++k) {  // Taylor's polynomial of each step ends where the next begins
    const double round_off = 1e-14 / (dt * dt);
    EXPECT_NEAR(m.angle[k] + dt * (m.rate[k] + dt / 2 * (m.acceleration[k] + dt / 3 * m.jerk[k])), m.angle[k + 1], 1e-15);
    EXPECT_NEAR(m.rate[k] + dt * (m.acceleration[k] + dt / 2 * m.jerk[k]), m.rate[k + 1], round_off);
    EXPECT_NEAR(m.acceleration[k] + dt * m.jerk[k], m.acceleration[k + 1], round_off);
  }
  EXPECT_EQ(m.jerk[m.jerk.size() - 2], 0) << "constant acceleration over the last step";
}

TEST(InterpolatedMotion, AccelerationIsOfSecondOrder) {
  double last = 0;
  for (const double dt : {0.1, 0.05, 0.025}) {
    const Motion m = sampled(dt, 8);
    double error = 0;
    for (Index k = 0; dt * static_cast<double>(k) < 6; ++k)  // away from the end, where the acceleration is held
      error = std::max(error, std::abs(m.acceleration[k] - acceleration(dt * static_cast<double>(k))));
    if (last > 0) {
      EXPECT_NEAR(last / error, 4, 0.4) << dt;
    }
    last = error;
  }
}

TEST(InterpolatedMotion, DrivesASystemAlongItsSamples) {
  // Pitch alone as a system: what the propagator integrates from the jerks is the spline; 2e4 samples' round-off.
  LinearSystem system;
  system.A = DualMatrix(MatrixXd{{0, 1, 0}, {0, 0, 1}, {0, 0, 0}});
  system.B = DualMatrix(MatrixXd::Zero(3, 0));
  system.C = DualMatrix(MatrixXd::Identity(1, 3));
  system.D = DualMatrix(MatrixXd::Zero(1, 0));
  system.motion = 0;
  const double dt = 0.0005;
  const Motion m = sampled(dt, 10);
  const VectorXd start{{0, 0, m.acceleration[0]}};
  const Response r = drive(system, exact_step(system, dt), DualMatrix(start), m.jerk.size(), m.jerk, {}, Partials::none);
  EXPECT_LT((r.output.col(0) - m.angle).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(InterpolatedMotion, RefusesWhatHasNoSpline) {
  EXPECT_THROW(interpolated_motion(VectorXd::Zero(2), 0.1), std::invalid_argument);
  EXPECT_THROW(interpolated_motion(VectorXd::Constant(5, std::numeric_limits<double>::quiet_NaN()), 0.1), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
