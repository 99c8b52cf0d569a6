#include "fit/search/decays_first.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "fit/fit_description.h"
#include "fit/search/arrival.h"
#include "fit/search/effect_search.h"
#include "fit/search/law_smoother.h"
#include "fit/search/noise_of_trial.h"
#include "fit/solver/least_squares.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double followed = 1.2;  // chi-square over the degrees of freedom of decays that a model can be said to follow

bool is_decay(const RunResidual& run) { return run.motion().unknowns() == 0; }

bool acts_in_decays(const JointProblem& joint, const std::string& id) {
  const Rig& rig = joint.model().rig();
  return std::any_of(joint.runs().begin(), joint.runs().end(), [&](const RunResidual& run) { return is_decay(run) && effect(rig, id).acts(rig, run.conditions()); });
}

/// Whether any law does.
bool follow_laws(const JointProblem& joint) {
  return std::any_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) {
    return is_decay(run) && !run.model().system(run.conditions(), run.model().start_values(), run.channels()).feedback.empty();
  });
}

/// theta and the decays' trajectories, with laws that are trusted more and more (fit/search/law_smoother.h).
class GrowingTrust {
 public:
  GrowingTrust(const GrowingTrust&) = delete;  // the smoothers look at its runs
  GrowingTrust& operator=(const GrowingTrust&) = delete;

  explicit GrowingTrust(JointProblem joint) : joint_(std::move(joint)) {
    for (std::size_t i = 0; i < joint_.unknowns().size(); ++i)
      if (const Unknown& u = joint_.unknowns()[i]; !u.held && u.run < 0) {
        free_.push_back(i);
        parameters_.push_back(u.parameter);
      }
    for (std::size_t r = 0; r < joint_.runs().size(); ++r) {
      if (!is_decay(joint_.runs()[r])) continue;
      decays_.push_back(r);
      smoothers_.emplace_back(joint_.runs()[r], parameters_);
      samples_ += static_cast<double>(smoothers_.back().samples());
    }
    begun_ = values();
  }

  static constexpr int first_levels = 3, trusted_levels = 5, all_levels = 9;

  /// Up to this level of trust, or until the laws leave more than the noise and more than they did.
  void fit(int levels) {
    constexpr int steps = 3, most_steps = 9;
    constexpr double more_trust = 3, worse = 2, enough = 1.1, falls = 0.98;
    if (sigma_.empty()) begin();
    for (; level_ < levels && !gave_up_; ++level_) {
      const VectorXd before = values();
      for (int i = 0; i < steps; ++i) step(true);
      double now = cost();
      for (int i = 0; i < most_steps && now > enough * samples_; ++i) {  // on while that helps
        step(true);
        const double next = cost();
        if (!(next < falls * now)) break;
        now = next;
      }
      if (!(now < worse * std::max(left_, samples_)) && level_ > 0) {
        set(before);
        gave_up_ = true;
        return;
      }
      left_ = now;
      linear_.clear();
      for (const LawSmoother& s : smoothers_) linear_.push_back(s.linear());
      trust(more_trust);
    }
  }

  /// Whether this fit trusts its laws further, or as far and leaves less.
  bool better_than(const GrowingTrust& other) const { return level_ != other.level_ ? level_ > other.level_ : left_ < other.left_; }

  /// J over the number of samples, where the laws are trusted to within 2.5 % of the force that is missed without them (2 over more_trust^4); infinite before.
  double left_as_trusted() const { return level_ >= trusted_levels ? left_ / samples_ : INFINITY; }

  const JointProblem& joint() const { return joint_; }
  /// States of the decays along their trajectories, per run.
  std::vector<MatrixXd> states() const {
    std::vector<MatrixXd> all(joint_.runs().size());
    for (std::size_t d = 0; d < decays_.size(); ++d) all[decays_[d]] = smoothers_[d].states();
    return all;
  }
  /// c of the decays, in their order.
  const std::vector<VectorXd>& linear() const { return linear_; }

 private:
  /// A first trajectory without laws, then sigma from what they are missed for; accelerations that no law explains count as less likely.
  void begin() {
    constexpr double ample = 4, beside = 0.1, least = 1e-6;
    for (std::size_t d = 0; d < decays_.size(); ++d) {
      sigma_.push_back(ample * smoothers_[d].enough_to_move(joint_.theta(decays_[d])));
      sigma_[d].tail(smoothers_[d].coordinates()) *= beside;
    }
    share_sigma();
    step(false);
    for (std::size_t d = 0; d < decays_.size(); ++d) sigma_[d] = (2 * smoothers_[d].disturbance()).cwiseMax(least * sigma_[d]);
    share_sigma();
    constexpr int first_steps = 8;
    for (int i = 0; i < first_steps; ++i) step(true);
  }

