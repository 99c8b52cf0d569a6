#include "fit/diagnose/mismatch.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/numerics/spectrum.h"
#include "core/files/text_file.h"
#include "fit/uncertainty/coloured_noise.h"
#include "fit/likelihood/standardised_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;

constexpr double significant = 1e-3;
constexpr double of_tests = 3;  // Bonferroni
constexpr double beyond_motion = 1.05;  // a motion that is known to its noise leaves up to a twentieth

double upper_normal(double z) { return 0.5 * std::erfc(z / std::sqrt(2.0)); }

/// The shortest interval of `power` that holds the share `most` of what it has above `floor`.
Interval holding(const VectorXd& power, double floor, double most) {
  const Index n = power.size();
  VectorXd sum = VectorXd::Zero(n + 1);
  for (Index k = 0; k < n; ++k) sum[k + 1] = sum[k] + power[k] - floor;
  const double wanted = most * sum[n];
  Interval best{0, n};
  if (!(wanted > 0)) return best;
  Index last = 0;
  for (Index first = 0; first < n; ++first) {
    last = std::max(last, first);
    while (last < n && sum[last] - sum[first] < wanted) ++last;
    if (sum[last] - sum[first] < wanted) break;
    if (last - first < best.length()) best = {first, last};
  }
  return best;
}

VectorXd smoothed(const VectorXd& x, Index half) {
  VectorXd sum = VectorXd::Zero(x.size() + 1), out(x.size());
  for (Index k = 0; k < x.size(); ++k) sum[k + 1] = sum[k] + x[k];
  for (Index k = 0; k < x.size(); ++k) {
    const Index a = std::max<Index>(0, k - half), b = std::min(x.size(), k + half + 1);
    out[k] = (sum[b] - sum[a]) / static_cast<double>(b - a);
  }
  return out;
}

/// Whether what is left at rest is noise, whatever its level and tails: white, and even over the record. What a model lacks comes and goes with the motion.
bool is_noise(const RunResidual& run, const VectorXd& left) {
  const VectorXd resting = residual_at_rest(left, run.motion().phases(), run.linear_unknowns());
  return whiteness({resting}) > significant && evenness(resting) > significant;
}

/// What is left of one channel.
struct Left {
  std::size_t run;
  VectorXd residual;  // over the noise
  Line line;
  double p_but_for_line;
};

bool is_linear(const RunResidual& run, const VectorXd& theta) { return run.model().system(run.conditions(), theta, run.channels()).feedback.empty(); }

/// "growing with the motion": how the r.m.s. of the excess goes with that of the gauge's own swing from run to run, where three or more runs tell.
std::string growth(const std::vector<double>& swing, const std::vector<double>& excess) {
  if (swing.size() < 3) return "";
  const Eigen::Map<const Eigen::ArrayXd> x(swing.data(), static_cast<Index>(swing.size())), y(excess.data(), static_cast<Index>(excess.size()));
  const Eigen::ArrayXd u = x.log() - x.log().mean(), v = y.log() - y.log().mean();
  const double spread = u.matrix().norm() * v.matrix().norm(), slope = (u * v).sum() / u.square().sum();
  constexpr double clearly = 0.9, fastest = 0.25;
  if (!(spread > 0) || (u * v).sum() / spread < clearly || slope < fastest) return "";
  return fmt::format("; from run to run it grows {} what the gauge swings", in_words_of_power(slope));
}

/// "82 % of the excess of step_a.csv lies between 13 and 17 Hz, from 1.0 to 1.4 s (0 to 3 semichords after the motion begins)".
std::string describe(const RunResidual& run, const VectorXd& left, Mismatch& mismatch) {
  constexpr double most = 0.8;
  const double dt = run.run().dt;
  const Interval time = holding(smoothed(left.cwiseAbs2(), 12), 1, most);
  const VectorXcd lines = fourier(left);
  const VectorXd power = lines.cwiseAbs2() / static_cast<double>(left.size());
  const Interval band = holding(power, 1, most);
  const double per_line = 1 / (dt * static_cast<double>(left.size()));
  const double t0 = run.run().time(time.first), t1 = run.run().time(std::min(time.last, run.run().samples()) - 1);
  const double f0 = static_cast<double>(band.first) * per_line, f1 = static_cast<double>(band.last) * per_line;
  mismatch.time.push_back({t0, t1});
  mismatch.frequency.push_back({f0, f1});
  std::string text = fmt::format("{:.0f} % of the excess of {} lies between {:.3g} and {:.3g} Hz, and {:.0f} % of it between {:.3g} and {:.3g} s", 100 * most, base_name(run.run().file), f0, f1,
                                 100 * most, t0, t1);
  if (run.motion().unknowns() > 0 && run.conditions().speed > 0) {
    const double onset = run.run().time(run.motion().active().front().first), per_second = run.conditions().speed / run.model().rig().semichord();
    text += fmt::format(" ({:.2g} to {:.2g} semichords after the motion begins)", std::max(0.0, (t0 - onset) * per_second), (t1 - onset) * per_second);
  }
  return text;
}

