#include "core/propagate/response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "core/numerics/product.h"
#include "core/numerics/work.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index block_length = FreeResponse::block_length;

bool acts(const LinearSystem& system, Index parameter) {
  return system.A.depends_on(parameter) || system.B.depends_on(parameter) || system.C.depends_on(parameter) || system.D.depends_on(parameter);
}

Response make_response(Index samples, const LinearSystem& system, Partials partials) {
  Response r;
  r.output.resize(samples, system.C.rows());
  if (partials == Partials::all) {
    r.partial.assign(static_cast<std::size_t>(system.A.parameters()), MatrixXd());
    for (Index j = 0; j < system.A.parameters(); ++j)
      if (acts(system, j)) r.partial[static_cast<std::size_t>(j)].resize(samples, system.C.rows());
  }
  return r;
}

DualMatrix without_partials(const DualMatrix& a) { return DualMatrix(a.value); }

/// C, C T, C T^2 ... stacked: block_length x n per channel, channels in turn.
DualMatrix observation_block(const DualMatrix& C, const DualMatrix& transition) {
  const Index channels = C.rows(), n = C.cols();
  DualMatrix block(MatrixXd(block_length * channels, n), C.parameters());
  DualMatrix rows = C;
  for (Index k = 0; k < block_length; ++k) {
    for (Index c = 0; c < channels; ++c) block.set_block(c * block_length + k, 0, rows.block(c, 0, 1, n));
    if (k + 1 < block_length) rows = rows * transition;
  }
  return block;
}

/// What has died out becomes zero: numbers below the smallest normal one are a hundred times slower to reckon with.
DualMatrix without_dust(DualMatrix state) {
  constexpr double dust = 1e-250;
  const auto settled = [](double x) { return std::abs(x) < dust ? 0.0 : x; };
  state.value = state.value.unaryExpr(settled);
  for (MatrixXd& p : state.partial) p = p.unaryExpr(settled);
  return state;
}

MatrixXd identity_like(const MatrixXd& m) { return MatrixXd::Identity(m.rows(), m.cols()); }
DualMatrix identity_like(const DualMatrix& m) { return DualMatrix(MatrixXd(MatrixXd::Identity(m.rows(), m.cols())), m.parameters()); }
MatrixXd times(const MatrixXd& a, const MatrixXd& b) { return product(a, b); }
DualMatrix times(const DualMatrix& a, const DualMatrix& b) { return a * b; }

}  // namespace

template <class Matrix>
Matrix power(Matrix m, Index exponent) {
  Matrix result = identity_like(m);
  bool one = true;
  for (; exponent > 0; exponent /= 2) {
    if (exponent % 2 == 1) result = one ? m : times(result, m), one = false;
    if (exponent > 1) m = times(m, m);
  }
  return result;
}
template MatrixXd power(MatrixXd, Index);
template DualMatrix power(DualMatrix, Index);

FreeResponse::FreeResponse(const LinearSystem& system, const ExactStep& step, Partials partials) : channels_(system.C.rows()) {
  const bool with_partials = partials == Partials::all;
  transition_ = with_partials ? step.transition : without_partials(step.transition);
  observe_ = observation_block(with_partials ? system.C : without_partials(system.C), transition_);
  leap_ = power(transition_, block_length);
  if (with_partials)
    for (Index j = 0; j < system.A.parameters(); ++j) acts_.push_back(acts(system, j));
}

DualMatrix FreeResponse::block(Index channel) const { return observe_.block(channel * block_length, 0, block_length, observe_.cols()); }

Response FreeResponse::empty(Index samples) const {
  Response r;
  r.output = MatrixXd::Zero(samples, channels_);
  r.partial.resize(acts_.size());
  for (std::size_t j = 0; j < acts_.size(); ++j)
    if (acts_[j]) r.partial[j] = MatrixXd::Zero(samples, channels_);
  return r;
}

Response FreeResponse::from(const DualMatrix& start, Index samples) const {
  Response response = empty(samples);
  const bool at_rest = start.value.isZero(0) && std::all_of(start.partial.begin(), start.partial.end(), [](const MatrixXd& p) { return p.isZero(0); });
  if (at_rest) {
    response.end = start;
    return response;
  }
  DualMatrix state = acts_.empty() ? without_partials(start) : start;
  for (Index first = 0; first < samples; first += block_length) {
    const Index count = std::min(block_length, samples - first);
    const DualMatrix outputs = observe_ * state;
    for (Index c = 0; c < channels_; ++c) {
      response.output.col(c).segment(first, count) = outputs.value.col(0).segment(c * block_length, count);
      for (std::size_t j = 0; j < response.partial.size(); ++j)
        if (response.partial[j].size() > 0 && outputs.depends_on(static_cast<Index>(j)))
          response.partial[j].col(c).segment(first, count) = outputs.d(static_cast<Index>(j)).col(0).segment(c * block_length, count);
    }
    if (count == block_length) {
      state = without_dust(leap_ * state);
    } else {
      for (Index k = 0; k < count; ++k) state = transition_ * state;
    }
  }
  response.end = state;
  return response;
}

Response coast(const LinearSystem& system, const ExactStep& step, const DualMatrix& start, Index samples, Partials partials) {
  return FreeResponse(system, step, partials).from(start, samples);
}

