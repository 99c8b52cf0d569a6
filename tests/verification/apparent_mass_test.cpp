// Apparent mass, apparent inertia and centrifugal force (Eq. 2.11 to 2.15) out of the coupled model, for a rigid section in heave and pitch
// on springs, and for the loads of a rigid rig.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <numbers>

#include "core/model/rigid_system.h"
#include "tests/verification/seed.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double density = 1000, b = 0.1, length = 0.7, U = 2.5;
constexpr double apparent = pi * density * b * b * length;  // kg
constexpr double round_off = 1e-12;

/// One element that heaves, one that twists; mass and inertia of one so that modal and physical coordinates are the same.
AeroelasticModel section(double pitch_axis) {
  Rig rig;
  rig.name = "section";
  rig.chord = 2 * b;
  rig.pitch_axis = pitch_axis;
  rig.station = VectorXd::Ones(1);
  rig.mass_centre = VectorXd::Zero(1);
  rig.normal = {VectorXd::Ones(1), MatrixXd::Constant(1, 1, 1e-3), {}, 1};
  rig.torsion = {VectorXd::Ones(1), MatrixXd::Constant(1, 1, 1e-2), {}, 1};
  rig.rigid_from = 1;
  rig.submerged = {1};
  rig.strip_length = length;
  return {rig, make_basis(rig, Index{1}, Index{1}), wagner(Wagner::jones)};
}

/// Position of the pitch axis in semichords aft of mid-chord.
constexpr double axes[] = {-0.5, -0.2, 0, 0.3};

TEST(ApparentMass, StandsInTheMassMatrix) {
  for (const double a : axes) {
    const AeroelasticModel model = section((1 + a) / 2);
    const UndampedSystem u = undamped_system(model.rig(), model.basis(), density);
    // N_app = -m (h'' + a b theta'') at mid-chord, which is a b aft of the axis, and the couple -m b^2/8 theta''.
    const Matrix2d expected{{apparent, apparent * a * b}, {apparent * a * b, apparent * b * b * (1.0 / 8 + a * a)}};
    EXPECT_LT((u.fluid_mass - expected).cwiseAbs().maxCoeff(), round_off * apparent) << "axis " << a;
    EXPECT_LT((u.mass - Matrix2d::Identity()).cwiseAbs().maxCoeff(), round_off);
  }
}

TEST(ApparentMass, IsWhatASystemInTheFluidAcceleratesWith) {
  // x'' = -(I + C_a fluid)^-1 K x: from the state matrix that every command uses, and for another C_a than 1.
  for (const double a : axes) {
    const AeroelasticModel model = section((1 + a) / 2);
    VectorXd theta = undamped(model);
    theta[model.index("apparent_mass_coefficient")] = 1.2;
    const LinearSystem system = model.system({density, 0, false, false, false}, theta, {});
    const Matrix2d stiffness = Eigen::Vector2d(1e3, 1e2).asDiagonal();
    const Matrix2d mass = -stiffness * system.A.value.block(2, 0, 2, 2).inverse();
    const Matrix2d expected{{1 + 1.2 * apparent, 1.2 * apparent * a * b},
                            {1.2 * apparent * a * b, 1 + 1.2 * apparent * b * b * (1.0 / 8 + a * a)}};
    EXPECT_LT((mass.transpose() - expected).cwiseAbs().maxCoeff(), 1e-10 * apparent) << "axis " << a << "; two inversions";
  }
}

TEST(CentrifugalForce, ActsAtTheThreeQuarterChord) {
  // With no circulation (slope 0) what is left of the rates is m U theta', and its moment -(1/2 - a) b about the axis (Eq. 2.12, 2.15).
  for (const double a : axes) {
    const AeroelasticModel model = section((1 + a) / 2);
    VectorXd theta = undamped(model);
    theta[model.index("normal_force_slope")] = 0;
    theta[model.index("apparent_mass_coefficient")] = 0;  // accelerations are forces then: unit mass
    const LinearSystem system = model.system({density, U, true, false, false}, theta, {});
    const double force = apparent * U, moment = -(0.5 - a) * b * force;
    for (const Index rate : {Index{3}, system.motion + 1}) {  // of the elastic twist, and of the shaft
      EXPECT_NEAR(system.A.value(2, rate), force, round_off * force);
      EXPECT_NEAR(system.A.value(3, rate), moment, round_off * force);
    }
    EXPECT_NEAR(system.A.value(2, 2), 0, round_off * force) << "heave";
    EXPECT_NEAR(system.A.value(3, 2), 0, round_off * force);
  }
}

TEST(Circulation, ActsAtTheQuarterChord) {
  for (const double a : axes) {
    const AeroelasticModel model = section((1 + a) / 2);
    VectorXd theta = undamped(model), without = theta;
    without[model.index("normal_force_slope")] = 0;
    const Conditions conditions{density, U, true, false, false};
    const UndampedSystem u = undamped_system(model.rig(), model.basis(), density);
    const MatrixXd force = (u.mass + u.fluid_mass) *
                           (model.system(conditions, theta, {}).A.value - model.system(conditions, without, {}).A.value).middleRows(2, 2);
    const double steady = 2 * pi * density * U * U * b * length;  // per radian (Eq. 2.1)
    const Index p = force.cols() - 3;
    EXPECT_NEAR(force(0, p), 0.5 * steady, 1e-9 * steady) << "half of it at once; the mass matrix cancels";
    EXPECT_NEAR(force(0, p + 1), 0.5 * steady * (0.5 - a) * b / U, 1e-9 * steady) << "downwash at the three-quarter chord (Eq. 2.6)";
    EXPECT_NEAR(force(0, 2), -0.5 * steady / U, 1e-9 * steady) << "heave towards positive force is a downwash of its own";
    const VectorXd arm = force.row(1) - (0.5 + a) * b * force.row(0);
    EXPECT_LT(arm.cwiseAbs().maxCoeff(), 1e-9 * steady) << "axis " << a;
  }
}

TEST(RigidRig, LoadsAreEquations211To215) {
  for (const double a : axes) {
    const AeroelasticModel model = section((1 + a) / 2);
    VectorXd theta = undamped(model);
    theta[model.index("normal_force_slope")] = 0;
    theta[model.index("apparent_mass_coefficient")] = 1.1;
    const LinearSystem rigid = rigid_system(model, {density, U, true, false, false}, theta);
    const Index rate = rigid.motion + 1, acceleration = rigid.motion + 2;
    EXPECT_NEAR(rigid.C.value(1, rate), apparent * U, round_off * apparent * U);
    EXPECT_NEAR(rigid.C.value(1, acceleration), -1.1 * apparent * a * b, round_off * apparent);
    EXPECT_NEAR(rigid.C.value(2, rate), -(0.5 - a) * b * apparent * U, round_off * apparent);
    EXPECT_NEAR(rigid.C.value(2, acceleration), -1.1 * apparent * b * b * (1.0 / 8 + a * a), round_off * apparent);
  }
}

}  // namespace
}  // namespace unrig::seed
