#include "correct/estimate/misfit.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "core/numerics/spectrum.h"

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

MatrixXd disturbance_root(const RunResidual& residual, const RunResidual::Sensitivity& sensitivity, const RunResidual::Evaluation& e, const MatrixXd& root,
                          const std::function<double(const std::string& channel, double frequency)>& density) {
  const Index thetas = root.cols();
  const double dt = residual.run().dt;
  MatrixXd gram = MatrixXd::Zero(thetas + 1, thetas + 1);  // over theta in the coordinates of the root, and the first offset where theta is held
  for (std::size_t c = 0; c < residual.channels().size(); ++c) {
    const RunResidual::Sensitivity::PerChannel& channel = sensitivity.channels[c];
    const Index n = channel.residual.size();
    MatrixXd reading(n, thetas + 1);
    reading << channel.slope * root, channel.into_offset;
    Eigen::MatrixXcd lines(n / 2 + 1, thetas + 1);
    for (Index j = 0; j <= thetas; ++j) lines.col(j) = fourier(reading.col(j));
    const NoiseColour* colour = residual.colour(c);
    const double white = 2 * dt * (colour ? colour->white : std::pow(residual.sigma(c), 2));
    VectorXd weight(lines.rows());
    for (Index k = 0; k < weight.size(); ++k) {
      const double frequency = static_cast<double>(k) / (static_cast<double>(n) * dt), noise = colour ? colour->density(frequency, dt) : white;
      const bool has_mirror = k > 0 && 2 * k != n;
      weight[k] = (has_mirror ? 2 : 1) * std::max(0.0, density(residual.channels()[c], frequency) + white - noise) / noise / static_cast<double>(n);
    }
    gram += (lines.adjoint() * weight.asDiagonal() * lines).real();
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(gram);
  const MatrixXd factor = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal(), of_theta = root * factor.topRows(thetas);
  MatrixXd columns(root.rows() + e.linear.size(), thetas + 1);
  columns << of_theta, e.linear_slope * of_theta;
  columns.row(root.rows() + residual.first_offset()) += factor.bottomRows(1);
  return columns;
}

}  // namespace unrig
