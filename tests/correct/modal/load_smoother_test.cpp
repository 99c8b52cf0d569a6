// Filter and smoother of an unknown load against what they stand for: the Gaussian distribution of all samples at once, by dense algebra, and its limits.

#include "correct/modal/load_smoother.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.1, roughness = 4;

/// A load that is read as it is: l'' white, over a sample [dt^3/3, dt^2/2; dt^2/2, dt].
LoadModel rigid() { return {MatrixXd{{1, dt}, {0, 1}}, MatrixXd{{dt * dt * dt / 3, dt * dt / 2}, {dt * dt / 2, dt}}, Eigen::RowVector2d(1, 0), Eigen::Vector2d(1, 1)}; }

/// A decaying oscillation that the load pushes, read beside the load.
LoadModel swinging() {
  LoadModel model{MatrixXd::Zero(4, 4), MatrixXd::Zero(4, 4), Eigen::RowVector4d(1, 0.1, 0.4, 0), Eigen::Vector4d(1, 2, 1, 3)};
  model.transition << 0.9, 0.3, 0.05, 0, -0.3, 0.9, 0.1, 0, 0, 0, 1, dt, 0, 0, 0, 1;
  model.diffusion.bottomRightCorner(2, 2) = rigid().diffusion;
  return model;
}

VectorXd some_readings(Index n, Index missing) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  VectorXd y(n);
  for (Index k = 0; k < n; ++k) y[k] = 5 * std::sin(0.2 * static_cast<double>(k)) + normal(random);
  if (missing >= 0) y[missing] = y[missing + 1] = std::numeric_limits<double>::quiet_NaN();
  return y;
}

/// States of all samples are Gaussian around zero with this covariance, the first with a thousand times its scale.
MatrixXd prior_of_states(const LoadModel& model, Index n) {
  const Index states = model.transition.rows();
  MatrixXd covariance = MatrixXd::Zero(n * states, n * states);
  covariance.topLeftCorner(states, states) = (1e3 * model.start_scale).cwiseAbs2().asDiagonal();
  for (Index k = 1; k < n; ++k) {
    const Index at = k * states, before = at - states;
    covariance.block(at, 0, states, at) = model.transition * covariance.block(before, 0, states, at);
    covariance.block(0, at, at, states) = covariance.block(at, 0, states, at).transpose();
    covariance.block(at, at, states, states) = model.transition * covariance.block(before, before, states, states) * model.transition.transpose() + roughness * model.diffusion;
  }
  return covariance;
}

struct Dense {
  VectorXd mean;
  MatrixXd covariance;      // of all states for given readings
  MatrixXd of_reading;      // covariance of those that are there, with noise of one
  VectorXd reading;
};

Dense dense(const LoadModel& model, const VectorXd& y) {
  const Index states = model.transition.rows();
  std::vector<Index> there;
  for (Index k = 0; k < y.size(); ++k)
    if (std::isfinite(y[k])) there.push_back(k);
  const auto count = static_cast<Index>(there.size());
  MatrixXd see = MatrixXd::Zero(count, y.size() * states);
  for (Index i = 0; i < count; ++i) see.block(i, there[static_cast<std::size_t>(i)] * states, 1, states) = model.observe;
  const MatrixXd prior = prior_of_states(model, y.size());
  Dense d{{}, {}, see * prior * see.transpose() + MatrixXd::Identity(count, count), y(there)};
  const Eigen::LLT<MatrixXd> llt(d.of_reading);
  d.mean = prior * see.transpose() * llt.solve(d.reading);
  d.covariance = prior - prior * see.transpose() * llt.solve(see * prior);
  return d;
}

