#include "core/model/aeroelastic_model.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/run/motion.h"
#include "core/propagate/response.h"
#include "core/model/rigid_load.h"
#include "tests/support/sample_data.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using std::numbers::pi;
using Circulation = AeroelasticModel::Circulation;

constexpr double water = 998.2;
const std::vector<std::string> gauge{"gauge"};
const std::vector<std::string> every_channel{"gauge", "heave", "velocity", "acceleration", "twist", "twist_rate"};
const std::vector<std::string> every_channel_of_a_beam{"gauge", "heave", "velocity", "acceleration", "twist", "twist_rate", "bridge"};

Sensor sensor(const std::string& column, SensorKind reads, int element, double gain) {
  Sensor s;
  s.column = column;
  s.reads = reads;
  s.element = element;
  s.gain = gain;
  return s;
}

/// The seed's rig with a sensor of every kind.
const Rig& seed_rig() {
  static const Rig rig = [] {
    Rig r = read_rig(test::null_campaign("rig.toml"));
    r.sensors = {sensor("heave", SensorKind::displacement, 16, -1),
                 sensor("velocity", SensorKind::velocity, 16, -1),
                 sensor("acceleration", SensorKind::acceleration, 16, -1),
                 sensor("twist", SensorKind::twist, 13, 2),
                 sensor("twist_rate", SensorKind::twist_rate, 13, 2),
                 sensor("bridge", SensorKind::load, 5, 1)};
    r.sensors.back().row = {0.3, -0.7, 1.6};
    return r;
  }();
  return rig;
}

AeroelasticModel seed_model(Index normal_modes = 3, Index torsion_modes = 1, Wagner circulation = Wagner::jones,
                            Circulation build_up = Circulation::given) {
  return {seed_rig(), make_basis(seed_rig(), normal_modes, torsion_modes), wagner(circulation), build_up};
}

Rig modal_rig() {
  Rig rig;
  rig.name = "two modes";
  rig.modal = {{1.5, 7, 0.01, 1000, "N"}, {0.4, 31, 0.03, -200, "N"}};
  return rig;
}

Conditions still(double density = water) {
  Conditions c;
  c.density = density;
  return c;
}

Conditions stream(double speed, bool pitch = true) {
  Conditions c;
  c.density = water;
  c.speed = speed;
  c.prescribed_pitch = pitch;
  return c;
}

VectorXd theta_with(const AeroelasticModel& model, std::initializer_list<std::pair<const char*, double>> values) {
  VectorXd theta = model.start_values();
  for (const auto& [name, value] : values) theta[model.index(name)] = value;
  return theta;
}

MatrixXd outputs(const LinearSystem& system, const VectorXd& start, Index samples, double dt, const VectorXd& jerk = {}, const MatrixXd& input = {}) {
  return drive(system, exact_step(system, dt), DualMatrix(MatrixXd(start)), samples, jerk, input, Partials::none).output;
}

VectorXd at_rest(const LinearSystem& system) { return VectorXd::Zero(system.states()); }

/// A smooth turn of the shaft by `step` from sample `at` on over `rise` samples.
VectorXd turn(Index samples, Index at, Index rise, double step) {
  VectorXd c = VectorXd::Zero(samples);
  for (Index k = at; k < samples; ++k) {
    const double s = std::min(1.0, static_cast<double>(k - at) / static_cast<double>(rise));
    c[k] = step * (s - std::sin(2 * pi * s) / (2 * pi));
  }
  return c;
}

// ---------------------------------------------------------------------------------------------------------------- laws

TEST(AeroelasticModel, NothingMovesWithoutACause) {
  const AeroelasticModel model = seed_model();
  for (const Conditions& c : {still(), stream(0.6)}) {
    const LinearSystem s = model.system(c, model.start_values(), every_channel);
    EXPECT_EQ(outputs(s, at_rest(s), 50, 0.002).norm(), 0);
  }
}