  /// Runs in which the same laws act trust them alike.
  void share_sigma() {
    for (VectorXd& a : sigma_)
      for (const VectorXd& b : sigma_)
        if (a.size() == b.size()) a = a.cwiseMax(b);
  }

  void trust(double more) {
    for (std::size_t d = 0; d < decays_.size(); ++d) {
      sigma_[d] /= more;
      sigma_[d].tail(smoothers_[d].coordinates()) /= more;
    }
  }

  /// One Gauss-Newton step of all trajectories and, where asked, of theta: by half of its size or so.
  void step(bool move) {
    const auto count = static_cast<Index>(free_.size()), runs = static_cast<Index>(decays_.size());
    MatrixXd rows = MatrixXd::Zero(count * (runs + 1), count);
    VectorXd right = VectorXd::Zero(rows.rows());
    in_parallel(decays_.size(), [&](std::size_t d) {
      const LawSmoother::Information known = smoothers_[d].information(joint_.theta(decays_[d]), sigma_[d]);
      rows.middleRows(static_cast<Index>(d) * count, count) = known.factor;
      right.segment(static_cast<Index>(d) * count, count) = known.right;
    });
    VectorXd change = VectorXd::Zero(count);
    if (move && count > 0) {
      constexpr double share = 0.5, hardly = 1e-9;
      const VectorXd now = values();
      const VectorXd size = sizes(now);
      for (Index i = 0; i < count; ++i) {
        const Parameter& p = parameter(i);
        if (std::isfinite(p.known_to)) right[count * runs + i] = (p.start - now[i]) / p.known_to;
        rows(count * runs + i, i) = std::isfinite(p.known_to) ? 1 / p.known_to : size[i] > 0 ? 1 / (share * size[i]) : hardly * rows.col(i).norm() + 1e-300;
      }
      set(within_reach(now, now + rows.colPivHouseholderQr().solve(right)));
      change = values() - now;
    }
    in_parallel(decays_.size(), [&](std::size_t d) { smoothers_[d].step(change); });
  }

  const Parameter& parameter(Index i) const { return joint_.parameter(joint_.unknowns()[free_[static_cast<std::size_t>(i)]]); }
  Effect::Band bounds(Index i, double now) const { return bounds_at(joint_.model(), joint_.unknowns()[free_[static_cast<std::size_t>(i)]].parameter, now); }

  /// What theta is told in units of: itself; of what may have either sign at least what it began with, for on its way through zero it has none; at least to what it is known beside the runs.
  VectorXd sizes(const VectorXd& now) const {
    VectorXd size = now.cwiseAbs();
    for (Index i = 0; i < now.size(); ++i) {
      if (bounds(i, now[i]).first < 0) size[i] = std::max(size[i], std::abs(begun_[i]));
      if (std::isfinite(parameter(i).known_to)) size[i] = std::max(size[i], parameter(i).known_to);
    }
    return size;
  }

  /// To twice or half of itself at most; what may have either sign by its size.
  VectorXd within_reach(const VectorXd& now, VectorXd then) const {
    const VectorXd size = sizes(now);
    for (Index i = 0; i < now.size(); ++i) {
      const auto [lower, upper] = bounds(i, now[i]);
      if (size[i] > 0) then[i] = std::clamp(then[i], lower < 0 ? now[i] - size[i] : now[i] / 2, now[i] + size[i]);
      then[i] = std::clamp(then[i], lower, upper);
      if (!std::isfinite(then[i])) then[i] = now[i];
    }
    return then;
  }

  VectorXd values() const {
    VectorXd v(static_cast<Index>(free_.size()));
    for (std::size_t i = 0; i < free_.size(); ++i) v[static_cast<Index>(i)] = joint_.unknowns()[free_[i]].value;
    return v;
  }
  void set(const VectorXd& values) {
    for (std::size_t i = 0; i < free_.size(); ++i) joint_.unknowns()[free_[i]].value = values[static_cast<Index>(i)];
  }
  double cost() const {
    double sum = 0;
    for (std::size_t d = 0; d < decays_.size(); ++d) sum += smoothers_[d].cost(sigma_[d]);
    return sum;
  }

