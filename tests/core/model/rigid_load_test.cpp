#include "core/model/rigid_load.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <string>

#include "core/files/csv_table.h"
#include "core/files/text_file.h"
#include "tests/support/sample_data.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

struct TrueRun {
  const char* name;
  double slope;  ///< KEY.json, runs, cna
};

/// KEY.json, null, truth.
constexpr double true_apparent_mass = 1.1219030719225085;
constexpr TrueRun true_runs[] = {{"step_a", 5.863641575002156}, {"step_b", 5.863641575002156}, {"step_c", 3.5523042648357173}, {"heldout", 5.863641575002156}};

VectorXd column(const CsvTable& table, const std::string& name) {
  for (const CsvColumn& c : table.columns)
    if (c.name == name) return c.value;
  ADD_FAILURE() << "no column " << name;
  return {};
}

AeroelasticModel model_of_null(Wagner circulation, AeroelasticModel::Circulation build_up = AeroelasticModel::Circulation::given) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  return {rig, make_basis(rig, Index{1}, Index{1}), wagner(circulation), build_up};
}

VectorXd theta_of(const AeroelasticModel& model, double slope) {
  VectorXd theta = model.start_values();
  theta[model.index("apparent_mass_coefficient")] = true_apparent_mass;
  theta[model.index("normal_force_slope")] = slope;
  return theta;
}

TEST(RigidLoad, IsThatOfTheSimulatedCampaign) {
  // The simulator's shaft follows a cubic spline through the samples of the angle, which are written to 5e-6 deg = 8.7e-8 rad. Rounding stays in
  // the circulation as it is, and enters the apparent mass by its second difference over dt^2:
  // pi rho b^2 L C_a b/2 = 0.83 N s^2 x 8.7e-8 x 12 / 4e-6 s^2 (the most that an interpolating spline makes of it) = 0.2 N.
  // Circulation: what is left, up to 7.1e-4 of the change, ripples slowly like the best sum of four exponentials (7.3e-4 of its end), with which the
  // simulator seems to build circulation up.
  const AeroelasticModel model = model_of_null(Wagner::within_1e6);
  for (const TrueRun& truth : true_runs) {
    const std::string file = test::null_campaign(std::string("truth_") + truth.name + ".csv");
    const std::string text = read_text(file);
    const CsvTable table = read_csv(text, 1, file);
    const unrig::Run run = read_run(test::null_campaign(std::string(truth.name) + ".csv"));
    const VectorXd angle = column(table, "alpha") * (pi / 180), circulatory = column(table, "circulatory"), normal_force = column(table, "normal_force");

    // The spline through the samples: knots wherever the angle moves, and some beyond.
    Index first = 0, last = angle.size() - 1;
    while (angle[first] == angle[0]) ++first;
    while (angle[last] == angle[angle.size() - 1]) --last;
    const MotionBasis motion(angle.size(), {{{first - 24, last + 20}, 1}});
    const Interval window{first - 30, last + 30};
    const MatrixXd columns = motion.angle_columns(window);
    const VectorXd u = columns.colPivHouseholderQr().solve((angle.segment(window.first, window.length()).array() - angle[0]).matrix());

    const RigidLoad load = rigid_load(model, conditions_of(run), theta_of(model, truth.slope), motion, run.dt, u);
    const VectorXd miss = load.circulatory.array() + circulatory[0] - circulatory.array();
    const VectorXd whole = load.normal_force.array() + normal_force[0] - normal_force.array();
    const double change = circulatory[angle.size() - 1] - circulatory[0];
    EXPECT_LT(miss.cwiseAbs().maxCoeff(), 8e-4 * std::abs(change)) << truth.name << ", of a change by " << change << " N";
    EXPECT_LT(whole.cwiseAbs().maxCoeff(), 0.2) << truth.name << ", of a peak of " << (normal_force.array() - normal_force[0]).abs().maxCoeff() << " N";
  }
}

TEST(RigidLoad, CarriesItsSlopes) {
  const AeroelasticModel model = model_of_null(Wagner::jones, AeroelasticModel::Circulation::free);
  const double dt = 0.002;
  const MotionBasis motion(80, {{{10, 14}, 1}, {{40, 46}, 2}});
  const VectorXd u = VectorXd::LinSpaced(motion.unknowns(), -0.01, 0.02), theta = theta_of(model, 5.9);
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  const RigidLoad load = rigid_load(model, conditions, theta, motion, dt, u);

  for (const char* name : {"normal_force_slope", "apparent_mass_coefficient", "circulation.amplitude[1]", "circulation.amplitude[2]", "normal.stiffness_scale"}) {
    const Index j = model.index(name);
    const auto moved = [&](double h) { return rigid_load(model, conditions, theta + h * VectorXd::Unit(theta.size(), j), motion, dt, u); };
    EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).circulatory; }, load.circulatory_by_theta.col(j), 1e-2)) << name;
    EXPECT_TRUE(test::is_slope([&](double h) { return moved(h).normal_force; }, load.normal_force_by_theta.col(j), 1e-2)) << name;
  }
  // The load is linear in the motion.
  EXPECT_LT((load.circulatory_by_motion * u - load.circulatory).norm(), 1e-9 * load.circulatory.norm());
  EXPECT_LT((load.normal_force_by_motion * u - load.normal_force).norm(), 1e-9 * load.normal_force.norm());
}

