#include "core/run/motion.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "core/numerics/median.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;


/// Coefficients of a cubic B-spline stretched by `stride` in splines on the fine knots: four boxes of that width, convolved.
VectorXd two_scale(Index stride) {
  VectorXd mask = VectorXd::Ones(1);
  for (int box = 0; box < 4; ++box) {
    VectorXd wider = VectorXd::Zero(mask.size() + stride - 1);
    for (Index k = 0; k < stride; ++k) wider.segment(k, mask.size()) += mask;
    mask = wider;
  }
  const double s = static_cast<double>(stride);
  return mask / (s * s * s);
}

double median_of_five(const VectorXd& x, Index k) {
  std::array<double, 5> near{};
  int count = 0;
  for (Index i = std::max<Index>(0, k - 2); i <= std::min(x.size() - 1, k + 2); ++i)
    if (std::isfinite(x[i])) near[static_cast<std::size_t>(count++)] = x[i];
  if (count == 0) return std::nan("");
  std::nth_element(near.begin(), near.begin() + count / 2, near.begin() + count);
  return near[static_cast<std::size_t>(count / 2)];
}

/// Sample k minus the cubic through the two nearest samples on either side that are not `out`, over the gain of its noise; 0 where there are none.
double off_the_cubic(const VectorXd& x, const std::vector<bool>& out, Index k) {
  const auto usable = [&](Index i) { return std::isfinite(x[i]) && !out[static_cast<std::size_t>(i)]; };
  if (!usable(k)) return 0;
  std::vector<Index> near;
  for (const Index side : {-1, 1}) {
    const std::size_t wanted = near.size() + 2;
    for (Index i = k + side; i >= 0 && i < x.size() && near.size() < wanted; i += side)
      if (usable(i)) near.push_back(i);
    if (near.size() < wanted) return 0;
  }
  double difference = x[k], gain = 1;
  for (const Index i : near) {
    double weight = 1;
    for (const Index j : near)
      if (j != i) weight *= static_cast<double>(k - j) / static_cast<double>(i - j);
    difference -= weight * x[i];
    gain += weight * weight;
  }
  return difference / std::sqrt(gain);
}

}  // namespace

MotionBasis::MotionBasis(Index samples, std::vector<Window> windows) : samples_(samples), windows_(std::move(windows)) {
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    const Window& window = windows_[w];
    if (window.stride < 1 || window.knots.first < 0 || window.knots.length() < window.stride)
      throw std::invalid_argument("a window of the motion needs knots inside the record and a stride of at least 1");
    const VectorXd mask = two_scale(window.stride);
    const Index count = window.knots.length() / window.stride;
    for (Index i = 0; i < count; ++i) columns_.push_back({window.knots.first + i * window.stride, mask, 0});
    // The level after the window: every further coarse spline at once, a ramp of fine coefficients that ends in 1.
    VectorXd level = VectorXd::Zero(mask.size());
    double total = 0;
    for (Index k = 0; k < mask.size(); ++k) {
      for (Index j = k; j >= 0; j -= window.stride) level[k] += mask[j];
      total = level[k];
    }
    columns_.push_back({window.knots.first + count * window.stride, level, total});
  }
}

std::vector<Interval> MotionBasis::active() const {
  std::vector<Interval> intervals;
  for (const Window& window : windows_) {
    const Index reach = 4 * window.stride;  // support of the last spline's jerk
    intervals.push_back({window.knots.first, std::min(samples_, window.knots.last + reach)});
  }
  return intervals;
}

std::vector<MotionBasis::Phase> MotionBasis::phases() const {
  std::vector<Phase> phases;
  Index at = 0;
  for (const Interval& interval : active()) {
    if (interval.first > at) phases.push_back({{at, interval.first}, false});
    if (interval.first < at)  // the last splines of one window still act when the next begins
      phases.back().samples.last = interval.last;
    else
      phases.push_back({interval, true});
    at = interval.last;
  }
  if (at < samples_) phases.push_back({{at, samples_}, false});
  return phases;
}

