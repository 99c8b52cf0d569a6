// Laws with corners: the steps within a sample that they ask for, and the one that freeplay has.
#include "core/propagate/nonlinear_response.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "core/effects/effect.h"
#include "core/numerics/spline_curvature.h"
#include "core/numerics/work.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double omega = 2 * pi * 5, dt = 0.01;  // twenty samples a period

double sharp_gap(const double* z, const double* p, double* slope, double* partial) {
  *slope = std::abs(*z) < p[0] ? 1 : 0;
  *partial = std::abs(*z) < p[0] ? 0 : (*z > 0 ? 1 : -1);
  return std::clamp(*z, -p[0], p[0]);
}

/// x and x' of x'' = -omega^2 (x - clamp(x, -delta, delta)), from x = 1 at rest.
MatrixXd behind_a_gap(double delta, Index steps_per_sample, Index samples) {
  LinearSystem system;
  system.A = DualMatrix(MatrixXd{{0, 1}, {-omega * omega, 0}});
  system.B = DualMatrix(MatrixXd{{0}, {omega * omega}});
  system.C = DualMatrix(MatrixXd::Identity(2, 2));
  system.D = DualMatrix(MatrixXd::Zero(2, 1));
  system.coordinates = 1;
  system.feedback.push_back({Eigen::RowVector2d(1, 0), 0, 1, sharp_gap, nullptr, steps_per_sample});
  const VectorXd theta = VectorXd::Constant(1, delta);
  return follow(system, step_to_follow(system, dt), theta, {Eigen::Vector2d(1, 0), {}, {}, MatrixXd(2, 0), {}}, samples, Partials::none).output;
}

/// Of the spring behind the gap and of the mass, over what it was at first.
double energy(const MatrixXd& motion, Index sample, double delta) {
  const double stretch = std::max(0.0, std::abs(motion(sample, 0)) - delta), speed = motion(sample, 1) / omega;
  return (stretch * stretch + speed * speed) / ((1 - delta) * (1 - delta));
}

TEST(NonlinearResponse, AGapKeepsEnergyAndPeriod) {
  // Beyond the gap half a period of the oscillator on each side; across it 2 delta at the speed omega (1 - delta), twice.
  constexpr double delta = 0.17, exact = 2 * pi / omega + 4 * delta / (omega * (1 - delta));
  constexpr int periods = 3;
  constexpr Index samples = 90;
  const MatrixXd coarse = behind_a_gap(delta, 1, samples), fine = behind_a_gap(delta, 8, samples);
  // Where the law has its corner the parabola of a step cuts it, four times a period; an eighth of the step, a sixty-fourth of the loss.
  const double lost_coarse = std::abs(1 - energy(coarse, samples - 1, delta)), lost_fine = std::abs(1 - energy(fine, samples - 1, delta));
  EXPECT_LT(lost_fine, 0.01);
  EXPECT_GT(lost_coarse, 8 * lost_fine);
  std::vector<double> crossings;  // downwards; inside the gap the mass moves evenly
  for (Index k = 0; k + 1 < samples; ++k)
    if (fine(k, 0) > 0 && fine(k + 1, 0) <= 0) crossings.push_back(dt * (static_cast<double>(k) + fine(k, 0) / (fine(k, 0) - fine(k + 1, 0))));
  ASSERT_GT(crossings.size(), static_cast<std::size_t>(periods));
  EXPECT_NEAR((crossings[periods] - crossings[0]) / periods / exact, 1, 1e-3) << "a loss of 1 % would change it by 0.1 %";
}

double dry_friction(const double* z, const double* p, double* slope, double*) {
  const double t = std::tanh(*z / p[0]);
  *slope = -(1 - t * t) / p[0];
  return -t;
}

