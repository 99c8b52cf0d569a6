#include "correct/long_motion/variance_in_gaps.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// An oscillator that an integrated noise drives, looked at by two channels, one of them at the drive.
SettledFilter oscillator() {
  const MatrixXd F{{0.97, 0.2, 0.02}, {-0.2, 0.97, 0.1}, {0, 0, 0.995}};
  const MatrixXd C{{1, 0, 0}, {0, 0, 1}};
  return settle(F, VectorXd{{0.001, 0.005, 0.05}}, C, VectorXd{{0.04, 0.01}});
}

/// Variances of quantities of every state for all readings that are not missing, by one dense covariance of the whole record.
MatrixXd dense(const SettledFilter& filter, const Missing& missing, const MatrixXd& rows) {
  const Index n = missing.rows(), states = filter.F.rows(), channels = filter.C.rows();
  MatrixXd covariance(n * states, n * states);
  MatrixXd P = filter.P;
  for (Index k = 0; k < n; ++k) {
    MatrixXd later = P;
    for (Index j = k; j < n; ++j) {
      covariance.block(j * states, k * states, states, states) = later;
      covariance.block(k * states, j * states, states, states) = later.transpose();
      later = filter.F * later;
    }
    P = filter.F * P * filter.F.transpose() + filter.b * filter.b.transpose();
  }
  std::vector<VectorXd> reads;
  std::vector<double> noise;
  for (Index k = 0; k < n; ++k)
    for (Index c = 0; c < channels; ++c) {
      if (missing(k, c)) continue;
      reads.push_back(VectorXd::Zero(n * states));
      reads.back().segment(k * states, states) = filter.C.row(c);
      noise.push_back(filter.r[c]);
    }
  MatrixXd read(static_cast<Index>(reads.size()), n * states);
  for (Index i = 0; i < read.rows(); ++i) read.row(i) = reads[static_cast<std::size_t>(i)];
  const MatrixXd seen = read * covariance;
  MatrixXd S = seen * read.transpose();
  S.diagonal() += VectorXd::Map(noise.data(), read.rows());
  const MatrixXd left = covariance - seen.transpose() * S.llt().solve(seen);
  MatrixXd variance(n, rows.rows());
  for (Index k = 0; k < n; ++k) variance.row(k) = (rows * left.block(k * states, k * states, states, states)).cwiseProduct(rows).rowwise().sum();
  return variance;
}

TEST(VarianceInGaps, IsThatOfTheWholeRecordAtOnce) {
  const SettledFilter filter = oscillator();
  constexpr Index n = 400;
  Missing missing = Missing::Constant(n, 2, false), none = missing;
  missing.col(0).segment(100, 40).setConstant(true);
  missing.middleRows(150, 13).setConstant(true);  // before the first gap is forgotten
  missing.col(1).segment(250, 7).setConstant(true);
  const MatrixXd rows{{1, 0, 0}, {0.3, -1, 2}};
  const MatrixXd usual = dense(filter, none, rows), expected = dense(filter, missing, rows) - usual;
  const MatrixXd every = variance_in_gaps(filter, missing, rows, 1), fourth = variance_in_gaps(filter, missing, rows, 4);
  ASSERT_GT(expected.col(0).maxCoeff(), usual(n / 2, 0));
  for (Index q = 0; q < 2; ++q) {
    EXPECT_LT((every - expected).col(q).cwiseAbs().maxCoeff(), 4e-3 * usual(n / 2, q)) << "either way a gap is forgotten when it adds less than a thousandth";
    for (Index k = 100; k < 140; k += 4) EXPECT_NEAR(fourth(k, q), expected(k, q), 2e-3 * usual(n / 2, q)) << "by strides, where they end";
    EXPECT_LT((fourth - expected).col(q).cwiseAbs().maxCoeff(), 0.2 * expected.col(q).maxCoeff()) << "in between on straight lines";
  }
}

TEST(VarianceInGaps, NothingMissingAddsNothing) {
  const SettledFilter filter = oscillator();
  EXPECT_EQ(variance_in_gaps(filter, Missing::Constant(50, 2, false), MatrixXd::Ones(1, 3), 4).cwiseAbs().maxCoeff(), 0);
}

TEST(VarianceInGaps, AGapToTheEndGrows) {
  const SettledFilter filter = oscillator();
  Missing missing = Missing::Constant(300, 2, false);
  missing.bottomRows(60).setConstant(true);
  const MatrixXd row = MatrixXd{{0, 0, 1}}, added = variance_in_gaps(filter, missing, row, 4), usual = dense(filter, Missing::Constant(300, 2, false), row), expected = dense(filter, missing, row) - usual;
  ASSERT_GT(usual(299, 0), 1.3 * usual(150, 0)) << "without a gap it grows there too";
  for (const Index k : {236, 240, 260, 299}) EXPECT_NEAR(added(k, 0), expected(k, 0), 0.01 * expected(k, 0) + 1e-3 * usual(150, 0)) << k;
}

}  // namespace
}  // namespace unrig