/// A motion in two parts, the second of which goes on from the first: as in one, and with the slopes of what the first hands on.
TEST(RigidLoad, GoesOnFromAnother) {
  const AeroelasticModel model = model_of_null(Wagner::jones, AeroelasticModel::Circulation::free);
  const double dt = 0.002;
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  const MotionBasis whole(300, {{{10, 30}, 1}, {{150, 170}, 1}}), first(120, {{{10, 30}, 1}}), second(180, {{{30, 50}, 1}});
  const VectorXd u = VectorXd::LinSpaced(whole.unknowns(), -0.01, 0.02), theta = theta_of(model, 5.9);
  const Index own = first.unknowns();
  const RigidLoad expected = rigid_load(model, conditions, theta, whole, dt, u);
  const RigidLoad begins = rigid_load(model, conditions, theta, first, dt, u.head(own));
  // As if the motion of the first part followed theta.
  const Eigen::MatrixXd follows = Eigen::MatrixXd::Random(own, theta.size());
  const RigidLoad goes_on = rigid_load(model, conditions, theta, second, dt, u.tail(whole.unknowns() - own), {}, {begins.behind.value, {}, begins.behind.by_motion * follows});
  EXPECT_LT((begins.normal_force - expected.normal_force.head(120)).norm(), 1e-10 * expected.normal_force.norm());
  EXPECT_LT((goes_on.normal_force - expected.normal_force.tail(180)).norm(), 1e-10 * expected.normal_force.norm());
  EXPECT_LT((goes_on.circulatory - expected.circulatory.tail(180)).norm(), 1e-10 * expected.circulatory.norm());
  const Eigen::MatrixXd by_theta = expected.circulatory_by_theta.bottomRows(180) + expected.circulatory_by_motion.bottomRows(180).leftCols(own) * follows;
  EXPECT_LT((goes_on.circulatory_by_theta - by_theta).norm(), 1e-10 * by_theta.norm());
  EXPECT_LT((goes_on.normal_force_by_motion - expected.normal_force_by_motion.bottomRows(180).rightCols(whole.unknowns() - own)).norm(), 1e-10 * expected.normal_force_by_motion.norm());
}

TEST(RigidLoad, OfAShaftAtRestSettles) {
  // Ten minutes after the last of two motions, 4800 semichords: slope times rho U^2 b L times the angle. A rate left over by the splines' rounding would add up.
  const AeroelasticModel model = model_of_null(Wagner::jones);
  const double dt = 0.002;
  const Index samples = 400000, last = samples - 1;
  const MotionBasis motion(samples, {{{10, 40}, 1}, {{100000, 100030}, 1}});
  const VectorXd u = VectorXd::LinSpaced(motion.unknowns(), 0.01, 0.02);
  Conditions conditions;
  conditions.density = 998.2;
  conditions.speed = 0.6;
  const RigidLoad load = rigid_load(model, conditions, theta_of(model, 5.9), motion, dt, u, {50000, last});
  const Rig& rig = model.rig();
  const double force = 5.9 * 998.2 * 0.6 * 0.6 * rig.semichord() * rig.strip_length * static_cast<double>(rig.submerged.size());
  const double angle = motion_of(motion.coefficients(u), dt).angle[last];
  EXPECT_NEAR(load.circulatory[last] / (force * angle), 1, 1e-9);
  EXPECT_NEAR(load.normal_force[last] / (force * angle), 1, 1e-9);
  EXPECT_NEAR(load.circulatory_by_motion.row(1).dot(u) / load.circulatory[last], 1, 1e-9);
  EXPECT_NEAR(load.circulatory_by_motion.row(0).dot(u) / load.circulatory[50000], 1, 1e-9);
}

TEST(RigidLoad, InStillWaterIsInertiaAlone) {
  const AeroelasticModel model = model_of_null(Wagner::jones);
  const double dt = 0.002;
  const MotionBasis motion(60, {{{10, 20}, 1}});
  const VectorXd u = VectorXd::LinSpaced(motion.unknowns(), 0, 0.02);
  Conditions conditions;
  conditions.density = 998.2;
  const RigidLoad load = rigid_load(model, conditions, theta_of(model, 5.9), motion, dt, u);
  EXPECT_EQ(load.circulatory.norm(), 0);
  const Rig& rig = model.rig();
  const double b = rig.semichord(), length = rig.strip_length * static_cast<double>(rig.submerged.size());
  const VectorXd expected = -true_apparent_mass * pi * 998.2 * b * b * length * rig.axis() * b * motion_of(motion.coefficients(u), dt).acceleration;
  EXPECT_LT((load.normal_force - expected).norm(), 1e-9 * expected.norm());
}

TEST(RigidLoad, NeedsASection) {
  Rig rig;
  rig.modal = {{1, 5, 0.01, 1, "N"}};
  const AeroelasticModel model(rig, {}, wagner(Wagner::jones));
  EXPECT_THROW(rigid_load(model, {}, model.start_values(), MotionBasis(20, {{{2, 6}, 1}}), 0.1, VectorXd::Zero(5)), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
