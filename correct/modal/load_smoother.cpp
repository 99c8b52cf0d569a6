#include "correct/modal/load_smoother.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index most_states = 24;
using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_states, most_states>;
using Vector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_states, 1>;

/// Filter: state before and after each reading. A covariance that no longer changes is not computed again.
class Filter {
 public:
  Filter(const LoadModel& model, double roughness) : T_(model.transition), Q_(roughness * model.diffusion), c_(model.observe.transpose()), x(Vector::Zero(T_.rows())) {
    constexpr double unknown = 1e3;
    P = (unknown * model.start_scale).cwiseAbs2().asDiagonal();
  }
  /// Takes the reading; innovation and its variance (over the noise's), or false where it is missing.
  bool update(double reading) {
    if (!std::isfinite(reading)) {
      settled = false;
      return false;
    }
    innovation = reading - c_.dot(x);
    if (!settled) {
      const Vector Pc = P * c_;
      variance = 1 + c_.dot(Pc);
      gain_ = Pc / variance;
      P -= gain_ * Pc.transpose();
    } else {
      P = after_;
    }
    x += gain_ * innovation;
    return true;
  }
  void predict() {
    x = T_ * x;
    if (settled) {
      P = before_;
      return;
    }
    const Matrix after = P;
    P = T_ * P * T_.transpose() + Q_;
    P = 0.5 * (P + P.transpose().eval());
    constexpr double same = 1e-12;
    settled = before_.size() > 0 && ((P - before_).array().abs() <= same * (P.diagonal() * P.diagonal().transpose()).array().sqrt()).all();
    before_ = P;
    after_ = after;
  }
  Matrix P;
  double innovation = 0, variance = 0;
  bool settled = false;

 private:
  Matrix T_, Q_, before_, after_;
  Vector c_, gain_;

 public:
  Vector x;
};

}  // namespace

LoadLikelihood likelihood(const LoadModel& model, double roughness, const Eigen::Ref<const VectorXd>& reading) {
  Filter filter(model, roughness);
  const Index skip = model.transition.rows();  // readings that only find the start
  double squares = 0, logarithms = 0;
  Index count = 0, seen = 0;
  for (Index k = 0; k < reading.size(); ++k) {
    if (filter.update(reading[k]) && ++seen > skip) {
      squares += filter.innovation * filter.innovation / filter.variance;
      logarithms += std::log(filter.variance);
      ++count;
    }
    filter.predict();
  }
  const auto n = static_cast<double>(std::max<Index>(1, count));
  return {-0.5 * (n * std::log(squares / n) + logarithms), squares / n};
}

SmoothedLoad smooth(const LoadModel& model, double roughness, const VectorXd& reading) {
  const Index n = reading.size(), states = model.transition.rows(), load = states - 2;
  const Matrix T = model.transition, Q = roughness * model.diffusion;
  MatrixXd means(states, n);
  std::vector<Matrix> covariances;  // after the reading, those that differ
  std::vector<std::size_t> which(static_cast<std::size_t>(n));
  Filter filter(model, roughness);
  bool shared = false;
  for (Index k = 0; k < n; ++k) {
    const bool was_settled = filter.settled, there = filter.update(reading[k]);
    if (!(was_settled && there && shared)) covariances.emplace_back(filter.P);
    shared = was_settled && there;
    which[static_cast<std::size_t>(k)] = covariances.size() - 1;
    means.col(k) = filter.x;
    filter.predict();
  }
  SmoothedLoad result{VectorXd(n), VectorXd(n), VectorXd(n)};
  Vector x = means.col(n - 1);
  Matrix P = covariances.back(), gain, predicted;
  std::size_t last = covariances.size();
  for (Index k = n - 1;; --k) {
    const double variance = P(load, load), across = P(load, load + 1) / variance;
    result.load[k] = x[load];
    result.variance[k] = variance;
    result.angular_speed[k] = std::sqrt(std::max(0.0, P(load + 1, load + 1) / variance - across * across));
    if (k == 0) break;
    const std::size_t at = which[static_cast<std::size_t>(k - 1)];
    const Matrix& own = covariances[at];
    if (at != last) {
      predicted = T * own * T.transpose() + Q;
      // Scaled: modal displacements and loads differ by many powers of ten.
      const Vector scale = predicted.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
      const Matrix scaled = scale.asDiagonal() * predicted * scale.asDiagonal();
      gain = (scale.asDiagonal() * Matrix(scaled.ldlt().solve(Matrix(scale.asDiagonal() * (T * own))))).transpose();
      last = at;
    }
    const Vector mean = means.col(k - 1);
    x = mean + gain * (x - T * mean);
    P = own + gain * (P - predicted) * gain.transpose();
  }
  return result;
}

}  // namespace unrig
