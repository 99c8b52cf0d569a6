#include "correct/long_motion/restless_run.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/numerics/in_parallel.h"
#include "core/run/motion.h"
#include "core/model/run_inputs.h"

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
auto flat(const MatrixXd& a) { return Eigen::Map<const VectorXd>(a.data(), a.size()); }

bool knows(const MatrixXd& R, Index j) {
  constexpr double nothing = 1e-13;
  return std::abs(R(j, j)) > nothing * R.col(j).head(j + 1).norm();
}

/// x with R' x = g; zero where R knows nothing of it.
VectorXd solve_below(const MatrixXd& R, VectorXd g) {
  for (Index j = 0; j < g.size(); ++j) g[j] = knows(R, j) ? (g[j] - R.col(j).head(j).dot(g.head(j))) / R(j, j) : 0;
  return g;
}

/// x with R x = y; zero where R knows nothing of it.
VectorXd solve_above(const MatrixXd& R, VectorXd y) {
  for (Index j = y.size() - 1; j >= 0; --j) {
    y[j] = knows(R, j) ? y[j] / R(j, j) : 0;
    y.head(j) -= y[j] * R.col(j).head(j);
  }
  return y;
}

/// What a unit spline does to all outputs, by parameter, as a Convolution wants to know it; empty where a parameter does not act.
struct SplineKernels {
  std::vector<MatrixXd> near, far;
};

SplineKernels spline_kernels(const LinearSystem& system, const ExactStep& step, const ExactStep& stride, const Convolution& convolution, const std::vector<Index>& parameters) {
  if (convolution.far() == 0) {
    std::vector<MatrixXd> near = spline_response(system, step, convolution.near(), parameters).partial;
    std::vector<MatrixXd> none(near.size(), MatrixXd(0, system.C.rows()));
    return {std::move(near), std::move(none)};
  }
  const LinearSystem few = with_partials_of(system, parameters);
  const Response first = spline_response(system, step, convolution.half(), parameters);
  const Response second = FreeResponse(few, with_partials_of(step, parameters), Partials::all).from(first.end, convolution.near() - convolution.half());
  SplineKernels kernels{first.partial, FreeResponse(few, with_partials_of(stride, parameters), Partials::all).from(first.end, convolution.far()).partial};
  for (std::size_t j = 0; j < kernels.near.size(); ++j) {
    if (first.partial[j].size() == 0) continue;
    kernels.near[j].resize(convolution.near(), system.C.rows());
    kernels.near[j] << first.partial[j], second.partial[j];
  }
  return kernels;
}

VectorXd masked(const VectorXd& x, const Eigen::Matrix<bool, Eigen::Dynamic, 1>& missing) { return missing.select(VectorXd::Constant(x.size(), std::nan("")), x); }

}  // namespace

