#include "fit/uncertainty/determined.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "fit/uncertainty/identifiability.h"
#include "fit/likelihood/joint_problem.h"
#include "fit/uncertainty/undetermined.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd values_of(const JointProblem& joint) {
  VectorXd values(static_cast<Index>(joint.unknowns().size()));
  for (Index i = 0; i < values.size(); ++i) values[i] = joint.unknowns()[static_cast<std::size_t>(i)].value;
  return values;
}

/// Values of all unknowns where chi-square is least, with one held unknown below and above where it is; empty where that is not to be had.
struct Valley {
  VectorXd below, above;
  bool known() const { return below.size() > 0 && above.size() > 0; }
};

/// `slope`: d unknown / d held.
VectorXd refit(JointProblem joint, std::size_t held, double value, const VectorXd& slope) {
  const double change = value - joint.unknowns()[held].value;
  for (std::size_t i = 0; i < joint.unknowns().size(); ++i) {
    Unknown& u = joint.unknowns()[i];
    const Parameter& p = joint.parameter(u);
    const double there = i == held ? value : u.value + slope[static_cast<Index>(i)] * change;
    if (i == held && (value < p.lower || value > p.upper)) return {};
    u.value = std::clamp(there, p.lower, p.upper);
  }
  JointProblem::SolveOptions options;
  options.iterations = 100;
  const JointProblem::Summary summary = joint.solve(options);
  return summary.converged ? values_of(joint) : VectorXd();
}

Valley follow_valley(const JointProblem& joint, std::size_t held, const VectorXd& slope) {
  const double now = joint.unknowns()[held].value, factor = is_damping_ratio(joint.parameter(joint.unknowns()[held])) ? 2 : 1.25;
  if (now == 0) return {};
  return {refit(joint, held, now / factor, slope), refit(joint, held, now * factor, slope)};
}

/// All combinations of one joint fit.
class Combinations {
 public:
  Combinations(const JointProblem& joint, const HeldInfluence& influence, const MatrixXd& covariance) : joint_(joint), influence_(influence), covariance_(covariance), now_(values_of(joint)) {}

  std::vector<DeterminedCombination> all() {
    std::vector<DeterminedCombination> result;
    for (std::size_t i = 0; i < joint_.unknowns().size(); ++i) {
      const std::vector<std::size_t> tied = tied_to(i);
      if (!tied.empty()) result.push_back(best_of(i, tied));
    }
    return result;
  }

 private:
  /// Which of the held ones (places in influence_.held) shift it noticeably.
  std::vector<std::size_t> tied_to(std::size_t i) const {
    constexpr double noticeable = 3;
    std::vector<std::size_t> tied;
    const auto row = static_cast<Index>(i);
    for (std::size_t h = 0; h < influence_.held.size(); ++h)
      if (std::abs(influence_.shift(row, static_cast<Index>(h))) > noticeable * std::sqrt(covariance_(row, row))) tied.push_back(h);
    return tied;
  }

  DeterminedCombination best_of(std::size_t i, const std::vector<std::size_t>& tied) {
    DeterminedCombination best = with_slopes(i, tied, false);
    if (!best.product) {  // simple powers of what is held are laws
      follow(tied);
      double least = change(best, tied);
      const auto consider = [&](const DeterminedCombination& other) {
        if (const double changes = change(other, tied) / relative_to(other, best); changes < least) best = other, least = changes;
      };
      consider(with_slopes(i, tied, true));
      for (std::size_t y = 0; y < i; ++y)
        if (const double exponent = simple_exponent(i, y, tied); exponent != 0) consider(with_other(i, y, exponent));
    }
    best.value = at(best, now_);
    best.std_error = std::hypot(std::sqrt(variance(best)), change(best, tied));
    best.settled_by = what_settles(i, tied);
    return best;
  }

  /// x with what is held: simple powers where the slopes are those of powers, else a sum with the slope here or, `mean`, with that between the valley's ends.
  DeterminedCombination with_slopes(std::size_t i, const std::vector<std::size_t>& tied, bool mean) const {
    DeterminedCombination c;
    c.unknowns.push_back(i);
    Tie tie{name(i), value(i), {}, {}, {}};
    for (const std::size_t h : tied) {
      const std::size_t held = influence_.held[h];
      double slope = influence_.slope(static_cast<Index>(i), static_cast<Index>(h));
      if (const Valley* v = valley(h); mean && v) slope = (v->above[static_cast<Index>(i)] - v->below[static_cast<Index>(i)]) / (v->above[static_cast<Index>(held)] - v->below[static_cast<Index>(held)]);
      c.unknowns.push_back(held);
      c.factor.push_back(-slope);
      tie.add(name(held), value(held), slope);
    }
    c.combination = tie.determined();
    c.product = tie.is_product();
    if (c.product)
      for (std::size_t k = 0; k < c.factor.size(); ++k) c.factor[k] = -std::round(2 * tie.relative(k)) / 2;
    return c;
  }

