#pragma once
#include <Eigen/Core>

namespace unrig {

/// Share of a channel's variance that a prediction follows, in the samples that count (weight > 0):
///
///   1 - sum (y - prediction)^2 / sum (y - mean y)^2
///
/// y: readings, in any unit. It is 1 where there is nothing to follow, and negative where the prediction is worse than the mean.
///
/// Behind one step in a long record most of the variance is noise, which nothing follows. Where half of the whole is not followed, the record is therefore looked at
/// in blocks of a thousandth (64 samples at least). Where the reading varies by more within a block than in the middle one, by more than six times what the quieter half
/// of them scatters by, it stands out of its noise, which is what it varies by in the other blocks, of whatever colour. Where that is the lesser part of the record, the blocks
/// on either side counted in, the share of what can be explained there,
///
///   1 - (mean (y - prediction)^2 - noise) / (mean (y - mean y)^2 - noise)
///
/// is returned, provided that it is four fifths: in the crests of a beat of three tones alike a prediction of one of them follows five ninths.
/// What does not stand out anywhere does not count, however long the record.
double share_followed(const Eigen::VectorXd& reading, const Eigen::VectorXd& prediction, const Eigen::VectorXd& weight);

}  // namespace unrig
