#include "fit/likelihood/chain_eliminator.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <functional>
#include <utility>

#include "tests/support/random_matrix.h"

namespace unrig::run_rows {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Links with random rows, and the same rows over all unknowns.
struct Problem {
  std::vector<Link> links;
  MatrixXd begin, last_rows, columns;  // columns: of the links' rows in turn, then of the last
  std::vector<MatrixXd> right;
  MatrixXd last_right, all_right;
  Index unknowns = 0, shared = 0;

  ChainEliminator chain() const { return {links, unknowns, begin, shared, last_rows}; }
};

/// `own`: of each link; links with few rows leave their unknowns to the later ones. The state has 3 numbers, of which `forgotten` die out within a link.
Problem random_problem(const std::vector<Index>& own, const std::vector<Index>& rows, Index forgotten, const std::function<void(std::size_t, Link&)>& change = {}) {
  constexpr Index states = 3, last = 4, shared = 2;
  Problem p;
  p.shared = shared;
  for (const Index count : own) p.unknowns += count;
  p.unknowns += last;
  p.begin = test::random_matrix(states, last, 1);
  p.last_rows = test::random_matrix(5, last, 2);
  p.last_right = test::random_matrix(5, 2, 3);
  MatrixXd state = MatrixXd::Zero(states, p.unknowns);
  state.rightCols(last) = p.begin;
  std::vector<MatrixXd> columns, right;
  Index first = 0;
  for (std::size_t k = 0; k < own.size(); ++k) {
    const auto seed = static_cast<unsigned>(10 * k + 20);
    Link link{first, own[k], test::random_matrix(rows[k], own[k] + states + shared, seed), test::random_matrix(states, own[k] + states, seed + 1)};
    link.transition.topRows(forgotten).rightCols(states) *= 1e-200;
    if (change) change(k, link);
    MatrixXd over_all = link.rows.middleCols(own[k], states) * state, next = link.transition.rightCols(states) * state;
    over_all.middleCols(first, own[k]) += link.rows.leftCols(own[k]);
    over_all.rightCols(shared) += link.rows.rightCols(shared);
    next.middleCols(first, own[k]) += link.transition.leftCols(own[k]);
    state = next;
    columns.push_back(over_all);
    p.right.push_back(test::random_matrix(rows[k], 2, seed + 2));
    p.links.push_back(std::move(link));
    first += own[k];
  }
  p.links.back().transition.resize(0, 0);
  MatrixXd of_last = MatrixXd::Zero(5, p.unknowns);
  of_last.rightCols(last) = p.last_rows;
  columns.push_back(of_last);
  p.columns = stacked(columns, p.unknowns);
  right = p.right;
  right.push_back(p.last_right);
  p.all_right = stacked(right, 2);
  return p;
}

std::vector<Problem> problems() {
  return {random_problem({4, 0, 6, 5}, {9, 3, 14, 12}, 0), random_problem({4, 6, 5}, {6, 3, 30}, 0), random_problem({4, 0, 6, 5}, {9, 3, 14, 12}, 2), random_problem({3}, {8}, 3), random_problem({0, 0}, {6, 6}, 0)};
}

TEST(ChainEliminator, SolvesAsAllRowsAtOnce) {
  for (const Problem& p : problems()) {
    const ChainEliminator chain = p.chain();
    const ChainEliminator::Rotated rotated = chain.rotated(p.right, p.last_right);
    const Eigen::ColPivHouseholderQR<MatrixXd> all(p.columns);
    ASSERT_EQ(all.rank(), p.unknowns);
    const MatrixXd expected = all.solve(p.all_right);
    EXPECT_TRUE(chain.solve(rotated).isApprox(expected, 1e-9));
    MatrixXd beside = MatrixXd::Zero(2, 2);
    for (const MatrixXd& rows : rotated.beside) beside += rows.transpose() * rows;
    const MatrixXd left = p.all_right - p.columns * expected;
    EXPECT_TRUE(beside.isApprox(left.transpose() * left, 1e-9));
  }
}

TEST(ChainEliminator, KnowsWhatTheRowsSay) {
  for (const Problem& p : problems()) {
    const ChainEliminator chain = p.chain();
    const MatrixXd information = p.columns.transpose() * p.columns, factor = chain.factor();
    EXPECT_TRUE(factor.isUpperTriangular(1e-300));
    EXPECT_TRUE((factor.transpose() * factor).isApprox(information, 1e-9));
    const MatrixXd root = MatrixXd(p.columns.householderQr().matrixQR().topRows(p.unknowns).triangularView<Eigen::Upper>()).inverse();
    const MatrixXd covariance = root * root.transpose(), last = covariance.bottomRightCorner(4, 4);
    EXPECT_TRUE((chain.last_factor().transpose() * chain.last_factor()).isApprox(last.inverse(), 1e-8));
    for (Index j = p.unknowns - 4; j < p.unknowns; ++j) EXPECT_TRUE(chain.covariance_column(j).isApprox(covariance.col(j), 1e-8));
  }
}

TEST(ChainEliminator, DampedStepIsThatOfTheWholeFactor) {
  for (const Problem& p : problems()) {
    const ChainEliminator chain = p.chain();
    const VectorXd full = test::random_matrix(p.unknowns, 1, 9);
    const MatrixXd information = p.columns.transpose() * p.columns, scale = information.diagonal().asDiagonal();
    for (const double damping : {1e-4, 1.0, 100.0}) {
      const VectorXd expected = (information + damping * scale).ldlt().solve(information * full);
      EXPECT_TRUE(chain.damped_step(full, damping).isApprox(expected, 1e-8)) << damping;
    }
  }
}

/// Further rows of each link and of the last unknowns, and what is known of an unknown and of states then.
TEST(ChainEliminator, HeldByFurtherRowsIsWhatAllRowsSay) {
  for (const Problem& p : problems()) {
    const ChainEliminator chain = p.chain();
    const VectorXd at = test::random_matrix(p.unknowns, 1, 9);
    std::vector<MatrixXd> further, over_all{p.columns};
    MatrixXd state = MatrixXd::Zero(3, p.unknowns);
    state.rightCols(4) = p.begin;
    std::vector<MatrixXd> ends;  // [own | state] over all
    for (std::size_t k = 0; k < p.links.size(); ++k) {
      const Link& link = p.links[k];
      further.push_back(test::random_matrix(2, link.own + 5, static_cast<unsigned>(40 + k)));
      MatrixXd end = MatrixXd::Zero(link.own + 3, p.unknowns);
      end.topRows(link.own).middleCols(link.first, link.own).setIdentity();
      end.bottomRows(3) = state;
      over_all.push_back(further.back().leftCols(link.own + 3) * end);
      over_all.back().rightCols(2) += further.back().rightCols(2);
      if (link.transition.size() > 0) state = link.transition * end;
      ends.push_back(std::move(end));
    }
    const MatrixXd last = test::random_matrix(1, 4, 7);
    MatrixXd of_last = MatrixXd::Zero(1, p.unknowns);
    of_last.rightCols(4) = last;
    over_all.push_back(of_last);
    const MatrixXd rows = stacked(over_all, p.unknowns), information = rows.transpose() * rows;
    const auto [of_both, unknowns] = chain.held(at, further, last);
    EXPECT_TRUE(unknowns.isApprox(information.ldlt().solve(p.columns.transpose() * p.columns * at), 1e-8));
    const MatrixXd covariance = information.inverse();
    const std::vector<MatrixXd> roots = of_both.covariance_roots();
    ASSERT_EQ(roots.size(), ends.size() + 1);
    for (std::size_t k = 0; k < ends.size(); ++k) EXPECT_TRUE((roots[k] * roots[k].transpose()).isApprox(ends[k] * covariance * ends[k].transpose(), 1e-8)) << k;
    EXPECT_TRUE((roots.back() * roots.back().transpose()).isApprox(covariance.bottomRightCorner(4, 4), 1e-8));
  }
}

/// Two unknowns of which only the sum enters, and one that nothing sees.
TEST(ChainEliminator, LeavesAtZeroWhatNothingDetermines) {
  const Problem p = random_problem({4, 6, 5}, {12, 16, 30}, 0, [](std::size_t k, Link& link) {
    if (k != 1) return;
    for (MatrixXd* m : {&link.rows, &link.transition}) {
      m->col(1) = m->col(0);
      m->col(3).setZero();
    }
  });
  const ChainEliminator chain = p.chain();
  const ChainEliminator::Rotated rotated = chain.rotated(p.right, p.last_right);
  const MatrixXd found = chain.solve(rotated);
  EXPECT_TRUE(found.row(7).isZero(0));
  EXPECT_TRUE(found.row(4).isZero(0) != found.row(5).isZero(0));
  const MatrixXd left = p.all_right - p.columns * found, least = p.all_right - p.columns * p.columns.colPivHouseholderQr().solve(p.all_right);
  EXPECT_NEAR(left.norm() / least.norm(), 1, 1e-12);
  MatrixXd beside = MatrixXd::Zero(2, 2);
  for (const MatrixXd& rows : rotated.beside) beside += rows.transpose() * rows;
  EXPECT_TRUE(beside.isApprox(least.transpose() * least, 1e-9));
  EXPECT_TRUE((chain.factor().transpose() * chain.factor()).isApprox(p.columns.transpose() * p.columns, 1e-9));
}

TEST(ChainEliminator, ALinkThatNothingIsKnownOfStaysAtZero) {
  const Problem p = random_problem({4, 6, 5}, {12, 16, 30}, 0, [](std::size_t k, Link& link) {
    if (k != 1) return;
    for (MatrixXd* m : {&link.rows, &link.transition}) m->leftCols(6).setZero();
  });
  const MatrixXd found = p.chain().solve(p.chain().rotated(p.right, p.last_right));
  EXPECT_TRUE(found.middleRows(4, 6).isZero(0));
  const MatrixXd left = p.all_right - p.columns * found, least = p.all_right - p.columns * p.columns.colPivHouseholderQr().solve(p.all_right);
  EXPECT_NEAR(left.norm() / least.norm(), 1, 1e-12);
}

TEST(ChainEliminator, WithoutLinksIsOneElimination) {
  const MatrixXd rows = test::random_matrix(9, 4, 5), right = test::random_matrix(9, 1, 6);
  const ChainEliminator chain({}, 4, MatrixXd(0, 4), 4, rows);
  EXPECT_TRUE(chain.solve(chain.rotated({}, right)).isApprox(MatrixXd(rows.colPivHouseholderQr().solve(right)), 1e-12));
}

}  // namespace
}  // namespace unrig::run_rows
