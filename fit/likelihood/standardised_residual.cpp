#include "fit/likelihood/standardised_residual.h"

#include "fit/likelihood/readings_noise.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd standardised_residual(const RunResidual& run, const VectorXd& theta, const RunResidual::Prediction& p, std::size_t c) {
  MatrixXd left = -p.output;
  for (Index k = 0; k < left.cols(); ++k) left.col(k) += run.run().channel(p.channels[static_cast<std::size_t>(k)]).value;
  return standardised_readings(run, theta, left).col(static_cast<Index>(c));
}

}  // namespace unrig