/// What following x'' = -omega^2 x - 0.02 omega^2 tanh(x' / v) from x = 1 at rest until it sticks costs.
std::uint64_t work_of_friction(double v, Index samples) {
  LinearSystem system;
  system.A = DualMatrix(MatrixXd{{0, 1}, {-omega * omega, 0}});
  system.B = DualMatrix(MatrixXd{{0}, {0.02 * omega * omega}});
  system.C = DualMatrix(MatrixXd::Identity(2, 2));
  system.D = DualMatrix(MatrixXd::Zero(2, 1));
  system.coordinates = 1;
  system.feedback.push_back({Eigen::RowVector2d(0, 1), 0, 1, dry_friction, nullptr, 1});
  const VectorXd theta = VectorXd::Constant(1, v);
  const std::uint64_t before = work_done();
  const MatrixXd motion = follow(system, step_to_follow(system, dt), theta, {Eigen::Vector2d(1, 0), {}, {}, MatrixXd(samples, 0), {}}, samples, Partials::none).output;
  EXPECT_LT(std::abs(motion(samples - 1, 1)), 1e-3 * omega);
  return work_done() - before;
}

/// Where friction sticks, Newton's method from the force of the step before leaves the narrow range in which the force is not full; the slope at the speed before leads into it at once.
TEST(NonlinearResponse, AFrictionThatSticksCostsNoMoreThanTwiceOneThatSlides) {
  constexpr Index samples = 400;  // a period, of twenty, takes 4 x 0.02 off the amplitude: it slides for the first 250
  const double slides = static_cast<double>(work_of_friction(0.1 * omega, samples));
  for (const double v : {1e-8, 1e-7, 1e-6}) EXPECT_LT(static_cast<double>(work_of_friction(v * omega, samples)), 2 * slides) << v;
}

double minus(const double* z, const double*, double* slope, double*) {
  *slope = -1;
  return -*z;
}

/// Under a force that is a spline a spring that is a law does what it does in the linear system, but for what its own parabolas lose: the fourth power of the steps.
TEST(NonlinearResponse, FollowsASplineWithinASample) {
  constexpr Index samples = 60;
  const double stiffness = 0.5 * omega * omega, wide = 0.05;  // twelve samples a period of the force, four of the whole rig
  LinearSystem linear;
  linear.A = DualMatrix(MatrixXd{{0, 1}, {-omega * omega, -2}});
  linear.B = DualMatrix(MatrixXd{{0, 0}, {1, 0}});
  linear.C = DualMatrix(MatrixXd::Identity(2, 2));
  linear.D = DualMatrix(MatrixXd::Zero(2, 2));
  linear.curved = 1;
  MatrixXd input(samples + 1, 2);
  for (Index k = 0; k <= samples; ++k) input(k, 0) = std::sin(2 * static_cast<double>(k * k % 7));
  input.col(1) = spline_curvature(input.col(0), wide);
  const MatrixXd exact = drive(linear, exact_step(linear, wide), DualMatrix(MatrixXd::Zero(2, 1)), samples, {}, input, Partials::none).output;
  const auto error = [&](Index steps) {
    LinearSystem system = linear;
    system.A.value(1, 0) += stiffness;
    system.B = DualMatrix(MatrixXd{{0, 0, 0}, {1, 0, stiffness}});
    system.D = DualMatrix(MatrixXd::Zero(2, 3));
    system.feedback.push_back({Eigen::RowVector2d(1, 0), 0, 0, minus, nullptr, steps});
    return (follow(system, step_to_follow(system, wide), VectorXd(), {Eigen::Vector2d::Zero(), {}, input, MatrixXd(2, 0), {}}, samples, Partials::none).output - exact).norm() / exact.norm();
  };
  EXPECT_NEAR(error(8) / error(16), 16, 0.1);
  EXPECT_LT(error(16), 1e-5);
}

