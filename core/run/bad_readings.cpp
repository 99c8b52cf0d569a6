#include "core/run/bad_readings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "core/numerics/median.h"
#include "core/run/motion.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double far = 10;  // scales

/// Of the medians over five samples.
struct Range {
  double low = 0, high = 0;
};

Range range_of(const VectorXd& x) {
  Range range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  std::array<double, 5> near{};
  for (Index k = 0; k < x.size(); ++k) {
    std::size_t count = 0;
    for (Index i = std::max<Index>(0, k - 2); i <= std::min(x.size() - 1, k + 2); ++i)
      if (std::isfinite(x[i])) near[count++] = x[i];
    if (count == 0) continue;
    const auto middle = near.begin() + static_cast<std::ptrdiff_t>(count / 2);
    std::nth_element(near.begin(), middle, near.begin() + static_cast<std::ptrdiff_t>(count));
    range.low = std::min(range.low, *middle);
    range.high = std::max(range.high, *middle);
  }
  return range.high > range.low ? range : Range{};
}

/// Which samples a prediction may not rest on.
class Readings {
 public:
  explicit Readings(const VectorXd& x) : x_(x), out_(static_cast<std::size_t>(x.size()), 0) {}

  const VectorXd& value() const { return x_; }
  bool usable(Index k) const { return k >= 0 && k < x_.size() && std::isfinite(x_[k]) && !out_[static_cast<std::size_t>(k)]; }
  void leave_out(Index first, Index last) { std::fill(out_.begin() + first, out_.begin() + last, char{1}); }
  void take_back(Index first, Index last) { std::fill(out_.begin() + first, out_.begin() + last, char{0}); }

  /// Value that the neighbours of k predict, and the standard deviation of x_k less that in units of the noise; a gain of 0 where there are too few.
  struct Prediction {
    double value = 0, gain = 0;
  };
  Prediction predicted(Index k) const {
    std::array<Index, 4> near{};
    const bool left = find(k, -1, 2, near, 0) == 2, right = find(k, 1, 2, near, 2) == 2;
    if (!left && find(k, 1, 4, near, 0) < 4) return {};  // the record begins
    if (!right && find(k, -1, 4, near, 0) < 4) return {};
    Prediction p;
    double squares = 1;
    for (const Index i : near) {
      double weight = 1;
      for (const Index j : near)
        if (j != i) weight *= static_cast<double>(k - j) / static_cast<double>(i - j);
      p.value += weight * x_[i];
      squares += weight * weight;
    }
    p.gain = std::sqrt(squares);
    return p;
  }
  /// |x_k - prediction| / gain; 0 where nothing can be said.
  double deviation(Index k) const {
    if (k < 0 || k >= x_.size() || !std::isfinite(x_[k])) return 0;
    const Prediction p = predicted(k);
    return p.gain > 0 ? std::abs(x_[k] - p.value) / p.gain : 0;
  }

 private:
  static constexpr Index reach = 12;  // samples

  /// The nearest usable samples on one side, into `near` from `at` on; how many there are.
  std::size_t find(Index k, Index side, std::size_t wanted, std::array<Index, 4>& near, std::size_t at) const {
    std::size_t found = 0;
    for (Index i = k + side; std::abs(i - k) <= reach && i >= 0 && i < x_.size() && found < wanted; i += side)
      if (usable(i)) near[at + found++] = i;
    return found;
  }

  const VectorXd& x_;
  std::vector<char> out_;
};

/// Samples [first, last) that are suspect together.
struct Group {
  Index first = 0, last = 0;
};

/// Those that hold sample k: itself, pairs, and the run of one and the same value, if it is short.
std::vector<Group> groups_around(const VectorXd& x, Index k) {
  std::vector<Group> groups{{k, k + 1}};
  if (k > 0) groups.push_back({k - 1, k + 1});
  if (k + 1 < x.size()) groups.push_back({k, k + 2});
  constexpr Index longest = 8;
  Group alike{k, k + 1};
  while (alike.first > 0 && x[alike.first - 1] == x[k] && k - alike.first < longest) --alike.first;
  while (alike.last < x.size() && x[alike.last] == x[k] && alike.last - k <= longest) ++alike.last;
  if (const Index length = alike.last - alike.first; length > 2 && length <= longest) groups.push_back(alike);
  return groups;
}

class IsolatedReadings {
 public:
  IsolatedReadings(const VectorXd& x, ReadingOf of, const std::vector<Index>& beside) : readings_(x), range_(range_of(x)), deviation_(x.size()) {
    std::vector<double> known;
    for (Index k = 0; k < x.size(); ++k)
      if (deviation_[k] = readings_.deviation(k); readings_.usable(k)) known.push_back(deviation_[k]);
    constexpr double digits = 1e-8;  // of a simulation
    scale_ = std::max({median_to_sigma * median(known), rounding_level(x), digits * (range_.high - range_.low)});
    if (of == ReadingOf::input) find_rest();
    for (const Index blow : beside) {
      constexpr Index before = 1, behind = 3;  // samples: a delay of the channel
      for (Index k = std::max<Index>(0, blow - before); k <= std::min(x.size() - 1, blow + behind); ++k) kept_.push_back(k);
    }
    std::sort(kept_.begin(), kept_.end());
  }

