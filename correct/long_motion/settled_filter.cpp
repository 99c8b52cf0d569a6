#include "correct/long_motion/settled_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

#include "core/files/error.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How uncertain each state is after some samples, roughly.
VectorXd sizes(const MatrixXd& F, const VectorXd& b, const MatrixXd& C, const VectorXd& r) {
  constexpr int samples = 100;
  MatrixXd P = b * b.transpose();
  for (int k = 0; k < samples; ++k) {
    const MatrixXd seen = P * C.transpose();
    MatrixXd S = C * seen;
    S.diagonal() += r;
    P -= seen * S.ldlt().solve(seen.transpose());
    P = (F * P * F.transpose()).eval();
    P += b * b.transpose();
  }
  const VectorXd size = P.diagonal().cwiseAbs().cwiseSqrt();
  return size.cwiseMax(1e-12 * size.maxCoeff());
}

}  // namespace

SettledFilter settle(const MatrixXd& F, const VectorXd& b, const MatrixXd& C, const VectorXd& r) {
  const Index n = F.rows();
  const VectorXd size = sizes(F, b, C, r);
  const MatrixXd unit = MatrixXd::Identity(n, n);
  const MatrixXd scaled_C = C * size.asDiagonal();
  const VectorXd scaled_b = b.cwiseQuotient(size);
  MatrixXd A = (size.cwiseInverse().asDiagonal() * F * size.asDiagonal()).transpose();
  MatrixXd G = scaled_C.transpose() * r.cwiseInverse().asDiagonal() * scaled_C, H = scaled_b * scaled_b.transpose();
  constexpr int most = 60;  // 2^60 samples
  constexpr double settled = 1e-13;
  bool arrived = false;
  for (int round = 0; round < most && !arrived; ++round) {
    const Eigen::PartialPivLU<MatrixXd> lu(unit + G * H);
    const MatrixXd next = lu.solve(A), spread = lu.solve(G);
    const MatrixXd more = A.transpose() * (H * next);
    G += A * spread * A.transpose();
    A = (A * next).eval();
    H += 0.5 * (more + more.transpose());
    G = (0.5 * (G + G.transpose())).eval();
    arrived = more.cwiseAbs().maxCoeff() < settled * H.cwiseAbs().maxCoeff();
  }
  SettledFilter filter;
  filter.F = F, filter.C = C, filter.b = b, filter.r = r;
  filter.P = size.asDiagonal() * H * size.asDiagonal();
  const MatrixXd seen = filter.P * C.transpose();
  MatrixXd S = C * seen;
  S.diagonal() += r;
  const Eigen::LLT<MatrixXd> llt(S);
  if (!arrived || !filter.P.allFinite() || llt.info() != Eigen::Success) throw NoAnswer("the filter of the moving shaft does not settle: part of the rig runs away where no channel sees it");
  filter.K = F * llt.solve(seen.transpose()).transpose();
  filter.L = F - filter.K * C;
  filter.whiten = llt.matrixL().solve(MatrixXd::Identity(S.rows(), S.rows()));
  filter.log_determinant = 2 * MatrixXd(llt.matrixL()).diagonal().array().log().sum();
  return filter;
}

}  // namespace unrig
