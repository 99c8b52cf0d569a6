#include <gtest/gtest.h>

#include "core/effects/effect.h"
#include "core/model/aeroelastic_model.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double angle = 0.05, steady = 0.4, share = 0.02, rounding = 1e-9;

class SurgeOfACarriage : public testing::Test {
 protected:
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel bare = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
  const AeroelasticModel model = bare.with_effects({"speed-surge"});
  const Conditions conditions = conditions_of(read_run(test::null_campaign("step_a.csv")));

  VectorXd theta() const {
    VectorXd values = model.start_values();
    values[model.index("speed-surge.steady_normal_force")] = steady;
    return values;
  }

  /// Rates of the coordinates' velocities with the shaft turned by `turned`, circulation caught up, at the share `e`.
  VectorXd pushed(double turned, double e) const {
    const LinearSystem system = model.system(conditions, theta(), {"gauge"});
    VectorXd x = VectorXd::Zero(system.states());
    x[system.motion] = turned;
    x.segment(2 * system.coordinates, system.lags).setConstant(turned * conditions.speed);
    x[system.exogenous.front()] = e;
    VectorXd rates = system.A.value * x;
    const auto laws = static_cast<Index>(system.feedback.size());
    for (Index i = 0; i < laws; ++i) {
      const Feedback& f = system.feedback[static_cast<std::size_t>(i)];
      const VectorXd z = f.sees * x;
      double slope[2];
      rates += f.law(z.data(), nullptr, slope, nullptr) * system.B.value.col(system.B.cols() - laws + i);
    }
    return rates.segment(system.coordinates, system.coordinates);
  }
};

/// Of the circulatory load at the angle and of the steady one, which is that of the same slope at the angle C_N0 / s, each grows by 2 e; and no other load does.
TEST_F(SurgeOfACarriage, ScalesSteadyAndCirculatoryLoadByTheDynamicPressure) {
  const double slope = theta()[model.index("normal_force_slope")];
  const auto circulatory = [&](double turned) -> VectorXd { return pushed(turned, 0) - pushed(0, 0); };
  EXPECT_LT((pushed(angle, share) - pushed(angle, 0) - 2 * share * circulatory(angle + steady / slope)).norm(), rounding * circulatory(angle).norm());
  EXPECT_LT((pushed(0, share) - 2 * share * circulatory(steady / slope)).norm(), rounding * circulatory(angle).norm()) << "before the motion";
  EXPECT_GT(circulatory(angle).norm(), 0);
}

TEST_F(SurgeOfACarriage, TurnsAtItsFrequencyAndNeedsAStream) {
  const LinearSystem system = model.system(conditions, theta(), {"gauge"});
  ASSERT_EQ(system.exogenous.size(), 2u);
  const Eigen::Matrix2d turn = system.A.value(system.exogenous, system.exogenous);
  const double omega = 2 * 3.14159265358979323846 * theta()[model.index("speed-surge.frequency")];
  EXPECT_LT((turn * turn + omega * omega * Eigen::Matrix2d::Identity()).norm(), rounding * omega * omega);
  Conditions still = conditions;
  still.speed = 0;
  EXPECT_EQ(model.system(still, theta(), {"gauge"}).states(), bare.system(still, bare.start_values(), {"gauge"}).states());
}

}  // namespace
}  // namespace unrig