  SuspectReadings find() {
    if (!(scale_ > 0)) return {};
    std::vector<std::pair<double, Index>> suspects;
    for (Index k = 0; k < deviation_.size(); ++k)
      if (deviation_[k] > far * scale_) suspects.emplace_back(-deviation_[k], k);
    std::sort(suspects.begin(), suspects.end());
    for (const auto& [off, k] : suspects)
      if (readings_.usable(k) && !std::binary_search(kept_.begin(), kept_.end(), k) && readings_.deviation(k) > far * std::max(scale_, at_a_glance(k))) judge(k);
    std::sort(found_.isolated.begin(), found_.isolated.end());
    if (!rests_) return found_;
    for (const auto& [off, k] : suspects)
      if (!std::binary_search(found_.isolated.begin(), found_.isolated.end(), k)) found_.blows.push_back(k);
    std::sort(found_.blows.begin(), found_.blows.end());
    return found_;
  }

 private:
  const VectorXd& x() const { return readings_.value(); }

  /// An input that is at rest in most of the record.
  void find_rest() {
    std::vector<double> values, off;
    for (const double v : x())
      if (std::isfinite(v)) values.push_back(v);
    rest_ = median(values);
    for (const double v : values) off.push_back(std::abs(v - rest_));
    constexpr double hardly = 5;  // scales
    rests_ = median(off) <= hardly * scale_;
  }

  /// At least so much is the deviation around, of samples that a suspect and its neighbour do not reach.
  double at_a_glance(Index k) const {
    constexpr Index from = 4, to = 8;
    std::vector<double> around;
    for (const Index side : {-1, 1})
      for (Index i = from; i <= to; ++i)
        if (readings_.usable(k + side * i)) around.push_back(deviation_[k + side * i]);
    std::sort(around.begin(), around.end());
    return around.size() < 2 * (to - from + 1) ? 0 : median_to_sigma * around[1];  // ten of sixteen: their median is no less than the second of these
  }

  void judge(Index k) {
    for (const Group& group : groups_around(x(), k)) {
      readings_.leave_out(group.first, group.last);
      if (!stands_alone(group)) {
        readings_.take_back(group.first, group.last);
        continue;
      }
      if (leaves_its_rest(group)) return readings_.take_back(group.first, group.last);
      for (Index i = group.first; i < group.last; ++i) found_.isolated.push_back(i);
      return;
    }
  }

  bool stands_alone(const Group& group) const {
    if (group.last - group.first == 2 && x()[group.first] != x()[group.first + 1] && !far_outside(group)) return false;
    double least = std::numeric_limits<double>::infinity();
    for (Index i = group.first; i < group.last; ++i) least = std::min(least, readings_.deviation(i));
    if (!(least > far * scale_)) return false;
    constexpr Index beside = 3, around = 8;
    constexpr double within = 5;  // scales
    std::vector<double> deviations;
    for (const Index side : {-1, 1}) {
      Index counted = 0;
      for (Index i = side < 0 ? group.first - 1 : group.last; counted < around && i >= 0 && i < x().size() && std::abs(i - group.first) < 4 * around; i += side) {
        if (!readings_.usable(i)) continue;
        const double off = readings_.deviation(i);
        if (++counted <= beside && off > std::max(within * scale_, least / far)) return false;
        deviations.push_back(off);
      }
    }
    constexpr std::size_t enough = 4;
    return deviations.size() >= enough && least > far * median_to_sigma * median(deviations);
  }

  /// By half of the channel's range, as no pulse of a rig is that friction or a gap makes within two samples.
  bool far_outside(const Group& group) const {
    const double half = 0.5 * (range_.high - range_.low);
    const auto outside = [&](double v) { return v > range_.high + half || v < range_.low - half; };
    return outside(x()[group.first]) && outside(x()[group.first + 1]);
  }

  bool leaves_its_rest(const Group& group) const {
    if (!rests_) return false;
    for (Index i = group.first; i < group.last; ++i)
      if (std::abs(x()[i] - rest_) > std::abs(readings_.predicted(i).value - rest_)) return true;
    return false;
  }

  Readings readings_;
  Range range_;
  VectorXd deviation_;
  double scale_ = 0, rest_ = 0;
  bool rests_ = false;
  std::vector<Index> kept_;
  SuspectReadings found_;
};

/// The straight line through y at t: where it passes t = 0, and the standard error of that in units of y's.
struct LineAtZero {
  double value = 0, leverage = 0;
};

LineAtZero line_at_zero(const VectorXd& t, const VectorXd& y) {
  const double middle = t.mean(), spread = (t.array() - middle).square().sum();
  const double slope = (t.array() - middle).matrix().dot(y) / spread;
  return {y.mean() - slope * middle, std::sqrt(1 / static_cast<double>(t.size()) + middle * middle / spread)};
}

