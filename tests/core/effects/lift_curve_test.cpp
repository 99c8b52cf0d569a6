#include <gtest/gtest.h>

#include "core/effects/effect.h"
#include "core/model/aeroelastic_model.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class LiftCurveInAStream : public testing::Test {
 protected:
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"lift-curve"});
  const Conditions conditions = conditions_of(read_run(test::null_campaign("step_a.csv")));

  VectorXd theta(double bend, double slope) const {
    VectorXd values = model.start_values();
    values[model.index("lift-curve.bend")] = bend;
    values[model.index("normal_force_slope")] = slope;
    return values;
  }
};

/// Turned by 0.1 rad, a strip sees half of that before the circulation's lags have caught up, and all of it after: phi(0) = 1/2, phi(infinity) = 1.
TEST_F(LiftCurveInAStream, IsReadAtTheAngleThatCirculationHasCaughtUpWith) {
  const LinearSystem system = model.system(conditions, model.start_values(), {"gauge"});
  ASSERT_EQ(system.feedback.size(), rig.submerged.size());
  VectorXd state = VectorXd::Zero(system.states());
  state[system.motion] = 0.1;
  for (const Feedback& f : system.feedback) EXPECT_NEAR((f.sees * state)[0], 0.05, 1e-12);
  state.segment(2 * system.coordinates, system.lags).setConstant(0.1 * conditions.speed);
  for (const Feedback& f : system.feedback) EXPECT_NEAR((f.sees * state)[0], 0.1, 1e-12);
}

/// What a law sees carries no partials: it may not move with theta, not even where the amplitudes of the build-up are among it.
TEST_F(LiftCurveInAStream, SeesTheSameWhereTheBuildUpIsSearched) {
  const AeroelasticModel free = AeroelasticModel(rig, model.basis(), model.circulation(), AeroelasticModel::Circulation::free).with_effects({"lift-curve"});
  const VectorXd start = free.start_values();
  VectorXd moved = start;
  for (Index k = 0; k < free.circulation().rate.size(); ++k) moved[free.circulation_parameter(k)] *= 1.2;
  ASSERT_NE(moved, start);
  const LinearSystem one = free.system(conditions, start, {"gauge"}), other = free.system(conditions, moved, {"gauge"});
  for (std::size_t i = 0; i < one.feedback.size(); ++i) EXPECT_EQ(one.feedback[i].sees, other.feedback[i].sees);
}

/// The lift lost in the end is the share k a^2 of s a: what the linear part gains by a is what the bent one loses at that share, whatever the slope.
TEST_F(LiftCurveInAStream, LosesItsShareOfTheLinearLift) {
  constexpr double bend = 40, angle = 0.1, rounding = 1e-9;
  for (const double slope : {3.6, 6.28}) {
    const LinearSystem system = model.system(conditions, theta(bend, slope), {"gauge"});
    VectorXd turned = VectorXd::Zero(system.states());
    turned[system.motion] = angle;
    VectorXd settled = turned;
    settled.segment(2 * system.coordinates, system.lags).setConstant(angle * conditions.speed);
    // With the lags at rest at w the circulation is all there; with them at 0 it is phi(0) = 1/2 of it.
    const VectorXd half = system.A.value * (settled - turned);
    double slope_of_law = 0, by_bend = 0;
    VectorXd lost = VectorXd::Zero(system.states());
    for (std::size_t i = 0; i < system.feedback.size(); ++i) {
      const double force = system.feedback[i].law(&angle, &bend, &slope_of_law, &by_bend);
      EXPECT_DOUBLE_EQ(force, -bend * angle * angle * angle);
      lost += system.B.value.col(system.B.value.cols() - static_cast<Index>(system.feedback.size()) + static_cast<Index>(i)) * force;
    }
    const Index n = system.coordinates;
    EXPECT_LT((lost.segment(n, n) + bend * angle * angle * 2 * half.segment(n, n)).norm(), rounding * lost.segment(n, n).norm()) << slope;
  }
}

}  // namespace
}  // namespace unrig
