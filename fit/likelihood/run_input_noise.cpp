#include <algorithm>
#include <cmath>

#include "core/propagate/nonlinear_response.h"
#include "fit/likelihood/input_noise.h"
#include "fit/likelihood/readings_noise.h"
#include "fit/likelihood/run_linearised.h"

// RunResidual where noise of the measured inputs colours what is left of the readings: generalised least squares.
//
// The inputs themselves are unknown, N of them: errors in variables. At their most probable values, minus twice the logarithm of the likelihood is r^T W(theta) r, r what the measured inputs
// leave and W the inverse covariance of the readings with the noise as the model at theta lets it through. W must follow theta: with W held, the measured input's noise makes every response
// too small, and masses too large (10 % under ten times the force noise of tests/fit/impact_cases.h). There is no log det W: the inputs are maximised over, not integrated over.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// What a model does to its inputs, nonlinear forces left out.
LinearSystem linear_system(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels, Partials partials) {
  LinearSystem linear = linear_part(model.system(conditions, theta, channels));
  if (partials == Partials::none)
    for (DualMatrix* m : {&linear.A, &linear.B, &linear.C, &linear.D}) m->partial.clear();
  return linear;
}

/// Where f is least between two ends, of a function that falls and then rises: golden section to a hundredth.
template <class F>
double least_between(double low, double high, F f) {
  constexpr double golden = 0.6180339887498949, precision = 0.01;
  double a = high - golden * (high - low), b = low + golden * (high - low), at_a = f(a), at_b = f(b);
  const double at_low = f(low), first = low;
  while (high - low > precision) {
    if (at_a < at_b) {
      high = b, b = a, at_b = at_a, a = high - golden * (high - low), at_a = f(a);
    } else {
      low = a, a = b, at_a = at_b, b = low + golden * (high - low), at_b = f(b);
    }
  }
  return std::min(at_a, at_b) < at_low ? 0.5 * (low + high) : first;
}

}  // namespace

void RunResidual::Linearised::keep_input_noise(RunResidual& run, const RunResidual& other) {
  if (input_noise(other) == input_noise(run)) return;
  run.shared_ = std::make_shared<SharedResponses>();  // of its own: what else is shared belongs to another model
  run.shared_->input_noise = other.shared_ ? other.shared_->input_noise : nullptr;
}

void RunResidual::Linearised::settle_input_noise(RunResidual& run, const VectorXd& theta, const MatrixXd& left) {
  if (run.motion_.unknowns() > 0 || run.inputs_.cols() == 0) return;
  const std::optional<InputNoiseModel> inputs = noise_of_inputs(*run.run_, run.conditions_);
  if (!inputs) return;
  const LinearSystem linear = linear_system(*run.model_, run.conditions_, theta, run.channels_, Partials::none);
  const ExactStep to_next = exact_step(linear, run.run_->dt);
  const MatrixXd column = MatrixXd((run.weight_.array() > 0).select(left, 0.0)).reshaped();
  MatrixXd weight = run.tempered_ * run.weight_;
  const auto improbable = [&](const MatrixXd& trial) {  // -2 log likelihood of what is left
    const InputNoise noise(linear, to_next, *inputs, trial);
    return noise.log_determinant() + noise.whitened(column).squaredNorm();
  };
  // Differences of a raw reading keep some of a fast signal; of an acceleration, what the force does to it at once, noise included.
  const double most = std::log(100);
  for (Index c = 0; c < weight.cols(); ++c) {
    const auto sharper = [&](double logarithm) {
      MatrixXd trial = weight;
      trial.col(c) *= std::exp(logarithm);
      return trial;
    };
    const double factor = std::exp(least_between(0, most, [&](double logarithm) { return improbable(sharper(logarithm)); }));
    weight.col(c) *= factor;
    run.weight_.col(c) *= factor;
    run.sigma_[static_cast<std::size_t>(c)] /= factor;
  }
  run.shared_ = std::make_shared<SharedResponses>();  // copies of the run keep theirs
  run.shared_->input_noise = std::make_shared<const InputNoiseModel>(*inputs);
}

std::shared_ptr<const InputNoise> RunResidual::Linearised::noise_through(const RunResidual& run, const VectorXd& theta) {
  const InputNoiseModel* inputs = input_noise(run);
  if (!inputs) return nullptr;
  if (run.last_solution_.model && run.last_solution_.theta == theta) return run.last_solution_.model->noise;
  const LinearSystem linear = linear_system(*run.model_, run.conditions_, theta, run.channels_, Partials::none);
  return std::make_shared<const InputNoise>(linear, exact_step(linear, run.run_->dt), *inputs, run.tempered_ * run.weight_);
}

bool RunResidual::may_be_coloured() const { return arrival_.rows() == 0 && !Linearised::input_noise(*this); }