Response drive(const LinearSystem& system, const ExactStep& step, const DualMatrix& start, Index samples, const VectorXd& jerk, const MatrixXd& input,
               Partials partials) {
  if (input.rows() > 0 && input.cols() != system.B.cols()) throw std::invalid_argument(fmt::format("a system of {} inputs cannot be driven by {}", system.B.cols(), input.cols()));
  const Index n = system.states(), channels = system.C.rows();
  std::vector<Index> active;  // parameters carried along
  if (partials == Partials::all)
    for (Index j = 0; j < system.A.parameters(); ++j)
      if (acts(system, j)) active.push_back(j);
  const auto count = static_cast<Index>(active.size());
  const bool has_jerk = jerk.size() > 0, has_input = input.rows() > 0;
  count_work(samples * n * n * (1 + 2 * count));

  // One column for the state, one per parameter for its partial; the partials' own forcing dT x + dJ j + dB u by one stacked product.
  MatrixXd state = MatrixXd::Zero(n, 1 + count), next(n, 1 + count);
  state.col(0) = start.value.col(0);
  MatrixXd stacked = MatrixXd::Zero(n * count, n), stacked_jerk = MatrixXd::Zero(n * count, 1);
  MatrixXd stacked0 = MatrixXd::Zero(n * count, input.cols()), stacked1 = stacked0;
  for (Index a = 0; a < count; ++a) {
    const Index j = active[static_cast<std::size_t>(a)];
    if (start.depends_on(j)) state.col(1 + a) = start.d(j).col(0);
    if (step.transition.depends_on(j)) stacked.middleRows(a * n, n) = step.transition.d(j);
    if (has_jerk && step.jerk.depends_on(j)) stacked_jerk.middleRows(a * n, n) = step.jerk.d(j);
    if (has_input && step.input0.depends_on(j)) stacked0.middleRows(a * n, n) = step.input0.d(j);
    if (has_input && step.input1.depends_on(j)) stacked1.middleRows(a * n, n) = step.input1.d(j);
  }

  Response response = make_response(samples, system, partials);
  VectorXd forcing(n * count);
  MatrixXd outputs(channels, 1 + count);
  for (Index k = 0; k < samples; ++k) {
    outputs.noalias() = system.C.value * state;
    if (has_input) outputs.col(0).noalias() += system.D.value * input.row(k).transpose();
    response.output.row(k) = outputs.col(0).transpose();
    for (Index a = 0; a < count; ++a) {
      const Index j = active[static_cast<std::size_t>(a)];
      if (system.C.depends_on(j)) outputs.col(1 + a).noalias() += system.C.d(j) * state.col(0);
      if (has_input && system.D.depends_on(j)) outputs.col(1 + a).noalias() += system.D.d(j) * input.row(k).transpose();
      response.partial[static_cast<std::size_t>(j)].row(k) = outputs.col(1 + a).transpose();
    }
    set_product(step.transition.value, state, next);
    if (count > 0) forcing.noalias() = stacked * state.col(0);
    if (has_jerk) {
      next.col(0) += jerk[k] * step.jerk.value.col(0);
      if (count > 0) forcing += jerk[k] * stacked_jerk.col(0);
    }
    if (has_input) {
      next.col(0).noalias() += step.input0.value * input.row(k).transpose();
      next.col(0).noalias() += step.input1.value * input.row(k + 1).transpose();
      if (count > 0) {
        forcing.noalias() += stacked0 * input.row(k).transpose();
        forcing.noalias() += stacked1 * input.row(k + 1).transpose();
      }
    }
    if (count > 0) next.rightCols(count) += forcing.reshaped(n, count);
    state.swap(next);
  }
  response.end = DualMatrix(state.col(0), system.A.parameters());
  for (Index a = 0; a < count; ++a) response.end.partial[static_cast<std::size_t>(active[static_cast<std::size_t>(a)])] = state.col(1 + a);
  return response;
}

std::vector<MatrixXd> free_response_rows(const LinearSystem& system, const ExactStep& step, Index samples) {
  const Index channels = system.C.rows(), n = system.states();
  const DualMatrix transition(step.transition.value);
  DualMatrix block = observation_block(DualMatrix(system.C.value), transition);
  const DualMatrix leap = power(transition, block_length);
  std::vector<MatrixXd> rows(static_cast<std::size_t>(channels), MatrixXd(samples, n));
  for (Index first = 0; first < samples; first += block_length) {
    const Index count = std::min(block_length, samples - first);
    for (Index c = 0; c < channels; ++c) rows[static_cast<std::size_t>(c)].middleRows(first, count) = block.value.middleRows(c * block_length, count);
    if (first + count < samples) block = block * leap;
  }
  return rows;
}

MatrixXd spline_states(const ExactStep& step, Index samples) {
  const Index n = step.transition.rows();
  const std::array<double, 4> third_difference{1, -3, 3, -1};
  MatrixXd states = MatrixXd::Zero(n, samples);
  const double cube = step.dt * step.dt * step.dt;
  for (Index k = 0; k + 1 < samples; ++k) {
    states.col(k + 1).noalias() = step.transition.value * states.col(k);
    if (k < 4) states.col(k + 1) += third_difference[static_cast<std::size_t>(k)] / cube * step.jerk.value.col(0);
  }
  return states;
}

void stand_still(MatrixXd& states, Index motion, const Eigen::RowVectorXd& angle) {
  states.row(motion) = angle;
  states.middleRows(motion + 1, 2).setZero();
}

}  // namespace unrig