/// "step_a.csv has a line at 60.0 Hz, of 25 times the power that its noise has there".
std::string describe_line(const RunResidual& run, const Line& line, Mismatch& mismatch) {
  const double dt = run.run().dt, frequency = line.place / dt, half_width = 0.5 / (dt * static_cast<double>(run.run().samples()));
  mismatch.time.push_back({run.run().time(0), run.run().time(run.run().samples() - 1)});
  mismatch.frequency.push_back({frequency - half_width, frequency + half_width});
  return fmt::format("{} has a line at {:.3g} Hz, of {:.2g} times the power that its noise has there", base_name(run.run().file), frequency, line.over_mean);
}

}  // namespace

std::string in_words_of_power(double exponent) {
  constexpr double close = 0.15;
  if (std::abs(exponent - 1) < close) return "in proportion to";
  if (std::abs(exponent - 2) < close) return "with the square of";
  if (std::abs(exponent - 3) < close) return "with the cube of";
  return fmt::format("with the power {:.2g} of", exponent);
}

Mismatch locate_mismatch(const JointProblem& joint) {
  Mismatch mismatch;
  std::vector<Left> all;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    if (run.is_aside()) continue;
    const RunResidual::Prediction p = run.predict(joint.theta(r));
    for (std::size_t c = 0; c < p.channels.size(); ++c) {
      VectorXd left = standardised_residual(run, joint.theta(r), p, c);
      // In units of its own white part, where that can be told: the assumed level may be off by a few per cent.
      const double count = static_cast<double>((left.array() != 0).count());
      const bool is_coarse = run.converter(c).step > 0;
      if (is_coarse) left = run.converter(c).beyond(left * run.sigma(c));
      ChannelMismatch m{run.run().file, p.channels[c]};
      m.energy = left.squaredNorm() / count;
      const double freedom = count - static_cast<double>(run.linear_unknowns());
      const double energy_p = upper_normal((left.squaredNorm() - freedom) / std::sqrt(2 * freedom) / beyond_motion - (beyond_motion - 1) * std::sqrt(freedom / 2));
      // A law is followed in steps, which leave lines of their own; so does a coarse converter.
      const Line line = is_linear(run, joint.theta(r)) && !is_coarse ? strongest_line(left) : Line();
      const double but_for_line = std::min(is_noise(run, left) ? 1.0 : energy_p, whiteness({left}));
      m.p_value = std::min(1.0, of_tests * std::min(but_for_line, line.p_value));
      m.excess = std::max(0.0, left.squaredNorm() - freedom);
      mismatch.channels.push_back(m);
      all.push_back({r, std::move(left), line, but_for_line});
    }
  }
  const auto tests = static_cast<double>(mismatch.channels.size());
  std::size_t worst = 0;
  std::vector<double> swing, excess;
  for (std::size_t i = 0; i < mismatch.channels.size(); ++i) {
    const ChannelMismatch& m = mismatch.channels[i];
    mismatch.p_value = std::min(mismatch.p_value, tests * m.p_value);
    const auto is_seen = [&](double p_value) { return tests * of_tests * p_value < significant; };
    const bool is_loud = m.energy >= beyond_motion && is_seen(all[i].p_but_for_line);
    if (!is_loud && !is_seen(all[i].line.p_value)) continue;
    mismatch.found = true;
    mismatch.runs.push_back(m.run);
    const RunResidual& run = joint.runs()[all[i].run];
    const VectorXd theta = joint.theta(all[i].run);
    std::string text = is_loud ? describe(run, all[i].residual, mismatch) : describe_line(run, all[i].line, mismatch);
    mismatch.state.push_back(is_loud && is_linear(run, theta) ? depends_on(run_states(run, run.predict(theta), theta), all[i].residual) : std::nullopt);
    if (mismatch.state.back()) text += ", " + sentence(*mismatch.state.back());
    if (const VectorXd& read = run.run().channel(m.channel).value; m.channel == run.channels().front() && read.allFinite()) {
      swing.push_back(std::sqrt((read.array() - read.mean()).square().mean()));
      excess.push_back(std::sqrt(m.excess / static_cast<double>(read.size())) * run.sigma(0));
    }
    if (mismatch.summary.empty() || m.excess > mismatch.channels[worst].excess) mismatch.summary = text, worst = i;
  }
  mismatch.summary += growth(swing, excess);
  if (!mismatch.found) mismatch.summary = "the model explains every run to its noise";
  return mismatch;
}

bool has_line(const JointProblem& joint, const Effect& e) {
  const auto tests = static_cast<double>(e.bands.size() * joint.runs().size());
  for (std::size_t r = 0; r < joint.runs().size() && e.frequency; ++r) {
    const RunResidual& run = joint.runs()[r];
    if (run.is_aside() || !e.acts(joint.model().rig(), run.conditions())) continue;
    const VectorXd theta = joint.theta(r), left = standardised_residual(run, theta, run.predict(theta), 0);
    const auto at = [&](double parameter) { return run.run().dt * e.frequency(joint.model(), run.conditions(), VectorXd::Constant(1, parameter)); };
    for (const auto& [lower, upper] : e.bands)
      if (tests * strongest_line(left, at(lower), at(upper)).p_value < significant) return true;
  }
  return false;
}

}  // namespace unrig
