#include "correct/estimate/uncertainty_budget.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// R of rows whose columns may differ by many powers of ten.
MatrixXd triangle(const MatrixXd& rows, VectorXd& scale) {
  scale = rows.colwise().norm().transpose().cwiseMax(1e-300).cwiseInverse();
  const Eigen::HouseholderQR<MatrixXd> qr(rows * scale.asDiagonal());
  MatrixXd r = qr.matrixQR().topRows(std::min(rows.rows(), rows.cols())).triangularView<Eigen::Upper>();
  r.conservativeResizeLike(MatrixXd::Zero(rows.cols(), rows.cols()));
  constexpr double undetermined = 1e-11;  // as in RunResidual: what no row sees stays where it is
  for (Index j = 0; j < r.cols(); ++j)
    if (std::abs(r(j, j)) < undetermined) {
      r.row(j).setZero();
      r(j, j) = 1 / undetermined;
    }
  return r;
}

/// Columns whose products with themselves sum to (rows^T rows)^-1.
MatrixXd inverse_root(const MatrixXd& rows) {
  VectorXd scale;
  const MatrixXd r = triangle(rows, scale);
  return scale.asDiagonal() * MatrixXd(r.triangularView<Eigen::Upper>().solve(MatrixXd::Identity(r.rows(), r.cols())));
}

/// Information of the angle channel on c. While the shaft rests all rows are alike and are one row with their common weight.
MatrixXd angle_information(const RunResidual& residual) {
  const Index unknowns = residual.linear_unknowns(), motion = residual.motion().unknowns(), samples = residual.angle_weight().size();
  constexpr Index block = 2048;
  MatrixXd information = MatrixXd::Zero(unknowns, unknowns);
  const auto add = [&](const Interval& range, const VectorXd& weight) {
    MatrixXd rows = MatrixXd::Zero(range.length(), unknowns);
    rows.leftCols(motion) = residual.motion().angle_columns(range);
    rows.rightCols(1).setOnes();  // the angle before the motion comes last
    rows = weight.asDiagonal() * rows;
    information.selfadjointView<Eigen::Lower>().rankUpdate(rows.transpose());
  };
  Index at = 0;
  const auto rest_until = [&](Index end) {
    if (at < end) add({at, at + 1}, VectorXd::Constant(1, residual.angle_weight().segment(at, end - at).norm()));
    at = std::max(at, end);
  };
  for (const Interval& active : residual.motion().active()) {
    rest_until(active.first);
    for (const Index last = std::min(samples, active.last); at < last; at = std::min(last, at + block)) {
      const Interval range{at, std::min(last, at + block)};
      add(range, residual.angle_weight().segment(range.first, range.length()));
    }
  }
  rest_until(samples);
  return information.selfadjointView<Eigen::Lower>();
}

MatrixXd place(const MatrixXd& part, const std::vector<Index>& at, Index size) {
  MatrixXd full = MatrixXd::Zero(size, part.cols());
  full(at, Eigen::all) = part;
  return full;
}

/// Rows of the motion's prior times what stands in the rows of c.
MatrixXd roughness_of(const MatrixXd& motion_prior, const MatrixXd& c_rows) { return motion_prior.rows() > 0 ? MatrixXd(motion_prior * c_rows) : MatrixXd::Zero(0, c_rows.cols()); }

}  // namespace

MatrixXd variance_shares(const MatrixXd& by_source, const VectorXd& of_givens) {
  MatrixXd shares = MatrixXd::Zero(by_source.rows(), static_cast<Index>(share_names.size()));
  const auto variance = [&](Source s) -> VectorXd { return by_source.col(static_cast<Index>(s)).cwiseAbs2(); };
  shares.col(0) = variance(Source::gauge);
  shares.col(1) = variance(Source::angle);
  shares.col(2) = variance(Source::calibration);
  if (of_givens.size() > 0) shares.col(4) = of_givens.cwiseAbs2();
  shares.col(3) = (variance(Source::rig) - shares.col(4)).cwiseMax(0);
  shares.col(5) = variance(Source::regularisation);
  const VectorXd whole = shares.rowwise().sum();
  return shares.array().colwise() / whole.array();
}

ThetaKnown theta_known(const RunResidual& residual, const RunResidual::Evaluation& e, const MatrixXd& motion_prior) {
  const MatrixXd& S = e.linear_slope;
  const MatrixXd rough = roughness_of(motion_prior, S);
  return {S.transpose() * angle_information(residual) * S, rough.transpose() * rough};
}

MatrixXd theta_root(const RunResidual::Evaluation& e, const Prior& prior) {
  const MatrixXd known = prior.rows();
  MatrixXd rows(e.jacobian.rows() + known.rows(), e.jacobian.cols());
  rows << e.jacobian, known;
  return place(inverse_root(rows(Eigen::all, prior.free)), prior.free, e.jacobian.cols());
}

UncertaintyBudget::UncertaintyBudget(const RunResidual& residual, const RunResidual::Evaluation& e, const Prior& prior, const MatrixXd& motion_prior, const std::optional<OtherParts>& others,
                                     double calibration_uncertainty, double inflation)
    : UncertaintyBudget(
          e, prior,
          [&](const MatrixXd& F, const MatrixXd&) -> Shares {
            const MatrixXd c_rows = F.bottomRows(e.linear.size()), rough = roughness_of(motion_prior, c_rows);
            Shares shares{c_rows.transpose() * angle_information(residual) * c_rows, rough.transpose() * rough};
            if (others) {
              const MatrixXd theta_rows = F.topRows(e.jacobian.cols());
              shares.angle += theta_rows.transpose() * others->known.angle * theta_rows;
              shares.roughness += theta_rows.transpose() * others->known.roughness * theta_rows;
            }
            return shares;
          },
          [&](const MatrixXd& F, const MatrixXd& gauge) -> VectorXd {
            if (others) return others->answer_to_reading;
            VectorXd reading = VectorXd::Zero(F.cols());  // (0, c) in the coordinates of F
            const Index unknowns = e.linear.size();
            reading.tail(unknowns) = F.bottomRightCorner(unknowns, unknowns).colPivHouseholderQr().solve(e.linear);
            return F * (gauge * reading);
          },
          calibration_uncertainty, inflation) {}