VectorXd MotionBasis::coefficients(const VectorXd& u) const {
  VectorXd c = VectorXd::Zero(samples_);
  // A level adds to all that came before; each window's knots are relative to the level they start from.
  for (std::size_t j = 0; j < columns_.size(); ++j) {
    const Column& column = columns_[j];
    const double amount = u[static_cast<Index>(j)];
    const Index inside = std::clamp<Index>(samples_ - column.first, 0, column.value.size());
    c.segment(column.first, inside) += amount * column.value.head(inside);
    const Index after = column.first + inside;
    if (column.tail != 0 && after < samples_) c.tail(samples_ - after).array() += amount * column.tail;
  }
  return c;
}

Eigen::MatrixXd MotionBasis::angle_columns(Interval range, Index first, Index last) const {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(range.length(), last - first);
  for (Index j = 0; j < columns.cols(); ++j) {
    const Column& column = columns_[static_cast<std::size_t>(first + j)];
    const auto coefficient = [&](Index k) {
      if (k < column.first) return 0.0;
      return k - column.first < column.value.size() ? column.value[k - column.first] : column.tail;
    };
    for (Index k = std::max(range.first, column.first); k < range.last; ++k) {
      columns(k - range.first, j) = (coefficient(k - 3) + 4 * coefficient(k - 2) + coefficient(k - 1)) / 6;
      if (k > column.first + column.value.size() + 3) {  // constant from here on
        columns.col(j).tail(range.last - k).setConstant(column.tail);
        break;
      }
    }
  }
  return columns;
}

Motion motion_of(const VectorXd& c, double dt) {
  const Index n = c.size();
  Motion m{VectorXd(n), VectorXd(n), VectorXd(n), VectorXd(n)};
  const auto at = [&](Index j) { return j >= 0 ? c[j] : 0.0; };
  for (Index k = 0; k < n; ++k) {
    m.angle[k] = (at(k - 3) + 4 * at(k - 2) + at(k - 1)) / 6;
    m.rate[k] = (at(k - 1) - at(k - 3)) / (2 * dt);
    m.acceleration[k] = (at(k - 1) - 2 * at(k - 2) + at(k - 3)) / (dt * dt);
    m.jerk[k] = (at(k) - 3 * at(k - 1) + 3 * at(k - 2) - at(k - 3)) / (dt * dt * dt);
  }
  return m;
}

Motion interpolated_motion(const VectorXd& angle, double dt) {
  const Index n = angle.size();
  if (n < 3 || !angle.allFinite()) throw std::invalid_argument("a spline needs three samples, and a number in each");
  // Continuous rate at every knot: m_{k-1} + 4 m_k + m_{k+1} = 6 (p_{k-1} - 2 p_k + p_{k+1}) / dt^2 for the accelerations m, with
  // 2 m_0 + m_1 = 6 (p_1 - p_0) / dt^2 at the resting start and m_{n-1} = m_{n-2} at the end; by elimination from the start.
  VectorXd diagonal(n - 1), m(n);
  diagonal[0] = 2;
  m[0] = 6 * (angle[1] - angle[0]) / (dt * dt);
  for (Index k = 1; k < n - 1; ++k) {
    diagonal[k] = (k < n - 2 ? 4.0 : 5.0) - 1 / diagonal[k - 1];
    m[k] = 6 * (angle[k - 1] - 2 * angle[k] + angle[k + 1]) / (dt * dt) - m[k - 1] / diagonal[k - 1];
  }
  m[n - 2] /= diagonal[n - 2];
  for (Index k = n - 3; k >= 0; --k) m[k] = (m[k] - m[k + 1]) / diagonal[k];
  m[n - 1] = m[n - 2];

  Motion motion{angle.array() - angle[0], VectorXd(n), m, VectorXd(n)};
  for (Index k = 0; k + 1 < n; ++k) {
    motion.rate[k] = (angle[k + 1] - angle[k]) / dt - dt * (2 * m[k] + m[k + 1]) / 6;
    motion.jerk[k] = (m[k + 1] - m[k]) / dt;
  }
  motion.rate[n - 1] = motion.rate[n - 2] + dt * m[n - 2];
  motion.jerk[n - 1] = 0;
  return motion;
}

