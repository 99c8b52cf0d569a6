#include "fit/likelihood/run_residual.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/numerics/median.h"
#include "core/run/bad_readings.h"
#include "core/model/run_inputs.h"
#include "core/propagate/memory.h"
#include "core/run/run_limits.h"
#include "fit/likelihood/run_linearised.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// No reading is better than its converter, nor than the digits of a simulation, about a hundred-millionth of its range. A single wrong reading does not count in that.
double least_noise(const VectorXd& value) {
  constexpr double digits = 1e-8;
  const double range = robust_range(value);
  return range > 0 ? std::max(rounding_level(value), digits * range) : 0;
}

/// Standard deviation of a channel's noise; 0 where the channel never changes.
double noise_of(const VectorXd& value) {
  const double least = least_noise(value);
  return least > 0 ? std::max(noise_level(value), least) : 0;
}

}  // namespace

namespace {

/// How far a motion reaches into a rest beside it: a shaft that sets out softly has left its level long before a few samples show that it moves. Means over `block`
/// samples, in turn from the motion on, until two lie on the rest's level, within what the rest's own means scatter by where it is long, and not less than `white_scatter`. `mean(i)`: of block i.
template <class Mean>
Index soft_edge(Index blocks, Index block, double white_scatter, Mean mean) {
  std::vector<double> all;
  for (Index i = 0; i < blocks; ++i)
    if (const double m = mean(i); std::isfinite(m)) all.push_back(m);
  if (all.size() < 4) return 0;  // too short to have a level
  const double level = median(all);
  for (double& m : all) m = std::abs(m - level);
  constexpr double chance = 4;    // standard deviations of a block's mean
  constexpr Index farthest = 25;  // blocks: a drift of the channel is no motion
  const bool is_mostly_rest = blocks > 2 * farthest;  // however far motions reach in on both sides
  const double scatter = is_mostly_rest ? std::max(white_scatter, median_to_sigma * median(all)) : white_scatter;  // coloured noise does not average out
  Index reach = 0;
  for (Index i = 0; i < std::min(blocks, farthest) && i < reach + 2; ++i)
    if (std::abs(mean(i) - level) > chance * scatter) reach = i + 1;
  constexpr Index unseen = 2;  // blocks: what sets out like t^3 is within the scatter for as long again
  return reach > 0 ? std::min(blocks, reach + unseen) * block : 0;
}

/// Where the shaft moves, soft beginnings and ends included.
std::vector<Interval> moving_softly(const VectorXd& angle, double sigma) {
  std::vector<Interval> intervals = moving(angle, sigma);
  constexpr Index block = 20;
  const double scatter = sigma / std::sqrt(static_cast<double>(block));
  const std::vector<Interval> hard = intervals;
  const std::vector<bool> is_spike = isolated_spikes(angle, sigma, hard);  // one beside a motion would widen it
  VectorXd without_spikes = angle;
  for (Index k = 1; k < angle.size(); ++k)
    if (is_spike[static_cast<std::size_t>(k)]) without_spikes[k] = without_spikes[k - 1];
  for (std::size_t i = 0; i <= hard.size() && !hard.empty(); ++i) {  // the rest before interval i
    const Index first = i == 0 ? 0 : hard[i - 1].last, last = i == hard.size() ? angle.size() : hard[i].first, blocks = (last - first) / block;
    if (i < hard.size()) intervals[i].first -= soft_edge(blocks, block, scatter, [&](Index k) { return without_spikes.segment(last - (k + 1) * block, block).mean(); });
    if (i > 0) intervals[i - 1].last += soft_edge(blocks, block, scatter, [&](Index k) { return without_spikes.segment(first + k * block, block).mean(); });
  }
  return intervals;
}

}  // namespace

// Steps need a knot on every sample: 560 of them, four steps in a record, are corrected in 3 s. What the bands take goes with the cube: what goes on and on has to do with fewer.
Eigen::Index most_knots(std::size_t windows) { return windows > 1 ? 600 : 400; }

namespace {

/// A window that is shorter than the knots lie apart has none of its own: it becomes part of the one beside it. A single one is long enough.
void join_short(std::vector<MotionBasis::Window>& windows, Index stride) {
  for (std::size_t w = 0; windows.size() > 1 && w < windows.size();) {
    if (windows[w].knots.length() >= stride) {
      ++w;
      continue;
    }
    Interval& beside = windows[w > 0 ? w - 1 : 1].knots;
    beside = {std::min(beside.first, windows[w].knots.first), std::max(beside.last, windows[w].knots.last)};
    windows.erase(windows.begin() + static_cast<std::ptrdiff_t>(w));
  }
}

}  // namespace

