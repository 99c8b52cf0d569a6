// A pluck is let go from rest: where a law is strong, its trajectory is searched from there.
#include <gtest/gtest.h>

#include <random>

#include "core/model/simulate.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/likelihood/run_residual.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Dry friction of a fifth of the release load, sharp: it changes its sign within a fraction of a millimetre a second.
class ReleasedDecay : public testing::Test {
 protected:
  ReleasedDecay() : rig_(read_rig(test::null_campaign("rig.toml"))), model_(AeroelasticModel(rig_, make_basis(rig_, 1000, 998.2), wagner(Wagner::within_1e6)).with_effects({"coulomb-friction"})), truth_(model_.start_values()) {
    truth_[model_.index("coulomb-friction.force")] = 6;
    truth_[model_.index("coulomb-friction.velocity")] = 2e-4;
  }

  /// Three seconds of which every 4 ms are recorded, followed in steps of an eighth of a millisecond.
  unrig::Run pluck() const {
    constexpr Index finer = 32, recorded = 750;
    unrig::Run fine = read_run(test::null_campaign("dry_pluck.csv")), run = fine;
    run.dt = 0.004;
    fine.dt = run.dt / finer;
    for (Channel& c : fine.channels) c.value = VectorXd::Zero(recorded * finer);
    fine = simulate({model_, truth_, fine, {}, 30.0, {}}).run;
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    for (Channel& c : run.channels) {
      c.value = fine.channel(c.name).value(Eigen::seqN(0, recorded, finer));
      if (c.name == "gauge") c.value += VectorXd::NullaryExpr(recorded, [&] { return noise_ * normal(random); });
    }
    return run;
  }

  static constexpr double noise_ = 0.03;  // N
  Rig rig_;
  AeroelasticModel model_;
  VectorXd truth_;
};

TEST_F(ReleasedDecay, IsFollowedFromNothingWhereverThetaIsNearTheTruth) {
  const unrig::Run run = pluck();
  RunResidual known(model_, run, {});
  known.follow_in(8);
  EXPECT_LT(known.solve(truth_).chi2, 1.1 * static_cast<double>(known.degrees_of_freedom())) << "noise alone scatters by 0.05";
  for (const double off : {-0.02, -0.01, -0.003, 0.003, 0.01, 0.02}) {
    VectorXd theta = truth_;
    theta[model_.index("coulomb-friction.force")] *= 1 + off;
    theta[model_.index("normal.damping_ratio")] *= 1 - 3 * off;
    RunResidual anew(model_, run, {}), beside = known;
    anew.follow_in(8);
    EXPECT_LT(anew.solve(theta).chi2, 1.001 * beside.solve(theta).chi2) << off << ": no worse than from the trajectory of the truth";
  }
}

}  // namespace
}  // namespace unrig