TEST(AeroelasticModel, AngleAloneIsNoCauseInStillWater) {
  const AeroelasticModel model = seed_model();
  const LinearSystem s = model.system(stream(0), model.start_values(), every_channel);
  VectorXd start = at_rest(s);
  start[s.motion] = 0.1;
  const MatrixXd y = outputs(s, start, 200, 0.002);
  EXPECT_EQ(y.leftCols(4).norm(), 0);
  // Only the twist sensor sees it: it reads the angle of the section, prescribed and elastic.
  EXPECT_LT((y.col(4).array() - 2 * 0.1).matrix().norm(), 1e-14);
  EXPECT_EQ(y.col(5).norm(), 0);
}

TEST(AeroelasticModel, StillWaterIsTheLimitOfASlowStream) {
  const AeroelasticModel model = seed_model();
  const VectorXd theta = model.start_values();
  const auto at_rest_poles = oscillatory_poles(model.system(still(), theta, gauge));
  const auto shift = [&](double speed) {
    const auto poles = oscillatory_poles(model.system(stream(speed, false), theta, gauge));
    EXPECT_EQ(poles.size(), at_rest_poles.size());
    double largest = 0;
    for (std::size_t i = 0; i < poles.size(); ++i) largest = std::max(largest, std::abs(poles[i] - at_rest_poles[i]));
    return largest;
  };
  const double slow = shift(1e-3), slower = shift(1e-4);
  EXPECT_NEAR(slow / slower, 10, 0.1) << "the damping by the stream grows with the speed";
  EXPECT_LT(slower, 1e-2) << "of poles at 20 to 800 per second";
}

TEST(AeroelasticModel, EnergyDecaysByDampingAlone) {
  const AeroelasticModel model = seed_model();
  const Index n = model.basis().size();
  const VectorXd start = VectorXd::LinSpaced(2 * n, -1, 1);
  for (const double zeta : {0.0, 0.01}) {
    const VectorXd theta = theta_with(model, {{"normal.damping_ratio", zeta}, {"torsion.damping_ratio", zeta}, {"normal.stiffness_scale", 0.8},
                                              {"torsion.stiffness_scale", 1.3}, {"apparent_mass_coefficient", 1.2}});
    const UndampedSystem u = undamped_system(seed_rig(), model.basis(), water);
    const MatrixXd mass = u.mass + 1.2 * u.fluid_mass, stiffness = 0.8 * u.normal_stiffness + 1.3 * u.torsion_stiffness;
    LinearSystem s = model.system(still(), theta, gauge);
    s.C = DualMatrix(MatrixXd::Identity(2 * n, 2 * n));
    s.D = DualMatrix(MatrixXd(2 * n, 0));
    const MatrixXd states = outputs(s, start, 2000, 0.0005);
    const auto energy = [&](Index k) {
      const VectorXd x = states.row(k).head(n), v = states.row(k).tail(n);
      return 0.5 * (v.dot(mass * v) + x.dot(stiffness * x));
    };
    for (Index k = 1; k < 2000; ++k) {
      if (zeta == 0)
        ASSERT_NEAR(energy(k) / energy(0), 1, 1e-9) << "sample " << k;  // 2000 products, each with round-off of the stiffest mode
      else
        ASSERT_LT(energy(k), energy(k - 1)) << "sample " << k;
    }
  }
}

TEST(AeroelasticModel, MassAndStiffnessAreSymmetricAndPositive) {
  const Basis basis = make_basis(seed_rig(), Index{5}, Index{2});
  const UndampedSystem u = undamped_system(seed_rig(), basis, water);
  for (const MatrixXd* m : {&u.mass, &u.fluid_mass, &u.normal_stiffness, &u.torsion_stiffness})
    EXPECT_LT((*m - m->transpose()).norm(), 1e-14 * m->norm());
  EXPECT_EQ(MatrixXd(u.mass).llt().info(), Eigen::Success);
  EXPECT_EQ(MatrixXd(u.mass + u.fluid_mass).llt().info(), Eigen::Success);
  // Fluid on three strips cannot have more than six independent motions; none of them has a negative mass.
  const VectorXd fluid = Eigen::SelfAdjointEigenSolver<MatrixXd>(u.fluid_mass).eigenvalues();
  EXPECT_GT(fluid.minCoeff(), -1e-12 * fluid.maxCoeff());
}