  /// x / y^exponent.
  DeterminedCombination with_other(std::size_t i, std::size_t y, double exponent) const {
    Tie tie{name(i), value(i), {}, {}, {}};
    tie.add(name(y), value(y), exponent * value(i) / value(y));
    return {tie.determined(), 0, 0, {i, y}, {-exponent}, true, {}};
  }

  /// d ln x / d ln y along every valley, to the half that it is nearest to; 0 where there is none, or where it is not near.
  double simple_exponent(std::size_t i, std::size_t y, const std::vector<std::size_t>& tied) const {
    constexpr double near = 0.05, most = 2;
    if (!(value(i) > 0) || !(value(y) > 0) || joint_.unknowns()[y].held || tied_to(y) != tied) return 0;
    double exponent = 0;
    for (const std::size_t h : tied) {
      const auto column = static_cast<Index>(h);
      const double ratio = influence_.slope(static_cast<Index>(i), column) / value(i) / (influence_.slope(static_cast<Index>(y), column) / value(y)), simple = std::round(2 * ratio) / 2;
      if (!(std::abs(ratio - simple) < near) || std::abs(simple) > most || (h != tied.front() && simple != exponent)) return 0;
      exponent = simple;
    }
    return exponent;
  }

  double at(const DeterminedCombination& c, const VectorXd& values) const {
    std::vector<double> own;
    for (const std::size_t u : c.unknowns) own.push_back(values[static_cast<Index>(u)]);
    return c.at(own);
  }

  /// Largest change of a combination along the valleys.
  double change(const DeterminedCombination& c, const std::vector<std::size_t>& tied) const {
    double most = 0;
    for (const std::size_t h : tied)
      if (const Valley* v = valley(h))
        for (const VectorXd* end : {&v->below, &v->above}) most = std::max(most, std::abs(at(c, *end) - at(c, now_)));
    return most;
  }

  /// How much more `a` moves with its unknown x than `b` does.
  double relative_to(const DeterminedCombination& a, const DeterminedCombination& b) const {
    const auto gain = [&](const DeterminedCombination& c) { return c.product ? at(c, now_) / value(c.unknowns.front()) : 1; };
    return std::abs(gain(a) / gain(b));
  }

  double variance(const DeterminedCombination& c) const {
    const auto count = static_cast<Index>(c.unknowns.size());
    VectorXd slope(count);
    slope[0] = c.product ? at(c, now_) / value(c.unknowns.front()) : 1;
    for (Index k = 1; k < count; ++k) slope[k] = c.product ? c.factor[static_cast<std::size_t>(k - 1)] * at(c, now_) / value(c.unknowns[static_cast<std::size_t>(k)]) : c.factor[static_cast<std::size_t>(k - 1)];
    const std::vector<Index> own(c.unknowns.begin(), c.unknowns.end());
    return slope.dot(covariance_(own, own) * slope);
  }

  std::string what_settles(std::size_t i, const std::vector<std::size_t>& tied) const {
    const auto shift = [&](std::size_t h) { return std::abs(influence_.shift(static_cast<Index>(i), static_cast<Index>(h))); };
    const std::size_t most = *std::max_element(tied.begin(), tied.end(), [&](std::size_t a, std::size_t b) { return shift(a) < shift(b); });
    return what_to_record(joint_, joint_.unknowns()[influence_.held[most]]);
  }

  void follow(const std::vector<std::size_t>& tied) {
    valleys_.resize(influence_.held.size());
    followed_.resize(influence_.held.size());
    for (const std::size_t h : tied) {
      if (!followed_[h]) valleys_[h] = follow_valley(joint_, influence_.held[h], influence_.slope.col(static_cast<Index>(h)));
      followed_[h] = true;
    }
  }
  const Valley* valley(std::size_t h) const { return h < valleys_.size() && valleys_[h].known() ? &valleys_[h] : nullptr; }

  std::string name(std::size_t i) const { return short_name(joint_, joint_.unknowns()[i]); }
  double value(std::size_t i) const { return now_[static_cast<Index>(i)]; }

  const JointProblem& joint_;
  const HeldInfluence& influence_;
  const MatrixXd& covariance_;
  VectorXd now_;
  std::vector<Valley> valleys_;
  std::vector<bool> followed_;
};

}  // namespace

double DeterminedCombination::at(const std::vector<double>& values) const {
  double result = values.front();
  for (std::size_t k = 0; k < factor.size(); ++k) result = product ? result * std::pow(values[k + 1], factor[k]) : result + factor[k] * values[k + 1];
  return result;
}

std::vector<DeterminedCombination> determined_combinations(const JointProblem& joint, const HeldInfluence& influence, const MatrixXd& covariance) {
  return Combinations(joint, influence, covariance).all();
}

}  // namespace unrig