namespace {

/// Whether differences beyond `limit` come all over the record, as tails of noise do and transients do not: test of Kolmogorov and Smirnov of their places, failed once in a thousand. Differences that have
/// a reading in common count as one. False where there are fewer than ten.
bool come_all_over(const std::vector<double>& differences, double limit, int order) {
  std::vector<double> place;
  std::size_t last = 0;
  for (std::size_t k = 0; k < differences.size(); ++k) {
    if (!(differences[k] > limit)) continue;
    if (place.empty() || k - last > static_cast<std::size_t>(order)) place.push_back((static_cast<double>(k) + 0.5) / static_cast<double>(differences.size()));
    last = k;
  }
  constexpr std::size_t few = 10;
  constexpr double once_in_a_thousand = 1.9495;
  if (place.size() < few) return false;
  const auto count = static_cast<double>(place.size());
  double distance = 0;
  for (std::size_t i = 0; i < place.size(); ++i) distance = std::max({distance, static_cast<double>(i + 1) / count - place[i], place[i] - static_cast<double>(i) / count});
  return std::sqrt(count) * distance < once_in_a_thousand;
}

}  // namespace

double noise_level(const VectorXd& channel, int order) {
  std::vector<double> differences;
  std::vector<double> binomial(static_cast<std::size_t>(order) + 1, 1);
  for (int k = 1; k <= order; ++k) binomial[static_cast<std::size_t>(k)] = -binomial[static_cast<std::size_t>(k - 1)] * (order - k + 1) / k;
  double gain = 0;
  for (double b : binomial) gain += b * b;
  for (Index k = 0; k + order < channel.size(); ++k) {
    double difference = 0;
    for (int i = 0; i <= order; ++i) difference += binomial[static_cast<std::size_t>(i)] * channel[k + i];
    if (std::isfinite(difference)) differences.push_back(std::abs(difference));
  }
  const double robust = median_to_sigma * median(differences);
  // The median alone wastes two thirds of the data: mean square of all that lies within a cut, over that of a normal cut off there.
  constexpr double near = 3.5, near_variance = 0.99389, far = 10;  // as far out as a reading that is kept (core/run/bad_readings.h)
  const bool tails = come_all_over(differences, near * robust, order);
  const double cut = tails ? far : near, cut_variance = tails ? 1 : near_variance;
  double sum = 0;
  Index count = 0;
  for (double d : differences)
    if (d <= cut * robust) sum += d * d, ++count;
  const double level = count > 0 ? std::sqrt(sum / static_cast<double>(count) / cut_variance / gain) : 0;
  return std::max(level, rounding_level(channel));
}

double rounding_level(const VectorXd& channel) {
  std::vector<double> changes;  // between neighbours, where there is any
  for (Index k = 0; k + 1 < channel.size(); ++k)
    if (const double change = std::abs(channel[k + 1] - channel[k]); change > 0) changes.push_back(change);
  if (changes.empty()) return 0;
  const auto quantile = [&](std::size_t one_in) {
    const auto place = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() / one_in);
    std::nth_element(changes.begin(), place, changes.end());
    return *place;
  };
  // Of changes spread evenly, as those of a fast signal are, the 5 % quantile is five times the 1 % quantile. Of a converter's both are its
  // quantum, up to the decimals with which it is printed.
  const double least = quantile(100), low = quantile(20);
  constexpr double alike = 1.2;
  return low < alike * least ? low / std::sqrt(12.0) : 0;
}

