#include "core/numerics/spline_curvature.h"

#include <gtest/gtest.h>

#include <cmath>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double dt = 0.1;

VectorXd sampled(Index samples, double (*f)(double)) {
  VectorXd value(samples);
  for (Index k = 0; k < samples; ++k) value[k] = f(dt * static_cast<double>(k));
  return value;
}

TEST(SplineCurvature, OfACubicIsItsOwn) {
  for (const Index samples : {4, 5, 6, 40}) {
    const VectorXd found = spline_curvature(sampled(samples, [](double t) { return 2 - t + 3 * t * t - 4 * t * t * t; }), dt);
    EXPECT_LT((found - sampled(samples, [](double t) { return 6 - 24 * t; })).norm(), 1e-10 * found.norm()) << samples;
  }
  EXPECT_LT((spline_curvature(sampled(3, [](double t) { return 1 + t - 5 * t * t; }), dt).array() + 10).matrix().norm(), 1e-10);
}

TEST(SplineCurvature, BelowThreeSamplesIsNone) {
  for (const Index samples : {0, 1, 2}) EXPECT_EQ(spline_curvature(sampled(samples, [](double t) { return t + 1; }), dt), VectorXd::Zero(samples));
}

/// Between two samples the spline has one third derivative; its slope must be the same from both sides of a sample.
TEST(SplineCurvature, MakesTheSlopeContinuous) {
  const VectorXd value = sampled(30, [](double t) { return std::sin(40 * t * t); }), curvature = spline_curvature(value, dt);
  for (Index k = 1; k + 1 < value.size(); ++k) {
    const double from_left = (value[k] - value[k - 1]) / dt + dt / 6 * (curvature[k - 1] + 2 * curvature[k]);
    const double from_right = (value[k + 1] - value[k]) / dt - dt / 6 * (2 * curvature[k] + curvature[k + 1]);
    EXPECT_NEAR(from_left, from_right, 1e-11) << k;
  }
}

}  // namespace
}  // namespace unrig
