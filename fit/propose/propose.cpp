#include "fit/propose/propose.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <random>

#include <fmt/format.h>

#include "core/numerics/in_parallel.h"
#include "fit/likelihood/run_order.h"
#include "fit/propose/expected_odds.h"
#include "fit/propose/fitted_explanation.h"

namespace unrig {
namespace {

using Eigen::VectorXd;
using Fits = std::vector<std::unique_ptr<FittedExplanation>>;

/// As a key to sort by: what is not known comes last.
double known_or_last(double x) { return std::isfinite(x) ? x : -std::numeric_limits<double>::infinity(); }

double least_of(const std::pair<double, double>& both) {
  return std::isfinite(both.first) && std::isfinite(both.second) ? std::min(both.first, both.second) : ExpectedOutcome::unknown;
}

double mean(const std::vector<double>& x) { return std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size()); }

/// The noise of a candidate is the same whatever is simulated: differences then are the models'.
std::mt19937_64 noise_of(const ProposeProblem& problem, std::size_t candidate, std::size_t draw) {
  std::seed_seq seeds{problem.seed, static_cast<std::uint64_t>(candidate), static_cast<std::uint64_t>(draw)};
  return std::mt19937_64(seeds);
}

class Search {
 public:
  Search(const ProposeProblem& problem, const std::vector<CandidateRun>& candidates, const Fits& fits) : problem_(problem), candidates_(candidates), fits_(fits) {}

  Comparison compare(std::size_t first, std::size_t second) const {
    constexpr int most = 3;
    for (int round = 1;; ++round) {
      Comparison comparison = refitted_comparison(first, second);
      if (round < most && found_better_fits(comparison)) continue;
      draw_for_the_best(comparison);
      return comparison;
    }
  }

 private:
  /// Whether refits have shown that an explanation fits the runs at hand better than was known; then it does from now on.
  bool found_better_fits(const Comparison& comparison) const {
    bool found = false;
    for (const ExpectedOutcome& outcome : comparison.outcomes)
      for (const std::size_t end : {0, 1, 2, 3})
        if (outcome.risen[end] < -FittedExplanation::clearly_less && fits_[end == 0 || end == 3 ? comparison.first : comparison.second]->adopt(outcome.ends[end])) found = true;
    return found;
  }

  Comparison refitted_comparison(std::size_t first, std::size_t second) const {
    Comparison comparison{first, second, {}, {}};
    std::vector<ExpectedOutcome> all(candidates_.size());
    in_parallel(all.size(), [&](std::size_t c) { all[c] = to_first_order(first, second, c); });
    for (ExpectedOutcome& outcome : all) {
      if (!candidates_[outcome.candidate].repeat) comparison.outcomes.push_back(std::move(outcome));
      else if (known_or_last(least_of(outcome.linear)) >= known_or_last(least_of(comparison.repeat.linear))) comparison.repeat = std::move(outcome);
    }
    refit_the_best(comparison);
    return comparison;
  }

  void tell(const std::string& what) const {
    if (problem_.progress) problem_.progress(what);
  }

  ExpectedOutcome to_first_order(std::size_t first, std::size_t second, std::size_t c) const {
    ExpectedOutcome outcome;
    outcome.candidate = c;
    const CandidateRun& candidate = candidates_[c];
    const auto odds = [&](std::size_t i, std::size_t j) {
      std::mt19937_64 random = noise_of(problem_, c, 0);
      const ImaginedRun run = imagined(*fits_[i], candidate, fits_[i]->theta(candidate), random);
      return expected_log_odds(*fits_[i], *fits_[j], run, candidate);
    };
    try {
      outcome.linear = {odds(first, second), odds(second, first)};
      if (!std::isfinite(outcome.linear.first) || !std::isfinite(outcome.linear.second)) outcome.failed = "a model has no finite answer there";
    } catch (const std::runtime_error& e) {
      outcome.failed = e.what();
    }
    return outcome;
  }

  /// A refit that leaves more than it should (of the true explanation beyond chance, of the other by what would decide) may have lost its way. It is searched anew, and the better of both counts. With
  /// noise it starts from `end`, where that without noise ended.
  FittedExplanation::Refit refitted(std::size_t of, const ImaginedRun& run, const CandidateRun& candidate, bool exact, double should_leave, std::size_t end, ExpectedOutcome& outcome) const {
    const RunResidual added = residual_of(*fits_[of], run, candidate, exact);
    FittedExplanation::Refit refit = fits_[of]->refit(added, candidate.like, outcome.ends[end]);
    if (!refit.arrived || (exact && refit.chi2 > should_leave)) {
      FittedExplanation::Refit anew = fits_[of]->refit_anew(added, run.noisy);
      if (anew.arrived && (!refit.arrived || anew.chi2 < refit.chi2)) refit = std::move(anew);
    }
    if (exact && refit.arrived) outcome.ends[end] = refit.unknowns, outcome.risen[end] = refit.chi2;
    ++outcome.searches;
    outcome.arrived += refit.arrived ? 1 : 0;
    return refit;
  }

