#include "core/run/release.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/run/motion.h"
#include "core/run/run.h"

namespace unrig {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index shortest = 12;  // readings, or blocks of them, in a hold: their variance to 40 %
constexpr Index most = 96;      // blocks in a window, which bounds the work
constexpr int quartic = 4, sextic = 6;
// One in a thousand: as it is, of a normal deviate, of a chi-square with one degree of freedom.
constexpr double false_alarm = 1e-3, deviate_of_it = 3.0902, chi_square_of_it = 10.828;

/// Readings x at times t [samples], in order.
struct Readings {
  VectorXd t, x;
  Index count() const { return t.size(); }
};

Readings readings_of(const VectorXd& value) {
  Readings r{VectorXd(value.size()), VectorXd(value.size())};
  Index count = 0;
  for (Index k = 0; k < value.size(); ++k)
    if (std::isfinite(value[k])) r.t[count] = static_cast<double>(k), r.x[count++] = value[k];
  r.t.conservativeResize(count), r.x.conservativeResize(count);
  return r;
}

/// Means over blocks of so many readings, the last of which ends before `end`.
Readings in_blocks(const Readings& of, Index end, Index block, Index blocks) {
  const Index count = std::min(blocks, end / block), first = end - count * block;
  Readings means{VectorXd(count), VectorXd(count)};
  for (Index i = 0; i < count; ++i) means.t[i] = of.t.segment(first + i * block, block).mean(), means.x[i] = of.x.segment(first + i * block, block).mean();
  return means;
}

/// What least squares leave of x. The bases are those of a few powers on [0, 1] or of Legendre, for which normal equations will do.
VectorXd left_of(const MatrixXd& basis, const VectorXd& x) {
  const MatrixXd normal = basis.transpose() * basis;
  return x - basis * VectorXd(normal.ldlt().solve(basis.transpose() * x));
}

/// Sum of squares about the polynomial of that degree.
double left_of_smooth(const Readings& r, int degree) {
  const ArrayXd u = 2 * (r.t.array() - r.t[0]) / (r.t[r.count() - 1] - r.t[0]) - 1;
  MatrixXd legendre(r.count(), degree + 1);
  legendre.col(0).setOnes(), legendre.col(1) = u;
  for (int n = 1; n < degree; ++n) legendre.col(n + 1) = (((2 * n + 1) * u * legendre.col(n).array() - n * legendre.col(n - 1).array()) / (n + 1)).matrix();
  return left_of(legendre, r.x).squaredNorm();
}

/// What is left of readings with a hold up to a release.
struct Hinge {
  Index held = 0, freedom = 0;  ///< readings of the hold; degrees of freedom behind it
  double hold = 0, behind = 0;  ///< sums of squares
  double sum() const { return hold + behind; }
  double variance(double least) const { return std::max(least, hold / static_cast<double>(held - 1)); }
};

/// A constant, and from the release on three powers of the time since, of which `lowest` is the first.
Hinge hinge(const Readings& r, double release, int lowest = 2) {
  const Index held = std::upper_bound(r.t.begin(), r.t.end(), release) - r.t.begin(), behind = r.count() - held, powers = std::min<Index>(quartic - 1, behind);
  MatrixXd basis = MatrixXd::Zero(r.count(), 1 + powers);
  basis.col(0).setOnes();
  const ArrayXd u = (r.t.tail(behind).array() - release) / (r.t[r.count() - 1] - release);
  ArrayXd power = lowest == 2 ? u : ArrayXd::Ones(behind);
  for (Index j = 1; j <= powers; ++j) basis.col(j).tail(behind) = power *= u;
  const VectorXd left = left_of(basis, r.x);
  return {held, behind - powers, left.head(held).squaredNorm(), left.tail(behind).squaredNorm()};
}

/// With a rate that jumps where that leaves less: an overdamped decay sets out within few samples.
Hinge better_hinge(const Readings& r, double release) {
  const Hinge smooth = hinge(r, release), kink = hinge(r, release, 1);
  return kink.sum() < smooth.sum() ? kink : smooth;
}

/// ln of the chance that a ratio of sums of squares with 4 and n degrees of freedom exceeds r: (1 + r)^(-n/2) (1 + (n/2) r/(1 + r)).
double log_chance(double r, double n) { return -0.5 * n * std::log1p(r) + std::log1p(0.5 * n * r / (1 + r)); }

/// Standard normal deviate of a ratio of variances with n1 and n2 degrees of freedom (Paulson 1942).
double deviate(double ratio, double n1, double n2) {
  const double a = 2 / (9 * n1), b = 2 / (9 * n2), root = std::cbrt(ratio);
  return ((1 - b) * root - (1 - a)) / std::sqrt(b * root * root + a);
}

/// Whether the readings scatter about a constant before the release as they do about a smooth curve, and about the departure behind it as they do before.
bool holds_and_departs(const Readings& r, const Hinge& h, double least) {
  const double held = static_cast<double>(h.held - 1), free = static_cast<double>(h.held - 1 - quartic), behind = static_cast<double>(h.freedom), variance = h.variance(least);
  const double smooth = std::max(least, left_of_smooth({r.t.head(h.held), r.x.head(h.held)}, quartic) / free);
  return deviate(variance / smooth, held, free) < deviate_of_it && (h.freedom == 0 || deviate(h.behind / behind / variance, behind, held) < deviate_of_it);
}

/// The likeliest release in a window: blocks of so many readings up to `end`.
struct Candidate {
  double log_chance = 0, release = 0;
  Index end = 0, block = 0;
};

class Search {
 public:
  explicit Search(const VectorXd& value) : all_(readings_of(value)), sum_(VectorXd::Zero(all_.count() + 1)), squares_(sum_) {
    if (all_.count() == 0) return;
    constexpr double digits = 1e-8;  // of a simulation
    const double rounding = std::max(rounding_level(value), digits * (all_.x.maxCoeff() - all_.x.minCoeff()));
    least_ = rounding * rounding;
    for (Index k = 0; k < all_.count(); ++k) {
      const double x = all_.x[k] - all_.x[0];
      sum_[k + 1] = sum_[k] + x, squares_[k + 1] = squares_[k] + x * x;
    }
  }