TEST(LoadSmoother, IsMeanAndVarianceForGivenReadings) {
  constexpr Index n = 60;
  constexpr double rounding = 1e-5;  // a start that is unknown by a million times the noise's variance costs six digits of each of two inversions
  for (const LoadModel& model : {rigid(), swinging()})
    for (const Index missing : {Index{-1}, Index{0}, Index{31}}) {
      const VectorXd y = some_readings(n, missing);
      const SmoothedLoad found = smooth(model, roughness, y);
      const Dense expected = dense(model, y);
      const Index states = model.transition.rows();
      for (Index k = 0; k < n; ++k) {
        const Index load = k * states + states - 2;
        EXPECT_NEAR(found.load[k], expected.mean[load], rounding) << k << ", " << missing;
        const double variance = expected.covariance(load, load), across = expected.covariance(load, load + 1) / variance;
        EXPECT_NEAR(found.variance[k], variance, rounding) << k << ", " << missing;
        EXPECT_NEAR(found.angular_speed[k], std::sqrt(expected.covariance(load + 1, load + 1) / variance - across * across), 1e-4) << k << ", " << missing;
      }
    }
}

/// Of the readings behind those that only find the start: -(m ln s + ln det S) / 2 with S their covariance for given first readings and s = y' S^-1 y / m.
TEST(LoadSmoother, ItsLikelihoodIsThatOfTheReadings) {
  for (const LoadModel& model : {rigid(), swinging()})
    for (const Index missing : {Index{-1}, Index{31}}) {
      const VectorXd y = some_readings(60, missing);
      const Dense d = dense(model, y);
      const Index first = model.transition.rows(), m = d.reading.size() - first;
      const Eigen::LLT<MatrixXd> start(MatrixXd(d.of_reading.topLeftCorner(first, first)));
      const MatrixXd across = d.of_reading.bottomLeftCorner(m, first);
      const MatrixXd S = d.of_reading.bottomRightCorner(m, m) - across * start.solve(MatrixXd(across.transpose()));
      const VectorXd off = d.reading.tail(m) - across * start.solve(d.reading.head(first));
      const Eigen::LLT<MatrixXd> llt(S);
      const double noise = off.dot(llt.solve(off)) / static_cast<double>(m);
      const LoadLikelihood found = likelihood(model, roughness, y);
      EXPECT_NEAR(found.noise_variance, noise, 1e-4 * noise);
      EXPECT_NEAR(found.logarithm, -0.5 * static_cast<double>(m) * std::log(noise) - MatrixXd(llt.matrixL()).diagonal().array().log().sum(), 1e-2);
    }
}

TEST(LoadSmoother, ALoadWithoutRoughnessIsTheBestStraightLine) {
  const VectorXd y = some_readings(60, -1);
  MatrixXd line(60, 2);
  line << VectorXd::Ones(60), VectorXd::LinSpaced(60, 0, 59);
  const VectorXd expected = line * line.householderQr().solve(y);
  const MatrixXd covariance = (line.transpose() * line).inverse();
  const SmoothedLoad found = smooth(rigid(), 1e-12, y);
  EXPECT_LT((found.load - expected).cwiseAbs().maxCoeff(), 1e-4);
  EXPECT_NEAR(found.variance[30], (line.row(30) * covariance * line.row(30).transpose()).value(), 1e-5);
}

TEST(LoadSmoother, ALoadWithoutBoundsIsTheReading) {
  const VectorXd y = some_readings(60, 31);
  const SmoothedLoad found = smooth(rigid(), 1e9, y);
  for (Index k = 1; k < 59; ++k) {
    if (!std::isfinite(y[k])) continue;
    EXPECT_NEAR(found.load[k], y[k], 1e-3) << k;
    EXPECT_NEAR(found.variance[k], 1, 1e-3) << k;
  }
  EXPECT_GT(found.variance[31], 100) << "what is missing is open";
}

/// A long record settles: its middle does not know how long it is.
TEST(LoadSmoother, TheMiddleOfALongRecordHasOneVariance) {
  const SmoothedLoad found = smooth(swinging(), roughness, some_readings(3000, -1));
  EXPECT_NEAR(found.variance[1000], found.variance[2000], 1e-9 * found.variance[1000]);
  EXPECT_NEAR(found.variance[1000], smooth(swinging(), roughness, some_readings(600, -1)).variance[300], 1e-6 * found.variance[1000]);
}

}  // namespace
}  // namespace unrig