  /// Log odds of the true explanation, both refitted; nothing where a search did not arrive. `end`: the place in `ends` of the true one, before that of the other.
  std::optional<double> by_refit(std::size_t truth, std::size_t other, std::size_t c, std::size_t draw, std::size_t end, ExpectedOutcome& outcome) const {
    const CandidateRun& candidate = candidates_[c];
    const bool exact = draw == 0;
    std::mt19937_64 random = noise_of(problem_, c, draw);
    const VectorXd theta = exact ? fits_[truth]->theta(candidate) : fits_[truth]->drawn_theta(candidate, random);
    const ImaginedRun run = imagined(*fits_[truth], candidate, theta, random);
    // The readings that are read with noise leave as many as there are, within what chance leaves in one of a million; the angle of a turn always is.
    const double read = static_cast<double>(run.exact.samples()) * ((exact ? 0.0 : static_cast<double>(fits_[truth]->joint().runs()[candidate.like].channels().size())) + (run.windows.empty() ? 0.0 : 1.0));
    const double chance = read + 5 * std::sqrt(2 * read) + 5;
    const FittedExplanation::Refit right = refitted(truth, run, candidate, exact, chance, end, outcome);
    const FittedExplanation::Refit wrong = refitted(other, run, candidate, exact, right.chi2 + 2 * enough_to_decide, end + 1, outcome);
    if (!right.arrived || !wrong.arrived) return {};
    if (right.chi2 > chance) {  // the truth is at hand, and the search did not find it
      --outcome.arrived;
      return {};
    }
    return 0.5 * (wrong.chi2 - right.chi2);
  }

  void refit(const Comparison& comparison, ExpectedOutcome& outcome) const {
    try {
      outcome.refitted.first = by_refit(comparison.first, comparison.second, outcome.candidate, 0, 0, outcome).value_or(ExpectedOutcome::unknown);
      outcome.refitted.second = by_refit(comparison.second, comparison.first, outcome.candidate, 0, 2, outcome).value_or(ExpectedOutcome::unknown);
    } catch (const std::runtime_error& e) {
      outcome.failed = e.what();
    }
  }

  static void sort(std::vector<ExpectedOutcome>& outcomes) {
    const auto key = [](const ExpectedOutcome& o) {
      const bool counts = o.was_refitted() && std::isfinite(o.least());
      return std::pair(counts ? 1 : 0, known_or_last(counts ? o.least() : least_of(o.linear)));
    };
    std::stable_sort(outcomes.begin(), outcomes.end(), [&](const ExpectedOutcome& a, const ExpectedOutcome& b) { return key(a) > key(b); });
  }

  /// The best to first order; and as many again while one promises more to first order than any refit has kept.
  void refit_the_best(Comparison& comparison) const {
    std::vector<ExpectedOutcome>& all = comparison.outcomes;
    std::stable_sort(all.begin(), all.end(), [](const ExpectedOutcome& a, const ExpectedOutcome& b) { return known_or_last(least_of(a.linear)) > known_or_last(least_of(b.linear)); });
    const auto wanted = static_cast<std::size_t>(std::max(problem_.refits, 0));
    std::size_t next = 0;
    double best = -std::numeric_limits<double>::infinity();
    while (next < all.size() && next < 2 * wanted && std::isfinite(least_of(all[next].linear)) && (next < wanted || least_of(all[next].linear) > best)) {
      const std::size_t many = std::min({next < wanted ? wanted - next : std::size_t{1}, all.size() - next});
      tell(fmt::format("refitting {} of {} candidate runs", next + many, all.size()));
      in_parallel(many, [&](std::size_t k) {
        if (all[next + k].failed.empty()) refit(comparison, all[next + k]);
      });
      for (std::size_t k = 0; k < many; ++k) best = std::max(best, known_or_last(least_of(all[next + k].refitted)));
      next += many;
    }
    sort(all);
  }