TEST(AeroelasticModel, MoreApparentMassLowersEveryFrequency) {
  const AeroelasticModel model = seed_model();
  std::vector<double> before(model.basis().size(), 1e9);
  for (const double ca : {0.0, 0.5, 1.0, 1.5}) {
    const auto poles = oscillatory_poles(model.system(still(), theta_with(model, {{"apparent_mass_coefficient", ca}}), gauge));
    ASSERT_EQ(poles.size(), before.size());
    for (std::size_t i = 0; i < poles.size(); ++i) {
      EXPECT_LT(std::abs(poles[i]), before[i]) << "C_a " << ca << ", mode " << i + 1;
      before[i] = std::abs(poles[i]);
    }
  }
}

TEST(AeroelasticModel, PolesAreThoseOfTheUndampedSystemWithoutDamping) {
  const AeroelasticModel model = seed_model();
  const VectorXd theta = theta_with(model, {{"normal.damping_ratio", 0}, {"torsion.damping_ratio", 0}});
  const auto poles = oscillatory_poles(model.system(still(), theta, gauge));
  const VectorXd hertz = coupled_frequencies(seed_rig(), model.basis(), water);
  ASSERT_EQ(static_cast<Index>(poles.size()), hertz.size());
  for (std::size_t i = 0; i < poles.size(); ++i) {
    EXPECT_NEAR(poles[i].imag() / (2 * pi) / hertz[static_cast<Index>(i)], 1, 1e-10);
    EXPECT_NEAR(poles[i].real() / poles[i].imag(), 0, 1e-10);
  }
}

// ---------------------------------------------------------------------------------------------------------------- readings

/// What the gauge reads when everything has died away, per radian of the shaft: C (-A)^-1 A_p over the free states, and p itself.
double steady_reading(const AeroelasticModel& model, const VectorXd& theta) {
  const LinearSystem s = model.system(stream(0.6), theta, gauge);
  const Index n = s.free_states();
  const VectorXd x = -s.A.value.topLeftCorner(n, n).partialPivLu().solve(s.A.value.col(s.motion).head(n));
  return s.C.value.row(0).head(n) * x + s.C.value(0, s.motion);
}

TEST(AeroelasticModel, SteadyLoadReadsTheSameWithAnyNumberOfModes) {
  // The lift stands at the quarter chord, which is the pitch axis of this rig: it does not twist it, and each strip carries
  // s rho U^2 b l. The gauge reads its moment over the lever of the calibration.
  const Rig& rig = seed_rig();
  const double at_gauge = rig.station[rig.gauge_element - 1], lever = rig.station[rig.calibration_element - 1] - at_gauge;
  double expected = 0;
  for (const int element : rig.submerged)
    expected += 2 * pi * water * 0.6 * 0.6 * rig.semichord() * rig.strip_length * (rig.station[element - 1] - at_gauge) / lever;
  for (const Index modes : {1, 2, 3, 5, 8}) {
    const AeroelasticModel model = seed_model(modes);
    EXPECT_NEAR(steady_reading(model, model.start_values()) / expected, 1, 1e-10) << modes << " normal modes";  // condition of A: omega^2 of the last
  }
}