UncertaintyBudget::UncertaintyBudget(const RunResidual::Evaluation& e, const Prior& prior, const SharesOf& shares, const AnswerToReading& reading, double calibration_uncertainty,
                                     double inflation) {
  const Index parameters = e.jacobian.cols(), unknowns = e.linear.size();
  // H^-1 = F F^T over (theta, c), with c = slope theta + what is left of it at given theta.
  const MatrixXd root_of_theta = theta_root(e, prior);
  const Index thetas = root_of_theta.cols();
  MatrixXd F = MatrixXd::Zero(parameters + unknowns, thetas + unknowns);
  F.topLeftCorner(parameters, thetas) = root_of_theta;
  F.bottomLeftCorner(unknowns, thetas) = e.linear_slope * root_of_theta;
  F.bottomRightCorner(unknowns, unknowns) = inverse_root(e.linear_factor);

  // Shares F^T I_s F; the gauge's is what is left of the identity.
  const auto share = [](const MatrixXd& a) -> MatrixXd { return a.transpose() * a; };
  const MatrixXd amplitudes = share(prior.regularisation() * F.topRows(parameters)), rig = share(prior.known * F.topRows(parameters));
  const Shares of_run = shares(F, amplitudes + rig);
  const MatrixXd smoothing = amplitudes + of_run.roughness;
  const MatrixXd gauge = MatrixXd::Identity(F.cols(), F.cols()) - of_run.angle - smoothing - rig;

  const auto root_of_share = [&](const MatrixXd& a) -> MatrixXd {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(a);
    return F * (eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal());
  };
  const auto source = [&](Source s) -> MatrixXd& { return by_source_[static_cast<std::size_t>(s)]; };
  source(Source::gauge) = inflation * root_of_share(gauge);
  source(Source::angle) = inflation * root_of_share(of_run.angle);
  source(Source::regularisation) = root_of_share(smoothing);
  source(Source::rig) = root_of_share(rig);
  if (!prior.held.empty()) {
    const MatrixXd held = e.jacobian(Eigen::all, prior.held) * prior.held_root;
    const MatrixXd answer = place(prior.held_root, prior.held, parameters) - root_of_theta * (root_of_theta.transpose() * e.jacobian.transpose() * held);
    source(Source::rig).resize(parameters + unknowns, held.cols());
    source(Source::rig) << answer, e.linear_slope * answer;
  }
  source(Source::calibration) = calibration_uncertainty * reading(F, gauge);
  gather();
}

void UncertaintyBudget::add(Source s, const MatrixXd& columns) {
  MatrixXd& all = by_source_[static_cast<std::size_t>(s)];
  const Index before = all.cols();
  all.conservativeResize(columns.rows(), before + columns.cols());
  all.rightCols(columns.cols()) = columns;
  gather();
}

void UncertaintyBudget::gather() {
  Index columns = 0;
  for (const MatrixXd& s : by_source_) columns += s.cols();
  root_.resize(by_source_.front().rows(), columns);
  Index at = 0;
  for (const MatrixXd& s : by_source_) root_.middleCols(at, s.cols()) = s, at += s.cols();
}

Index UncertaintyBudget::first_column(Source s) const {
  Index first = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(s); ++i) first += by_source_[i].cols();
  return first;
}

UncertaintyBySource UncertaintyBudget::of(const MatrixXd& by_theta, const MatrixXd& by_c) const {
  MatrixXd rows(by_theta.rows(), by_theta.cols() + by_c.cols());
  rows << by_theta, by_c;
  UncertaintyBySource u;
  u.by_source.resize(rows.rows(), sources);
  const MatrixXd all = rows * root_;
  Index at = 0;
  for (Index s = 0; s < sources; ++s) {
    const Index width = by_source_[static_cast<std::size_t>(s)].cols();
    u.by_source.col(s) = all.middleCols(at, width).rowwise().norm();
    at += width;
  }
  u.std = u.by_source.rowwise().norm();
  u.length = curve_length(all);
  u.simultaneous = simultaneous_factor_of_length(u.length);
  return u;
}

double curve_length(const MatrixXd& rows) {
  double length = 0;
  VectorXd before;
  for (Index i = 0; i < rows.rows(); ++i) {
    const double norm = rows.row(i).norm();
    if (!(norm > 0)) continue;
    const VectorXd here = rows.row(i).transpose() / norm;
    // From the chord: the cosine of a small angle has no digits left.
    if (before.size() > 0) length += 2 * std::asin(std::min(1.0, (here - before).norm() / 2));
    before = here;
  }
  return length;
}

double simultaneous_factor(const MatrixXd& rows) { return simultaneous_factor_of_length(curve_length(rows)); }

double simultaneous_factor_of_length(double length) {
  const auto beyond = [&](double c) { return length / std::numbers::pi * std::exp(-c * c / 2) + std::erfc(c / std::numbers::sqrt2); };
  double low = 1, high = 10;
  while (high - low > 1e-6) (beyond((low + high) / 2) > 0.05 ? low : high) = (low + high) / 2;
  return high;
}

}  // namespace unrig