/// Smallest change between neighbours: the resolution of converter and print. Infinite where nothing changes.
double resolution(const VectorXd& x) {
  double least = std::numeric_limits<double>::infinity();
  for (Index k = 0; k + 1 < x.size(); ++k)
    if (const double change = std::abs(x[k + 1] - x[k]); change > 0) least = std::min(least, change);
  return least;
}

/// Whether the signal around [first, last), whose samples are all `end`, passes beyond it there; `sign` 1 where that is the largest reading, -1 the smallest. Either side heads for it by
/// itself: a rest at the channel's largest reading is no end of a range.
bool passes_beyond(const VectorXd& x, const Group& plateau, double end, double sign, double error, double step) {
  const Index length = plateau.last - plateau.first, wanted = std::max<Index>(3, (length + 2) / 3), farthest = wanted + 3;
  const double middle = 0.5 * static_cast<double>(plateau.first + plateau.last - 1);
  for (const Index side : {-1, 1}) {
    VectorXd t(wanted), y(wanted);
    Index found = 0;
    for (Index i = side < 0 ? plateau.first - 1 : plateau.last, walked = 0; found < wanted && walked < farthest && i >= 0 && i < x.size(); i += side, ++walked) {
      if (!std::isfinite(x[i]) || x[i] == end) continue;
      t[found] = static_cast<double>(i) - middle;
      y[found++] = sign * (x[i] - end);
    }
    if (found < wanted) return false;
    const LineAtZero line = line_at_zero(t, y);
    constexpr double turning = 2, chance = 6;  // steps that tangents of a parabola pass it by; standard errors
    if (!(line.value > turning * step + chance * line.leverage * error)) return false;
  }
  return true;
}

}  // namespace

SuspectReadings isolated_readings(const VectorXd& x, ReadingOf of, const std::vector<Index>& beside) { return IsolatedReadings(x, of, beside).find(); }

namespace {

double step_of(const VectorXd& x) { return std::max(std::sqrt(12.0) * rounding_level(x), resolution(x)); }

/// Whether a plateau up to the end of the record is a converter at the end of its range, for good. Readings whose noise is above a step are two alike in four cases of ten at most: twenty in 1e8 records.
bool stays_for_good(const VectorXd& x, const Group& plateau, double end) {
  constexpr Index shortest = 20, enough = 100;
  if (plateau.last < x.size() || plateau.last - plateau.first < shortest) return false;
  std::vector<double> others;  // a channel that rests at its end, and leaves it for a blow, has few
  for (Index k = 0; k < plateau.first; ++k)
    if (x[k] != end) others.push_back(x[k]);
  const auto count = static_cast<Index>(others.size());
  if (count < enough) return false;
  const VectorXd before = Eigen::Map<const VectorXd>(others.data(), count);
  constexpr double alike = 2;  // differences of every order give the level of noise, not that of a simulation's smooth signal
  const double noise = noise_level(before);
  return noise > step_of(before) && noise_level(before, 3) < alike * noise;
}

}  // namespace

std::vector<Index> clipped_readings(const VectorXd& x) {
  std::vector<Index> clipped;
  double error = -1, step = 0;
  for (const double sign : {1.0, -1.0}) {
    double end = -std::numeric_limits<double>::infinity();
    for (const double v : x)
      if (std::isfinite(v)) end = std::max(end, sign * v);
    end *= sign;
    std::vector<Index> there;
    bool cut = false;
    for (Index k = 0; k < x.size(); ++k) {
      if (x[k] != end) continue;
      Group plateau{k, k};
      while (plateau.last < x.size() && x[plateau.last] == end) there.push_back(plateau.last++);
      constexpr Index shortest = 3;
      if (!cut && plateau.last - plateau.first >= shortest && plateau.first > 0 && plateau.last < x.size()) {
        if (error < 0) {
          constexpr double fine = 4;  // steps: three readings in so much noise are alike once in some hundred times, and seldom the largest
          const double noise = noise_level(x);
          step = step_of(x);
          error = std::max(step / std::sqrt(12.0), noise < fine * step ? noise : 0);
        }
        cut = passes_beyond(x, plateau, end, sign, error, step);
      }
      cut = cut || stays_for_good(x, plateau, end);
      k = plateau.last;
    }
    if (cut) clipped.insert(clipped.end(), there.begin(), there.end());
  }
  std::sort(clipped.begin(), clipped.end());
  return clipped;
}

double robust_range(const VectorXd& x) {
  const Range range = range_of(x);
  if (range.high > range.low) return range.high - range.low;
  // Of a few readings the medians are one and the same.
  double low = std::numeric_limits<double>::infinity(), high = -low;
  constexpr Index few = 5;
  if (x.size() > few) return 0;
  for (const double value : x)
    if (std::isfinite(value)) low = std::min(low, value), high = std::max(high, value);
  return high > low ? high - low : 0;
}

}  // namespace unrig
