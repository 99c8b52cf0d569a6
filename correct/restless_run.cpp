#include "correct/restless_run.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/error.h"
#include "core/motion.h"
#include "core/run_inputs.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

MatrixXd triangle_of(MatrixXd rows) {
  const Eigen::HouseholderQR<Eigen::Ref<MatrixXd>> qr(rows);  // in place
  return rows.topRows(std::min(rows.rows(), rows.cols())).triangularView<Eigen::Upper>();
}

/// Samples x channels as one column.
VectorXd flat(const MatrixXd& a) { return a.reshaped(); }

VectorXd masked(const VectorXd& x, const Eigen::Matrix<bool, Eigen::Dynamic, 1>& missing) { return missing.select(VectorXd::Constant(x.size(), std::nan("")), x); }

}  // namespace

RestlessRun::RestlessRun(const AeroelasticModel& model, const Run& run)
    : model_(&model), run_(&run), conditions_(conditions_of(run)), channels_(model.output_channels(run)), convolution_(run.samples()) {
  const Index n = run.samples(), channels = outputs() + 1;
  const LinearSystem system = loaded_system(model, conditions_, model.start_values(), channels_);
  exogenous_ = system.exogenous;
  motion_state_ = system.motion;
  for (Index i = 0; i < system.states(); ++i)
    if (std::find(exogenous_.begin(), exogenous_.end(), i) == exogenous_.end()) kept_.push_back(i);
  inputs_ = run_inputs(run, conditions_);

  measured_.resize(n, channels);
  missing_.resize(n, channels);
  sigma_.resize(channels);
  const Channel* weight = run.find("weight");
  for (Index c = 0; c < channels; ++c) {
    const std::string& name = c < outputs() ? channels_[static_cast<std::size_t>(c)] : "alpha";
    measured_.col(c) = run.channel(name).value;
    for (Index k = 0; k < n; ++k) missing_(k, c) = !std::isfinite(measured_(k, c)) || (weight && !(weight->value[k] > 0));
    sigma_[c] = noise_level(masked(measured_.col(c), missing_.col(c)));
    if (!(sigma_[c] > 0))
      throw InputError({run.file, run.header_line}, fmt::format("the column \"{}\" never changes", name), "wanted a reading that answers to the rig", "Look for a broken cable or a stopped converter.");
  }
  measured_.rightCols(1).array() -= conditions_.onset_angle;
  const std::vector<bool> spike = isolated_spikes(measured_.col(channels - 1), sigma_[channels - 1], {{0, n}});
  for (Index k = 0; k < n; ++k) missing_(k, channels - 1) = missing_(k, channels - 1) || spike[static_cast<std::size_t>(k)];
  fill_between_neighbours();
}

void RestlessRun::fill_between_neighbours() {
  const Index n = samples();
  observations_ = measured_.size() - missing_.count();
  longest_gap_ = 0;
  for (Index c = 0; c < measured_.cols(); ++c)
    for (Index k = 0; k < n; ++k) {
      if (!missing_(k, c)) continue;
      Index end = k;
      while (end < n && missing_(end, c)) ++end;
      const double left = k > 0 ? measured_(k - 1, c) : end < n ? measured_(end, c) : 0, right = end < n ? measured_(end, c) : left;
      for (Index i = k; i < end; ++i) measured_(i, c) = left + (right - left) * static_cast<double>(i - k + 1) / static_cast<double>(end - k + 1);
      if (end - k > longest_gap_) longest_gap_ = end - k, longest_gap_at_ = run_->time(k);
      k = end;
    }
}

RowVectorXd RestlessRun::row(const RowVectorXd& over_model_states) const {
  RowVectorXd all = RowVectorXd::Zero(static_cast<Index>(kept_.size()) + 1);
  all.head(all.size() - 1) = over_model_states(kept_);
  return all;
}