MatrixXd RunResidual::Linearised::white(const RunResidual& run, const MatrixXd& rows) const { return noise->whitened(rows) / run.tempered_; }

MatrixXd RunResidual::Linearised::white_slopes(const RunResidual& run, const VectorXd& theta, MatrixXd rows) const {
  // The slope of r^T W r is twice that of the model under the most probable inputs, times W r: theta moves what the measured ones do and, beside it, what their errors do.
  const auto parameters = static_cast<Index>(run.model_->parameters().size());
  const VectorXd left = noise->whitened(rows.rightCols(1));
  const LinearSystem driven = linear_system(*run.model_, run.conditions_, theta, run.channels_, Partials::all);
  MatrixXd errors = MatrixXd::Zero(run.inputs_.rows(), run.inputs_.cols());
  const MatrixXd probable = noise->most_probable(left);
  errors.topLeftCorner(probable.rows(), probable.cols()) = probable;
  const Response response = drive(driven, exact_step(driven, run.run_->dt), DualMatrix(MatrixXd::Zero(driven.states(), 1)), run.run_->samples(), {}, errors, Partials::all);
  for (Index j = 0; j < parameters; ++j)
    if (const auto index = static_cast<std::size_t>(j); index < response.partial.size() && response.partial[index].size() > 0)
      rows.col(j) -= response.partial[index].topRows(run.last_sample_).reshaped();
  rows = noise->whitened(rows);
  rows.rightCols(1) = left;
  return rows / run.tempered_;
}

MatrixXd RunResidual::Linearised::standardised(const RunResidual& run, const VectorXd& theta, const MatrixXd& left) {
  const MatrixXd there = (run.weight_.array() > 0 && left.array().isFinite()).select(left, 0.0);
  if (wanders(run))
    if (const Solution solution = run.solve(theta); solution.model->wandering)
      return (there.array() != 0).select(run.tempered_ * run.weight_.cwiseProduct(solution.model->innovations(run, solution.linear)), 0.0);
  if (const std::shared_ptr<const InputNoise> noise = noise_through(run, theta)) return MatrixXd(noise->whitened(there.reshaped())).reshaped(left.rows(), left.cols());
  MatrixXd white = there;
  for (std::size_t c = 0, f = 0; c < run.colour_.size(); ++c)
    if (run.colour_[c]) white.col(static_cast<Index>(c)) = run.filters_[f++].filtered(there.col(static_cast<Index>(c)));
  return run.tempered_ * run.weight_.cwiseProduct(white);
}

void RunResidual::Linearised::whiten(const RunResidual& run, const VectorXd& theta, Sensitivity& s) const {
  const Index columns = s.channels.front().slope.cols(), samples = run.last_sample_, channels = run.measured_.cols();
  MatrixXd rows(samples * channels, columns + 1);
  for (Index c = 0; c < channels; ++c) {
    const Sensitivity::PerChannel& channel = s.channels[static_cast<std::size_t>(c)];
    rows.middleRows(c * samples, samples) << -channel.slope.topRows(samples), channel.residual.head(samples) + run.measured_.col(c).head(samples);
  }
  rows = white_slopes(run, theta, std::move(rows));
  for (Index c = 0; c < channels; ++c) {
    Sensitivity::PerChannel& channel = s.channels[static_cast<std::size_t>(c)];
    channel.slope.setZero();
    channel.residual.setZero();
    channel.slope.topRows(samples) = -rows.middleRows(c * samples, samples).leftCols(columns);
    channel.residual.head(samples) = rows.middleRows(c * samples, samples).col(columns);
  }
}

void RunResidual::Linearised::settle_white(const RunResidual& run, const MatrixXd& start, std::vector<MatrixXd> tangents, const MatrixXd& right) {
  const Index samples = right.rows(), unknowns = run.unknowns_;
  MatrixXd rows = MatrixXd::Zero(samples * right.cols(), unknowns + 1);
  blocks.clear();
  for (Index c = 0; c < right.cols(); ++c) {
    MatrixXd& tangent = tangents[static_cast<std::size_t>(c)];
    auto own = rows.middleRows(c * samples, samples);
    own.leftCols(unknowns) = tangent * start;
    own.col(run.first_offset_ + c).setOnes();
    own.col(unknowns) = right.col(c);
    blocks.emplace_back(Interval{0, samples}, false, c, start, std::move(tangent), samples);
  }
  settle({white(run, rows)}, unknowns, 0);
}

MatrixXd standardised_readings(const RunResidual& run, const VectorXd& theta, const MatrixXd& left) { return RunResidual::Linearised::standardised(run, theta, left); }

double sigma_of_inputs(const RunResidual& run, const VectorXd& theta, std::size_t channel) {
  const std::shared_ptr<const InputNoise> noise = RunResidual::Linearised::noise_through(run, theta);
  return noise ? std::sqrt(noise->variance(static_cast<Index>(channel))) : 0;
}

}  // namespace unrig
