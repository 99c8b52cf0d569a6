#include "core/convolution.h"

#include <algorithm>

namespace unrig {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

/// The next length whose only prime factors are 2 and one 3 or 5.
Index quick_length(Index least) {
  Index best = 1;
  while (best < least) best *= 2;
  for (const Index odd : {3, 5, 9})
    for (Index length = odd; length < best; length *= 2)
      if (length >= least && length % 2 == 0) best = length;
  return best;
}

}  // namespace

Convolution::Convolution(Index samples) : samples_(samples), plan_(std::make_shared<FourierPlan>(quick_length(std::max<Index>(2, 2 * samples)))) {}

VectorXcd Convolution::transform(const VectorXd& x) const { return plan_->forward(x); }

VectorXd Convolution::inverse(const VectorXcd& lines) const { return plan_->inverse(lines).head(samples_); }

double Convolution::mean(const VectorXd& power) const {
  return (2 * power.sum() - power[0] - power[power.size() - 1]) / static_cast<double>(length());
}

}  // namespace unrig
