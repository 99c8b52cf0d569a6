#include "correct/long_motion/variance_in_gaps.h"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <memory>
#include <utility>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::PartialPivLU;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

MatrixXd symmetric(const MatrixXd& a) { return 0.5 * (a + a.transpose()); }

constexpr double small_change = 1e-3;  // of a variance
constexpr int in_a_row = 4;      // a variance that oscillates comes by

/// As far as these quantities tell.
bool alike(const MatrixXd& rows, const MatrixXd& P, const MatrixXd& settled) {
  const VectorXd before = (rows * settled).cwiseProduct(rows).rowwise().sum(), now = (rows * P).cwiseProduct(rows).rowwise().sum();
  return ((now - before).array().abs() < small_change * before.array()).all();
}

/// So many samples of the filter.
struct Stretch {
  MatrixXd A, G, H;

  MatrixXd covariance_behind(const MatrixXd& P) const { return symmetric(H + A.transpose() * P * (MatrixXd::Identity(A.rows(), A.rows()) + G * P).lu().solve(A)); }
  MatrixXd information_before(const MatrixXd& Lambda) const { return symmetric(G + A * Lambda * (MatrixXd::Identity(A.rows(), A.rows()) + H * Lambda).lu().solve(A.transpose())); }
};

/// One stretch, then the same again.
Stretch twice(const Stretch& s) {
  const PartialPivLU<MatrixXd> W(MatrixXd::Identity(s.A.rows(), s.A.rows()) + s.G * s.H);
  const MatrixXd second = W.solve(s.A);
  return {s.A * second, symmetric(s.G + s.A * W.solve(s.G) * s.A.transpose()), symmetric(s.H + s.A.transpose() * s.H * second)};
}

/// The filter in units of each state's own uncertainty, with the stretches that a record is made of.
class Gaps {
 public:
  Gaps(const SettledFilter& filter, const Missing& missing, const MatrixXd& rows, Index stride) : filter_(filter), missing_(missing) {
    const VectorXd size = filter.P.diagonal().cwiseAbs().cwiseSqrt();
    unit_ = size.cwiseMax(1e-12 * size.maxCoeff());
    P_ = in_units(filter.P);
    rows_ = rows * unit_.asDiagonal();
    while (2 * stride_ <= stride) stride_ *= 2, ++doublings_;
    // What all samples to come say where none is missing.
    constexpr int most = 60;  // 2^60 samples
    constexpr double settled = 1e-13;
    Stretch all = one(0);
    for (int round = 0; round < most; ++round) {
      const MatrixXd before = std::exchange(Lambda_, all.G);
      if (round > 0 && (Lambda_ - before).cwiseAbs().maxCoeff() < settled * Lambda_.cwiseAbs().maxCoeff()) break;
      all = twice(all);
    }
    usual_ = variance(P_, Lambda_);
  }

  MatrixXd added() {
    MatrixXd added = MatrixXd::Zero(missing_.rows(), rows_.rows());
    for (Index k = 0; k < missing_.rows(); ++k)
      if (without(k) != 0) k = from(k, added) - 1;
    return added;
  }

 private:
  MatrixXd in_units(const MatrixXd& covariance) const { return unit_.cwiseInverse().asDiagonal() * covariance * unit_.cwiseInverse().asDiagonal(); }

  /// Which channels are missing, as bits.
  unsigned without(Index k) const {
    unsigned bits = 0;
    for (Index c = 0; c < missing_.cols(); ++c) bits |= missing_(k, c) ? 1U << c : 0U;
    return bits;
  }

  Stretch one(unsigned bits) const {
    const MatrixXd C = filter_.C * unit_.asDiagonal();
    Stretch s{(unit_.cwiseInverse().asDiagonal() * filter_.F * unit_.asDiagonal()).transpose(), MatrixXd::Zero(P_.rows(), P_.rows()), in_units(filter_.b * filter_.b.transpose())};
    for (Index c = 0; c < C.rows(); ++c)
      if ((bits >> c & 1U) == 0) s.G += C.row(c).transpose() * C.row(c) / filter_.r[c];
    return s;
  }

