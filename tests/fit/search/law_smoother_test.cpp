#include "fit/search/law_smoother.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

class LawSmootherOfAPluck : public testing::Test {
 protected:
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const unrig::Run run = read_run(test::null_campaign("wet_pluck.csv"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"cubic-stiffness"});
  const RunResidual residual{model, run, {}};
  const std::vector<Index> searched{model.index("normal.stiffness_scale"), model.index("torsion.damping_ratio"), model.index("apparent_mass_coefficient"),
                                    model.index("cubic-stiffness.coefficient")};

  VectorXd away() const {
    VectorXd theta = model.start_values();
    theta[model.index("cubic-stiffness.coefficient")] = 1e6;
    return theta;
  }

  /// The least J at this theta, from `smoother`'s trajectory on.
  static double least(LawSmoother& smoother, const VectorXd& theta, const VectorXd& sigma, Index changes) {
    for (int i = 0; i < 8; ++i) {
      smoother.information(theta, sigma);
      smoother.step(VectorXd::Zero(changes));
    }
    smoother.information(theta, sigma);  // the laws along the last trajectory
    return smoother.cost(sigma);
  }
};

TEST_F(LawSmootherOfAPluck, WhatTheRunSaysOfThetaIsTheSlopeOfTheLeastJ) {
  LawSmoother smoother(residual, searched);
  const VectorXd theta = away(), sigma = smoother.enough_to_move(theta);
  const auto count = static_cast<Index>(searched.size());
  least(smoother, theta, sigma, count);
  const LawSmoother::Information known = smoother.information(theta, sigma);
  const VectorXd slope = -2 * known.factor.transpose() * known.right;
  for (Index j = 0; j < count; ++j) {
    VectorXd moved = theta;
    const double h = 1e-4 * theta[searched[static_cast<std::size_t>(j)]];
    moved[searched[static_cast<std::size_t>(j)]] += h;
    const double up = least(smoother, moved, sigma, count);
    moved[searched[static_cast<std::size_t>(j)]] -= 2 * h;
    const double down = least(smoother, moved, sigma, count);
    // A ten-thousandth squared times the curvature, and what the laws' second derivative adds along a trajectory that is not the model's own.
    EXPECT_NEAR((up - down) / (2 * h) / slope[j], 1, 0.01) << model.parameters()[static_cast<std::size_t>(searched[static_cast<std::size_t>(j)])].name;
  }
}

TEST_F(LawSmootherOfAPluck, TrustedLawsGiveTheModelsOwnTrajectory) {
  LawSmoother smoother(residual, searched);
  const VectorXd theta = model.start_values();  // no cubic term: linear, where one step arrives
  const VectorXd loose = smoother.enough_to_move(theta), firm = 1e-6 * loose;
  const auto count = static_cast<Index>(searched.size());
  EXPECT_LT(least(smoother, theta, loose, count), residual.solve(theta).chi2) << "disturbances can only lower it";
  const RunResidual::Solution own = residual.solve(theta);
  EXPECT_NEAR(least(smoother, theta, firm, count) / own.chi2, 1, 1e-4);
  EXPECT_LT((smoother.linear() - own.linear).norm(), 1e-4 * own.linear.norm());
}

TEST_F(LawSmootherOfAPluck, NoiseOfAColourIsTakenForWhite) {
  const VectorXd theta = model.start_values();
  const double variance = residual.noise(0) * residual.noise(0);
  RunResidual coloured = residual;
  coloured.set_colours(theta, RunResidual::Colours(residual.channels().size(), NoiseColour{VectorXd::Constant(1, 8.0), VectorXd::Constant(1, 0.75 * variance), 0.25 * variance}));
  ASSERT_GT(coloured.linear_unknowns(), residual.linear_unknowns()) << "the noise has states of its own";
  LawSmoother white(residual, searched), smoother(coloured, searched);
  const VectorXd sigma = white.enough_to_move(theta);
  const auto count = static_cast<Index>(searched.size());
  smoother.enough_to_move(theta);
  EXPECT_DOUBLE_EQ(least(smoother, theta, sigma, count), least(white, theta, sigma, count));
  const VectorXd known = smoother.linear(), own = white.linear();
  ASSERT_EQ(known.size(), coloured.linear_unknowns());
  const Index channels = static_cast<Index>(residual.channels().size()), states = own.size() - channels;
  EXPECT_EQ(known.head(states), own.head(states));
  EXPECT_EQ(known.tail(channels), own.tail(channels));
  EXPECT_TRUE(known.segment(states, known.size() - own.size()).isZero(0));
}

}  // namespace
}  // namespace unrig