std::shared_ptr<RestlessRun::Point> RestlessRun::point_at(const VectorXd& theta) const {
  auto point = std::make_shared<Point>();
  point->theta = theta;
  LinearSystem& system = point->system;
  system = loaded_system(*model_, conditions_, theta, channels_);
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();
  const ExactStep step = exact_step(system, run_->dt);

  // The filter: kept states, then the jerk.
  const auto states = static_cast<Index>(kept_.size()), n = samples(), channels = outputs() + 1;
  const double cube = run_->dt * run_->dt * run_->dt, tau = roughness_ * sigma_[channels - 1];
  MatrixXd F = MatrixXd::Identity(states + 1, states + 1);
  F.topLeftCorner(states, states) = step.transition.value(kept_, kept_);
  F.topRightCorner(states, 1) = step.jerk.value(kept_, Eigen::all);
  MatrixXd C(channels, states + 1);
  for (Index c = 0; c < outputs(); ++c) C.row(c) = row(system.C.value.row(c));
  C.row(channels - 1) = row(RowVectorXd::Unit(system.states(), motion_state_));
  const VectorXd b = tau / cube * F.rightCols(1);
  point->smoother.emplace(settle(F, b, C, sigma_.cwiseAbs2()), convolution_);
  point->log_determinant = point->smoother->filter().log_determinant;

  // What else reaches the readings: offsets, the level of the angle, signals from any start; and the measured inputs.
  for (Index c = 0; c < channels; ++c) {
    point->columns.emplace_back(MatrixXd::Zero(n, channels));
    point->columns.back().col(c).setOnes();
  }
  for (const Index i : exogenous_) {
    point->columns.emplace_back(MatrixXd::Zero(n, channels));
    point->columns.back().leftCols(outputs()) = coast(system, step, DualMatrix(MatrixXd(VectorXd::Unit(system.states(), i))), n, Partials::none).output.leftCols(outputs());
  }
  MatrixXd y = measured_;
  if (inputs_.cols() > 0) y.leftCols(outputs()) -= drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), n, {}, inputs_, Partials::none).output.leftCols(outputs());
  point->white_columns.resize(n * channels, static_cast<Index>(point->columns.size()));
  for (std::size_t j = 0; j < point->columns.size(); ++j) point->white_columns.col(static_cast<Index>(j)) = flat(point->smoother->innovations(point->columns[j]));
  const MatrixXd white = point->smoother->innovations(y);
  point->linear = point->white_columns.colPivHouseholderQr().solve(flat(white));
  point->left = y;
  for (std::size_t j = 0; j < point->columns.size(); ++j) point->left -= point->linear[static_cast<Index>(j)] * point->columns[j];
  point->white = (flat(white) - point->white_columns * point->linear).reshaped(n, channels);
  point->chi2 = point->white.squaredNorm();
  return point;
}

const RestlessRun::Point& RestlessRun::at(const VectorXd& theta) const {
  if (!last_ || last_->theta != theta) last_ = point_at(theta);
  return *last_;
}

double RestlessRun::growth(const VectorXd& theta) const {
  const LinearSystem system = loaded_system(*model_, conditions_, theta, channels_);
  std::vector<Index> own;  // the shaft's position, velocity and acceleration are driven from outside
  for (const Index i : kept_)
    if (i < motion_state_ || i > motion_state_ + 2) own.push_back(i);
  if (!system.A.value.allFinite()) return INFINITY;
  return MatrixXd(system.A.value(own, own)).eigenvalues().real().maxCoeff() * run_->dt * static_cast<double>(samples());
}

RunResidual::Solution RestlessRun::solve(const VectorXd& theta) const {
  // The filter forgets how a motion grows, but the responses that the slopes are made of run over the whole record.
  constexpr double flutter = 1;
  if (!(growth(theta) < flutter)) return {theta, INFINITY, {}, nullptr};
  const Point& point = at(theta);
  return {theta, point.chi2, point.linear, nullptr};
}

VectorXd RestlessRun::motion(const Point& point, const SettledSmoother::Series& series) const {
  const Index n = samples();
  const double h = run_->dt;
  // At sample k the spline has c_(k-2) = p - h^2 p''/6 and c_(k-1) = p + h p' + h^2 p''/3.
  RowVectorXd inner = RowVectorXd::Zero(point.system.states()), last = inner;
  inner.segment(motion_state_, 3) << 1, 0, -h * h / 6;
  last.segment(motion_state_, 3) << 1, h, h * h / 3;
  const VectorXd found = point.smoother->smoothed(point.smoother->quantity(row(inner)), series);
  VectorXd c = VectorXd::Zero(n);
  c.head(n - 2) = found.tail(n - 2);
  c[n - 2] = point.smoother->smoothed(point.smoother->quantity(row(last)), series)[n - 1];
  c.head(n - 1).array() -= found[1];
  return c;
}

void RestlessRun::slopes(const Point& point, const VectorXcd& motion, const std::vector<Index>& parameters, const std::function<void(Index, const MatrixXd&)>& take) const {
  const LinearSystem system = loaded_system(*model_, conditions_, point.theta, channels_);
  const ExactStep step = exact_step(system, run_->dt);
  constexpr std::size_t at_once = 3;  // responses to a spline in memory
  for (std::size_t first = 0; first < parameters.size(); first += at_once) {
    const std::size_t last = std::min(parameters.size(), first + at_once);
    const std::vector<Index> few(parameters.begin() + static_cast<std::ptrdiff_t>(first), parameters.begin() + static_cast<std::ptrdiff_t>(last));
    Response response = spline_response(system, step, samples(), few);
    for (std::size_t j = first; j < last; ++j) {
      MatrixXd& kernel = response.partial[static_cast<std::size_t>(parameters[j])];
      if (kernel.size() == 0) kernel = MatrixXd::Zero(samples(), system.C.rows());
      if (!kernel.allFinite())
        throw NoAnswer(fmt::format("{}: over so long a record ({} samples) the model's response to the shaft does not stay finite where the search has come to; correct the run in shorter parts", run_->file, samples()));
      for (Index c = 0; c < kernel.cols(); ++c)
        if (!kernel.col(c).isZero(0)) kernel.col(c) = convolution_.past(convolution_.transform(kernel.col(c)), motion);
      take(static_cast<Index>(j), kernel);
      kernel.resize(0, 0);
    }
  }
}

