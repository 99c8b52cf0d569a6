#include "fit/uncertainty/uncertainty.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "fit/uncertainty/coloured_noise.h"
#include "fit/givens/inexact_uncertainty.h"

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

/// Of a matrix with large and small numbers on its diagonal, by way of a unit diagonal.
MatrixXd inverse_of(const MatrixXd& information) {
  const VectorXd scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Index n = information.cols();
  return scale.asDiagonal() * MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()).ldlt().solve(MatrixXd::Identity(n, n)) * scale.asDiagonal();
}

std::vector<Index> free_unknowns(const JointProblem& joint) {
  std::vector<Index> free;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
    if (!joint.unknowns()[i].held) free.push_back(static_cast<Index>(i));
  return free;
}

/// (J^T J)^-1 of the unknowns, and behind them of the deviations, whose own information is 1.
MatrixXd inverse_information(const JointProblem& joint, const JointProblem::Linearisation& lin, const std::vector<Index>& free, const NumberSlopes* numbers) {
  if (!numbers) return inverse_information(lin.jacobian(Eigen::all, free));
  MatrixXd information = joint_information(joint, *numbers).of_data;
  information.diagonal().tail(numbers->offset.cols()).array() += 1;
  return inverse_of(information);
}

/// Per estimate: its row of `influence` times slopes^T residual, over the samples until half of all that the run says of it.
VectorXd moved_by_earlier_half(const RunResidual::Sensitivity& sensitivity, const MatrixXd& influence) {
  const Index samples = sensitivity.channels.front().residual.size();
  MatrixXd says = MatrixXd::Zero(samples, influence.rows()), pull = says;
  for (const auto& channel : sensitivity.channels) {
    const MatrixXd through = channel.slope * influence.transpose();
    says += through.cwiseAbs2();
    pull += channel.residual.asDiagonal() * through;
  }
  VectorXd moved = VectorXd::Zero(influence.rows());
  for (Index a = 0; a < moved.size(); ++a) {
    const double half = 0.5 * says.col(a).sum();
    double said = 0;
    for (Index k = 0; k < samples && said < half; ++k) {
      said += says(k, a);
      moved[a] += pull(k, a);
    }
  }
  return moved;
}

}  // namespace

JointInformation joint_information(const JointProblem& joint, const NumberSlopes& slopes) {
  JointInformation information{free_unknowns(joint), {}, {}};
  const auto count = static_cast<Index>(information.free.size()), deviations = slopes.offset.cols(), parameters = static_cast<Index>(joint.model().parameters().size());
  information.of_data = MatrixXd::Zero(count + deviations, count + deviations);
  information.downhill = VectorXd::Zero(count + deviations);
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    if (joint.runs()[r].is_aside()) continue;
    std::vector<Index> column, place;  // of the slopes, and where it acts
    for (Index a = 0; a < count; ++a) {
      const Unknown& u = joint.unknowns()[static_cast<std::size_t>(information.free[static_cast<std::size_t>(a)])];
      if (u.run < 0 || u.run == static_cast<int>(r)) column.push_back(u.parameter), place.push_back(a);
    }
    for (Index k = 0; k < deviations; ++k) column.push_back(parameters + k), place.push_back(count + k);
    for (const auto& channel : slopes.runs[r].channels) {
      const MatrixXd own = channel.slope(Eigen::all, column);
      information.of_data(place, place) += MatrixXd(own.transpose() * own);
      information.downhill(place) += VectorXd(own.transpose() * channel.residual);
    }
  }
  return information;
}

MatrixXd told_of_deviations(const JointInformation& information, Index deviations) {
  const Index count = information.of_data.cols() - deviations;
  const VectorXd scale = information.of_data.diagonal().head(count).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const MatrixXd of_parameters = scale.asDiagonal() * information.of_data.topLeftCorner(count, count) * scale.asDiagonal(), with = scale.asDiagonal() * information.of_data.topRightCorner(count, deviations);
  return information.of_data.bottomRightCorner(deviations, deviations) - with.transpose() * of_parameters.ldlt().solve(with);
}