TEST(AeroelasticModel, StandsAsItsFlexibilitySaysUnderASteadyForce) {
  Rig rig = seed_rig();
  const Index all = chain_modes(rig.normal).omega.size(), c = rig.calibration_element - 1;
  const AeroelasticModel model(rig, make_basis(rig, all, 1), wagner(Wagner::jones));
  Conditions conditions = still();
  conditions.force = true;
  const LinearSystem s = model.system(conditions, theta_with(model, {{"normal.stiffness_scale", 0.8}}), {"gauge", "heave"});
  const VectorXd x = -s.A.value.partialPivLu().solve(s.B.value.col(0));
  const VectorXd y = s.C.value * x + s.D.value.col(0);
  EXPECT_NEAR(y[0], 1, 1e-9) << "the gauge is calibrated by dead weights at this station";
  // The modes that rounding has made up of the printed matrix are left out: its digits, 5e-4.
  EXPECT_NEAR(-y[1] / (rig.normal.flexibility(15, c) / 0.8), 1, 5e-4);
}

TEST(AeroelasticModel, VelocityAndAccelerationAreTheSlopesOfDisplacement) {
  const AeroelasticModel model = seed_model();
  for (const bool shaken : {false, true}) {
    Conditions conditions = stream(0.6);
    conditions.mount = shaken;
    const LinearSystem s = model.system(conditions, model.start_values(), every_channel);
    constexpr Index samples = 400;
    const auto run = [&](double dt) {
      // The same motion at every step size: turn of 0.05 s, mount moving with 3 Hz.
      const auto at = static_cast<Index>(std::round(0.02 / dt)), rise = static_cast<Index>(std::round(0.05 / dt));
      const Motion motion = motion_of(turn(samples, at, rise, 0.03), dt);
      MatrixXd input = MatrixXd::Zero(shaken ? samples + 1 : 0, shaken ? 4 : 0);  // straight between samples
      for (Index k = 0; k < input.rows(); ++k) {
        const double t = 2 * pi * 3 * dt * static_cast<double>(k);
        input.row(k).head(2) << 0.01 * (1 - std::cos(t)), 0.01 * 2 * pi * 3 * std::sin(t);
      }
      return outputs(s, at_rest(s), samples, dt, motion.jerk, input);
    };
    const double dt = 2e-4;
    const MatrixXd y = run(dt);
    // The mount's displacement is no state, so that a displacement is relative to it; velocity and acceleration count it.
    const auto miss = [&](Index value, Index slope, double known) {
      double largest = 0;
      for (Index k = 1; k + 1 < samples; ++k) {
        const double t = 2 * pi * 3 * dt * static_cast<double>(k);
        const double mount = shaken ? known * 0.01 * (1 - std::cos(t)) : 0;
        largest = std::max(largest, std::abs((y(k + 1, value) - y(k - 1, value)) / (2 * dt) + mount - y(k, slope)));
      }
      return largest / y.col(slope).cwiseAbs().maxCoeff();
    };
    // Central differences miss (omega dt)^2 / 6 of the stiffest mode, 140 Hz: 0.5 %.
    EXPECT_LT(miss(1, 2, -1), 0.005) << "heave, gain -1, mount " << shaken;
    EXPECT_LT(miss(2, 3, 0), 0.01);
    EXPECT_LT(miss(4, 5, 0), 0.005);
  }
}