  JointProblem joint_;
  std::vector<std::size_t> free_, decays_;
  std::vector<Index> parameters_;
  std::vector<LawSmoother> smoothers_;
  std::vector<VectorXd> sigma_, linear_;
  VectorXd begun_;  ///< theta
  double samples_ = 0, left_ = INFINITY;
  int level_ = 0;
  bool gave_up_ = false;
};

/// The decays of a joint problem as least squares in theta and c. Unknowns: those of the joint problem that are free, then c of each decay.
class Decays {
 public:
  /// `linear`: c of each decay, to start from.
  Decays(JointProblem& joint, const std::vector<VectorXd>& linear) : joint_(joint) {
    for (std::size_t r = 0; r < joint.runs().size(); ++r)
      if (is_decay(joint.runs()[r])) decays_.push_back(r);
    for (std::size_t i = 0; i < joint.unknowns().size(); ++i) {
      const Unknown& u = joint.unknowns()[i];
      if (!u.held && (u.run < 0 || is_decay(joint.runs()[static_cast<std::size_t>(u.run)]))) free_.push_back(i);
    }
    for (const std::size_t i : free_) {
      const Unknown& u = joint.unknowns()[i];
      const auto [lower, upper] = bounds_at(joint.model(), u.parameter, u.value);
      problem_.unknowns.push_back({joint.name(u), u.value, lower, upper, false, 0});
    }
    for (std::size_t d = 0; d < decays_.size(); ++d) add(decays_[d], linear[d]);
    for (std::size_t i = 0; i < free_.size(); ++i)
      if (const Parameter& p = joint.parameter(joint.unknowns()[free_[i]]); std::isfinite(p.known_to)) problem_.terms.push_back(what_is_known(i, p));
  }

  /// Over the whole records at once (`growth` 0), or over records that grow by this factor from a few samples. False where it gave up: `lost` times the noise's
  /// power, over a part of the records.
  bool search(double growth, double lost = INFINITY) {
    Index longest = 0, first = 0;
    for (const RunResidual& run : runs_) {
      longest = std::max(longest, run.run().samples());
      first = std::max(first, 2 * run.linear_unknowns());
    }
    LeastSquaresOptions options;
    options.effort = LeastSquaresOptions::Effort::once;
    options.precision = 0.5;
    options.relative_change = 1e-3;
    options.iterations = 8;
    for (samples_ = first; growth > 0 && samples_ < longest; samples_ = static_cast<Index>(growth * static_cast<double>(samples_)))
      if (search_with(options, true) > lost * static_cast<double>(samples_ * static_cast<Index>(runs_.size()))) return false;
    samples_ = longest;
    options.iterations = 30;
    search_with(options, false);
    return true;
  }

  /// Of the decay of which most is left: chi-square over its samples.
  double most_left() const { return most_left_; }

  /// chi-square over the degrees of freedom of the whole records; theta and c go back to the joint problem.
  double settle() {
    const LeastSquaresPoint point = try_values(problem_, problem_.values());
    Index row = 0;
    most_left_ = point.finite ? 0 : INFINITY;
    for (std::size_t d = 0; d < decays_.size(); row += problem_.terms[d++].size)
      most_left_ = std::max(most_left_, point.residual.segment(row, problem_.terms[d].size).squaredNorm() / static_cast<double>(runs_[d].observations()));
    for (std::size_t i = 0; i < free_.size(); ++i) joint_.unknowns()[free_[i]].value = problem_.unknowns[i].value;
    double freedom = -static_cast<double>(free_.size());
    for (std::size_t d = 0; d < decays_.size(); ++d) {
      VectorXd c(runs_[d].linear_unknowns());
      for (Index k = 0; k < c.size(); ++k) c[k] = problem_.unknowns[first_c_[d] + static_cast<std::size_t>(k)].value;
      joint_.runs()[decays_[d]].start_from(c);
      freedom += static_cast<double>(runs_[d].degrees_of_freedom());
    }
    return point.finite ? point.chi2() / std::max(1.0, freedom) : INFINITY;
  }

 private:
  /// chi-square. `prior`: theta stays near where it is, while a few samples determine little of it.
  double search_with(const LeastSquaresOptions& options, bool prior) {
    LeastSquaresProblem problem = problem_;
    for (std::size_t i = 0; prior && i < free_.size(); ++i) problem.terms.push_back(weak_prior(i, problem.unknowns[i]));
    const LeastSquaresResult result = solve_least_squares(problem, options);
    if (result.point.finite) take(result.point, problem_);
    return result.point.chi2();
  }

