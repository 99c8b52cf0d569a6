#pragma once
#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/law/law.h"
#include "fit/search/decays_first.h"

namespace unrig {

/// Forces that are known but for their size, regressed on free decays beside a linear rig whose stiffness and damping may change.
///
/// Every force, evaluated on the states that the readings ask for, is sent through the linear rig onto the readings. With e_k the innovations of the Kalman filter of an unknown force of density q (fit/force/missing_force.h),
///
///   e_k(readings) = sum over shifts a e_k(force of shift) + sum over initial states + offset + sum over forces c e_k(force)
///
/// is linear in all that is looked for. q is smaller the more the forces explain: the normal equations stand at several q, over all decays together. Laws at work in `beside` are left out of the rig.
class LawRegression {
 public:
  /// Forces along a decay, samples x count [N or N m]. `states`: x, v, twist and twist rate in SI, 4 x samples.
  using Forces = std::function<Eigen::MatrixXd(const Eigen::MatrixXd& states, const Conditions& conditions, double dt)>;
  LawRegression(ActsOn place, const BesideUnknownForces& beside, const Forces& forces);

  /// Normal equations at one density of the unknown force, shifts, initial states and offsets eliminated.
  struct Level {
    Eigen::MatrixXd products;  ///< [forces | readings]' [forces | readings] of innovations over their standard deviation
    double entropy = 0;        ///< sum of ln(variance of an innovation)
    double density = 1;        ///< of the unknown force, over what the decays ask for where no law is known
    /// -2 ln likelihood with no force, but for a constant.
    double deviance() const { return products(products.rows() - 1, products.rows() - 1) + entropy; }
  };
  /// By falling density; empty where no decay tells anything.
  const std::vector<Level>& levels() const { return levels_; }
  double samples() const { return samples_; }
  /// Least -2 ln likelihood with no force.
  double deviance() const;

 private:
  std::vector<Level> levels_;
  double samples_ = 0;
};

}  // namespace unrig
