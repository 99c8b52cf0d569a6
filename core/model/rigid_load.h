#pragma once
#include <Eigen/Core>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/run/motion.h"

namespace unrig {

/// The load that a perfectly rigid rig would feel under a prescribed pitch, as deviation from the steady load before the motion:
///
///   circulatory       s rho U b L Int phi(U (t-t')/b) dw(t'),  w = U p + (1/2 - a) b p'      (seed, Eq. 2.6, 2.9)
///   non-circulatory   pi rho b^2 L (U p' - C_a a b p'')                                       (Eq. 2.11, 2.12)
///
/// over the whole submerged length L, in newtons. Both are rows over the states of a small linear system (lags, p, p', p'') that is
/// propagated exactly for cubic-spline motion.
struct RigidLoad {
  /// State of lags, p, p', p'', and how it moves with the motion's unknowns and with theta.
  struct State {
    Eigen::VectorXd value;
    Eigen::MatrixXd by_motion, by_theta;
  };

  Eigen::VectorXd circulatory;    ///< per sample [N]
  Eigen::VectorXd normal_force;   ///< circulatory + non-circulatory [N]
  Eigen::MatrixXd circulatory_by_motion;   ///< samples asked for x motion unknowns [N/rad]
  Eigen::MatrixXd normal_force_by_motion;
  Eigen::MatrixXd circulatory_by_theta;    ///< samples asked for x model parameters
  Eigen::MatrixXd normal_force_by_theta;
  State behind;                            ///< the last sample, for a motion that goes on
};

/// At theta of `model` (its slope, circulation and C_a act) for the motion with unknowns `u`; the load at every sample, its slopes at the samples
/// `slopes_at` (ascending; empty: all). `from`: the state in which the motion begins, known but for what theta does to it (it moves the motion before); empty: at rest. Throws std::invalid_argument for a modal rig.
RigidLoad rigid_load(const AeroelasticModel& model, const Conditions& conditions, const Eigen::VectorXd& theta, const MotionBasis& motion, double dt,
                     const Eigen::VectorXd& u, std::vector<Eigen::Index> slopes_at = {}, const RigidLoad::State& from = {});

}  // namespace unrig