  /// One sample, or a stride of them, without these channels.
  const Stretch& stretch(unsigned bits, bool whole) {
    const auto [place, is_new] = stretches_.try_emplace({bits, whole});
    if (is_new) {
      place->second = one(bits);
      for (int round = 0; whole && round < doublings_; ++round) place->second = twice(place->second);
    }
    return place->second;
  }

  /// Whether the same channels are missing over a stride from k on, far enough from the end that nothing grows within it.
  bool is_whole(Index k) const {
    Index alike = k;
    while (alike + stride_ < missing_.rows() && alike - k < stride_ && without(alike) == without(k)) ++alike;
    return alike - k == stride_;
  }

  RowVectorXd variance(const MatrixXd& P, const MatrixXd& Lambda) const {
    const MatrixXd P_q = P * rows_.transpose();
    return rows_.transpose().cwiseProduct((MatrixXd::Identity(P.rows(), P.rows()) + P * Lambda).lu().solve(P_q)).colwise().sum();
  }

  /// Past the gap at `first` and all that are not forgotten when the next begins; returns where the filter has settled again.
  Index from(Index first, MatrixXd& added) {
    const Index samples = missing_.rows();
    struct Before {
      Index at;
      bool whole;
      const Stretch* stretch;
      std::shared_ptr<const MatrixXd> P;  // one for as long as it does not change
    };
    constexpr double unchanged = 1e-10;
    std::vector<Before> way;
    auto P = std::make_shared<const MatrixXd>(P_);
    Index end = first;
    for (int settled = 0; end < samples && (without(end) != 0 || settled < in_a_row);) {
      const bool whole = is_whole(end);
      const Stretch& here = stretch(without(end), whole);
      way.push_back({end, whole, &here, P});
      auto next = std::make_shared<const MatrixXd>(here.covariance_behind(*P));
      if ((*next - *P).norm() > unchanged * P->norm()) P = std::move(next);
      settled = alike(rows_, *P, P_) ? settled + 1 : 0;
      end += whole ? stride_ : 1;
    }
    const bool to_the_end = end == samples;
    MatrixXd Lambda = to_the_end ? MatrixXd(MatrixXd::Zero(P_.rows(), P_.rows())) : Lambda_, without_gaps = Lambda;
    RowVectorXd usual = usual_;
    Index behind = end;
    RowVectorXd value_behind;
    const auto back_to = [&](Index at, bool whole, const Stretch& over, const MatrixXd& P_there) {
      Lambda = over.information_before(Lambda);
      if (to_the_end) {
        without_gaps = stretch(0, whole).information_before(without_gaps);
        usual = variance(P_, without_gaps);
      }
      const RowVectorXd value = (variance(P_there, Lambda) - usual).cwiseMax(0);
      if (value_behind.size() == 0) value_behind = value;
      for (Index k = at; k < behind; ++k) {
        const double part = static_cast<double>(k - at) / static_cast<double>(behind - at);
        added.row(k) = added.row(k).cwiseMax((1 - part) * value + part * value_behind);
      }
      behind = at;
      value_behind = value;
    };
    for (auto place = way.rbegin(); place != way.rend(); ++place) back_to(place->at, place->whole, *place->stretch, *place->P);
    for (int forgotten = 0; behind > 0 && forgotten < in_a_row;) {
      const bool whole = behind >= stride_;
      back_to(behind - (whole ? stride_ : 1), whole, stretch(0, whole), P_);
      forgotten = (value_behind.array() < small_change * usual.array()).all() ? forgotten + 1 : 0;
    }
    return end;
  }

  const SettledFilter& filter_;
  const Missing& missing_;
  Index stride_ = 1;
  int doublings_ = 0;
  VectorXd unit_;
  MatrixXd P_, Lambda_, rows_;  ///< covariance and information far from all gaps
  RowVectorXd usual_;
  std::map<std::pair<unsigned, bool>, Stretch> stretches_;
};

}  // namespace

MatrixXd variance_in_gaps(const SettledFilter& filter, const Missing& missing, const MatrixXd& rows, Index stride) { return Gaps(filter, missing, rows, stride).added(); }

}  // namespace unrig