RestlessRun::RestlessRun(const AeroelasticModel& model, const Run& run, Index in_one_piece)
    : model_(&model), run_(&run), conditions_(conditions_of(run)), in_one_piece_(in_one_piece), channels_(model.output_channels(run)) {
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
  whole_ = 0;
  for (Index k = 0; k < n; ++k) whole_ += missing_.row(k).any() ? 0 : 1;
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
  SettledFilter filter = settle(F, b, C, sigma_.cwiseAbs2());
  const std::shared_ptr<const Convolution> convolution = convolution_for(filter.L, system);
  point->smoother.emplace(std::move(filter), convolution);
  point->log_determinant = point->smoother->filter().log_determinant;
  set_freedom(*point, step);

  // What else reaches the readings: offsets, the level of the angle, signals from any start; and the measured inputs.
  for (const Index i : exogenous_) {
    point->signals.emplace_back(MatrixXd::Zero(n, channels));
    point->signals.back().leftCols(outputs()) = coast(system, step, DualMatrix(MatrixXd(VectorXd::Unit(system.states(), i))), n, Partials::none).output.leftCols(outputs());
  }
  const Index unknowns = channels + static_cast<Index>(exogenous_.size());
  point->left = measured_;
  if (inputs_.cols() > 0) point->left.leftCols(outputs()) -= drive(system, step, DualMatrix(MatrixXd::Zero(system.states(), 1)), n, {}, inputs_, Partials::none).output.leftCols(outputs());
  MatrixXd rows(n * channels, unknowns + 1);
  for (Index j = 0; j < unknowns; ++j) rows.col(j) = flat(point->smoother->innovations(column(*point, j)));
  point->white = point->smoother->innovations(point->left);
  rows.rightCols(1) = flat(point->white);
  point->white_columns = rows.leftCols(unknowns);
  const MatrixXd triangle = triangle_of(std::move(rows));
  point->linear_factor = triangle.topLeftCorner(unknowns, unknowns);
  point->linear = triangle.leftCols(unknowns).colPivHouseholderQr().solve(triangle.rightCols(1)).col(0);
  for (Index j = 0; j < unknowns; ++j) point->left -= point->linear[j] * column(*point, j);
  Eigen::Map<VectorXd>(point->white.data(), point->white.size()) -= point->white_columns * point->linear;
  point->chi2 = point->white.squaredNorm();
  return point;
}

void RestlessRun::set_freedom(Point& point, const ExactStep& step) const {
  const Convolution& convolution = point.smoother->convolution();
  const VectorXd none = VectorXd::Zero(convolution.far());
  const Response spline = spline_response(point.system, step, convolution.near(), {});
  const Index angle = outputs();
  const double tau = roughness_ * sigma_[angle];
  for (Index c = 0; c < outputs(); ++c) {
    const VectorXcd line = convolution.kernel(spline.output.col(c), none).fine;
    if (c == 0) point.frees.resize(line.size(), outputs());
    point.frees.col(c) = line.conjugate() / std::pow(sigma_[c], 2);
  }
  point.precision.resize(point.frees.rows());
  VectorXd smooth(point.frees.rows());  // Pi / D
  for (Index k = 0; k < smooth.size(); ++k) {
    const double w = 2 * std::acos(-1.0) * static_cast<double>(k) / static_cast<double>(convolution.length());
    const double pi = std::pow(2 - 2 * std::cos(w), 4) / (tau * tau), information = point.frees.row(k).cwiseAbs2() * sigma_.head(outputs()).cwiseAbs2() + std::pow((4 + 2 * std::cos(w)) / (6 * sigma_[angle]), 2);
    point.precision[k] = information + pi;
    smooth[k] = pi / point.precision[k];
    point.frees.row(k) *= 2 * static_cast<double>(whole_) * smooth[k] / point.precision[k];
  }
  point.freedom = static_cast<double>(whole_) * (1 - convolution.mean(smooth));
}

MatrixXd RestlessRun::column(const Point& point, Index j) const {
  const Index channels = outputs() + 1;
  if (j >= channels) return point.signals[static_cast<std::size_t>(j - channels)];
  MatrixXd offset = MatrixXd::Zero(samples(), channels);
  offset.col(j).setOnes();
  return offset;
}

std::vector<Index> RestlessRun::driven_states() const {
  std::vector<Index> driven;
  for (const Index i : kept_)
    if (i < motion_state_ || i > motion_state_ + 2) driven.push_back(i);
  return driven;
}

std::shared_ptr<const Convolution> RestlessRun::convolution_for(const MatrixXd& L, const LinearSystem& system) const {
  Index near = 0;
  if (samples() > in_one_piece_) {
    const std::vector<Index> driven = driven_states();
    const VectorXcd of_rig = (MatrixXd(system.A.value(driven, driven)).eigenvalues() * run_->dt).array().exp(), of_filter = L.eigenvalues();
    VectorXcd both(of_rig.size() + of_filter.size());
    both << of_rig, of_filter;
    near = near_samples(both, samples());
  }
  if (!convolution_ || convolution_->near() != (near > 0 ? near : samples())) convolution_ = std::make_shared<const Convolution>(samples(), near);
  return convolution_;
}