  void add(std::size_t r, const VectorXd& c) {
    const std::size_t d = runs_.size();
    runs_.push_back(joint_.runs()[r]);
    RunResidual& run = runs_.back();
    run.temper(1);
    const VectorXd theta = joint_.theta(r);
    first_c_.push_back(problem_.unknowns.size());
    for (Index k = 0; k < c.size(); ++k) problem_.unknowns.push_back({run.run().file, std::isfinite(c[k]) ? c[k] : 0, -INFINITY, INFINITY, false, 0});
    ResidualTerm term;
    std::vector<Index> parameters;
    for (std::size_t i = 0; i < free_.size(); ++i) {
      const Unknown& u = joint_.unknowns()[free_[i]];
      if (u.run >= 0 && u.run != static_cast<int>(r)) continue;
      term.unknowns.push_back(i);
      parameters.push_back(u.parameter);
    }
    run.differentiate_only(parameters);
    const auto count = static_cast<Index>(parameters.size());
    for (Index k = 0; k < c.size(); ++k) term.unknowns.push_back(first_c_[d] + static_cast<std::size_t>(k));
    term.size = theta.size() + c.size() + 1;
    term.evaluate = [this, d, parameters, count, start = theta](const VectorXd& values, VectorXd& residual, MatrixXd* jacobian) {
      VectorXd at = start;
      at(parameters) = values.head(count);
      const RunResidual::SideBySide s = runs_[d].side_by_side(at, values.tail(values.size() - count), samples_, jacobian == nullptr ? Partials::none : Partials::all);
      if (!std::isfinite(s.chi2)) return false;
      if (jacobian == nullptr) {
        residual[0] = std::sqrt(s.chi2);
        return true;
      }
      residual.head(s.residual.size()) = s.residual;
      jacobian->topLeftCorner(s.in_theta.rows(), count) = s.in_theta(Eigen::all, parameters);
      jacobian->topRightCorner(s.in_c.rows(), s.in_c.cols()) = s.in_c;
      return true;
    };
    problem_.terms.push_back(std::move(term));
  }

  JointProblem& joint_;
  std::vector<std::size_t> decays_, free_;
  std::vector<RunResidual> runs_;
  std::vector<std::size_t> first_c_;
  LeastSquaresProblem problem_;
  Index samples_ = 0;
  double most_left_ = INFINITY;
};

/// What one search leaves of the decays, and where it ended.
struct Followed {
  JointProblem joint;
  double left = INFINITY, most_left = INFINITY;
};

/// From theta and c of `start`, with a law whose corners bend a trajectory so often that only records that grow lead to it, if any do: the slower, the surer. Infinite
/// where that loses the decays.
Followed follow_round_corners(const GrowingTrust& start) {
  constexpr double lost = 4;
  std::vector<Followed> tried(2, {start.joint()});
  in_parallel(tried.size(), [&](std::size_t i) {
    Decays decays(tried[i].joint, start.linear());
    if (!decays.search(i == 0 ? 1.15 : 1.07, lost)) return;
    tried[i].left = decays.settle();
    tried[i].most_left = decays.most_left();
  });
  return std::move(tried[0].left < tried[1].left ? tried[0] : tried[1]);
}

/// From theta and c of `start`: over the whole records and, where that does not follow them, over records that grow. Leaves the better in `joint`.
double follow_exactly(JointProblem& joint, const GrowingTrust& start) {
  double least = INFINITY;
  for (const double growth : {0.0, 1.5}) {
    JointProblem tried = start.joint();
    Decays decays(tried, start.linear());
    decays.search(growth);
    const double left = decays.settle();
    if (left < least) joint = std::move(tried);
    least = std::min(least, left);
    if (least < followed) break;
  }
  return least;
}

/// The colour of the noise, where the model itself leaves no more than that of most of the decays: a trajectory that is lost leaves lines.
std::vector<ChannelColour> noise_left_of_decays(JointProblem joint) {
  if (has_colour(joint)) return {};  // it has been taken out
  for (RunResidual& run : joint.runs()) run.set_aside(!is_decay(run));
  return noise_colours_of_most(joint);
}

}  // namespace

bool takes_small_steps(const JointProblem& joint) {
  for (std::size_t r = 0; r < joint.runs().size(); ++r)
    if (joint.runs()[r].takes_small_steps(joint.theta(r))) return true;
  return false;
}

