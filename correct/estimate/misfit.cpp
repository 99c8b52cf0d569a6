#include "correct/estimate/misfit.h"

#include <cmath>

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double misfit_over_noise(const RunResidual::Sensitivity& sensitivity, const MatrixXd& root, const MatrixXd& answer_by_theta, double reduced_chi2) {
  constexpr Index blocks = 30;
  MatrixXd pull = MatrixXd::Zero(root.cols(), blocks), information = MatrixXd::Zero(root.cols(), root.cols());
  for (const RunResidual::Sensitivity::PerChannel& channel : sensitivity.channels) {
    const MatrixXd slope = channel.slope * root;
    information += slope.transpose() * slope;
    const Index n = channel.residual.size();
    for (Index b = 0; b < blocks; ++b) {
      const Index first = b * n / blocks, count = (b + 1) * n / blocks - first;
      pull.col(b) += slope.middleRows(first, count).transpose() * channel.residual.segment(first, count);
    }
  }
  const MatrixXd answer = answer_by_theta * root;
  const double as_noise = reduced_chi2 * (answer * information).cwiseProduct(answer).sum(), found = (answer * pull).squaredNorm();
  return as_noise > 0 ? std::sqrt(found / as_noise) : 1;
}

}  // namespace unrig
