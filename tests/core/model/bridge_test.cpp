#include "core/rig/bridge.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/model/aeroelastic_model.h"
#include "tests/support/sample_data.h"

// What a bridge with a row of a calibration matrix reads.

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double water = 998.2, speed = 0.6;

Conditions in_a_stream() {
  Conditions c;
  c.density = water;
  c.speed = speed;
  c.prescribed_pitch = true;
  return c;
}

Sensor bridge(int element, CalibrationRow row) {
  Sensor s;
  s.column = "bridge";
  s.reads = SensorKind::load;
  s.element = element;
  s.row = row;
  return s;
}

/// Loads outboard, inertial ones included, are what the undamped shaft transmits: elastic forces A^-1 w of its elements, whatever acts and moves. Needs every mode.
TEST(Bridge, ReadsWhatTheShaftTransmits) {
  Rig rig = read_rig(test::source_path("sample_data/seed/rig_from_drawings.toml"));
  const Modes normal = chain_modes(rig.normal), torsion = chain_modes(rig.torsion);
  ASSERT_EQ(normal.omega.size(), rig.station.size());
  ASSERT_EQ(torsion.omega.size(), rig.torsion.inertia.size());
  Conditions conditions = in_a_stream();
  conditions.force = conditions.mount = true;
  for (const int element : {2, 7, 12})
    for (const CalibrationRow& row : {CalibrationRow{1, 0, 0}, CalibrationRow{0, 1, 0}, CalibrationRow{0, 0, 1}, CalibrationRow{0.5, -2, 3}}) {
      rig.sensors = {bridge(element, row)};
      const AeroelasticModel model(rig, make_basis(rig, normal.omega.size(), torsion.omega.size()), wagner(Wagner::jones));
      const double kn = 0.8, kt = 0.9;
      VectorXd theta = model.start_values();
      for (const auto& [name, value] : {std::pair{"normal.stiffness_scale", kn}, {"torsion.stiffness_scale", kt}, {"normal.damping_ratio", 0.0}, {"torsion.damping_ratio", 0.0}, {"apparent_mass_coefficient", 1.1}}) theta[model.index(name)] = value;
      const LinearSystem s = model.system(conditions, theta, {"bridge"});
      const MatrixXd forces = kn * rig.normal.flexibility.llt().solve(model.basis().normal), couples = kt * rig.torsion.flexibility.llt().solve(model.basis().torsion_chain);
      RowVectorXd expected = RowVectorXd::Zero(s.states());
      for (Index i = element; i < rig.station.size(); ++i) expected.head(s.coordinates) += (row.per_force + row.per_bending_moment * (rig.station[i] - rig.station[element - 1])) * forces.row(i);
      for (Index j = element; j < rig.torsion.inertia.size(); ++j) expected.head(s.coordinates) += row.per_torque * couples.row(j);
      // Rounding, 2e-16, times the ratio of squared frequencies up to which modes are kept, 1e9 (chain_modes): each coordinate by itself, since stiff modes read far more than soft ones.
      constexpr double rounding = 1e-6;
      const RowVectorXd read = s.C.value.row(0);
      const double most = expected.cwiseAbs().maxCoeff();
      for (Index i = 0; i < s.coordinates; ++i) EXPECT_NEAR(read[i], expected[i], rounding * std::max(std::abs(expected[i]), rounding * most)) << element << ", coordinate " << i;
      EXPECT_LT(read.tail(s.states() - s.coordinates).cwiseAbs().maxCoeff(), 1e-3 * rounding * most) << element;
      EXPECT_LT(s.D.value.cwiseAbs().maxCoeff(), 1e-3 * rounding * most) << element;
    }
}

TEST(Bridge, InTheGaugesPlaceReadsWhatTheGaugeReads) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  const double lever = rig.station[rig.calibration_element - 1] - rig.station[rig.gauge_element - 1];
  rig.sensors = {bridge(rig.gauge_element, {0, 1 / lever, 0})};
  const AeroelasticModel model(rig, make_basis(rig, Index{3}, Index{1}), wagner(Wagner::jones));
  Conditions conditions = in_a_stream();
  conditions.force = conditions.mount = true;
  const LinearSystem s = model.system(conditions, model.start_values(), {"gauge", "bridge"});
  EXPECT_GT(s.C.value.row(0).norm(), 0);
  EXPECT_LT((s.C.value.row(0) - s.C.value.row(1)).norm(), 1e-14 * s.C.value.row(0).norm());
  EXPECT_LT((s.D.value.row(0) - s.D.value.row(1)).norm(), 1e-14 * s.D.value.row(0).norm());
}

/// A steady circulatory load acts at the quarter chord: what it bends and twists of a bridge inboard of the strips is their sum and its arm.
TEST(Bridge, ReadsTheSteadyLoadAtTheQuarterChord) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.pitch_axis = 0.4;
  const double expected = 2 * pi * water * speed * speed * rig.semichord() * rig.strip_length * 3, arm = 0.15 * rig.chord;
  const auto steady = [&](CalibrationRow row) {
    rig.sensors = {bridge(3, row)};
    const AeroelasticModel model(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
    VectorXd theta = model.start_values();
    theta[model.index("normal.stiffness_scale")] = theta[model.index("torsion.stiffness_scale")] = 1e9;  // twist adds no angle
    const LinearSystem s = model.system(in_a_stream(), theta, {"bridge"});
    const Index free = s.free_states();
    const VectorXd x = -s.A.value.topLeftCorner(free, free).partialPivLu().solve(s.A.value.col(s.motion).head(free));
    return s.C.value(0, s.motion) + s.C.value.row(0).head(free).dot(x);
  };
  // A stiffness of 1e9 leaves a twist of 1e-9 of what the rig has, which is below 1e-2.
  EXPECT_NEAR(steady({1, 0, 0}) / expected, 1, 1e-6);
  EXPECT_NEAR(steady({0, 0, 1}) / (expected * arm), 1, 1e-6);
}

}  // namespace
}  // namespace unrig