const RestlessRun::Point& RestlessRun::at(const VectorXd& theta) const {
  if (!last_ || last_->theta != theta) {
    last_.reset();
    last_ = point_at(theta);
  }
  return *last_;
}

void RestlessRun::forget_readings() {
  measured_.resize(0, 0), inputs_.resize(0, 0), missing_.resize(0, 0);
  if (!last_) return;
  last_->signals.clear();
  for (MatrixXd* m : {&last_->white_columns, &last_->left, &last_->white}) m->resize(0, 0);
  last_->frees.resize(0, 0);
}

double RestlessRun::growth(const VectorXd& theta) const {
  const LinearSystem system = loaded_system(*model_, conditions_, theta, channels_);
  const std::vector<Index> own = driven_states();  // the shaft's position, velocity and acceleration are driven from outside
  if (!system.A.value.allFinite()) return INFINITY;
  return MatrixXd(system.A.value(own, own)).eigenvalues().real().maxCoeff() * run_->dt * static_cast<double>(samples());
}

RunResidual::Solution RestlessRun::solve(const VectorXd& theta) const {
  // The filter forgets how a motion grows, but the responses that the slopes are made of run over the whole record.
  constexpr double flutter = 1;
  if (!(growth(theta) < flutter)) return {theta, INFINITY, {}, nullptr};
  const Point& point = at(theta);
  return {theta, point.objective(), point.linear, nullptr};
}

VectorXd RestlessRun::motion(const Point& point) const {
  const Index n = samples();
  const double h = run_->dt;
  // At sample k the spline has c_(k-2) = p - h^2 p''/6 and c_(k-1) = p + h p' + h^2 p''/3.
  RowVectorXd inner = RowVectorXd::Zero(point.system.states()), last = inner;
  inner.segment(motion_state_, 3) << 1, 0, -h * h / 6;
  last.segment(motion_state_, 3) << 1, h, h * h / 3;
  const SettledSmoother::Quantity of_inner = point.smoother->quantity(row(inner)), of_last = point.smoother->quantity(row(last));
  const MatrixXd found = point.smoother->smoothed({&of_inner, &of_last}, point.left, point.white);
  VectorXd c = VectorXd::Zero(n);
  c.head(n - 2) = found.col(0).tail(n - 2);
  c[n - 2] = found(n - 1, 1);
  c.head(n - 1).array() -= found(1, 0);
  return c;
}

void RestlessRun::slopes(const Point& point, const VectorXd& motion, const std::vector<Index>& parameters, const std::vector<Index>& at, const std::function<void(Index, Slope)>& take) const {
  const LinearSystem system = loaded_system(*model_, conditions_, point.theta, channels_);
  const ExactStep step = exact_step(system, run_->dt);
  const Convolution& convolution = point.smoother->convolution();
  ExactStep stride = step;
  if (convolution.far() > 0) stride.transition = power(step.transition, convolution.stride());
  constexpr std::size_t at_once = 2;  // responses to a spline in memory
  in_parallel((parameters.size() + at_once - 1) / at_once, [&](std::size_t group) {
    const std::size_t first = group * at_once, last = std::min(parameters.size(), first + at_once);
    const std::vector<Index> few(parameters.begin() + static_cast<std::ptrdiff_t>(first), parameters.begin() + static_cast<std::ptrdiff_t>(last));
    const SplineKernels kernels = spline_kernels(system, step, stride, convolution, few);
    for (std::size_t j = 0; j < few.size(); ++j) {
      const auto parameter = static_cast<std::size_t>(few[j]);
      const MatrixXd &near = kernels.near[parameter], &far = kernels.far[parameter];
      if (!near.allFinite() || !far.allFinite())
        throw NoAnswer(fmt::format("{}: over so long a record ({} samples) the model's response to the shaft does not stay finite where the search has come to; correct the run in shorter parts", run_->file, samples()));
      double freedom = 0;
      // Outputs [first, first + count) into as many of `columns` columns.
      const auto outputs_of = [&](Index first_output, Index wanted, Index columns, const std::vector<Index>& where) {
        std::vector<Convolution::Kernel> kernel;
        std::vector<Convolution::Sum> sums;
        kernel.reserve(static_cast<std::size_t>(wanted));
        for (Index c = 0; c < wanted && near.size() > 0; ++c) {
          if (near.col(first_output + c).isZero(0)) continue;
          kernel.push_back(convolution.kernel(near.col(first_output + c), far.col(first_output + c)));
          sums.push_back({&kernel.back(), motion.data(), Convolution::Direction::past, c});
          if (first_output == 0) freedom += convolution.mean(kernel.back().fine.cwiseProduct(point.frees.col(c)).real());
        }
        return convolution.sums(sums, columns, where);
      };
      MatrixXd readings = outputs_of(0, outputs(), outputs() + 1, {});
      take(static_cast<Index>(first + j), {std::move(readings), at.empty() ? MatrixXd() : outputs_of(outputs(), near.cols() - outputs(), near.cols() - outputs(), at), freedom});
    }
  });
}

