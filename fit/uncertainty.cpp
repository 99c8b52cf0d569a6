#include "fit/uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "fit/coloured_noise.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// (J^T J)^-1 by way of a unit diagonal.
MatrixXd inverse_information(const MatrixXd& jacobian) {
  const VectorXd scale = jacobian.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const MatrixXd scaled = jacobian * scale.asDiagonal();
  const Index n = jacobian.cols();
  return scale.asDiagonal() * (scaled.transpose() * scaled).ldlt().solve(MatrixXd::Identity(n, n)) * scale.asDiagonal();
}

}  // namespace

ParameterUncertainty estimate_uncertainty(const JointProblem& joint) {
  ParameterUncertainty u;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
    if (!joint.unknowns()[i].held) u.free.push_back(static_cast<Index>(i));
  const auto unknown = [&](Index a) -> const Unknown& { return joint.unknowns()[static_cast<std::size_t>(u.free[static_cast<std::size_t>(a)])]; };
  const auto count = static_cast<Index>(u.free.size());

  const JointProblem::Linearisation lin = joint.linearise();
  MatrixXd jacobian(lin.jacobian.rows(), count);
  for (Index a = 0; a < count; ++a) jacobian.col(a) = lin.jacobian.col(u.free[static_cast<std::size_t>(a)]);
  const MatrixXd inverse = inverse_information(jacobian);

  constexpr double significant = 0.01;
  double freedom = -static_cast<double>(count);
  MatrixXd middle = MatrixXd::Zero(count, count);
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual::Sensitivity sensitivity = joint.runs()[r].sensitivity(joint.theta(r));
    u.whiteness.push_back(whiteness(sensitivity));
    u.coloured |= u.whiteness.back() * static_cast<double>(joint.runs().size()) < significant;
    freedom += static_cast<double>(joint.runs()[r].degrees_of_freedom());
    const MatrixXd run = coloured_information(sensitivity);
    const auto acts = [&](const Unknown& x) { return x.run < 0 || x.run == static_cast<int>(r); };
    for (Index a = 0; a < count; ++a)
      for (Index b = 0; b < count; ++b)
        if (acts(unknown(a)) && acts(unknown(b))) middle(a, b) += run(unknown(a).parameter, unknown(b).parameter);
  }
  u.white_covariance = inverse * std::max(1.0, lin.chi2() / freedom);
  u.coloured_covariance = inverse * middle * inverse;
  return u;
}

}  // namespace unrig