std::vector<bool> isolated_spikes(const VectorXd& x, double sigma, const std::vector<Interval>& motion, double limit) {
  std::vector<bool> spike(static_cast<std::size_t>(x.size()), false);
  const auto moves = [&](Index k) { return std::any_of(motion.begin(), motion.end(), [&](const Interval& i) { return k >= i.first && k < i.last; }); };
  for (Index k = 0; k < x.size(); ++k)
    spike[static_cast<std::size_t>(k)] = std::isfinite(x[k]) && !moves(k) && std::abs(x[k] - median_of_five(x, k)) > limit * sigma;

  std::vector<std::pair<double, Index>> suspects;
  for (const Interval& i : motion)
    for (Index k = i.first; k < i.last; ++k)
      if (const double off = std::abs(off_the_cubic(x, spike, k)); off > limit * sigma) suspects.emplace_back(-off, k);
  std::sort(suspects.begin(), suspects.end());
  for (const auto& [off, k] : suspects) {
    const auto out = static_cast<std::size_t>(k);
    if (std::abs(off_the_cubic(x, spike, k)) <= limit * sigma) continue;  // it was its neighbour
    spike[out] = true;
    for (Index j = std::max<Index>(0, k - 2); j <= std::min(x.size() - 1, k + 2); ++j)
      if (j != k && std::abs(off_the_cubic(x, spike, j)) > limit * sigma) spike[out] = false;
  }
  return spike;
}

namespace {

/// A motion that hardly stands out of the noise shows its steepest part only. It lasts some two and a half times as long as its height takes at its steepest (a smooth step of the seventh degree 2.2 times).
void widen(std::vector<Interval>& intervals, const VectorXd& smooth, Index reach, double hardly) {
  constexpr double times = 2.5;
  constexpr Index gap = 10, level = 40;  // samples: between a motion and its levels, and of these
  const Index n = smooth.size();
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    Interval& moves = intervals[i];
    double steepest = 0;
    for (Index k = moves.first; k < moves.last; ++k) steepest = std::max(steepest, std::abs(smooth[k + reach] - smooth[k - reach]));
    const Index before = i > 0 ? intervals[i - 1].last : 0, behind = i + 1 < intervals.size() ? intervals[i + 1].first : n;
    if (!(steepest < hardly) || moves.first - before < gap + level || behind - moves.last < gap + level) continue;
    const double height = std::abs(smooth.segment(moves.last + gap, level).mean() - smooth.segment(moves.first - gap - level, level).mean());
    const Index middle = (moves.first + moves.last) / 2, half = static_cast<Index>(times / 2 * height / steepest * static_cast<double>(2 * reach));
    moves.first = std::max(before, std::min(moves.first, middle - half));
    moves.last = std::min(behind, std::max(moves.last, middle + half));
  }
}

constexpr double no_chance = 8;   // standard deviations
constexpr double one_code = 1.5;  // quanta: a quiet converter that changes by one is no motion

VectorXd running_sum(const VectorXd& x) {
  VectorXd sum = VectorXd::Zero(x.size() + 1);
  for (Index k = 0; k < x.size(); ++k) sum[k + 1] = sum[k] + x[k];
  return sum;
}

bool is_near(const std::vector<Interval>& motions, Index k, Index reach) {
  return std::any_of(motions.begin(), motions.end(), [&](const Interval& i) { return k + reach > i.first && k - reach < i.last; });
}

/// By how much the mean over `m` samples behind sample k differs from that over as many before it.
double change_of_means(const VectorXd& sum, Index m, Index k) { return std::abs(sum[k + m] - 2 * sum[k] + sum[k - m]) / static_cast<double>(m); }

/// What is white in it.
double white_change(double sigma, Index m) { return sigma * std::sqrt(2 / static_cast<double>(m)); }