TEST(NonlinearResponse, TangentsOfALawOfStraightPiecesAreThoseOfItsResponse) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"freeplay"});
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  conditions.prescribed_pitch = true;
  VectorXd theta = model.start_values();
  theta[model.index("freeplay.half_gap")] = 2e-4;
  const LinearSystem system = model.system(conditions, theta, {"gauge"});
  constexpr double step = 0.002;
  constexpr Index samples = 400;
  const Index n = system.states(), twist = system.coordinates - 1;
  VectorXd jerk = VectorXd::Zero(samples);
  for (Index k = 0; k < 50; ++k) jerk[k] = 1600 * std::sin(4 * pi * static_cast<double>(k) / 50);
  const std::vector<Index> jerks{3, 20, 40}, starts{0, twist, system.coordinates + twist};
  const auto directions = static_cast<Index>(jerks.size() + starts.size());
  NonlinearDrive drive{VectorXd::Zero(n), jerk, MatrixXd(samples + 1, 0), MatrixXd::Zero(n, directions), MatrixXd::Zero(samples, directions)};
  for (std::size_t i = 0; i < jerks.size(); ++i) drive.jerk_tangent(jerks[i], static_cast<Index>(i)) = 1;
  for (std::size_t i = 0; i < starts.size(); ++i) drive.start_tangent(starts[i], static_cast<Index>(jerks.size() + i)) = 1;
  const NonlinearResponse response = follow(system, step_to_follow(system, step), theta, drive, samples, Partials::all);
  ASSERT_TRUE(response.finite);
  ASSERT_GT(response.largest_argument[0], 3 * 2e-4) << "well beyond the gap";
  const auto output = [&](const VectorXd& start, const VectorXd& pushed, double gap) {
    VectorXd at = theta;
    at[model.index("freeplay.half_gap")] = gap;
    return VectorXd(follow(model.system(conditions, at, {"gauge"}), step_to_follow(system, step), at, {start, pushed, drive.input, MatrixXd(n, 0), {}}, samples, Partials::none).output.col(0));
  };
  const auto expect_slope = [&](Index column, const VectorXd& slope) {
    EXPECT_LT((response.tangent[0].col(column) - slope).norm(), 1e-4 * slope.norm()) << column << ": the step of the difference over the way to the next corner; 2e-5 measured for the gap, 3e-6 for the others";
  };
  for (Index j = 0; j < directions; ++j) {
    const double h = j < static_cast<Index>(jerks.size()) ? 1e-3 : 1e-9;
    expect_slope(j, (output(h * drive.start_tangent.col(j), jerk + h * drive.jerk_tangent.col(j), 2e-4) - output(-h * drive.start_tangent.col(j), jerk - h * drive.jerk_tangent.col(j), 2e-4)) / (2 * h));
  }
  const double h = 1e-10;
  expect_slope(directions + model.index("freeplay.half_gap"), (output(drive.start, jerk, 2e-4 + h) - output(drive.start, jerk, 2e-4 - h)) / (2 * h));
}

TEST(NonlinearResponse, FreeplayIsAGapWhoseCornersASearchRounds) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{1}, Index{1}), wagner(Wagner::jones)).with_effects({"freeplay"});
  Conditions conditions;
  conditions.density = 1.2;
  const LinearSystem system = model.system(conditions, model.start_values(), {"gauge"});
  ASSERT_EQ(system.feedback.size(), 1u);
  const auto law = system.feedback.front().rounded;
  const auto sharp_law = system.feedback.front().law;
  const double half = 2e-3, h = 1e-11;
  double slope = 0, ignored = 0, partial[1] = {}, none[1] = {};
  const auto at = [&](double z, double gap) { return law(&z, &gap, &ignored, none); };
  std::vector<double> arguments;
  for (double z = -3 * half; z <= 3 * half; z += 0.0317 * half) arguments.push_back(z);
  for (double z = 0.995 * half; z <= 1.005 * half; z += 0.00017 * half) arguments.push_back(z), arguments.push_back(-z);
  for (const double z : arguments) {
    const double value = law(&z, &half, &slope, partial), sharp = std::clamp(z, -half, half);
    const bool corner = std::abs(std::abs(z) - half) < 0.00301 * half;
    EXPECT_LE(std::abs(value - sharp), corner ? 0.000751 * half : 1e-18) << z << ": a corner of half width w is cut by w/4 at most";
    EXPECT_EQ(sharp_law(&z, &half, &ignored, none), sharp) << z;
    EXPECT_NEAR(slope, (at(z + h, half) - at(z - h, half)) / (2 * h), 1e-5) << z;
    EXPECT_NEAR(partial[0], (at(z, half + h) - at(z, half - h)) / (2 * h), 1e-5) << z;
    EXPECT_EQ(value, -at(-z, half)) << z;
  }
  const double zero = 0, somewhere = 1e-3;
  EXPECT_EQ(law(&somewhere, &zero, &slope, partial), 0) << "no gap takes nothing";
}

}  // namespace
}  // namespace unrig