RunResidual::Evaluation RestlessRun::differentiate(const RunResidual::Solution& solution, const std::vector<Index>& parameters) const {
  const Point& point = at(solution.theta);
  const Index n = samples(), channels = outputs() + 1, unknowns = point.linear.size(), count = solution.theta.size();
  const VectorXcd c = convolution_.transform(motion(point, point.smoother->series(point.left)));
  MatrixXd rows(n * channels, static_cast<Index>(parameters.size()) + 1);
  {
    MatrixXd y = MatrixXd::Zero(n, channels);
    slopes(point, c, parameters, [&](Index place, const MatrixXd& slope) {
      y.leftCols(outputs()) = slope.leftCols(outputs());
      rows.col(place) = -flat(point.smoother->innovations(y));
    });
  }
  const auto own = rows.leftCols(rows.cols() - 1);
  const Eigen::HouseholderQR<MatrixXd> reach(point.white_columns);
  RunResidual::Evaluation e;
  e.chi2 = point.chi2;
  e.linear = point.linear;
  e.linear_factor = reach.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
  const MatrixXd basis = reach.householderQ() * MatrixXd::Identity(n * channels, unknowns), along = basis.transpose() * own;
  e.linear_slope = MatrixXd::Zero(unknowns, count);
  e.linear_slope(Eigen::all, parameters) = MatrixXd(e.linear_factor.triangularView<Eigen::Upper>().solve(along));
  rows.leftCols(rows.cols() - 1).noalias() -= basis * along;
  rows.rightCols(1) = flat(point.white);
  const MatrixXd triangle = triangle_of(std::move(rows));
  e.residual = triangle.rightCols(1);
  e.jacobian = MatrixXd::Zero(triangle.rows(), count);
  e.jacobian(Eigen::all, parameters) = triangle.leftCols(triangle.cols() - 1);
  return e;
}

void RestlessRun::settle_noise(const VectorXd& theta) {
  const Point& point = at(theta);
  const SettledSmoother::Series series = point.smoother->series(point.left);
  const Index n = samples(), channels = outputs() + 1, angle = channels - 1;
  const VectorXd sigma = sigma_;
  MatrixXd filled = measured_;
  for (Index c = 0; c < channels; ++c) {
    const SettledSmoother::Quantity q = point.smoother->quantity(point.smoother->filter().C.row(c));
    const VectorXd left = point.left.col(c) - point.smoother->smoothed(q, series);
    // What the smoother leaves has the variance of the noise less that of the estimate.
    const double level = noise_level(masked(left, missing_.col(c)), 1), noise = std::sqrt(level * level + q.variance[n / 2]);
    if (noise > 0) sigma_[c] = std::max(std::min(sigma[c], noise), rounding_level(run_->channel(c < outputs() ? channels_[static_cast<std::size_t>(c)] : "alpha").value));
    filled.col(c) -= missing_.col(c).select(left, VectorXd::Zero(n));
    if (c != angle) continue;
    // Electrical spikes, alone or in pairs: three in a row are a motion that the model forces away from the measured one.
    constexpr double limit = 5;
    const auto off = [&](Index k) { return k >= 0 && k < n && !missing_(k, c) && std::abs(left[k]) > limit * sigma_[c]; };
    std::vector<Index> spikes;
    for (Index k = 0; k < n; ++k)
      if (off(k) && !(off(k - 1) && off(k + 1)) && !(off(k - 2) && off(k - 1)) && !(off(k + 1) && off(k + 2))) spikes.push_back(k);
    for (const Index k : spikes) missing_(k, c) = true, filled(k, c) -= left[k], --observations_;
  }
  measured_ = filled;
  last_.reset();
}

void RestlessRun::settle_roughness(const VectorXd& theta) {
  constexpr double smoothest = -6, roughest = 1, enough = 0.05, golden = 0.6180339887498949;  // decades
  const auto improbability = [&](double decade) {
    roughness_ = std::pow(10, decade);
    const std::shared_ptr<Point> point = point_at(theta);
    return static_cast<double>(samples()) * point->log_determinant + point->chi2;
  };
  double low = smoothest, high = roughest, a = high - golden * (high - low), b = low + golden * (high - low), at_a = improbability(a), at_b = improbability(b);
  while (high - low > enough)
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a, a = high - golden * (high - low), at_a = improbability(a);
    } else {
      low = a, a = b, at_a = at_b, b = low + golden * (high - low), at_b = improbability(b);
    }
  roughness_ = std::pow(10, (low + high) / 2);
  last_.reset();
}

}  // namespace unrig
