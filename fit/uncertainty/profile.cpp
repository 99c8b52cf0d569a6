#include "fit/uncertainty/profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "fit/uncertainty/identifiability.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using End = ProfileLimit::End;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// sqrt(rise of the least chi-square) as a function of the unknown: straight for a linear problem, so that few trials find where it crosses.
class Profile {
 public:
  Profile(LeastSquaresProblem problem, std::size_t which, const LeastSquaresPoint& minimum, const ProfileOptions& options)
      : problem_(std::move(problem)), which_(which), minimum_(minimum), options_(options), value_(minimum.values[static_cast<Index>(which)]) {
    problem_.unknowns[which].held = true;
  }

  int evaluations = 0;
  std::optional<LeastSquaresPoint> better;

  /// One end of the interval; `step` is where to look first, with its sign.
  ProfileLimit limit(double step, double target) {
    const LeastSquaresUnknown& unknown = problem_.unknowns[which_];
    const double bound = step < 0 ? unknown.lower : unknown.upper;
    if (step < 0 ? value_ <= bound : value_ >= bound) return {bound, End::bound};
    const double furthest = 1e6 * std::max(std::abs(value_), std::abs(step));
    solved_ = {minimum_.values};
    double inside = value_, rise_inside = 0, wall = std::copysign(infinite, step);  // no answer at the wall
    const auto at_wall = [&] { return std::isfinite(wall) && std::abs(wall - inside) <= options_.tolerance * std::abs(wall - value_); };
    for (double distance = std::abs(step);;) {
      double outside = value_ + std::copysign(distance, step);
      if (step < 0 ? outside < bound : outside > bound) outside = bound;
      if (std::abs(outside - value_) >= std::abs(wall - value_)) outside = (inside + wall) / 2;
      const double rise = rise_at(outside);
      if (better) return {outside, End::no_answer};
      if (std::isnan(rise)) {
        wall = outside;
        if (at_wall()) return {inside, End::no_answer};
        distance = std::abs((inside + wall) / 2 - value_);
        continue;
      }
      if (rise >= target) return crossing(inside, rise_inside, outside, rise, target);
      if (outside == bound) return {bound, End::bound};
      inside = outside, rise_inside = rise;
      if (at_wall()) return {inside, End::no_answer};
      distance = std::abs(outside - value_);
      if (distance > furthest) return {std::copysign(infinite, step), End::unbounded};
      constexpr double least_growth = 1.1, most_growth = 4;
      distance *= std::clamp(least_growth * target / std::max(rise, 1e-300), least_growth, most_growth);
    }
  }

 private:
  /// NaN where the model has no answer.
  double rise_at(double x) {
    // Where the others will be: on the line through the last two solutions.
    VectorXd guess = solved_.back();
    const auto w = static_cast<Index>(which_);
    if (const std::size_t n = solved_.size(); n > 1 && solved_[n - 1][w] != solved_[n - 2][w])
      guess += (x - solved_[n - 1][w]) / (solved_[n - 1][w] - solved_[n - 2][w]) * (solved_[n - 1] - solved_[n - 2]);
    guess[w] = x;
    if (!guess.allFinite()) guess = solved_.back();
    double rise = solve_from(guess);
    if (std::isnan(rise) && solved_.size() > 1) {  // the line may have led where the model has no answer
      guess = minimum_.values;
      guess[w] = x;
      rise = solve_from(guess);
    }
    return rise;
  }

  double solve_from(const VectorXd& guess) {
    for (std::size_t i = 0; i < problem_.unknowns.size(); ++i) problem_.unknowns[i].value = guess[static_cast<Index>(i)];
    const LeastSquaresResult result = solve_least_squares(problem_, options_.solve);
    evaluations += result.evaluations;
    if (!result.point.finite) return std::nan("");
    solved_.push_back(result.point.values);
    const double rise = (result.chi2() - minimum_.chi2()) / options_.variance_factor;
    constexpr double noticeable = 0.01;
    const double z = two_sided_quantile(options_.confidence);
    if (rise < -noticeable * z * z) better = result.point;
    return std::sqrt(std::max(0.0, rise));
  }

