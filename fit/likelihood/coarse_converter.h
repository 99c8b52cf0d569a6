#pragma once
#include <Eigen/Core>

namespace unrig {

/// A converter whose steps are coarse beside the noise of what it reads, more than three and a half of its standard deviations. Its errors are no noise: they repeat with the reading, and at rest they stay where they are, up to
/// half a step off. With more noise they are as good as white and independent of what is read (B. Widrow and I. Kollar, Quantization Noise (2008), chapter 4).
struct CoarseConverter {
  double step = 0;  ///< [the channel's unit]; 0 where it is fine enough

  /// That of its errors and of the most noise [the same], 0 where it is fine.
  double usual_error() const;
  /// Root mean square of a residual [the same], none counted with more than half a step; 0 where the converter is fine. Samples that are not finite do not count.
  double error(const Eigen::VectorXd& residual) const;
  /// What of a residual [the same] is further out than half a step, max(0, |r| - step/2), over what noise of a third of a step leaves there, more than it has: how coarse a converter is
  /// a record tells to a tenth. Of its errors the mean square is 1 at most.
  Eigen::VectorXd beyond(const Eigen::VectorXd& residual) const;
};

/// Of a channel in which noise and the converter's own error together have the standard deviation `white` [its unit]: fine where that is more than its usual error were.
CoarseConverter coarse_converter(const Eigen::VectorXd& readings, double white);

}  // namespace unrig