Index RestlessRun::stride_of_motion() const {
  constexpr double radian = 1, most = 16;
  return static_cast<Index>(std::clamp(radian / std::pow(roughness_, 0.25), 1.0, most));
}

RestlessRun::Looked RestlessRun::looked() const {
  constexpr Index end = 512;
  const Index n = samples(), stride = n > in_one_piece_ ? stride_of_motion() : 1;
  Looked looked;
  for (Index k = 0; k < n; k += k < end || k >= n - end ? 1 : std::min(stride, n - end - k)) looked.at.push_back(k);
  const auto count = static_cast<Index>(looked.at.size());
  looked.weight.resize(count);
  const auto place = [&](Index i) { return static_cast<double>(looked.at[static_cast<std::size_t>(std::clamp<Index>(i, 0, count - 1))]); };
  for (Index i = 0; i < count; ++i) looked.weight[i] = (place(i + 1) - place(i - 1)) / 2;
  looked.weight[0] += 0.5, looked.weight[count - 1] += 0.5;
  return looked;
}

RunResidual::Evaluation RestlessRun::differentiate(const RunResidual::Solution& solution, const std::vector<Index>& parameters) const {
  const Point& point = at(solution.theta);
  const Index channels = outputs() + 1, unknowns = point.linear.size(), count = solution.theta.size(), chosen = static_cast<Index>(parameters.size());
  const Looked looked_at = looked();
  const auto some = static_cast<Index>(looked_at.at.size());
  const VectorXd root = looked_at.weight.cwiseSqrt();
  RunResidual::Evaluation e;
  e.chi2 = point.objective();
  e.linear = point.linear;
  e.linear_factor = point.linear_factor;

  // Innovations of the slopes beside what the linear unknowns reach: `rows` those looked at, `half_gradient` what they have in common with what is left of the readings, and half the slope of the freedom.
  MatrixXd rows(some * channels, chosen), along(unknowns, chosen);
  VectorXd half_gradient(chosen);
  slopes(point, motion(point), parameters, {}, [&](Index place, const Slope& slope) {
    MatrixXd white = point.smoother->innovations(slope.readings);
    Eigen::Map<VectorXd> all(white.data(), white.size());
    const VectorXd reached = solve_above(e.linear_factor, solve_below(e.linear_factor, -point.white_columns.transpose() * all));
    all = -all;
    all.noalias() -= point.white_columns * reached;
    along.col(place) = reached;
    half_gradient[place] = all.dot(flat(point.white)) + slope.freedom / 2;
    for (Index c = 0; c < channels; ++c) rows.col(place).segment(c * some, some) = root.cwiseProduct(white.col(c)(looked_at.at));
  });
  e.linear_slope = MatrixXd::Zero(unknowns, count);
  e.linear_slope(Eigen::all, parameters) = along;
  const MatrixXd triangle = triangle_of(std::move(rows));
  e.residual.resize(chosen + 1);
  e.residual.head(chosen) = solve_below(triangle, half_gradient);
  e.residual[chosen] = std::sqrt(std::max(0.0, e.chi2 - e.residual.head(chosen).squaredNorm()));
  e.jacobian = MatrixXd::Zero(chosen + 1, count);
  e.jacobian.topRows(chosen)(Eigen::all, parameters) = triangle;
  return e;
}