  /// Regula falsi (Illinois) between a point inside and one outside.
  ProfileLimit crossing(double inside, double rise_inside, double outside, double rise_outside, double target) {
    double low = rise_inside - target, high = rise_outside - target, last = outside;
    int side = 0;
    constexpr int most_trials = 50;
    for (int trial = 0; trial < most_trials; ++trial) {
      const double x = inside + (outside - inside) * low / (low - high);
      const double near = 0.5 * options_.tolerance * std::abs(x - value_);
      if (std::abs(x - last) <= near || std::abs(outside - inside) <= near) return {x, End::crossed};
      const double rise = rise_at(x);
      if (std::isnan(rise) || better) return {inside, End::no_answer};
      last = x;
      if (rise < target) {
        inside = x, low = rise - target;
        if (side < 0) high /= 2;
        side = -1;
      } else {
        outside = x, high = rise - target;
        if (side > 0) low /= 2;
        side = 1;
      }
    }
    return {last, End::crossed};
  }

  LeastSquaresProblem problem_;
  std::size_t which_;
  const LeastSquaresPoint& minimum_;
  const ProfileOptions& options_;
  double value_;
  std::vector<VectorXd> solved_;
};

/// A first distance to look at: that of the linearised problem, else what seems to matter.
double first_step(const LeastSquaresProblem& problem, const LeastSquaresPoint& minimum, std::size_t which, const ProfileOptions& options) {
  LeastSquaresProblem free = problem;
  free.unknowns[which].held = false;
  CovarianceOptions scaled;
  scaled.variance_factor = options.variance_factor;
  const double error = covariance(free, minimum, scaled).unknowns[which].std_error;
  if (std::isfinite(error) && error > 0) return error * two_sided_quantile(options.confidence);
  const LeastSquaresUnknown& u = problem.unknowns[which];
  return u.scale > 0 ? u.scale : u.value != 0 ? 0.1 * std::abs(u.value) : 1;
}

std::string describe(const ProfileInterval& p, const std::string& name) {
  if (p.better) return fmt::format("{}: the fit had not arrived: chi-square is lower at {:.6g}", name, p.value);
  std::string text = fmt::format("{:.6g} to {:.6g} ({:.3g} %)", p.lower.value, p.upper.value, 100 * p.confidence);
  const auto add = [&](const char* which, const ProfileLimit& limit) {
    if (limit.end == End::bound) text += fmt::format(", the {} end is the bound", which);
    if (limit.end == End::unbounded) text += fmt::format(", unbounded {}: the data set no limit there", std::string(which) == "lower" ? "below" : "above");
    if (limit.end == End::no_answer) text += fmt::format(", the model has no answer beyond the {} end", which);
  };
  add("lower", p.lower);
  add("upper", p.upper);
  return text;
}

}  // namespace

double two_sided_quantile(double confidence) {
  if (!(confidence > 0 && confidence < 1)) throw std::invalid_argument(fmt::format("a confidence of {} is not between 0 and 1", confidence));
  double z = 1;
  constexpr int enough = 60;
  for (int i = 0; i < enough; ++i) {  // Newton on log P(|x| > z), which is convex: it converges from everywhere
    const double tail = std::erfc(z / std::sqrt(2.0)), density = std::sqrt(2 * std::numbers::inv_pi) * std::exp(-z * z / 2);
    const double step = std::log(tail / (1 - confidence)) * tail / density;
    z = std::max(z + step, z / 10);
    if (std::abs(step) < 1e-15 * z) break;
  }
  return z;
}

ProfileInterval profile(const LeastSquaresProblem& problem, std::size_t which, const ProfileOptions& options) {
  if (which >= problem.unknowns.size()) throw std::invalid_argument(fmt::format("there is no unknown {} of {}", which + 1, problem.unknowns.size()));
  const double target = two_sided_quantile(options.confidence);
  const LeastSquaresPoint minimum = linearise(problem, problem.values());
  ProfileInterval interval;
  interval.value = problem.unknowns[which].value;
  interval.confidence = options.confidence;
  interval.evaluations = 1;
  if (!minimum.finite) {
    interval.lower = interval.upper = {interval.value, End::no_answer};
    interval.text = fmt::format("{}: the model has no finite value to start from", problem.unknowns[which].name);
    return interval;
  }
  const double step = first_step(problem, minimum, which, options);
  Profile search(problem, which, minimum, options);
  interval.lower = search.limit(-step, target);
  if (!search.better) interval.upper = search.limit(step, target);
  interval.evaluations += search.evaluations;
  interval.better = search.better;
  if (interval.better) interval.value = (*interval.better).values[static_cast<Index>(which)];
  interval.text = describe(interval, problem.unknowns[which].name);
  return interval;
}

}  // namespace unrig