std::vector<MotionBasis::Window> motion_windows(const Run& run) {
  const Channel* alpha = run.find("alpha");
  if (!alpha || run.kind != RunKind::step) return {};
  const double sigma = noise_level(alpha->value);
  std::vector<MotionBasis::Window> windows;
  for (const Interval& i : moving_softly(alpha->value, sigma)) {
    // The load goes with the second derivative: it starts before the angle visibly does, and the drive rings after it has arrived, no longer for having moved for long.
    const Index before = std::clamp<Index>(i.length() / 2, 8, 100), after = std::clamp<Index>(2 * i.length(), 60, 300);
    const Index last_knot = run.samples() - 2;  // a shaft that still moves when the record ends is free up to there
    MotionBasis::Window window{{std::max<Index>(0, i.first - before), std::min(last_knot, i.last + after)}, 1};
    if (!windows.empty() && window.knots.first <= windows.back().knots.last + 4)
      window.knots.first = windows.back().knots.first, windows.pop_back();
    windows.push_back(window);
  }
  Index total = 0;
  for (const auto& w : windows) total += w.knots.length();
  const Index stride = 1 + total / (most_knots(windows.size()) + 1);
  join_short(windows, stride);
  for (auto& w : windows) w.stride = stride;
  return windows;
}

namespace {

/// An angle without its spikes, and its noise.
struct Angle {
  VectorXd value;
  double sigma = 0;
};

Angle without_spikes(const Run& run, const std::vector<MotionBasis::Window>& windows) {
  Angle angle{run.channel("alpha").value};
  angle.sigma = noise_level(angle.value);
  std::vector<Interval> moves;
  for (const MotionBasis::Window& window : windows) moves.push_back(window.knots);
  const std::vector<bool> spike = isolated_spikes(angle.value, angle.sigma, moves);
  for (Index k = 0; k < angle.value.size(); ++k)
    if (spike[static_cast<std::size_t>(k)]) angle.value[k] = std::nan("");
  return angle;
}

double off_its_knots(const Angle& angle, const std::vector<MotionBasis::Window>& windows, Index stride) {
  const VectorXd& x = angle.value;
  const double gain = std::sqrt(1 + (1 + 81 + 81 + 1) / 256.0);
  const Index half = (stride + 1) / 2;
  double squares = 0, count = 0;
  for (const MotionBasis::Window& window : windows)
    for (Index k = std::max(window.knots.first, 3 * half); k < window.knots.last && k + 3 * half < x.size(); ++k) {
      const double off = x[k] - (9 * (x[k - half] + x[k + half]) - x[k - 3 * half] - x[k + 3 * half]) / 16;
      if (std::isfinite(off)) squares += off * off, ++count;
    }
  return count > 0 ? std::sqrt(squares / count) / (gain * angle.sigma) : 0;
}

}  // namespace

double off_its_knots(const Run& run, const std::vector<MotionBasis::Window>& windows, Index stride) { return off_its_knots(without_spikes(run, windows), windows, stride); }

std::vector<MotionBasis::Window> windows_to_fit(const Run& run) {
  std::vector<MotionBasis::Window> windows = motion_windows(run);
  if (windows.empty() || windows.front().stride == 1) return windows;
  const Angle angle = without_spikes(run, windows);
  Index total = 0;
  for (const auto& w : windows) total += w.knots.length();
  // More than chance: three standard deviations of the mean of so many squares, of differences that have samples in common (sum of their squared correlations below 3), and of the noise level alike.
  const double followed = std::sqrt(1 + 3 * std::sqrt(12 / static_cast<double>(total)));
  Index stride = windows.front().stride;
  while (stride > 1 && total / (stride - 1) <= most_knots_to_fit && off_its_knots(angle, windows, stride) > followed) --stride;
  for (auto& w : windows) w.stride = stride;
  return windows;
}

