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
  ColouredCovariance coloured;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual::Sensitivity sensitivity = joint.runs()[r].sensitivity(joint.theta(r));
    u.whiteness.push_back(whiteness(sensitivity));
    u.coloured |= u.whiteness.back() * static_cast<double>(joint.runs().size()) < significant;
    freedom += static_cast<double>(joint.runs()[r].degrees_of_freedom());
    const Index parameters = joint.theta(r).size();
    MatrixXd influence = MatrixXd::Zero(count, parameters), own = MatrixXd::Zero(parameters, parameters);
    for (Index b = 0; b < count; ++b)
      if (unknown(b).run < 0 || unknown(b).run == static_cast<int>(r)) influence.col(unknown(b).parameter) += inverse.col(b);
    for (Index a = 0; a < count; ++a)
      if (unknown(a).run < 0 || unknown(a).run == static_cast<int>(r)) own.row(unknown(a).parameter) += influence.row(a);
    coloured.add(coloured_covariance(sensitivity, influence, own));
  }
  u.white_covariance = inverse * std::max(1.0, lin.chi2() / freedom);
  u.coloured_covariance = coloured.with_its_own_error();
  return u;
}

}  // namespace unrig
