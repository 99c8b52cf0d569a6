#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <optional>

#include "correct/estimate/prior.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

/// Where the uncertainty of a corrected quantity comes from.
enum class Source { gauge, angle, calibration, rig, regularisation };
constexpr std::array source_names{"gauge", "angle", "calibration", "rig", "regularisation"};
constexpr Eigen::Index sources = source_names.size();

/// The error budget of a load: what each part of its variance comes to, the rig's in two.
inline constexpr std::array share_names{"gauge", "angle", "calibration", "parameters", "givens", "regularisation"};

/// Shares of the variance, one row per sample as in `share_names`, 0 to 1. Rows sum to one, and are NaN where the load is exact.
/// `of_givens`: what stated uncertainties make of the rig's part [unit of by_source]; empty: nothing is stated.
Eigen::MatrixXd variance_shares(const Eigen::MatrixXd& by_source, const Eigen::VectorXd& of_givens);

/// Standard deviations of quantities, one per row.
struct UncertaintyBySource {
  Eigen::VectorXd std;          ///< total: root of the sum of squares
  Eigen::MatrixXd by_source;    ///< quantities x sources
  double simultaneous = 0;      ///< all quantities together stay within this many standard deviations with a probability of 95 %
  double length = 0;            ///< of the curve that they make on the unit sphere (simultaneous_factor_of_length)
};

/// What the angle and the roughness of the motion say of theta in a part of a run, c eliminated: S' I_s S, S = d c / d theta.
struct ThetaKnown {
  Eigen::MatrixXd angle, roughness;

  ThetaKnown operator+(const ThetaKnown& other) const { return {angle + other.angle, roughness + other.roughness}; }
};
ThetaKnown theta_known(const RunResidual& residual, const RunResidual::Evaluation& e, const Eigen::MatrixXd& motion_prior);

/// Where a run is in parts, beside one of them: what the others say of theta, and how (theta, c) of this one answer to readings that are all too high by a part of themselves.
struct OtherParts {
  ThetaKnown known;
  Eigen::VectorXd answer_to_reading;
};

/// Columns over theta whose products with themselves sum to its covariance; zero for what is held.
Eigen::MatrixXd theta_root(const RunResidual::Evaluation& e, const Prior& prior);

/// The covariance of everything that was estimated from a run, z = (theta, c), split by source.
///
/// H = sum_s I_s is the Gauss-Newton information of z: I_s that of the gauge (with all other fitted channels), the angle, the rig's prior and the
/// regularisation (amplitudes and roughness of the motion). The estimate moves by H^-1 A_s^T e_s with the errors e_s of source s, I_s = A_s^T A_s, so that
///
///   cov(z) = sum_s H^-1 I_s H^-1 = H^-1.
///
/// For a prior the same term is the square of the bias it causes, averaged over what the prior holds possible. Rig parameters that are held move z by
/// -H^-1 H_r times their own error. A relative calibration error moves all weighted readings A_g c by itself: z by H^-1 I_g (0, c) times it.
/// Noise counts `inflation` fold (the root of the reduced chi-square where that exceeds one).
class UncertaintyBudget {
 public:
  /// `others`: the other parts of the run, which are in the Jacobian of `e` already; none where it is in one.
  UncertaintyBudget(const RunResidual& residual, const RunResidual::Evaluation& e, const Prior& prior, const Eigen::MatrixXd& motion_prior, const std::optional<OtherParts>& others,
                    double calibration_uncertainty, double inflation);

  /// The same for runs whose c is not all of the linear unknowns: what the angle and the roughness of the motion know, F^T I_s F for H^-1 = F F^T, and how z answers to a
  /// reading that is all too high by a part of itself.
  struct Shares {
    Eigen::MatrixXd angle, roughness;
  };
  using SharesOf = std::function<Shares(const Eigen::MatrixXd& F, const Eigen::MatrixXd& priors)>;
  using AnswerToReading = std::function<Eigen::VectorXd(const Eigen::MatrixXd& F, const Eigen::MatrixXd& gauge)>;
  UncertaintyBudget(const RunResidual::Evaluation& e, const Prior& prior, const SharesOf& shares, const AnswerToReading& reading, double calibration_uncertainty, double inflation);

  /// Further columns over (theta, c) of a source.
  void add(Source s, const Eigen::MatrixXd& columns);

  /// Of quantities that move with theta and c by these rows.
  UncertaintyBySource of(const Eigen::MatrixXd& by_theta, const Eigen::MatrixXd& by_c) const;

  /// Columns over z whose products with themselves sum to the covariance.
  const Eigen::MatrixXd& root() const { return root_; }
  /// Which of them belong to a source.
  Eigen::Index columns(Source s) const { return by_source_[static_cast<std::size_t>(s)].cols(); }
  Eigen::Index first_column(Source s) const;

 private:
  void gather();
  Eigen::MatrixXd root_;  ///< over (theta, c)
  std::array<Eigen::MatrixXd, static_cast<std::size_t>(sources)> by_source_;
};

/// Largest deviation, in standard deviations, that a Gaussian curve exceeds anywhere with a probability of 5 %: c with
///
///   (kappa / pi) exp(-c^2/2) + 2 (1 - Phi(c)) = 0.05,
///
/// kappa the length of the curve on the unit sphere, sum of the angles between neighbours (J. Sun and C. R. Loader, Ann. Statist. 22 (1994) 1328, Eq. 2.2; an upper bound
/// by D. Q. Naiman, Ann. Statist. 14 (1986) 896). `rows`: one per point, rows times their transpose the covariance.
double simultaneous_factor(const Eigen::MatrixXd& rows);
/// The same for that kappa, and kappa itself.
double simultaneous_factor_of_length(double length);
double curve_length(const Eigen::MatrixXd& rows);

}  // namespace unrig