RunResidual::RunResidual(const AeroelasticModel& model, const Run& run, std::vector<MotionBasis::Window> motion, RunOptions options)
    : model_(&model),
      run_(&run),
      conditions_(options.conditions.value_or(conditions_of(run))),
      channels_(model.output_channels(run)),
      motion_(run.samples(), motion) {
  check_what_drives(run);
  conditions_.prescribed_pitch = motion_.unknowns() > 0;
  const Index n = run.samples();
  last_sample_ = n;
  const std::vector<Interval> active = motion_.active();
  if (options.horizon > 0) last_sample_ = std::min(n, (active.empty() ? 0 : active.front().first) + options.horizon);

  VectorXd use = VectorXd::Ones(n);
  if (const Channel* weight = run.find("weight")) use = weight->value.unaryExpr([](double w) { return std::isfinite(w) ? std::sqrt(w) : 0.0; });
  const auto judged = [counts = VectorXd(use)](const VectorXd& value) -> VectorXd { return (counts.array() > 0).select(value, std::nan("")); };  // for the noise
  use.tail(n - last_sample_).setZero();

  converter_.resize(channels_.size());
  measured_.resize(n, static_cast<Index>(channels_.size()));
  weight_.resizeLike(measured_);
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const VectorXd& value = run.channel(channels_[c]).value;
    sigma_.push_back(noise_of(judged(value)));
    converter_[c] = coarse_converter(value, sigma_[c]);
    sigma_[c] = std::max(sigma_[c], converter_[c].usual_error());
    if (!(sigma_[c] > 0))
      throw InputError({run.file, run.header_line}, fmt::format("the column \"{}\" never changes", channels_[c]), "wanted a reading that answers to the rig",
                       "Look for a broken cable or a stopped converter.");
    for (Index k = 0; k < n; ++k) {
      const bool there = std::isfinite(value[k]);
      measured_(k, static_cast<Index>(c)) = there ? value[k] : 0;
      weight_(k, static_cast<Index>(c)) = there ? use[k] / sigma_[c] : 0;
    }
  }
  if (conditions_.prescribed_pitch) {
    const VectorXd& value = run.channel("alpha").value;
    angle_sigma_ = noise_of(judged(value));
    const std::vector<bool> spike = isolated_spikes(value, angle_sigma_, active);
    angle_ = value;
    angle_weight_ = use / angle_sigma_;
    for (Index k = 0; k < n; ++k) {
      if (std::isfinite(value[k]) && !spike[static_cast<std::size_t>(k)]) continue;
      spikes_ += std::isfinite(value[k]) ? 1 : 0;
      angle_[k] = 0;
      angle_weight_[k] = 0;
    }
  }
  inputs_ = run_inputs(run, conditions_);
  phases_ = motion_.phases();
  cut_phases();

  // A step starts in the steady state of its first angle; everything else starts anyhow.
  const LinearSystem system = model.system(conditions_, model.start_values(), channels_);
  if (run.kind != RunKind::step) {
    for (Index i = 0; i < system.free_states(); ++i) free_.push_back(i);
    free_.insert(free_.end(), system.settling.begin(), system.settling.end());
    for (Index i = 0; options.free_memories && i < static_cast<Index>(system.feedback.size()); ++i)
      if (const Index memory = memory_of(system, i); memory >= 0) free_.push_back(memory);
  }
  free_.insert(free_.end(), system.exogenous.begin(), system.exogenous.end());
  states_ = system.states();
  lay_out();
}

/// Where in c each kind of unknown begins.
void RunResidual::lay_out() {
  first_state_ = motion_.unknowns();
  first_offset_ = first_state_ + static_cast<Index>(free_.size());
  unknowns_ = first_offset_ + static_cast<Index>(channels_.size());
  if (conditions_.prescribed_pitch) angle_offset_ = unknowns_++;
  motion_prior_.resize(0, 0);
  prior_rows_.clear();
  weights_changed();
}

Index RunResidual::observations() const {
  return (weight_.array() > 0).count() + (angle_weight_.size() > 0 ? (angle_weight_.array() > 0).count() : 0);
}

Index RunResidual::degrees_of_freedom() const { return observations() - unknowns_; }

void RunResidual::weights_changed() {
  smooth_readings_.clear();
  prepare_angle_rows();
}

void RunResidual::arrive_in(DualMatrix state) {
  if (arrival_.rows() == 0 || arrival_.value != state.value) forget_solutions();
  last_evaluation_ = {};
  arrival_ = std::move(state);
}

void RunResidual::share_responses_with(RunResidual& other) {
  if (!other.shared_) other.shared_ = std::make_shared<SharedResponses>();
  shared_ = other.shared_;
}

void RunResidual::set_motion_prior(const MatrixXd& rows) {
  motion_prior_ = MatrixXd::Zero(rows.rows(), unknowns_ + 1);
  if (rows.rows() > 0) motion_prior_.leftCols(unknowns_) = rows;
  prior_rows_ = by_piece(rows).rows;
  for (MatrixXd& own : prior_rows_)
    if (own.rows() > own.cols()) own = run_rows::compress(std::move(own));
  forget_solutions();
}

void RunResidual::keep_noise_of(const RunResidual& other) {
  sigma_ = other.sigma_;
  converter_ = other.converter_;
  weight_ = other.weight_;
  Linearised::keep_input_noise(*this, other);
  Linearised::keep_white(*this, other);
  take_colour(other);
  angle_sigma_ = other.angle_sigma_;
  angle_ = other.angle_;
  angle_weight_ = other.angle_weight_;
  spikes_ = other.spikes_;
  tempered_ = other.tempered_;
  bool other_colours = false;
  for (std::size_t c = 0; c < channels_.size(); ++c) {  // a number is as noisy as it was; what it stands for may be calibrated anew
    const double size = run_->find(channels_[c])->factor / other.run_->find(channels_[c])->factor;
    if (size == 1) continue;
    sigma_[c] *= size;
    converter_[c].step *= size;
    weight_.col(static_cast<Index>(c)) /= size;
    if (!colour(c)) continue;
    colour_[c] = colour_[c]->times(size);
    other_colours = true;
  }
  if (other_colours) take_colour(*this);
  weights_changed();
}