TEST(AeroelasticModel, AVeryStiffRigReadsTheRigidLoad) {
  const Rig& rig = seed_rig();
  const AeroelasticModel model = seed_model(3, 1, Wagner::within_1e4);
  const double dt = 0.002, at_gauge = rig.station[rig.gauge_element - 1], lever = rig.station[rig.calibration_element - 1] - at_gauge;
  constexpr Index samples = 300, rise = 20;
  const Conditions conditions = stream(0.6);
  const MotionBasis basis(samples, {{{40, 40 + rise}, 1}});
  const VectorXd u = turn(rise + 1, 0, rise, 0.03);
  const Motion motion = motion_of(basis.coefficients(u), dt);

  // Load of the fluid, even over the strips, and the inertia of mass centres that the shaft carries around.
  double strips = 0, moment = 0;
  for (const int element : rig.submerged) strips += (rig.station[element - 1] - at_gauge) / lever / static_cast<double>(rig.submerged.size());
  for (Index i = 0; i < rig.station.size(); ++i)
    moment += rig.normal.inertia[i] * rig.mass_centre[i] * std::max(0.0, rig.station[i] - at_gauge) / lever;
  const VectorXd theta = theta_with(model, {{"apparent_mass_coefficient", 1.1}, {"normal_force_slope", 5.9}});
  const VectorXd expected = strips * rigid_load(model, conditions, theta, basis, dt, u).normal_force + moment * motion.acceleration;

  const auto miss = [&](double scale) {
    VectorXd stiff = theta;
    stiff[model.index("normal.stiffness_scale")] = stiff[model.index("torsion.stiffness_scale")] = scale;
    const LinearSystem s = model.system(conditions, stiff, gauge);
    return (outputs(s, at_rest(s), samples, dt, motion.jerk).col(0) - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff();
  };
  const double stiff = miss(1e6), stiffer = miss(1e8);
  EXPECT_LT(stiffer, 1e-3);
  EXPECT_LT(stiffer, 0.15 * stiff) << "what is left falls with the period of the rig at least, that is with the root of its stiffness";
}

// ---------------------------------------------------------------------------------------------------------------- slopes

/// Row by row: entries of different units differ by many powers of ten.
void expect_slopes(const AeroelasticModel& model, const Conditions& conditions, const std::vector<std::string>& channels) {
  VectorXd theta = model.start_values();
  if (!model.rig().is_modal())
    theta.head(6) << 0.79, 0.8, 0.008, 0.027, 1.12, 5.86;  // off the start values, where partials may vanish by chance
  const LinearSystem here = model.system(conditions, theta, channels);
  for (Index j = 0; j < theta.size(); ++j) {
    const auto moved = [&](double h) { return model.system(conditions, theta + h * VectorXd::Unit(theta.size(), j), channels); };
    const double step = 1e-2 * std::max(1.0, std::abs(theta[j]));
    const LinearSystem up = moved(step);
    const auto check = [&](auto part, const char* name) {
      const DualMatrix& m = part(here);
      const MatrixXd partial = m.depends_on(j) ? m.d(j) : MatrixXd::Zero(m.rows(), m.cols());
      for (Index i = 0; i < m.rows(); ++i) {
        const MatrixXd slope = partial.row(i);
        const bool moves = (part(up).value.row(i) - m.value.row(i)).norm() > 1e-12 * m.value.row(i).norm();
        if (!moves) {
          EXPECT_LE(slope.norm() * step, 1e-11 * m.value.row(i).norm()) << name << " row " << i << ", " << model.parameters()[static_cast<std::size_t>(j)].name;
          continue;
        }
        EXPECT_TRUE(test::is_slope([&](double h) { return MatrixXd(part(moved(h)).value.row(i)); }, slope, step, 5e-14))
            << name << " row " << i << ", " << model.parameters()[static_cast<std::size_t>(j)].name;
      }
    };
    check([](const LinearSystem& s) -> const DualMatrix& { return s.A; }, "A");
    check([](const LinearSystem& s) -> const DualMatrix& { return s.B; }, "B");
    check([](const LinearSystem& s) -> const DualMatrix& { return s.C; }, "C");
    check([](const LinearSystem& s) -> const DualMatrix& { return s.D; }, "D");
  }
}

TEST(AeroelasticModel, CarriesItsSlopesInStillWater) {
  Conditions c = still();
  c.force = c.mount = true;
  expect_slopes(seed_model(), c, every_channel_of_a_beam);
}

TEST(AeroelasticModel, CarriesItsSlopesInAStream) {
  Conditions c = stream(0.6);
  c.force = c.mount = true;
  expect_slopes(seed_model(), c, every_channel_of_a_beam);
}

TEST(AeroelasticModel, CarriesItsSlopesWithFreeCirculation) {
  expect_slopes(seed_model(2, 1, Wagner::jones, Circulation::free), stream(0.6), gauge);
}

/// Two modes and a sensor of every kind.
Rig modal_rig_with_sensors() {
  Rig rig = modal_rig();
  rig.sensors = seed_rig().sensors;
  rig.sensors.pop_back();
  rig.modal[0].sensor_shape = {1, 0.9, 0.8, 2, 2.5};
  rig.modal[1].sensor_shape = {-0.4, 0.5, -0.6, 3, 0};
  return rig;
}

TEST(AeroelasticModel, CarriesItsSlopesAsModesWithSensors) {
  Conditions c = still(0);
  c.force = c.mount = true;
  expect_slopes(AeroelasticModel(modal_rig_with_sensors(), {}, wagner(Wagner::jones)), c, every_channel);
}

TEST(AeroelasticModel, CarriesItsSlopesAsModes) {
  Conditions c = still(0);
  c.force = c.mount = true;
  expect_slopes(AeroelasticModel(modal_rig(), {}, wagner(Wagner::jones)), c, gauge);
}

// ---------------------------------------------------------------------------------------------------------------- modes alone

TEST(ModalModel, HasTheFrequencyDampingAndGainOfItsModes) {
  const AeroelasticModel model(modal_rig(), {}, wagner(Wagner::jones));
  Conditions c = still(0);
  c.force = true;
  const LinearSystem s = model.system(c, model.start_values(), gauge);
  const auto poles = oscillatory_poles(s);
  ASSERT_EQ(poles.size(), 2u);
  EXPECT_NEAR(std::abs(poles[0]) / (2 * pi), 7, 1e-12);
  EXPECT_NEAR(-poles[1].real() / std::abs(poles[1]), 0.03, 1e-12);
  const VectorXd x = -s.A.value.partialPivLu().solve(s.B.value.col(0));
  const double stiff1 = 1.5 * std::pow(2 * pi * 7, 2), stiff2 = 0.4 * std::pow(2 * pi * 31, 2);
  EXPECT_NEAR((s.C.value * x)(0), 1000 / stiff1 - 200 / stiff2, 1e-12);
}

TEST(ModalModel, AMountThatAcceleratesIsAForceTheOtherWay) {
  const AeroelasticModel model(modal_rig(), {}, wagner(Wagner::jones));
  Conditions c = still(0);
  c.force = c.mount = true;
  const LinearSystem s = model.system(c, model.start_values(), gauge);
  EXPECT_LT((s.B.value.col(2).segment(2, 2) + Eigen::Vector2d(1, 1)).norm(), 1e-14) << "m q'' = -m a at the start values";
  EXPECT_LT((s.B.value.col(0).segment(2, 2) - Eigen::Vector2d(1 / 1.5, 1 / 0.4)).norm(), 1e-14);
}

/// A rate is the slope of what it is the rate of, under a force that is smooth; here all sensors sit in one place.
TEST(ModalModel, RatesAndAccelerationsOfSensorsAreSlopes) {
  Rig rig = modal_rig_with_sensors();
  for (ModalMode& m : rig.modal) std::fill(m.sensor_shape.begin(), m.sensor_shape.end(), m.sensor_shape.front());
  for (Sensor& s : rig.sensors) s.gain = 1;
  const AeroelasticModel model(rig, {}, wagner(Wagner::jones));
  Conditions c = still(0);
  c.force = true;
  constexpr double dt = 1e-4;
  constexpr Index n = 2000;
  MatrixXd force(n + 1, 2);
  for (Index k = 0; k <= n; ++k) {
    const double wave = std::cos(20 * dt * static_cast<double>(k));
    force.row(k) << 1 - wave, 400 * wave;  // and its second derivative
  }
  const LinearSystem s = model.system(c, model.start_values(), every_channel);
  const MatrixXd y = drive(s, exact_step(s, dt), DualMatrix(MatrixXd::Zero(4, 1)), n, {}, force, Partials::none).output;
  const auto slope = [&](Index column) -> VectorXd { return (y.col(column).tail(n - 2) - y.col(column).head(n - 2)) / (2 * dt); };
  const auto misses = [&](Index of, Index rate) { return (slope(of) - y.col(rate).segment(1, n - 2)).cwiseAbs().maxCoeff() / y.col(rate).cwiseAbs().maxCoeff(); };
  const double second_order = std::pow(2 * pi * 31 * dt, 2);  // of the central difference, at the higher mode's frequency
  EXPECT_LT(misses(1, 2), second_order);
  EXPECT_LT(misses(2, 3), second_order);
  EXPECT_LT(misses(4, 5), second_order);
}

/// A mode much stiffer than the motion is slow: the sensor goes with the mount.
TEST(ModalModel, ASensorIsCarriedAlongByTheMount) {
  const AeroelasticModel model(modal_rig_with_sensors(), {}, wagner(Wagner::jones));
  Conditions c = still(0);
  c.mount = true;
  const LinearSystem s = model.system(c, model.start_values(), every_channel);
  const RowVectorXd from_rest = s.D.value.col(0).transpose();
  EXPECT_EQ(from_rest, (RowVectorXd(6) << 0, 0, -1, 0, 0, 0).finished()) << "the gain of the velocity is -1";
  // Both modes have their mass as participation: at once they are left behind by the mount's acceleration, by shape each.
  EXPECT_NEAR(s.D.value(3, 1), -1 * (1 - 0.8 + 0.6), 1e-14);
}

// ---------------------------------------------------------------------------------------------------------------- channels

TEST(AeroelasticModel, NamesTheParameterThatItDoesNotHave) {
  try {
    seed_model().index("normal.stifness_scale");
    FAIL() << "no error";
  } catch (const std::out_of_range& error) {
    EXPECT_NE(std::string(error.what()).find("normal.stifness_scale"), std::string::npos);
  }
}

unrig::Run run_with(const std::vector<std::string>& columns) {
  unrig::Run run;
  run.file = "some.csv";
  run.dt = 0.01;
  run.kind = RunKind::pluck;
  for (const std::string& column : columns) {
    const std::string unit = column == "gauge" ? "N" : column == "heave" ? "m" : column == "strain" || column == "note" ? "1" : "rad";
    run.channels.push_back({column, unit, unit, 1, VectorXd::Zero(10), 0});
  }
  return run;
}

/// There was a row before the first once.
TEST(AeroelasticModel, AForceOnARigWithoutAGaugeActsAtItsFirstElement) {
  Rig rig = seed_rig(), loaded = rig;
  rig.gauge_element = rig.calibration_element = loaded.gauge_element = 0;
  loaded.calibration_element = 1;
  Conditions c = still();
  c.force = true;
  const auto pushed = [&](const Rig& r) {
    const AeroelasticModel model(r, make_basis(r, Index{3}, Index{1}), wagner(Wagner::jones));
    return MatrixXd(model.system(c, model.start_values(), {"heave"}).B.value);
  };
  EXPECT_EQ(pushed(rig), pushed(loaded));
  EXPECT_GT(pushed(rig).norm(), 0);
}

TEST(AeroelasticModel, FitsTheGaugeAndEverySensorThatTheRunHas) {
  const AeroelasticModel model = seed_model();
  EXPECT_EQ(model.output_channels(run_with({"alpha", "gauge", "twist", "note"})), (std::vector<std::string>{"gauge", "twist"}));
  EXPECT_EQ(model.output_channels(run_with({"heave"})), (std::vector<std::string>{"heave"}));
  try {
    model.output_channels(run_with({"alpha", "strain"}));
    FAIL() << "no error";
  } catch (const InputError& error) {
    const std::string text = error.what();
    for (const char* part : {"some.csv", "'gauge'", "'heave'", "rig.toml"}) EXPECT_NE(text.find(part), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace unrig