  std::optional<Release> release() {
    if (all_.count() < shortest + 2 || !(least_ > 0)) return {};
    for (const Index end : departures())
      for (Index block = 1; block == 1 || block / 2 * most < end; block *= 2) look(end, block);
    std::optional<Release> likeliest;
    Index first = 0;
    for (const Candidate& one : candidates_) {
      if (!(one.log_chance < std::log(false_alarm / tests_))) continue;
      const std::optional<Release> release = refined(one);
      if (!release) continue;
      first = std::max(first, release->first);
      const auto width = [](const Release& r) { return static_cast<double>(r.first) - r.instant; };
      if (!likeliest || width(*release) < width(*likeliest)) likeliest = release;
    }
    if (likeliest) likeliest->first = first;
    return likeliest;
  }

 private:
  double level(Index held) const { return all_.x[0] + sum_[held] / static_cast<double>(held); }
  double scatter(Index held) const {
    const double n = static_cast<double>(held);
    return std::sqrt(std::max(least_, (squares_[held] - sum_[held] * sum_[held] / n) / (n - 1)));
  }

  /// Ends of windows: where two readings stand out of the first k, for k that grow by a quarter.
  std::vector<Index> departures() const {
    std::vector<Index> ends;
    const Index n = all_.count();
    for (Index k = shortest; k < n; k = std::max(k + 1, k * 5 / 4)) {
      const double center = level(k), deviation = scatter(k);
      Index end = k;
      for (double times = least_times; times <= 32 * least_times; times *= 2) {
        const auto beyond = [&, limit = times * deviation](Index i) { return std::abs(all_.x[i] - center) > limit; };
        while (end + 1 < n && !(beyond(end) && beyond(end + 1))) ++end;
        if (end + 1 >= n) break;
        ends.push_back(end + 2);
      }
    }
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    return ends;
  }

  /// The likeliest release in one window becomes a candidate; all are counted.
  void look(Index end, Index block) {
    const Readings r = in_blocks(all_, end, block, most);
    const double smooth = left_of_smooth(r, quartic), smoother = left_of_smooth(r, sextic), least = least_ / static_cast<double>(block);
    Candidate best;
    for (Index k = shortest; k < r.count(); ++k) {
      ++tests_;
      if (const Index held = end - (r.count() - k) * block; !(std::abs(all_.x[end - 1] - level(held)) > least_times * scatter(held))) continue;
      const double release = 0.5 * (r.t[k - 1] + r.t[k]);
      const Hinge h = hinge(r, release);
      const double n = static_cast<double>(h.held - 1);
      const auto chance_beside = [&](double rival) { return log_chance(std::max(0.0, rival - h.sum()) / (n * h.variance(least)), n); };
      const double chance = chance_beside(smooth);
      if (chance < best.log_chance && chance_beside(smoother) < std::log(false_alarm) && holds_and_departs(r, h, least)) best = {chance, release, end, block};
    }
    if (best.log_chance < 0) candidates_.push_back(best);
  }

