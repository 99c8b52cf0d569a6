#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "fit/fit.h"

// A balance of two bridges: free decays in closed form, seen by both.

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double mass = 2, inertia = 0.004, stiffness = 3000, torsional_stiffness = 20;  // of the rig file: kg, kg m^2, N/m, N m/rad
constexpr double per_force = 0.3, per_torque = 12;
constexpr double dt = 0.002, noise = 0.02;

/// All mass sits at the second of two elements, so that each chain is one oscillator.
Rig balance() {
  constexpr double little = 1e-9;
  Rig rig;
  rig.file = "balance.toml";
  rig.chord = 0.1;
  rig.pitch_axis = 0.25;
  rig.station = Eigen::Vector2d(0.1, 0.5);
  rig.mass_centre = Eigen::Vector2d::Zero();
  const Eigen::Matrix2d shape{{0.01, 0.05}, {0.05, 1}}, twist{{0.2, 0.2}, {0.2, 1}};
  rig.normal = {Eigen::Vector2d(little, mass), shape / stiffness, {}, 1};
  rig.torsion = {Eigen::Vector2d(little * inertia, inertia), twist / torsional_stiffness, {}, 1};
  rig.rigid_from = 2;
  rig.submerged = {2};
  rig.strip_length = 0.1;
  rig.gauge_element = 1;
  rig.calibration_element = 2;
  Sensor second;
  second.column = "second";
  second.reads = SensorKind::load;
  second.element = 1;
  second.row = {per_force, 0, per_torque};
  rig.sensors = {second};
  return rig;
}

/// exp(-zeta omega t) cos(sqrt(1 - zeta^2) omega t + phase)
VectorXd decay(Index samples, double omega, double zeta, double phase) {
  return VectorXd::NullaryExpr(samples, [&](Index k) {
    const double t = dt * static_cast<double>(k);
    return std::exp(-zeta * omega * t) * std::cos(std::sqrt(1 - zeta * zeta) * omega * t + phase);
  });
}

struct Truth {
  double normal = 0.81, torsion = 1.1, normal_damping = 0.006, torsion_damping = 0.015;
};

/// Both bridges of a rig that was let go from a force beside its pitch axis.
unrig::Run decay_of_both(const Truth& truth, Index samples) {
  unrig::Run run;
  run.file = "decay.csv";
  run.kind = RunKind::pluck;
  run.medium = "air";
  run.dt = dt;
  std::mt19937_64 random(2611);
  std::normal_distribution<double> normal(0, noise);
  const auto with_noise = [&](VectorXd y) {
    for (double& value : y) value += normal(random);
    return y;
  };
  const VectorXd force = 5 * decay(samples, std::sqrt(truth.normal * stiffness / mass), truth.normal_damping, 0.4);
  const VectorXd couple = 0.1 * decay(samples, std::sqrt(truth.torsion * torsional_stiffness / inertia), truth.torsion_damping, -0.7);
  run.channels = {{"gauge", "N", "N", 1, with_noise(force.array() + 1.5), 0}, {"second", "N", "N", 1, with_noise(per_force * force + per_torque * couple).array() - 0.2, 0}};
  return run;
}

const FittedParameter* found(const FitResult& result, const std::string& name) {
  for (const FittedParameter& p : result.parameters)
    if (p.name == name) return &p;
  return nullptr;
}

TEST(Bridges, TellTogetherWhatOneAloneDoesNot) {
  const Truth truth;
  FitProblem problem;
  problem.rig = balance();
  problem.runs = {decay_of_both(truth, 2500)};
  const FitResult both = fit(problem);
  ASSERT_TRUE(both.converged) << both.message;
  const auto check = [&](const char* name, double value) {
    const FittedParameter* p = found(both, name);
    ASSERT_NE(p, nullptr) << name;
    EXPECT_TRUE(p->identified) << name;
    EXPECT_LT(std::abs(p->value - value), 4 * p->std_error) << name << ": " << p->value << " +- " << p->std_error;
    EXPECT_LT(p->std_error, 0.05 * value) << name << ": errors too wide to be of use";
  };
  check("normal.stiffness_scale", truth.normal);
  check("torsion.stiffness_scale", truth.torsion);
  check("normal.damping_ratio", truth.normal_damping);
  check("torsion.damping_ratio", truth.torsion_damping);
  ASSERT_EQ(both.runs.size(), 1u);
  ASSERT_EQ(both.runs.front().channels.size(), 2u);
  for (const auto& channel : both.runs.front().channels) EXPECT_NEAR(channel.rms_residual / noise, 1, 0.06) << "of 2500 samples: a standard deviation of 1.4 %";

  problem.rig.sensors.clear();
  const FitResult gauge = fit(problem);
  const FittedParameter* torsion = found(gauge, "torsion.stiffness_scale");
  EXPECT_TRUE(torsion == nullptr || !torsion->identified) << "the gauge reads no torque";
  EXPECT_LT(found(both, "normal.stiffness_scale")->std_error, found(gauge, "normal.stiffness_scale")->std_error);
}

/// A bridge whose row is wrong by a tenth is no matter of noise.
TEST(Bridges, AWrongRowShows) {
  FitProblem problem;
  problem.rig = balance();
  problem.rig.sensors.front().row.per_force *= 1.1;
  problem.runs = {decay_of_both({}, 2500)};
  EXPECT_GT(fit(problem).runs.front().reduced_chi2(), 2);
}

}  // namespace
}  // namespace unrig