RunResidual RunResidual::with_motion(std::vector<MotionBasis::Window> windows) const {
  RunResidual other(*model_, *run_, std::move(windows));
  other.keep_noise_of(*this);
  if (last_linear_.size() == unknowns_ && unknowns_ > 0 && other.motion_.unknowns() > 0) {  // a search for c starts from the same motion
    const Interval whole{0, run_->samples()};
    VectorXd start(other.unknowns_);
    start << other.motion_.angle_columns(whole).householderQr().solve(motion_.angle_columns(whole) * last_linear_.head(motion_.unknowns())), last_linear_.tail(unknowns_ - motion_.unknowns());
    if (start.allFinite()) other.last_linear_ = start;
  }
  return other;
}

void RunResidual::settle_noise(const VectorXd& theta) {
  const Prediction p = predict(theta);
  // Knots as close as samples take up to half of the noise of both channels while the shaft moves.
  std::vector<bool> at_rest(static_cast<std::size_t>(run_->samples()), false);
  for (const MotionBasis::Phase& phase : phases_)
    if (!phase.moving) std::fill(at_rest.begin() + phase.samples.first, at_rest.begin() + phase.samples.last, true);
  const auto settle = [&](const std::string& channel, VectorXd residual, Eigen::Ref<VectorXd> weight, double& sigma, const CoarseConverter& converter) {
    const auto counts = [&](Index k) { return weight[k] > 0 && std::isfinite(residual[k]); };
    Index all = 0, resting = 0;
    for (Index k = 0; k < residual.size(); ++k)
      if (counts(k)) ++all, resting += at_rest[static_cast<std::size_t>(k)] ? 1 : 0;
    constexpr Index enough = 100;  // samples, for a level to 9 %
    const bool rests = resting >= enough;
    if (!rests && all <= unknowns_) return;
    for (Index k = 0; k < residual.size(); ++k)
      if (!counts(k) || (rests && !at_rest[static_cast<std::size_t>(k)])) residual[k] = std::nan("");
    // Of a shaft that hardly rests, all unknowns may have taken their share from this channel.
    const double taken = rests ? 1 : std::sqrt(static_cast<double>(all) / static_cast<double>(all - unknowns_));
    constexpr double chance = 0.06;  // two standard deviations between the two estimates for some thousand samples
    const double third = noise_level(residual, 3), first = noise_level(residual, 1);
    double level = std::max(taken * (first < (1 + chance) * third ? first : third), least_noise(run_->channel(channel).value));
    if (converter.step > 0) level = converter.error(residual);
    if (!(level > 0) || (level >= sigma && converter.step == 0)) return;
    weight *= sigma / level;
    sigma = level;
  };
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const auto column = static_cast<Index>(c);
    if (colour(c)) continue;  // has its own level
    settle(channels_[c], measured_.col(column) - p.output.col(column), weight_.col(column), sigma_[c], converter_[c]);
  }
  if (angle_offset_ >= 0) settle("alpha", angle_ - p.motion.angle - VectorXd::Constant(angle_.size(), p.angle_offset[0]), angle_weight_, angle_sigma_, {});
  if (p.output.allFinite() && filters_.empty()) Linearised::settle_input_noise(*this, theta, measured_ - p.output);
  weights_changed();
}

Index RunResidual::reject_spikes(const VectorXd& theta, double limit) {
  if (angle_offset_ < 0) return 0;
  const Prediction p = predict(theta);
  const auto off = [&](Index k) {
    return k >= 0 && k < last_sample_ && angle_weight_[k] > 0 && std::abs(angle_[k] - p.angle_offset[0] - p.motion.angle[k]) > limit * angle_sigma_;
  };
  std::vector<Index> spikes;
  for (Index k = 0; k < last_sample_; ++k)
    if (off(k) && !(off(k - 1) && off(k + 1)) && !(off(k - 2) && off(k - 1)) && !(off(k + 1) && off(k + 2))) spikes.push_back(k);
  for (Index k : spikes) angle_weight_[k] = 0;
  const auto rejected = static_cast<Index>(spikes.size());
  spikes_ += rejected;
  if (rejected > 0) prepare_angle_rows();
  return rejected;
}

}  // namespace unrig
