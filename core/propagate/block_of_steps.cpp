#include "core/propagate/block_of_steps.h"

#include <algorithm>
#include <cmath>

#include "core/numerics/small_product.h"
#include "core/propagate/response.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;

Index BlockOfSteps::best_length(const StepMatrices& one) {
  // Least of L/2 changes on what is seen and the states once in L steps.
  const auto changes = static_cast<double>(one.forces() * (one.seen() + one.channels)), states = static_cast<double>(one.states * one.jerk());
  return std::max<Index>(1, std::lround(std::sqrt(2 * states / std::max(1.0, changes))));
}

BlockOfSteps::BlockOfSteps(const StepMatrices& one, Index steps, bool jerks)
    : steps_(steps), states_(one.states), feedbacks_(one.feedbacks), forces_(one.forces()), seen_(one.seen()), channels_(one.channels), changes_(forces_ + (jerks ? 1 : 0)) {
  const Index all = carried();
  MatrixXd step = MatrixXd::Zero(all, all), change = MatrixXd::Zero(all, changes_);
  step.topRows(states_) = one.step.topLeftCorner(states_, all);
  change.topLeftCorner(states_, forces_) = one.late.topRows(states_);
  change.block(states_, forces_ - feedbacks_, feedbacks_, feedbacks_).setIdentity();
  if (jerks) {
    change.col(forces_).head(states_) = one.step.col(one.jerk()).head(states_);
    jerk_at_once_ = one.step.col(one.jerk()).segment(one.argument(), seen_);
  }
  const MatrixXd sees = one.step.block(one.argument(), 0, per_step(), all);

  free_seen_.resize(all, steps * per_step());
  change_seen_.resize(steps * changes_, per_step());
  all_end_.resize(all + steps * changes_, states_);
  MatrixXd later = sees;
  for (Index k = 0; k < steps; ++k) {
    free_seen_.middleCols(k * per_step(), per_step()) = later.transpose();
    later *= step;
    const Index earlier = (steps - 1 - k) * changes_;
    change_seen_.middleRows(earlier, changes_) = (sees * change).transpose();
    all_end_.middleRows(all + earlier, changes_) = change.topRows(states_).transpose();
    change = step * change;
  }
  all_end_.topRows(all) = power(step, steps).topRows(states_).transpose();
}

BlockOfSteps::Work BlockOfSteps::work(Index directions) const {
  const Index rows = padded_rows(directions);
  return {MatrixXd::Zero(rows, all_end_.rows()), MatrixXd::Zero(rows, steps_ * per_step()), MatrixXd::Zero(rows, std::max(per_step(), states_))};
}

void BlockOfSteps::begin(Work& work) const {
  small_product(work.changes.data(), work.changes.rows(), free_seen_.rows(), free_seen_.data(), free_seen_.rows(), free_seen_.cols(), work.seen.data(), work.seen.rows());
}

void BlockOfSteps::add_changes(Work& work, Index k) const {
  auto seen = work.seen.middleCols(k * per_step(), per_step());
  if (k > 0 && changes_ > 0) {
    small_product(work.changes.col(carried()).data(), work.changes.rows(), k * changes_, change_seen_.data() + (steps_ - k) * changes_, change_seen_.rows(), per_step(), work.room.data(), work.room.rows());
    seen += work.room.leftCols(per_step());
  }
  if (changes_ > forces_) seen.leftCols(seen_) += jerk(work, k) * jerk_at_once_.transpose();
}

void BlockOfSteps::end(Work& work) const {
  small_product(work.changes.data(), work.changes.rows(), all_end_.rows(), all_end_.data(), all_end_.rows(), states_, work.room.data(), work.room.rows());
  work.changes.leftCols(states_) = work.room.leftCols(states_);
  work.changes.middleCols(states_, feedbacks_) = forces(work, steps_ - 1).rightCols(feedbacks_);
}

}  // namespace unrig
