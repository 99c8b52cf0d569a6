#pragma once
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "core/propagate/exact_step.h"
#include "core/propagate/response.h"

namespace unrig {

/// The readings of a run in which a force wanders (core/effects/process_noise.h), as innovations of the steady Kalman filter (B. D. O. Anderson and J. B. Moore, Optimal Filtering (1979), chapter 4):
///
///   x_{k+1} = A (x_k + sqrt(dt) G e_k),   y_k = C x_k + white noise,   the force's kicks e falling on the samples,
///   s_{k+1} = A s_k + K i_k,   i_k = y_k - C s_k,   K = A P C^T S^-1,   S = C P C^T + R,   P = A (P - P C^T S^-1 C P) A^T + dt A G G^T A^T.
///
/// With s_0 = 0 the innovations of what the model makes of c are its own outputs with A - K C in place of A: no state is added, and the cost stays linear in time. The filter is the steady
/// one from the first sample on. Innovations are weighted by the root of their variance as it was last settled; then least squares in theta is maximum likelihood, their variance profiled out
/// (L. Ljung, System Identification (1999), section 7.4). Of several channels the correlation of their innovations is not used. The partials of P solve Lyapunov equations.
class WanderingForce {
 public:
  /// `noise`: G, states x sources. `sigma`: standard deviation of each channel's white noise. `readings`: samples x channels, without gaps. Puts A - K C into `step`.
  WanderingForce(const DualMatrix& noise, const Eigen::VectorXd& sigma, const LinearSystem& system, const Eigen::MatrixXd& readings, Partials partials, ExactStep& step);

  /// Innovations of the readings: samples x channels.
  const Eigen::MatrixXd& readings() const { return readings_; }
  /// Innovations of a channel where one reading is raised by 1 throughout: samples x channels, a column for each that is raised.
  const Eigen::MatrixXd& raised(Eigen::Index channel) const { return raised_[static_cast<std::size_t>(channel)]; }
  /// Slope in parameter j of the innovations of a channel's readings, less `offset` (one for each channel); empty where it is zero.
  Eigen::VectorXd slope(Eigen::Index j, Eigen::Index channel, const Eigen::VectorXd& offset) const;
  /// Standard deviation of a channel's innovations.
  double sigma(Eigen::Index channel) const { return sigma_[channel]; }
  /// What the force, as the readings before each sample tell of it, adds to what `observe` (rows over the first states) reads. From all innovations, the model's own taken out.
  Eigen::MatrixXd foreseen(const Eigen::MatrixXd& innovations, const Eigen::MatrixXd& observe) const;

 private:
  /// Partials of the filter in a parameter.
  struct Moved {
    Eigen::Index parameter;
    Eigen::MatrixXd closed, gain, observe;
  };
  void filter(const Eigen::MatrixXd& readings, const Eigen::MatrixXd& closed, const Eigen::MatrixXd& observe, const std::vector<Moved>& moved);

  std::vector<Eigen::Index> reached_;  // states that the force moves
  Eigen::MatrixXd transition_, gain_;  // among these, the filter's feedback left out
  Eigen::MatrixXd readings_;
  std::vector<Eigen::MatrixXd> raised_;
  std::vector<Eigen::MatrixXd> slopes_;  // by parameter, samples x (channels (1 + channels)): the readings', then those of raised ones; empty where zero
  Eigen::VectorXd sigma_;
};

}  // namespace unrig
