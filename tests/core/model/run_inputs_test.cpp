#include "core/model/run_inputs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <random>

#include "core/propagate/response.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.01;
constexpr Index samples = 400;

unrig::Run pushed_by(double omega) {
  unrig::Run run;
  run.file = "forced.csv";
  run.kind = RunKind::forced;
  run.dt = dt;
  VectorXd force(samples);
  for (Index k = 0; k < samples; ++k) force[k] = std::sin(omega * dt * static_cast<double>(k));
  run.channels = {{"force", "N", "N", 1, force, 0}};
  return run;
}

Conditions by_force() {
  Conditions conditions;
  conditions.force = true;
  return conditions;
}

constexpr double w0 = 150, zeta = 0.2;

std::complex<double> transfer(double omega) { return 1.0 / std::complex<double>(w0 * w0 - omega * omega, 2 * zeta * w0 * omega); }

/// x'' + 2 zeta w0 x' + w0^2 x = u. Largest error of x in the second half of the record, where the start has died out, but for its end, over the exact amplitude.
double error_of_response(double omega, Index curved) {
  LinearSystem s;
  s.A = DualMatrix(MatrixXd{{0, 1}, {-w0 * w0, -2 * zeta * w0}});
  s.B = DualMatrix(MatrixXd{{0, 0}, {1, 0}});
  s.C = DualMatrix(MatrixXd{{1, 0}});
  s.D = DualMatrix(MatrixXd::Zero(1, 2));
  s.curved = curved;
  const MatrixXd input = run_inputs(pushed_by(omega), by_force());
  const VectorXd x = drive(s, exact_step(s, dt), DualMatrix(MatrixXd::Zero(2, 1)), samples, {}, input, Partials::none).output.col(0);
  double largest = 0;
  for (Index k = samples / 2; k < samples - 20; ++k) largest = std::max(largest, std::abs(x[k] - std::imag(transfer(omega) * std::polar(1.0, omega * dt * static_cast<double>(k)))));
  return largest / std::abs(transfer(omega));
}

/// A spline of odd degree d through the samples of a sine is the sines at omega + 2 pi k/dt, as large as (omega + 2 pi k/dt)^-(d + 1); at samples all have its phase.
double error_of_spline(double omega, int degree) {
  constexpr int images = 2000;  // straight lines leave 1/2000 of the sum behind them
  std::complex<double> answer = 0;
  double sum = 0;
  for (int k = -images; k <= images; ++k) {
    const double image = omega + 2 * std::numbers::pi * k / dt, size = std::pow(omega / image, degree + 1);
    answer += size * transfer(image);
    sum += size;
  }
  return std::abs(answer / sum / transfer(omega) - 1.0);
}

TEST(RunInputs, OfASineDriveAsItsSplineDoes) {
  for (const double phase : {0.5, 1.0}) {  // per sample
    const double omega = phase / dt;
    EXPECT_NEAR(error_of_response(omega, 1) / error_of_spline(omega, 3), 1, 0.01) << phase << ": samples come near the crest";
    EXPECT_NEAR(error_of_response(omega, 0) / error_of_spline(omega, 1), 1, 0.01) << phase;
    EXPECT_LT(error_of_response(omega, 1), 0.05 * error_of_response(omega, 0)) << phase << ": (w dt)^4/720 in place of (w dt)^2/12";
  }
}

/// A half sine of six samples is none that a filter against aliasing lets through, and noise of the sensor is as large at the Nyquist frequency as anywhere.
TEST(RunInputs, WhatTheSamplesDoNotResolveRunsStraight) {
  unrig::Run run = pushed_by(1.0);
  VectorXd& force = run.channels.front().value;
  const VectorXd slow = force;
  EXPECT_FALSE(run_inputs(run, by_force()).col(1).isZero(0)) << "a sine";
  const double lost = std::pow(dt, 2) / 12;  // of an amplitude of 1, by straight lines
  std::mt19937_64 engine(1);
  std::normal_distribution<double> noise(0, 2 * lost);
  for (Index k = 0; k < samples; ++k) force[k] = slow[k] + noise(engine);
  EXPECT_TRUE(run_inputs(run, by_force()).col(1).isZero(0)) << "more noise than straight lines lose";
  for (Index k = 0; k < samples; ++k) force[k] = k >= 100 && k <= 106 ? std::sin(std::numbers::pi * static_cast<double>(k - 100) / 6) : 0;
  EXPECT_TRUE(run_inputs(run, by_force()).col(1).isZero(0)) << "a blow";
}

TEST(RunInputs, ASampleThatIsMissingLiesBetweenItsNeighbours) {
  unrig::Run run = pushed_by(1.0);
  VectorXd& force = run.channels.front().value;
  force[50] = std::numeric_limits<double>::quiet_NaN();
  const MatrixXd input = run_inputs(run, by_force());
  EXPECT_DOUBLE_EQ(input(50, 0), 0.5 * (force[49] + force[51]));
  EXPECT_TRUE(input.allFinite());
  EXPECT_EQ(input.rows(), samples + 1);
  EXPECT_EQ(input.cols(), 2);
}

TEST(RunInputs, AForceThatIsNotRecordedIsNone) {
  unrig::Run run = pushed_by(1.0);
  run.channels.front().name = "gauge";
  EXPECT_TRUE(run_inputs(run, by_force()).isZero(0));
}

}  // namespace
}  // namespace unrig
