#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/numerics/householder.h"
#include "core/propagate/response.h"

// Readings of a rig that is left to itself, in few rows. RunResidual's arithmetic; not for others to include.

namespace unrig::rest_rows {

/// A rest is looked at in stretches of so many samples: short enough for the cache, long enough that a slow decay is left alone in few of them.
constexpr Eigen::Index stretch_samples = 1024;

/// Once the vibrations have died out, what is left over a stretch is a polynomial of degree below this, to rounding: exp(-a) over the stretch is off it by
/// 2 I_20(a/2) exp(-a/2), 2e-16 for a = 4, and whatever decays faster dies out within a few stretches.
constexpr Eigen::Index smooth_terms = 20;

/// Discrete polynomials of degree 0, 1, ... over `samples` evenly spaced samples, orthonormal: samples x smooth_terms.
Eigen::MatrixXd orthonormal_polynomials(Eigen::Index samples);

/// The weighted readings W y of one stretch against a polynomial signal B a with coefficients a:
///
///   |W (y - B a)|^2 = |reading - weight a|^2 + beside.
struct SmoothReadings {
  Eigen::MatrixXd weight;   ///< triangle of W B
  Eigen::VectorXd reading;
  double beside = 0;
};
SmoothReadings smooth_readings(const Eigen::Ref<const Eigen::VectorXd>& w, const Eigen::Ref<const Eigen::VectorXd>& y);

/// Coefficients of a signal that is one throughout.
const Eigen::VectorXd& smooth_constant();

/// The free response of one channel over a stretch, as a function of the state at its start.
struct FreeRows {
  Eigen::MatrixXd rows;    ///< samples x n
  Eigen::MatrixXd smooth;  ///< coefficients of its polynomial part: smooth_terms x n
  Eigen::MatrixXd size, rough;  ///< |size x| is the norm of the response, |rough x| that of what is no polynomial
  std::shared_ptr<const Householder> rotation;  ///< of [rows | 1]

  explicit FreeRows(Eigen::MatrixXd rows);
  /// True where the states in the columns of `state` respond smoothly, measured by what those of `before` respond with.
  bool is_smooth(const Eigen::MatrixXd& state, const Eigen::MatrixXd& before) const;
};

/// Coefficients of the polynomial part of the free response over a stretch, with partials, and the state behind it.
class SmoothResponse {
 public:
  explicit SmoothResponse(const FreeResponse& free);
  /// `output` and its partials hold coefficients: smooth_terms x channels.
  Response from(const DualMatrix& start) const;

 private:
  std::vector<DualMatrix> rows_;  // per channel
  DualMatrix leap_;
};

}  // namespace unrig::rest_rows