bool all_driven(const JointProblem& joint) {
  return std::all_of(joint.runs().begin(), joint.runs().end(), [](const RunResidual& run) { return run.conditions().force; });
}

bool has_decays(const JointProblem& joint) { return std::any_of(joint.runs().begin(), joint.runs().end(), is_decay); }

BesideUnknownForces beside_unknown_forces(const JointProblem& joint, int levels) {
  JointProblem start = joint;
  back_to_the_rig(start, 2);
  for (RunResidual& run : start.runs())
    if (is_decay(run)) run.temper(1);
  GrowingTrust trust(std::move(start));
  trust.fit(levels);
  return {trust.joint(), trust.states()};
}

double left_as_trusted(const JointProblem& joint) {
  JointProblem held = joint;
  for (Unknown& u : held.unknowns()) u.held = true;
  for (RunResidual& run : held.runs())
    if (is_decay(run)) run.temper(1);
  GrowingTrust trust(std::move(held));
  trust.fit(GrowingTrust::trusted_levels);
  return trust.left_as_trusted();
}

DecaysLeft fit_decays(JointProblem& joint, const std::string& id, bool from_here) {
  JointProblem start = joint;
  back_to_the_rig(start, 2);
  for (RunResidual& run : start.runs())
    if (is_decay(run)) run.temper(1);
  const std::vector<Unknown*> own = unknowns_of(start, id);
  const double size = own.empty() || !acts_in_decays(joint, id) ? 0 : own.front()->value;
  const auto trust = [&](double factor, int levels) {
    JointProblem sized = start;
    if (size != 0) {
      Unknown& u = *unknowns_of(sized, id).front();
      u.value = std::clamp(factor * size, sized.parameter(u).lower, sized.parameter(u).upper);
    }
    auto fit = std::make_unique<GrowingTrust>(std::move(sized));
    fit->fit(levels);
    return fit;
  };
  const auto better_of_other_sizes = [&](int levels) {
    std::vector<std::unique_ptr<GrowingTrust>> fits(2);
    in_parallel(fits.size(), [&](std::size_t i) { fits[i] = trust(i == 0 ? 0.2 : 5.0, levels); });
    return std::move(fits[0]->better_than(*fits[1]) ? fits[0] : fits[1]);
  };

  if (takes_small_steps(joint)) {
    std::unique_ptr<GrowingTrust> best = trust(1, GrowingTrust::first_levels);
    Followed found = follow_round_corners(*best);
    if (!(found.left < followed) && size != 0)
      for (const double factor : {0.2, 5.0}) {
        auto other = trust(factor, GrowingTrust::first_levels);
        if (Followed others = follow_round_corners(*other); others.left < found.left) found = std::move(others);
        if (other->better_than(*best)) best = std::move(other);
      }
    constexpr double deepest = 1.05, nearly = 1.5;  // trajectories that cross the corners for seconds have least chi-squares everywhere; few are the deepest
    std::vector<ChannelColour> noise;
    if (!(found.most_left < deepest) && found.left < nearly_explained) noise = noise_left_of_decays(found.joint);
    const bool to_its_noise = found.most_left < deepest || !noise.empty();
    if (!to_its_noise) best->fit(GrowingTrust::trusted_levels);
    if (to_its_noise || (found.left < nearly && best->left_as_trusted() > followed)) {
      joint = std::move(found.joint);
      return {found.left, true, std::move(noise)};
    }
    joint = best->joint();
    std::size_t d = 0;
    for (RunResidual& run : joint.runs())
      if (is_decay(run)) run.start_from(best->linear()[d++]);
    return {best->left_as_trusted(), false};
  }

  const std::unique_ptr<GrowingTrust> first = trust(1, follow_laws(joint) ? GrowingTrust::all_levels : GrowingTrust::first_levels);
  JointProblem found = joint;
  const double left = follow_exactly(found, *first);
  const auto to_its_noise = [&] { return left < nearly_explained && !noise_left_of_decays(found).empty(); };
  if (left > followed && size != 0 && !from_here && !to_its_noise()) {
    const std::unique_ptr<GrowingTrust> other = better_of_other_sizes(GrowingTrust::all_levels);
    if (const double others_left = other->better_than(*first) ? follow_exactly(joint, *other) : INFINITY; others_left < left) return {others_left, true};
  }
  joint = std::move(found);
  return {left, true};
}

}  // namespace unrig
