#pragma once
#include <Eigen/Core>

#include "correct/long_motion/settled_filter.h"

namespace unrig {

using Missing = Eigen::Matrix<bool, Eigen::Dynamic, Eigen::Dynamic>;  ///< samples x channels

/// What missing readings add to the variance of quantities q x_k (the rows of `rows`), as the smoother of a settled filter has it (correct/long_motion/settled_smoother.h): samples x quantities, zero far from all
/// gaps, to a thousandth of their variance. Looked at on every `stride`-th sample, in between along straight lines.
///
/// Over s samples the covariance P of what is to come for given past, and the information Lambda that what is to come has of the state, go on as
///
///   P_(k+s) = H + A' P_k (1 + G P_k)^-1 A,   Lambda_k = G + A Lambda_(k+s) (1 + H Lambda_(k+s))^-1 A',
///
/// for one sample A = F', G = C' R^-1 C of the channels that are read there, H = b b', for two stretches in a row (1 the earlier)
///
///   A = A_1 W A_2,   G = G_1 + A_1 W G_2 A_1',   H = H_2 + A_2' H_1 W A_2,   W = (1 + G_2 H_1)^-1
///
/// (the doubling of correct/long_motion/settled_filter.h). From a gap on P goes on until it has settled again, and back from there Lambda until the gap is forgotten; the variance is q P (1 + Lambda P)^-1 q'.
Eigen::MatrixXd variance_in_gaps(const SettledFilter& filter, const Missing& missing, const Eigen::MatrixXd& rows, Eigen::Index stride);

}  // namespace unrig
