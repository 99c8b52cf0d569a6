#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "fit/likelihood/noise_colour.h"
#include "fit/likelihood/run_linearised.h"

// RunResidual where the noise of a channel has a colour: model and readings pass the same whitening filter, and all that is exact for white noise holds behind it.

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd RunResidual::at_rest(VectorXd left, const VectorXd& weight) const {
  for (Index k = 0; k < left.size(); ++k)
    if (!(weight[k] > 0)) left[k] = std::nan("");
  for (const MotionBasis::Phase& phase : phases_)
    if (phase.moving) left.segment(phase.samples.first, phase.samples.length()).setConstant(std::nan(""));
  return left;
}

RunResidual::Colours RunResidual::colours(const VectorXd& theta, const std::vector<ChannelColour>& expected) const {
  const Prediction p = predict(theta);
  Colours found;
  for (Index c = 0; c < measured_.cols(); ++c) {
    const std::string& name = channels_[static_cast<std::size_t>(c)];
    const auto known = std::find_if(expected.begin(), expected.end(), [&](const ChannelColour& one) { return one.channel == name; });
    const RestResidual left{at_rest(measured_.col(c) - p.output.col(c), weight_.col(c)), run_->dt};
    if (expected.empty()) found.push_back(colour_of({left}));
    else found.push_back(known != expected.end() ? sized(known->colour, left) : std::nullopt);
  }
  return found;
}

void RunResidual::set_colours(const VectorXd& theta, const Colours& colours) {
  const Prediction p = predict(theta);
  colour_ = colours;
  shared_.reset();
  measured_ = (weight_.array() > 0).select(measured_, p.output);  // left-out readings have no innovation of their own
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    if (!colour_[c]) continue;
    const WhiteningFilter filter(*colour_[c], run_->dt);
    weight_.col(static_cast<Index>(c)) *= sigma_[c] / filter.sigma();
    sigma_[c] = filter.sigma();
  }
  take_colour(*this);
}

double RunResidual::log_noise_density() const {
  double sum = 0;
  for (std::size_t c = 0, f = 0; c < channels_.size(); ++c) {
    const auto count = static_cast<double>((weight_.col(static_cast<Index>(c)).array() > 0).count());
    const WhiteningFilter* filter = colour(c) ? &filters_[f++] : nullptr;
    sum -= count * std::log(sigma_[c] / (filter ? filter->gain() : 1));
    if (filter) sum += filter->log_start_information();
  }
  return sum;
}

void RunResidual::take_colour(const RunResidual& other) {
  if (&other != this) {
    colour_ = other.colour_;
    measured_ = (weight_.array() > 0).select(measured_, other.measured_);
  }
  filters_.clear();
  whitened_.resize(0, 0);
  const Index before = unknowns_, ends = unknowns_ - first_offset_;  // offsets and the angle before the motion
  while (!free_.empty() && free_.back() >= states_) free_.pop_back();
  const auto of_model = static_cast<Index>(free_.size());
  Index states = states_;
  for (std::size_t c = 0; c < colour_.size(); ++c) {
    if (!colour_[c]) continue;
    filters_.emplace_back(*colour_[c], run_->dt);
    for (Index i = 0; i < filters_.back().states(); ++i) free_.push_back(states++);
    if (whitened_.size() == 0) whitened_ = measured_;
    whitened_.col(static_cast<Index>(c)) = filters_.back().filtered(measured_.col(static_cast<Index>(c)));
  }
  if (!filters_.empty()) shared_ = Linearised::only_noise_of(*this);  // responses behind filters are this run's own
  lay_out();
  guide_ = {};
  if (last_linear_.size() != before) return;
  VectorXd start = VectorXd::Zero(unknowns_);  // a search for c starts from the same motion, states and offsets
  start.head(first_state_ + of_model) = last_linear_.head(first_state_ + of_model);
  start.tail(ends) = last_linear_.tail(ends);
  last_linear_ = start;
}

/// [c | reading] of the noise's state at the first sample, which is the filter's start less what the offset has settled it to.
MatrixXd RunResidual::colour_rows() const {
  std::vector<MatrixXd> all;
  Index state = first_offset_;
  for (const WhiteningFilter& filter : filters_) state -= filter.states();
  for (std::size_t c = 0, f = 0; c < colour_.size(); ++c) {
    if (!colour_[c]) continue;
    const WhiteningFilter& filter = filters_[f++];
    const MatrixXd root = filter.start_information();
    const VectorXd settled = root * filter.settled();
    MatrixXd rows = MatrixXd::Zero(filter.states(), unknowns_ + 1);
    rows.middleCols(state, filter.states()) = root;
    rows.col(first_offset_ + static_cast<Index>(c)) = settled;
    rows.col(unknowns_) = settled * whitened_(0, static_cast<Index>(c));
    all.push_back(std::move(rows));
    state += filter.states();
  }
  return run_rows::stacked(all, unknowns_ + 1);
}

Index RunResidual::filter_states() const {
  Index states = 0;
  for (const WhiteningFilter& filter : filters_) states += filter.states();
  return states;
}

/// The states of each filter: the last rows of `state`.
RunResidual::FilterStates RunResidual::filters_at(const MatrixXd& state) const {
  FilterStates at;
  Index row = state.rows() - filter_states();
  for (const WhiteningFilter& filter : filters_) {
    at.emplace_back(state.middleRows(row, filter.states()));
    row += filter.states();
  }
  return at;
}

/// Sends what a nonlinear model says of a channel, in columns, through the filter of that channel, if it has one.
void RunResidual::filter_outputs(std::size_t channel, Eigen::Ref<MatrixXd> columns, FilterStates& states) const {
  if (!colour(channel)) return;
  const auto filter = static_cast<std::size_t>(std::count_if(colour_.begin(), colour_.begin() + static_cast<std::ptrdiff_t>(channel), [](const auto& c) { return c.has_value(); }));
  filters_[filter].filter(columns, states[filter]);
}

void RunResidual::filter_output(LinearSystem& system, ExactStep& step) const {
  if (filters_.empty() || !system.feedback.empty()) return;  // what a nonlinear model says is filtered behind it
  for (std::size_t c = 0, f = 0; c < colour_.size(); ++c)
    if (colour_[c]) filters_[f++].append(static_cast<Index>(c), system, step);
}

}  // namespace unrig