  void draw_for_the_best(Comparison& comparison) const {
    if (comparison.outcomes.empty() || !std::isfinite(least_of(comparison.outcomes.front().refitted))) return;
    ExpectedOutcome& best = comparison.outcomes.front();
    const auto draws = static_cast<std::size_t>(std::max(problem_.draws, 0));
    tell(fmt::format("drawing parameters and noise for {}", candidates_[best.candidate].what));
    std::vector<ExpectedOutcome> each(2 * draws);
    for (ExpectedOutcome& one : each) one.ends = best.ends;
    std::vector<std::optional<double>> odds(2 * draws);
    in_parallel(2 * draws, [&](std::size_t k) {
      const bool first = k < draws;
      try {
        odds[k] = by_refit(first ? comparison.first : comparison.second, first ? comparison.second : comparison.first, best.candidate, 1 + k, first ? 0 : 2, each[k]);
      } catch (const std::runtime_error&) {  // drawn parameters with which the model runs away
        each[k].searches += 1;
      }
    });
    for (std::size_t k = 0; k < odds.size(); ++k) {
      best.searches += each[k].searches;
      best.arrived += each[k].arrived;
      if (odds[k]) (k < draws ? best.drawn.first : best.drawn.second).push_back(*odds[k]);
    }
    sort(comparison.outcomes);
  }

  const ProposeProblem& problem_;
  const std::vector<CandidateRun>& candidates_;
  const Fits& fits_;
};

double log_odds_between(const FittedExplanation& a, const FittedExplanation& b) {
  double samples = 0;
  for (const RunResidual& run : a.joint().runs()) samples += static_cast<double>(run.observations());
  return 0.5 * (b.chi2() - a.chi2() + (b.variables() - a.variables()) * std::log(samples));
}

std::vector<std::size_t> ranking_of(const Plan& plan) {
  struct Standing {
    std::size_t candidate;
    bool refitted = true;
    double least = std::numeric_limits<double>::infinity();
  };
  std::vector<Standing> standings;
  for (std::size_t c = 0; c < plan.candidates.size(); ++c) {
    if (plan.candidates[c].repeat) continue;
    Standing s{c};
    for (const Comparison& comparison : plan.comparisons)
      for (const ExpectedOutcome& o : comparison.outcomes) {
        if (o.candidate != c) continue;
        const bool counts = o.was_refitted() && std::isfinite(o.least());
        s.refitted = s.refitted && counts;
        s.least = std::min(s.least, known_or_last(counts ? o.least() : least_of(o.linear)));
      }
    standings.push_back(s);
  }
  std::stable_sort(standings.begin(), standings.end(), [](const Standing& a, const Standing& b) { return std::pair(a.refitted, a.least) > std::pair(b.refitted, b.least); });
  std::vector<std::size_t> order;
  for (const Comparison& comparison : plan.comparisons)  // what decides a pair comes before what decides no pair
    if (comparison.decides() && std::find(order.begin(), order.end(), comparison.outcomes.front().candidate) == order.end()) order.push_back(comparison.outcomes.front().candidate);
  if (order.size() > 1) {
    std::vector<std::size_t> by_standing;
    for (const Standing& s : standings)
      if (std::find(order.begin(), order.end(), s.candidate) != order.end()) by_standing.push_back(s.candidate);
    order = by_standing;
  }
  for (const Standing& s : standings)
    if (std::find(order.begin(), order.end(), s.candidate) == order.end()) order.push_back(s.candidate);
  return order;
}

}  // namespace

std::pair<double, double> ExpectedOutcome::expected() const {
  if (!was_refitted()) return linear;
  return {drawn.first.empty() ? refitted.first : mean(drawn.first), drawn.second.empty() ? refitted.second : mean(drawn.second)};
}

double ExpectedOutcome::least() const { return least_of(expected()); }

bool Comparison::decides() const { return !outcomes.empty() && outcomes.front().was_refitted() && outcomes.front().least() >= enough_to_decide; }

Plan propose(const ProposeProblem& problem) {
  Plan plan;
  Rivals rivals = problem.rivals;
  rivals.runs = in_order(rivals.runs, order_of_search(rivals.runs));
  plan.explanations = rivals.explanations;
  plan.remarks = rivals.left_out;
  plan.candidates = candidate_runs(problem.limits, rivals.rig, rivals.runs);
  Fits fits;
  for (const Explanation& e : rivals.explanations) {
    if (problem.progress) problem.progress("fitting " + e.name);
    fits.push_back(std::make_unique<FittedExplanation>(e, rivals, problem.progress));
    plan.no_answer.push_back(fits.back()->no_answer());
  }
  FittedExplanation& best = **std::min_element(fits.begin(), fits.end(), [](const auto& a, const auto& b) { return a->log_noise() < b->log_noise(); });
  best.settle(best);
  for (const auto& fit : fits)
    if (fit.get() != &best) fit->settle(best);
  for (std::size_t k = 1; k < fits.size(); ++k) plan.comparisons.push_back(Search(problem, plan.candidates, fits).compare(0, k));
  for (const auto& fit : fits) plan.log_odds_now.push_back(log_odds_between(*fits.front(), *fit));
  plan.ranking = ranking_of(plan);
  return plan;
}

}  // namespace unrig