/// What the smoother leaves of readings.
struct RestlessRun::Reader {
  explicit Reader(const Point& point) : smoother(*point.smoother) {
    for (const RowVectorXd& row : smoother.filter().C.rowwise()) read.push_back(smoother.quantity(row));
    for (const SettledSmoother::Quantity& q : read) each.push_back(&q);
  }
  MatrixXd left(const MatrixXd& readings, const MatrixXd& white) const { return readings - smoother.smoothed(each, readings, white); }

  const SettledSmoother& smoother;
  std::vector<SettledSmoother::Quantity> read;
  std::vector<const SettledSmoother::Quantity*> each;
};

MatrixXd RestlessRun::left_by_smoother(const Point& point) const { return Reader(point).left(point.left, point.white); }

double RestlessRun::settle_missing(const VectorXd& theta) {
  constexpr int most = 300;
  constexpr double little = 1e-3;  // of chi-square
  // In a gap of all channels chi-square falls by steps, with plateaus between that go with its length. In long records each step is dear.
  constexpr Index per_plateau = 8, fewest = 4, most_in_a_row = 64, dear = 1 << 22;
  const Index in_a_row = std::max(fewest, std::min({longest_gap_ / per_plateau, most_in_a_row, dear / samples()}));
  if (!missing_.any()) return 0;
  const Point& point = at(theta);
  const Reader reader(point);
  const MatrixXd none = MatrixXd::Zero(samples(), outputs() + 1);
  // Half the fall of chi-square with missing readings, in units of their noise.
  const auto uphill = [&](const MatrixXd& left) -> MatrixXd { return missing_.select(left * sigma_.cwiseInverse().asDiagonal(), none); };
  const auto left_of = [&](MatrixXd readings) {
    MatrixXd white = point.smoother->innovations(readings);
    const VectorXd linear = solve_above(point.linear_factor, solve_below(point.linear_factor, point.white_columns.transpose() * flat(white)));
    for (Index j = 0; j < linear.size(); ++j) readings -= linear[j] * column(point, j);
    Eigen::Map<VectorXd>(white.data(), white.size()) -= point.white_columns * linear;
    return reader.left(readings, white);
  };
  MatrixXd left = -uphill(reader.left(point.left, point.white)), direction = left, change = none;
  double fall = 0, squares = left.squaredNorm();
  Index small = 0;
  for (int step = 0; step < most && small < in_a_row && squares > 0; ++step) {
    const MatrixXd bent = uphill(left_of(direction * sigma_.asDiagonal()));
    const double bend = direction.cwiseProduct(bent).sum();
    if (!(bend > 0)) break;  // rounding
    const double length = squares / bend, fallen = length * squares;
    change += length * direction;
    left -= length * bent;
    fall += fallen;
    small = fallen < little ? small + 1 : 0;
    const double before = std::exchange(squares, left.squaredNorm());
    direction = left + squares / before * direction;
  }
  measured_ += change * sigma_.asDiagonal();
  last_.reset();
  return fall;
}

MatrixXd RestlessRun::variance_in_gaps(const Point& point, const MatrixXd& rows) const {
  if (longest_gap_ <= unnoticed) return {};
  Missing long_ones = missing_;
  for (Index c = 0; c < missing_.cols(); ++c)
    for (Index k = 0; k < samples(); ++k) {
      if (!missing_(k, c)) continue;
      Index end = k;
      while (end < samples() && missing_(end, c)) ++end;
      if (end - k <= unnoticed) long_ones.col(c).segment(k, end - k).setConstant(false);
      k = end;
    }
  return unrig::variance_in_gaps(point.smoother->filter(), long_ones, rows, stride_of_motion());
}

