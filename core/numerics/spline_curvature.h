#pragma once
#include <Eigen/Core>

namespace unrig {

/// Second derivatives at its knots of the cubic spline through samples `dt` apart: u''_{k-1} + 4 u''_k + u''_{k+1} = 6 (u_{k-1} - 2 u_k + u_{k+1})/dt^2.
/// At either end the third derivative is the same over two steps (not-a-knot): a cubic is its own spline from four samples on, a parabola from three.
/// Below three samples it is straight. Linear time (C. de Boor, A Practical Guide to Splines, 1978, ch. IV).
Eigen::VectorXd spline_curvature(const Eigen::VectorXd& value, double dt);

}  // namespace unrig
