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

  const auto runs = static_cast<Index>(joint.runs().size());
  u.offset_slope = MatrixXd::Zero(runs, static_cast<Index>(joint.unknowns().size()));
  for (Index r = 0; r < runs; ++r) {
    const RunResidual& run = joint.runs()[static_cast<std::size_t>(r)];
    const Eigen::RowVectorXd slope = run.evaluate(joint.theta(static_cast<std::size_t>(r)), Partials::all).linear_slope.row(run.first_offset());
    for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
      if (const Unknown& known = joint.unknowns()[i]; known.run < 0 || known.run == static_cast<int>(r)) u.offset_slope(r, static_cast<Index>(i)) = slope[known.parameter];
  }
  MatrixXd by_theta(count + runs, count);  // what the unknowns do to themselves and to the offsets
  by_theta << MatrixXd::Identity(count, count), u.offset_slope(Eigen::all, u.free);

  constexpr double significant = 0.01;
  double freedom = -static_cast<double>(count);
  ColouredCovariance coloured;
  u.white_covariance = by_theta * inverse * by_theta.transpose();
  for (Index r = 0; r < runs; ++r) {
    const RunResidual& run = joint.runs()[static_cast<std::size_t>(r)];
    if (run.is_aside()) {
      u.whiteness.push_back(1);
      continue;
    }
    const VectorXd theta = joint.theta(static_cast<std::size_t>(r));
    const RunResidual::Sensitivity sensitivity = run.sensitivity(theta);
    std::vector<VectorXd> residuals;
    for (const auto& channel : sensitivity.channels) {
      residuals.push_back(residual_at_rest(channel.residual, run.motion().phases(), run.linear_unknowns()));
      u.white_covariance(count + r, count + r) += channel.into_offset.squaredNorm();
    }
    u.whiteness.push_back(whiteness(residuals));
    u.coloured |= u.whiteness.back() * static_cast<double>(runs) < significant;
    freedom += static_cast<double>(run.degrees_of_freedom());
    const Index parameters = theta.size();
    const auto acts = [&](Index b) { return unknown(b).run < 0 || unknown(b).run == static_cast<int>(r); };
    MatrixXd influence = MatrixXd::Zero(count + runs, parameters), own = MatrixXd::Zero(parameters, parameters);
    const MatrixXd estimates = by_theta * inverse;
    for (Index b = 0; b < count; ++b)
      if (acts(b)) influence.col(unknown(b).parameter) += estimates.col(b);
    for (Index a = 0; a < count; ++a)
      if (acts(a)) own.row(unknown(a).parameter) += influence.row(a);
    coloured.add(coloured_covariance(sensitivity, residuals, influence, count + r, own));
  }
  u.white_covariance *= std::max(1.0, lin.chi2() / freedom);
  u.coloured_covariance = coloured.with_its_own_error();
  return u;
}

}  // namespace unrig
