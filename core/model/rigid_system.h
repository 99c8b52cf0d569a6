#pragma once
#include <Eigen/Core>

#include "core/model/aeroelastic_model.h"
#include "core/run/motion.h"

namespace unrig {

/// A perfectly rigid rig as a system of its own: the loads over all strips (span l) under a prescribed pitch p, as deviations from the
/// steady state before the motion (seed, Eq. 2.6-2.15; axis a, s and C_a as in AeroelasticModel):
///
///   circulatory   s rho U b l Int phi(U (t - t')/b) dw(t'),   w = U p + (1/2 - a) b p'          (Eq. 2.8)
///   normal_force  circulatory - C_a pi rho b^3 l a p'' + pi rho b^2 l U p'                       (Eq. 2.11, 2.12, 2.14)
///   moment        (1/2 + a) b circulatory - C_a pi rho b^4 l (1/8 + a^2) p'' - (1/2 - a) pi rho b^3 l U p'   (Eq. 2.13, 2.15)
///
/// about the pitch axis, nose up. States: one lag per term of the circulation, then angle, rate and acceleration; outputs in the order
/// above, with exact partials in slope, C_a and free amplitudes of the circulation. It takes the same motions as the flexible rig, ideal steps
/// included. Throws std::invalid_argument for a rig that is known only as modes.
LinearSystem rigid_system(const AeroelasticModel& model, const Conditions& conditions, const Eigen::VectorXd& theta);

/// What `motion` does to a system that carries the pitch, from rest: samples x outputs, exact for a motion whose jerk is constant over each
/// step.
Eigen::MatrixXd motion_response(const LinearSystem& system, const Motion& motion, double dt);

}  // namespace unrig