void RestlessRun::settle_noise(const VectorXd& theta) {
  settle_missing(theta);
  const Point& point = at(theta);
  const Index n = samples(), channels = outputs() + 1, angle = channels - 1;
  const VectorXd sigma = sigma_;
  const MatrixXd what_is_left = left_by_smoother(point);
  MatrixXd filled = measured_;
  for (Index c = 0; c < channels; ++c) {
    const VectorXd left = what_is_left.col(c);
    // What the smoother leaves has the variance of the noise less that of the estimate.
    const double level = noise_level(masked(left, missing_.col(c)), 1), noise = std::sqrt(level * level + point.smoother->variance(point.smoother->filter().C.row(c))[n / 2]);
    if (noise > 0) sigma_[c] = std::max(std::min(sigma[c], noise), rounding_level(run_->channel(c < outputs() ? channels_[static_cast<std::size_t>(c)] : "alpha").value));
    filled.col(c) -= missing_.col(c).select(left, VectorXd::Zero(n));
    if (c != angle) continue;
    // Electrical spikes, alone or in pairs: three in a row are a motion that the model forces away from the measured one.
    constexpr double limit = 5;
    const auto off = [&](Index k) { return k >= 0 && k < n && !missing_(k, c) && std::abs(left[k]) > limit * sigma_[c]; };
    std::vector<Index> spikes;
    for (Index k = 0; k < n; ++k)
      if (off(k) && !(off(k - 1) && off(k + 1)) && !(off(k - 2) && off(k - 1)) && !(off(k + 1) && off(k + 2))) spikes.push_back(k);
    for (const Index k : spikes) {
      if (!missing_.row(k).any()) --whole_;
      missing_(k, c) = true, filled(k, c) -= left[k], --observations_;
    }
  }
  measured_ = filled;
  last_.reset();
}

void RestlessRun::settle_roughness(const VectorXd& theta, Look look) {
  constexpr double smoothest = -6, roughest = 1, like_a_parabola = 0.2, golden = 0.6180339887498949, reach = 0.25;  // decades
  std::map<double, double> improbability;
  const auto ask = [&](double decade) {
    const auto [place, is_new] = improbability.try_emplace(decade, 0);
    if (is_new) {
      roughness_ = std::pow(10, decade);
      const std::shared_ptr<Point> point = point_at(theta);
      place->second = static_cast<double>(observations_) / static_cast<double>(outputs() + 1) * point->log_determinant + point->chi2;
    }
    return place->second;
  };
  last_.reset();
  const double was = std::log10(roughness_);
  double low = look == Look::near ? std::max(smoothest, was - reach) : smoothest, high = look == Look::near ? std::min(roughest, was + reach) : roughest;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  while (high - low > like_a_parabola)
    if (ask(a) < ask(b))
      high = b, b = a, a = high - golden * (high - low);
    else
      low = a, a = b, b = low + golden * (high - low);
  const auto least = std::min_element(improbability.begin(), improbability.end(), [](const auto& x, const auto& y) { return x.second < y.second; });
  const double best = least->first;
  const bool between = least != improbability.begin() && std::next(least) != improbability.end();
  if (!between && look == Look::near) return settle_roughness(theta, Look::everywhere);
  double found = best;
  if (between) {
    const auto [x0, y0] = *std::prev(least);
    const auto [x2, y2] = *std::next(least);
    const double left = (least->second - y0) / (best - x0), right = (y2 - least->second) / (x2 - best);
    if (right > left) found = (x0 + best) / 2 - left * (x2 - x0) / (2 * (right - left));
  }
  roughness_ = std::pow(10, found);
}

}  // namespace unrig