  /// A candidate's release in finer blocks, 64 of them in the departure and three times as many before; none where that is no hold any more.
  std::optional<Release> refined(const Candidate& one) const {
    const Index held = std::upper_bound(all_.t.begin(), all_.t.end(), one.release) - all_.t.begin(), departs = one.end - held;
    const Index block = std::max<Index>(1, departs / 64), before = std::max<Index>(2 * shortest, 3 * departs);
    const Readings r = in_blocks(all_, one.end, block, (before + departs) / block);
    if (r.count() < shortest + 2) return {};
    const double least = least_ / static_cast<double>(block), step = static_cast<double>(block), earliest = r.t[shortest - 1], last = r.t[r.count() - 1];
    double at = one.release, lowest = better_hinge(r, at).sum();
    for (double stride = static_cast<double>(std::max(block, one.block)); stride > 0.02 * step; stride *= 0.5)
      for (const double side : {-1.0, 1.0})
        for (double next = at + side * stride; next > earliest && next < last; next += side * stride) {
          const double left = better_hinge(r, next).sum();
          if (!(left < lowest)) break;
          lowest = left, at = next;
        }
    const Hinge h = better_hinge(r, at);
    constexpr double part = 0.1;
    if (at < earliest + part * step || !holds_and_departs(r, h, least)) return {};
    const double more = chi_square_of_it * h.variance(least) * colour(held, departs);
    double latest = at;
    while (latest + part * step < last && better_hinge(r, latest).sum() < lowest + more) latest += part * step;
    return Release{at, static_cast<Index>(std::ceil(latest))};
  }

  /// How much more means over blocks up to the departure's length scatter in the hold than those of white noise would: the largest ratio of variances, 1 at least.
  double colour(Index held, Index departs) const {
    const Index reach = std::min(held, 2 * shortest * std::max(most, departs));
    double white = 0, largest = 1;
    for (Index block = 1; reach / block >= shortest; block *= 2) {
      const Readings r = in_blocks(all_, held, block, reach / block);
      const double variance = static_cast<double>(block) * (r.x.array() - r.x.mean()).square().sum() / static_cast<double>(r.count() - 1);
      if (block == 1) white = std::max(least_, variance);
      largest = std::max(largest, variance / white);
    }
    return largest;
  }

  static constexpr double least_times = 10;  // standard deviations: a decay below that tells little, and coloured noise stands out by five

  Readings all_;
  VectorXd sum_, squares_;  // of x less its first, before each reading
  double least_ = 0;        // variance of a reading
  double tests_ = 0;
  std::vector<Candidate> candidates_;
};

bool answers(const Channel& channel) { return channel.name != "alpha" && channel.name != "weight" && channel.name != "force" && !channel.name.starts_with("mount_"); }

/// The readings of a channel that count.
VectorXd counting(const Run& run, const Channel& channel) {
  const Channel* weight = run.find("weight");
  if (!weight) return channel.value;
  return (weight->value.array() > 0).select(channel.value, std::numeric_limits<double>::quiet_NaN());
}

std::optional<Release> release_of_run(const Run& run) {
  if (const Channel* gauge = run.find("gauge")) return release_of(counting(run, *gauge));
  std::optional<Release> last;
  for (const Channel& channel : run.channels) {
    if (!answers(channel)) continue;
    const std::optional<Release> release = release_of(counting(run, channel));
    if (!release) return {};
    if (!last || release->first > last->first) last = release;
  }
  return last;
}

}  // namespace

std::optional<Release> release_of(const VectorXd& x) { return Search(x).release(); }

void begin_at_release(Run& run) {
  if (run.kind != RunKind::pluck) return;
  const std::optional<Release> release = release_of_run(run);
  if (!release) return;
  run.hold = Hold{release->first, run.start + run.dt * release->instant};
  for (Channel& channel : run.channels) channel.value = VectorXd(channel.value.tail(channel.value.size() - release->first));
  run.start += run.dt * static_cast<double>(release->first);
}

std::string said_of(const Hold& hold) { return fmt::format("released at {:.6g} s, {} samples of hold before left out", hold.release, hold.samples); }

}  // namespace unrig