InexactUncertainty inexact_uncertainty(const JointProblem& joint, const NumberSlopes* numbers) {
  InexactUncertainty whole;
  ParameterUncertainty& u = whole.parameters;
  u.free = free_unknowns(joint);
  const auto unknown = [&](Index a) -> const Unknown& { return joint.unknowns()[static_cast<std::size_t>(u.free[static_cast<std::size_t>(a)])]; };
  const auto count = static_cast<Index>(u.free.size()), deviations = numbers ? numbers->offset.cols() : 0;

  const JointProblem::Linearisation lin = joint.linearise();
  const MatrixXd inverse = inverse_information(joint, lin, u.free, numbers);

  const auto runs = static_cast<Index>(joint.runs().size());
  u.offset_slope = MatrixXd::Zero(runs, static_cast<Index>(joint.unknowns().size()));
  for (Index r = 0; r < runs; ++r) {
    const RunResidual& run = joint.runs()[static_cast<std::size_t>(r)];
    const Eigen::RowVectorXd slope = run.evaluate(joint.theta(static_cast<std::size_t>(r)), Partials::all).linear_slope.row(run.first_offset());
    for (std::size_t i = 0; i < joint.unknowns().size(); ++i)
      if (const Unknown& known = joint.unknowns()[i]; known.run < 0 || known.run == static_cast<int>(r)) u.offset_slope(r, static_cast<Index>(i)) = slope[known.parameter];
  }
  MatrixXd by_theta = MatrixXd::Zero(count + runs + deviations, count + deviations);  // what the unknowns and deviations do to themselves and to the offsets
  by_theta.topLeftCorner(count, count).setIdentity();
  by_theta.block(count, 0, runs, count) = u.offset_slope(Eigen::all, u.free);
  if (numbers) by_theta.block(count, count, runs, deviations) = numbers->offset;
  by_theta.bottomRightCorner(deviations, deviations).setIdentity();

  constexpr double significant = 0.01;
  double freedom = -static_cast<double>(count);
  ColouredCovariance coloured;
  const MatrixXd estimates = by_theta * inverse;
  MatrixXd white = estimates * by_theta.transpose();
  const MatrixXd stated = estimates.rightCols(deviations) * estimates.rightCols(deviations).transpose();  // the part of the errors that is the numbers' own
  u.earlier_half = VectorXd::Zero(count);
  for (Index r = 0; r < runs; ++r) {
    const RunResidual& run = joint.runs()[static_cast<std::size_t>(r)];
    if (run.is_aside()) {
      u.whiteness.push_back(1);
      continue;
    }
    const RunResidual::Sensitivity own_sensitivity = numbers ? RunResidual::Sensitivity{} : run.sensitivity(joint.theta(static_cast<std::size_t>(r)));
    const RunResidual::Sensitivity& sensitivity = numbers ? numbers->runs[static_cast<std::size_t>(r)] : own_sensitivity;
    std::vector<VectorXd> residuals;
    for (const auto& channel : sensitivity.channels) {
      residuals.push_back(residual_at_rest(channel.residual, run.motion().phases(), run.linear_unknowns()));
      white(count + r, count + r) += channel.into_offset.squaredNorm();
    }
    u.whiteness.push_back(whiteness(residuals));
    u.coloured |= u.whiteness.back() * static_cast<double>(runs) < significant;
    freedom += static_cast<double>(run.degrees_of_freedom());
    const auto parameters = static_cast<Index>(joint.model().parameters().size());
    const auto acts = [&](Index b) { return unknown(b).run < 0 || unknown(b).run == static_cast<int>(r); };
    MatrixXd influence = MatrixXd::Zero(by_theta.rows(), parameters + deviations), own = MatrixXd::Zero(parameters + deviations, parameters + deviations);
    for (Index b = 0; b < count; ++b)
      if (acts(b)) influence.col(unknown(b).parameter) += estimates.col(b);
    influence.rightCols(deviations) = estimates.rightCols(deviations);
    for (Index a = 0; a < count; ++a)
      if (acts(a)) own.row(unknown(a).parameter) += influence.row(a);
    own.bottomRows(deviations) = influence.bottomRows(deviations);
    coloured.add(coloured_covariance(sensitivity, residuals, influence, count + r, own));
    u.earlier_half += 2 * moved_by_earlier_half(sensitivity, influence.topRows(count));
  }
  const MatrixXd white_all = std::max(1.0, lin.chi2() / freedom) * (white - stated) + stated, coloured_all = coloured.with_its_own_error() + stated;
  u.white_covariance = white_all.topLeftCorner(count + runs, count + runs);
  u.coloured_covariance = coloured_all.topLeftCorner(count + runs, count + runs);
  const MatrixXd& all = u.coloured ? coloured_all : white_all;
  whole.with_deviations = all.topRightCorner(count + runs, deviations);
  whole.of_deviations = all.bottomRightCorner(deviations, deviations);
  return whole;
}

ParameterUncertainty estimate_uncertainty(const JointProblem& joint) { return inexact_uncertainty(joint, nullptr).parameters; }

}  // namespace unrig
