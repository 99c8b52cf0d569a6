#include "fit/standardised_residual.h"

#include <cmath>

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd standardised_residual(const RunResidual& run, const RunResidual::Prediction& p, std::size_t c) {
  const VectorXd& measured = run.run().channel(p.channels[c]).value;
  const VectorXd weight = run.tempered() * run.channel_weight(c);
  VectorXd left(measured.size());
  for (Index k = 0; k < left.size(); ++k) left[k] = weight[k] > 0 && std::isfinite(measured[k]) ? weight[k] * (measured[k] - p.output(k, static_cast<Index>(c))) : 0;
  return left;
}

}  // namespace unrig
