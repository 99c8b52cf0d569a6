#include "fit/likelihood/input_noise.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "core/propagate/response.h"
#include "core/model/run_inputs.h"
#include "tests/fit/impact_cases.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd normal(Index n, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> distribution(0, sigma);
  return VectorXd::NullaryExpr(n, [&] { return distribution(engine); });
}

/// Gauge and accelerometer on two modes under a force.
struct Driven {
  Rig rig = impact::balance();
  Conditions conditions;
  LinearSystem system;
  ExactStep step;
  explicit Driven(bool mount = false) {
    Sensor sensor;
    sensor.column = "acc";
    sensor.reads = SensorKind::acceleration;
    rig.sensors = {sensor};
    rig.modal[0].sensor_shape = {1};
    rig.modal[1].sensor_shape = {-0.6};
    conditions.force = !mount;
    conditions.mount = mount;
    const AeroelasticModel model(rig, {}, {});
    system = model.system(conditions, model.start_values(), {"gauge", "acc"});
    step = exact_step(system, 0.002);
  }
  VectorXd output(const MatrixXd& input) const { return drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), input.rows() - 1, {}, input, Partials::none).output.reshaped(); }
};

/// The whole covariance of the readings, each sample of the force's noise followed by itself; some readings are missing, some count less.
TEST(InputNoise, MakesTheNoiseWhiteAsTheWholeCovarianceSays) {
  const Driven d;
  constexpr Index n = 80;
  constexpr double level = 0.3;
  MatrixXd weight(n, 2);
  weight.col(0).setConstant(1 / 0.05);
  weight.col(1).setConstant(1 / 0.02);
  weight(12, 0) = weight(40, 1) = weight(41, 0) = weight(41, 1) = 0;
  weight.col(0).segment(50, 10) *= 0.5;
  MatrixXd covariance = MatrixXd::Zero(2 * n, 2 * n);
  for (Index k = 0; k < n; ++k) {
    MatrixXd input = MatrixXd::Zero(n + 1, 2);  // straight between samples, as noise is
    input(k, 0) = level;
    const VectorXd y = d.output(input);
    covariance += y * y.transpose();
  }
  std::vector<Index> there;
  for (Index i = 0; i < 2 * n; ++i)
    if (const double w = weight.reshaped()[i]; w > 0) covariance(i, i) += 1 / (w * w), there.push_back(i);
  const MatrixXd counted = covariance(there, there);

  const InputNoiseModel model{MatrixXd(0, 0), MatrixXd(0, 1), MatrixXd(1, 0), MatrixXd::Constant(1, 1, level), MatrixXd(0, 0)};
  const InputNoise noise(d.system, d.step, model, weight);
  const MatrixXd white = noise.whitened(MatrixXd::Identity(2 * n, 2 * n));
  const MatrixXd map = white(there, there);
  EXPECT_LT((map * counted * map.transpose() - MatrixXd::Identity(counted.rows(), counted.rows())).cwiseAbs().maxCoeff(), 1e-8);
  const Eigen::LLT<MatrixXd> root(counted);
  EXPECT_NEAR(noise.log_determinant(), 2 * MatrixXd(root.matrixL()).diagonal().array().log().sum(), 1e-7);
  const double power = covariance.topLeftCorner(n, n).trace() / n;
  VectorXd own = weight.col(0).unaryExpr([](double w) { return w > 0 ? 1 / (w * w) : 0.0; });
  EXPECT_NEAR(noise.variance(0), power - own.mean(), 1e-9 * power);
}

/// Where one of velocity and acceleration of the mount is measured, its noise comes out of the other as run_inputs derives it.
class NoiseOfTheMount : public ::testing::TestWithParam<const char*> {};

TEST_P(NoiseOfTheMount, IsWhiteBehindTheFilter) {
  const Driven d(true);
  constexpr Index n = 1500, draws = 6;
  constexpr double level = 0.01;
  const std::string column = GetParam();
  double squares = 0, neighbours = 0, count = 0;
  for (unsigned draw = 0; draw < draws; ++draw) {
    unrig::Run run;
    run.kind = RunKind::moved;
    run.dt = 0.002;
    VectorXd measured = normal(n, level, 10 + draw);
    run.channels.push_back({column, "", "", 1, measured, 0});
    const VectorXd y = d.output(run_inputs(run, d.conditions)) + normal(2 * n, 0.02, 100 + draw);
    measured.segment(n / 2, 200).array() += 1;  // a motion of the mount, beside which the rest is quiet
    run.channels.front().value = measured;
    const std::optional<InputNoiseModel> model = noise_of_inputs(run, d.conditions);
    ASSERT_TRUE(model);
    const InputNoise noise(d.system, d.step, *model, MatrixXd::Constant(n, 2, 1 / 0.02));
    VectorXd white = noise.whitened(y);
    for (const Index first : {Index{20}, n + 20}) {  // at the very start a difference is one-sided
      const auto part = white.segment(first, n - 40);
      squares += part.squaredNorm();
      neighbours += part.head(n - 41).dot(part.tail(n - 41));
      count += static_cast<double>(n - 40);
    }
  }
  const double chance = 5 * std::sqrt(2 / count);  // five standard deviations; and the level itself is known to 2 %
  EXPECT_NEAR(squares / count, 1, chance + 0.04);
  EXPECT_NEAR(neighbours / count, 0, chance);
}
INSTANTIATE_TEST_SUITE_P(Measured, NoiseOfTheMount, ::testing::Values("mount_velocity", "mount_acceleration"));

TEST(NoiseWhereQuiet, IsTheNoiseBesideABlow) {
  impact::Impact hit;
  hit.samples = 6000;
  const VectorXd force = impact::blow(hit) + normal(hit.samples, 0.3, 4);
  EXPECT_NEAR(noise_where_quiet(force), 0.3, 5 * 0.3 / std::sqrt(2.0 * 6000));
}

TEST(NoiseWhereQuiet, IsNotKnownOfAForceThatNeverRests) {
  EXPECT_EQ(noise_where_quiet(normal(6000, 20, 5)), 0) << "a random force";
  VectorXd tone(6000);
  for (Index k = 0; k < tone.size(); ++k) tone[k] = 20 * std::sin(0.1 * static_cast<double>(k));
  EXPECT_EQ(noise_where_quiet(tone + normal(6000, 0.3, 6)), 0) << "a tone";
  EXPECT_EQ(noise_where_quiet(impact::blow({})), 0) << "a force without noise";
}

}  // namespace
}  // namespace unrig
