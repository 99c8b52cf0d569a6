#include "core/propagate/block_of_steps.h"

#include <gtest/gtest.h>

#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A stable system of any matrices, two laws that see three arguments (or none), two channels.
struct Stepped {
  explicit Stepped(bool laws) : with_laws(laws) {}
  bool with_laws;
  std::mt19937 random{7};
  StepMatrices one = matrices();
  MatrixXd any(Index rows, Index columns) {
    std::normal_distribution<double> normal;
    return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
  }
  StepMatrices matrices() {
    constexpr Index n = 5, arguments = 3, channels = 2;
    const Index laws = with_laws ? 2 : 0;
    LinearSystem system;
    system.A = DualMatrix(any(n, n) - 4 * MatrixXd::Identity(n, n));
    system.B = DualMatrix(any(n, laws));
    system.C = DualMatrix(any(channels, n));
    system.D = DualMatrix(any(channels, laws));
    system.motion = 0;
    if (with_laws) {
      system.feedback.resize(2);
      system.feedback[0].sees = any(1, n);
      system.feedback[1].sees = any(arguments - 1, n);
    }
    ExactStep step;
    step.transition = DualMatrix(0.2 * any(n, n));
    step.jerk = DualMatrix(any(n, 1));
    step.input0 = DualMatrix(any(n, laws));
    step.input1 = DualMatrix(any(n, laws));
    step.bend = DualMatrix(any(n, laws));
    return {system, step, Arguments(system), 0};
  }
};

class BlockOfStepsWithLaws : public testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Or, BlockOfStepsWithLaws, testing::Bool());

/// The changes of the forces are given here: what the laws make of what they see is not the block's affair.
TEST_P(BlockOfStepsWithLaws, IsTheRecursionOfItsSteps) {
  Stepped stepped(GetParam());
  const StepMatrices& one = stepped.one;
  constexpr Index directions = 6;
  for (const Index steps : {1, 2, 7})
    for (const bool jerks : {false, true}) {
      const BlockOfSteps block(one, steps, jerks);
      BlockOfSteps::Work work = block.work(directions);
      MatrixXd x = stepped.any(one.states, directions), f = stepped.any(one.feedbacks, directions);
      work.changes.topLeftCorner(directions, one.states) = x.transpose();
      work.changes.block(0, one.states, directions, one.feedbacks) = f.transpose();
      block.begin(work);
      for (Index k = 0; k < steps; ++k) {
        const MatrixXd after = stepped.any(one.forces(), directions), jerk = jerks ? stepped.any(1, directions) : MatrixXd::Zero(1, directions);
        if (jerks) block.jerk(work, k).head(directions) = jerk.transpose();
        block.add_changes(work, k);
        block.forces(work, k).topRows(directions) = after.transpose();
        const MatrixXd all = one.step.leftCols(one.states) * x + one.step.middleCols(one.force(), one.feedbacks) * f + one.step.col(one.jerk()) * jerk;
        const MatrixXd seen = work.seen.block(0, k * block.per_step(), directions, block.per_step()).transpose();
        EXPECT_LT((seen - all.middleRows(one.argument(), block.per_step())).norm(), 1e-12 * all.norm()) << steps << " steps, step " << k;
        x = all.topRows(one.states) + one.late.topRows(one.states) * after;
        f = after.bottomRows(one.feedbacks);
      }
      block.end(work);
      EXPECT_LT((work.changes.topLeftCorner(directions, one.states).transpose() - x).norm(), 1e-12 * x.norm()) << steps << " steps";
      EXPECT_EQ(MatrixXd(work.changes.block(0, one.states, directions, one.feedbacks).transpose()), f) << steps << " steps";
    }
}

}  // namespace
}  // namespace unrig