/// Whether the shaft moves all the time, beside motions that are known. Means of m samples change by m times the rate where the motion is smooth, and like the square root of m where a channel
/// wanders (a random walk): from m / 4 to the shortest m at which the median change is clearly more than noise by four, or by two. The limit lies half-way, in the logarithm: of 2000 simulated
/// channels each, 3000 or 12 000 samples of walks by 0.05 and by 0.2 of the noise a sample and of noise of equal power in every octave, it takes 3, 11 and 1 for a motion (2026-11-30).
bool moves_without_a_rest(const VectorXd& angle, double sigma, double quantum, const std::vector<Interval>& known) {
  constexpr Index shortest = 16;     // samples in a mean
  constexpr std::size_t fewest = 40;  // means
  const double half_way = std::sqrt(2.0 * 4.0);
  const VectorXd sum = running_sum(angle);
  const auto changes = [&](Index m) {
    std::vector<double> change;
    for (Index k = m; k + m <= angle.size(); k += m / 4)
      if (!is_near(known, k, m)) change.push_back(change_of_means(sum, m, k));
    return change;
  };
  for (Index m = shortest;; m *= 2) {
    const std::vector<double> behind = changes(m);
    if (behind.size() < 4 * fewest) return false;
    const double change = median_to_sigma * median(behind), before = median_to_sigma * median(changes(m / 4)), white = white_change(sigma, m / 4);
    if (change > std::max(no_chance * white_change(sigma, m), one_code * quantum)) return change * change > half_way * half_way * (before * before - white * white);
  }
}

/// Slow motions far from those that are known: means over `m` samples that differ from those before by more than chance, and by more than what a channel that wanders does everywhere.
std::vector<Interval> moving_slowly(const VectorXd& angle, double sigma, double quantum, Index m, const std::vector<Interval>& known) {
  constexpr Index beside = 500;  // samples: how a motion begins and ends softly is for others to see
  constexpr std::size_t enough = 40;
  const Index n = angle.size();
  const VectorXd sum = running_sum(angle);
  std::vector<Index> at;
  std::vector<double> change;
  for (Index k = m; k + m <= n; k += m / 4) {
    if (is_near(known, k, m + beside)) continue;
    at.push_back(k);
    change.push_back(change_of_means(sum, m, k));
  }
  if (change.size() < enough) return {};
  const double least = std::max(no_chance * std::max(white_change(sigma, m), median_to_sigma * median(change)), one_code * quantum);
  std::vector<Interval> intervals;
  for (std::size_t i = 0; i < at.size(); ++i) {
    if (!(change[i] > least)) continue;
    const Interval found{at[i] - m / 2, at[i] + m / 2};
    if (!intervals.empty() && found.first <= intervals.back().last)
      intervals.back().last = found.last;
    else
      intervals.push_back(found);
  }
  return intervals;
}

}  // namespace

std::vector<Interval> moving(const VectorXd& angle, double sigma) {
  const Index n = angle.size();
  VectorXd smooth(n);
  for (Index k = 0; k < n; ++k) smooth[k] = median_of_five(angle, k);
  // The median of five has a standard deviation of 0.54 sigma; differences over three samples stay below 6 sigma with all but certainty.
  constexpr Index reach = 3, merge = 25;
  std::vector<Interval> intervals;
  for (Index k = reach; k + reach < n; ++k) {
    if (!(std::abs(smooth[k + reach] - smooth[k - reach]) > 6 * sigma)) continue;
    if (!intervals.empty() && k - intervals.back().last <= merge)
      intervals.back().last = k + 1;
    else
      intervals.push_back({k, k + 1});
  }
  for (Index k = 1; k < n; ++k)
    if (!std::isfinite(smooth[k])) smooth[k] = smooth[k - 1];
  for (Index k = n - 2; k >= 0; --k)
    if (!std::isfinite(smooth[k])) smooth[k] = smooth[k + 1];
  if (!smooth.allFinite()) return intervals;
  constexpr double hardly = 18;
  const double quantum = std::sqrt(12.0) * rounding_level(angle);
  if (moves_without_a_rest(angle.array().isFinite().select(angle, smooth), sigma, quantum, intervals)) return {{0, n}};
  widen(intervals, smooth, reach, hardly * sigma);
  for (const Index m : {16, 64, 256}) {
    const std::vector<Interval> slow = moving_slowly(smooth, sigma, quantum, m, intervals);
    intervals.insert(intervals.end(), slow.begin(), slow.end());
    std::sort(intervals.begin(), intervals.end(), [](const Interval& a, const Interval& b) { return a.first < b.first; });
  }
  return intervals;
}

}  // namespace unrig
