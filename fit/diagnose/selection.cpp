#include "fit/diagnose/selection.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "core/numerics/time_limit.h"
#include "fit/diagnose/mismatch.h"
#include "fit/search/decays_first.h"
#include "fit/search/lost_run.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

using Strings = std::vector<std::string>;
using Trials = std::vector<Trial>;  // the best first once they are fitted
using Tell = std::function<void(const std::string&)>;

/// A few rounds for all, the rest for those that are ahead.
void fit_linear(Trials& trials) {
  in_parallel(trials.size(), [&](std::size_t i) { hold_undetermined(trials[i]); });
  in_parallel(trials.size(), [&](std::size_t i) { fit_fully(trials[i], 2); });
  std::sort(trials.begin(), trials.end(), [](const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2(); });
  in_parallel(std::min(trials.size(), most_in_full), [&](std::size_t i) { fit_fully(trials[i], 6); });
}

/// Those that were `fitted`, behind `others`: laws by the free decays first, the most promising effect first; none after one that leaves nothing of a mismatch too large for two laws to explain alike.
void fit_nonlinear(const FitProblem& problem, const Tell& tell, Trials& trials, const Trial& base, const Trials& others, Trials& fitted) {
  double least = base.reduced_chi2();
  for (const Trial& other : others) least = std::min(least, other.reduced_chi2());
  for (Trial& trial : trials) {
    if (tell) tell(fmt::format("trying {}", fmt::join(trial.effects, " with ")));
    hold_undetermined(trial);
    if (brings_a_law(trial)) {
      follow_nonlinear(problem, trial, base, least);
    } else {
      fit_fully(trial, 2);
      if (trial.reduced_chi2() < least) fit_fully(trial, 6);
    }
    least = std::min(least, trial.reduced_chi2());
    fitted.push_back(std::move(trial));
    if (leaves_nothing(fitted.back()) && base.reduced_chi2() >= nearly_explained) break;
  }
  std::sort(fitted.begin(), fitted.end(), [](const Trial& a, const Trial& b) { return a.reduced_chi2() < b.reduced_chi2(); });
}

/// What has come to rest at a limit of what its parameters may be, other than zero, and leaves something stands in for something else.
bool plausible(const Trial& trial) {
  const JointProblem& joint = trial.arrival.joint;
  return leaves_nothing(trial) || std::none_of(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) {
    const Parameter& p = joint.parameter(u);
    const auto [lower, upper] = bounds_at(joint.model(), u.parameter, u.value);
    const auto at = [&](double bound) { return bound != 0 && std::abs(u.value - bound) < 1e-6 * std::abs(bound); };
    return !u.held && p.effect == trial.effects.back() && (at(lower) || at(upper));
  });
}

/// Whether what `trial` adds to `base` takes next to nothing of what that leaves: of the decays alone where it adds a law by which these decide, since of the other runs more may be left while they are not
/// followed.
bool takes_nothing(const Trial& trial, const Trial& base) {
  const bool by_decays = decays_decide(trial) && !decays_decide(base);
  const auto excess = [&](const Trial& t) { return by_decays ? left_of_decays(t) - 1 : t.excess(); };
  return excess(trial) > hardly_less * excess(base);
}

/// Whether each effect is something of its own beside the rest of the model; what makes one peak with a known mode, say, has taken its part of something else.
bool distinct(const Trial& trial) {
  const JointProblem& joint = trial.arrival.joint;
  double longest = 0;
  for (const RunResidual& run : joint.runs()) longest = std::max(longest, run.run().dt * static_cast<double>(run.run().samples()));
  return std::all_of(trial.effects.begin(), trial.effects.end(), [&](const std::string& id) {
    const Effect& e = effect(joint.model().rig(), id);
    return !e.distinct || e.distinct(joint.model(), joint.theta(0), longest);
  });
}

void keep_distinct(Trials& trials) {
  std::erase_if(trials, [](const Trial& t) { return !distinct(t); });
}

bool any_leaves_nothing(const Trials& trials) { return std::any_of(trials.begin(), trials.end(), leaves_nothing); }

/// All over again for those ahead, and for effects whose own fit has nothing to search in.
void fit_anew(const FitProblem& problem, Trials& trials) {
  in_parallel(trials.size(), [&](std::size_t i) {
    if (decays_decide(trials[i])) return;
    if (i < most_in_full || effect(trials[i].effects.back()).parameters_on(problem.rig).empty()) fit_from_first_guesses(problem, trials[i]);
  });
}

/// And for the others: among fits that all are far from the data, which is ahead says little.
void fit_others_anew(const FitProblem& problem, Trials& trials) {
  if (trials.size() <= most_in_full) return;
  in_parallel(trials.size() - most_in_full, [&](std::size_t i) {
    Trial& trial = trials[most_in_full + i];
    if (!effect(trial.effects.back()).parameters_on(problem.rig).empty()) fit_from_first_guesses(problem, trial);
  });
}

}  // namespace

bool same_set(Strings a, Strings b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  return a == b;
}

SearchOutcome search_of(const Trial& trial, const Trial& base) {
  if (trial.ruled_out) return SearchOutcome::ruled_out;
  return !effect(trial.arrival.joint.model().rig(), trial.effects.back()).parameters.empty() && deviance_difference(trial, base) > decisive ? SearchOutcome::failed : SearchOutcome::complete;
}

Mismatch what_remains(const Trial& trial) {
  Mismatch mismatch = locate_mismatch(trial.arrival.joint);
  if (!any_aside(trial.arrival.joint) || trial.decays.chi2 < explained) return mismatch;
  mismatch.found = true;
  if (mismatch.runs.empty()) mismatch.summary.clear();
  mismatch.summary += fmt::format("{}the free decays, followed with their laws trusted to some per cent, are left with {:.2g} times the power of their noise", mismatch.runs.empty() ? "" : "; ", trial.decays.chi2);
  return mismatch;
}

bool explained_by_noise(Trial& trial) {
  Trial coloured = trial;
  if (!take_noise_colour(coloured) || what_remains(coloured).found) return false;
  trial = std::move(coloured);
  return true;
}

bool in_noise_of_most(Trial& trial) {
  for (std::size_t r = 0; r < trial.variance.size(); ++r)
    if (!trial.arrival.joint.runs()[r].is_aside() && trial.variance[r] < explained) return false;
  Trial coloured = trial;
  if (!take_noise_colour_of_most(coloured) || 2 * locate_mismatch(coloured.arrival.joint).runs.size() > trial.variance.size()) return false;
  trial = std::move(coloured);
  return true;
}

Selection::Selection(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& baseline) : problem_(problem), fit_problem_(fit_problem), baseline_(baseline) {
  ranking_.push_back({{}, baseline.reduced_chi2(), 0, 0, 0});
}

/// Share of what `base` leaves that is gone with what all is held against, with the weights that `base` gives its runs, as promises are told; 0 where there is no such thing.
double Selection::taken_beyond(const Trial& base) const {
  double left = 0, all = 0;
  for (std::size_t r = 0; r < held_against_.size(); ++r) {
    const double weight = static_cast<double>(base.arrival.joint.runs()[r].run().samples()) / std::max(1.0, base.variance[r]);
    left += weight * held_against_[r];
    all += weight * base.variance[r];
  }
  return all > 0 ? std::max(0.0, 1 - left / all) : 0;
}

/// Effects that can act in at least one of the runs of this rig, are not at work yet, and not `hopeless`.
Strings Selection::candidates(const Strings& at_work, const Strings& hopeless) const {
  const JointProblem& joint = baseline_.arrival.joint;
  std::vector<Conditions> conditions;
  for (const RunResidual& run : joint.runs()) conditions.push_back(run.conditions());
  Strings ids;
  for (const Effect& e : effects()) {
    if (!problem_.effects.empty() && std::find(problem_.effects.begin(), problem_.effects.end(), e.id) == problem_.effects.end()) continue;
    if (std::find(at_work.begin(), at_work.end(), e.id) != at_work.end()) continue;
    if (std::find(hopeless.begin(), hopeless.end(), e.id) != hopeless.end()) continue;
    if (why_idle(e, problem_.rig, conditions).empty()) ids.push_back(e.id);
  }
  return ids;
}

/// Beside what else explains everything. Signals move the rig's parameters, and may take some times what they promise.
bool Selection::takes_too_little(const Trial& screened, const Trial& base) const {
  const double wanted = (brings_a_law(screened) ? half_of_it : quarter_of_it) * taken_beyond(base);
  return wanted > 0 && screened.score < wanted;
}

const Trials& Selection::screened_alone() {
  if (screened_.empty()) screened_ = screened_beside(fit_problem_, baseline_, candidates({}, {}));
  return screened_;
}

/// The best of all sets that have one effect more than `base`: all of them by one linear step, the promising ones in full.
Trials Selection::try_one_more(const Trial& base, const Strings& hopeless) {
  Trials prepared = base.effects.empty() ? screened_alone() : screened_beside(fit_problem_, base, candidates(base.effects, hopeless));
  if (base.effects.empty()) std::erase_if(prepared, [&](const Trial& t) { return std::find(hopeless.begin(), hopeless.end(), t.effects.back()) != hopeless.end(); });
  std::sort(prepared.begin(), prepared.end(), [](const Trial& a, const Trial& b) { return a.score > b.score; });
  const double best_score = prepared.empty() ? 0 : prepared.front().score;
  Trials linear, others, unpromising;
  for (Trial& trial : prepared) {
    const bool promises_nothing = effect(trial.effects.back()).parameters_on(problem_.rig).empty();  // it may hold all the same
    const bool follows_law = nonlinear(trial), far = base.reduced_chi2() > twice_the_noise;
    const bool promises = linear.size() + others.size() < most_refits && trial.score > quarter_of_it * best_score;
    const bool step_says_nothing = far && best_score < half_of_it && takes_small_steps(trial.arrival.joint);  // of corners that bend a trajectory
    if (brings_a_law(trial) && !far && !may_be_seen(trial, base)) continue;
    if (!promises_nothing && takes_too_little(trial, base)) continue;
    if (is_first(base) && follows_law && trial.score < 0) continue;  // dear to follow; a filter, which far away promises as little, is not
    if (prepared.size() <= few_candidates || promises_nothing || promises || step_says_nothing) (follows_law ? others : linear).push_back(std::move(trial));
    else if (!follows_law) unpromising.push_back(std::move(trial));
  }
  // Linear effects first, which are an order faster; nonlinear ones where none of those leaves nothing, and those that promise as much.
  const double by_linear = linear.empty() ? 0 : as_much * linear.front().score;
  const bool favours_linear = others.empty() || (!linear.empty() && by_linear >= others.front().score);
  fit_linear(linear);
  keep_distinct(linear);
  Trials followed;  // of the others
  const auto any_does = [&] { return any_leaves_nothing(linear) || any_leaves_nothing(followed); };
  try {
    bool done = any_leaves_nothing(linear);
    if (favours_linear && !done) {
      fit_anew(fit_problem_, linear);
      keep_distinct(linear);
      done = any_leaves_nothing(linear);
    }
    if (!done || !favours_linear) {  // a decaying tone may leave nothing of what a weak drag does, and explain it worse
      if (done) std::erase_if(others, [&](const Trial& t) { return by_linear >= t.score; });
      fit_nonlinear(fit_problem_, problem_.progress, others, base, linear, followed);
      done = done || any_leaves_nothing(followed);
      if (!done && !favours_linear) fit_anew(fit_problem_, linear);
      const bool decays_have_told = has_decays(base.arrival.joint);  // from first guesses nonlinear laws are not found where their decays do not lead
      if (!done && !decays_have_told && !any_leaves_nothing(linear)) fit_anew(fit_problem_, followed);
      if (!done && !any_does() && is_first(base) && base.reduced_chi2() > nearly_explained) fit_others_anew(fit_problem_, linear);
      if (!any_does()) {  // far from the truth one linear step promises little of what there is
        fit_linear(unpromising);
        fit_anew(fit_problem_, unpromising);
        std::move(unpromising.begin(), unpromising.end(), std::back_inserter(linear));
      }
    }
  } catch (const OutOfTime&) {  // what has been fitted stands
    stop();
  }
  std::move(followed.begin(), followed.end(), std::back_inserter(linear));
  keep_distinct(linear);
  try {
    in_parallel(linear.size(), [&](std::size_t i) {
      if (leaves_nothing(linear[i]) && !decays_decide(linear[i])) leave_out_terms(linear[i]);
    });
  } catch (const OutOfTime&) {  // with all of its terms each stands too
    stop();
  }
  std::sort(linear.begin(), linear.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  std::stable_partition(linear.begin(), linear.end(), plausible);
  for (const Trial& t : linear) ranking_.push_back({t.effects, t.reduced_chi2(), bic_difference(t, baseline_), 0, base.effects.empty() ? t.score : 0, search_of(t, base)});
  return linear;
}

/// Takes away again what the others made superfluous.
Trial Selection::without_superfluous(Trial trial) {
  for (Trial& fewer : taken_away(fit_problem_, trial)) {
    trial = std::move(fewer);
    ranking_.push_back({trial.effects, trial.reduced_chi2(), bic_difference(trial, baseline_), 0, 0});
  }
  return trial;
}

/// Sets with another effect in place of `member`, fitted from `best`, where motions and theta are all but known: of those that were not fitted before the ones that promise half of what the member does; laws, which are dear, for as long as they promise as much of
/// what is left of that.
Trials Selection::rivals(const Trial& best, const std::string& member) {
  Strings fewer = best.effects;
  std::erase(fewer, member);
  Trial others = prepare(fit_problem_, best, fewer);
  measure(others);
  // chi-square: with the member, as it is without, and where a step without it ends; the first step may lead astray.
  const double with_it = best.arrival.joint.chi2(), without = std::min(others.arrival.joint.chi2(), others.promised_left);
  const Strings ids = candidates(best.effects, {});
  const bool of_a_law = is_a_law(member, best.arrival.joint), one_law_will_do = others.reduced_chi2() > nearly_explained;
  const Screening screening(fit_problem_, others.arrival);
  // Where a signal explains the runs a step tells nearly all of a law that does.
  const auto share_of = [&](const Trial& trial) { return brings_a_law(trial) && one_law_will_do ? as_much : half_of_it; };
  // What is followed may leave more, by what the member's parameters cost.
  const double samples = std::accumulate(best.samples.begin(), best.samples.end(), 0.0), worth = decisive + (best.variables - others.variables) * std::log(samples);
  std::vector<std::optional<Trial>> prepared(ids.size());
  in_parallel(ids.size(), [&](std::size_t i) {
    Strings set = fewer;
    set.push_back(ids[i]);
    if (is_fitted(set)) return;
    Trial trial = screened(fit_problem_, screening, others, set);
    if (of_a_law && one_law_will_do && brings_a_law(trial)) return;  // too large a mismatch for two laws to explain alike
    if (takes_too_little(trial, others)) return;
    if (without - trial.promised_left > share_of(trial) * (without - with_it)) prepared[i] = std::move(trial);
  });
  Trials rivals;
  for (std::optional<Trial>& trial : prepared)
    if (trial) rivals.push_back(std::move(*trial));
  const auto follow = [&](Trial& rival) {
    hold_undetermined(rival);
    if (!brings_a_law(rival)) fit_fully(rival, 2);
    else if (!follow_nonlinear(fit_problem_, rival, others, others.reduced_chi2(), {with_it * (1 + worth / samples), share_of(rival)})) return;
    if (leaves_nothing(rival) && !decays_decide(rival)) leave_out_terms(rival);
  };
  // Here a step tells much. Of a mismatch too large for two laws to explain alike none is followed behind one that leaves nothing.
  std::stable_sort(rivals.begin(), rivals.end(), [](const Trial& a, const Trial& b) { return a.promised_left < b.promised_left; });
  const auto laws = std::stable_partition(rivals.begin(), rivals.end(), [&](const Trial& t) { return !(one_law_will_do && brings_a_law(t)); });
  in_parallel(static_cast<std::size_t>(laws - rivals.begin()), [&](std::size_t i) { follow(rivals[i]); });
  for (auto law = laws; law != rivals.end(); ++law) {
    follow(*law);
    if (leaves_nothing(*law)) {
      rivals.erase(law + 1, rivals.end());
      break;
    }
  }
  keep_distinct(rivals);
  std::erase_if(rivals, [](const Trial& t) { return t.ruled_out || !plausible(t); });
  std::sort(rivals.begin(), rivals.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  for (const Trial& t : rivals) ranking_.push_back({t.effects, t.reduced_chi2(), bic_difference(t, baseline_), 0, fewer.empty() ? t.score : 0, search_of(t, others)});
  return rivals;
}

/// Each member is challenged by its rivals: far from the truth a step promises little of what there is, and a search ends with the first that explains the runs. Beside others a line at a known frequency is not.
Trial Selection::challenged(Trial best) {
  const Strings members = best.effects;
  for (const std::string& member : members) {
    if (members.size() > lines_.size() && std::find(lines_.begin(), lines_.end(), member) != lines_.end()) continue;
    tell("trying what may explain the runs in place of " + member);
    Trials tried = rivals(best, member);
    if (tried.empty()) continue;
    if (bic_difference(tried.front(), best) < 0) {
      fit_fully(tried.front(), 6);
      std::swap(best, tried.front());
    }
    std::move(tried.begin(), tried.end(), std::back_inserter(tried_));
  }
  return best;
}

/// Whether this set was fitted, in whichever order.
bool Selection::is_fitted(const Strings& set) const {
  return std::any_of(ranking_.begin(), ranking_.end(), [&](const Candidate& c) { return same_set(c.effects, set); });
}

/// A law is not found from far away where the modes of a beam are too few for its trajectory: where nothing explains what is missing, every effect is tried beside the modes that were left out too.
void Selection::try_with_all_modes(Trials& tried) {
  if (any_leaves_nothing(tried) || baseline_.reduced_chi2() < nearly_explained || problem_.rig.is_modal()) return;
  const auto modes = std::find_if(tried.begin(), tried.end(), [](const Trial& t) { return t.effects.size() == 1 && effect(t.effects.front()).enriches_basis; });
  if (modes == tried.end()) return;
  tell("trying what may be missing beside " + modes->effects.front());
  const Trial base = *modes;
  for (Trial& t : try_one_more(base, {}))
    if (bic_difference(t, base) < -decisive) tried.push_back(std::move(t));
  std::sort(tried.begin(), tried.end(), [](const Trial& a, const Trial& b) { return bic_difference(a, b) < 0; });
  std::stable_partition(tried.begin(), tried.end(), plausible);
}

void Selection::stop() {
  TimeLimit::lift();
  stopped_ = true;
}

/// Signals at a frequency that is known beforehand whose lines stand out of what a fit leaves.
Strings Selection::known_lines(const Trial& of) const {
  Strings ids = candidates(of.effects, {});
  std::erase_if(ids, [&](const std::string& id) { return effect(id).bands.empty() || !has_line(of.arrival.joint, effect(id)); });
  return ids;
}

std::optional<Trial> Selection::with_known_lines() const {
  const Strings ids = known_lines(baseline_);
  if (ids.empty()) return std::nullopt;
  Trial with = prepare(fit_problem_, baseline_, ids);
  fit_fully(with, 2);
  return with;
}

/// Far from the noise a signal at a frequency that is known beforehand (Effect::bands) is drowned in what else is left, and yet nothing else makes its line: it is taken out first, or laws have it to follow.
void Selection::take_known_lines(Trial& best) {
  for (const std::string& id : known_lines(best)) {
    tell("taking out " + id);
    Strings set = best.effects;
    set.push_back(id);
    Trial with = prepare(fit_problem_, best, set);
    fit_fully(with, 2);
    ranking_.push_back({set, with.reduced_chi2(), bic_difference(with, baseline_), 0, with.score});
    lines_.push_back(id);
    best = std::move(with);
  }
  if (!lines_.empty() && !what_remains(best).found) best = challenged(best);  // a copy: where the limits are reached the best stays what it is
}

/// Held against what may explain the runs in place of its members; then without what that made superfluous.
Trial Selection::settled(Trial trial) {
  const Strings before = trial.effects;
  trial = challenged(std::move(trial));
  if (!same_set(before, trial.effects)) trial = without_superfluous(std::move(trial));
  judge_decays(trial);
  return trial;
}

void Selection::grow(Trial& best, const std::function<bool(const Trial&)>& enough, std::optional<Trial>& sufficient) {
  if (best.reduced_chi2() > twice_the_noise) take_known_lines(best);
  Strings hopeless;  // laws with which alone the fit is worse than without: from that far away they are not found, and are not tried again before half of the way is gone
  while (!stopped_ && what_remains(best).found) {
    const double before = best.reduced_chi2();
    best = in_finer_steps(with_lost_runs_followed(best));
    if (best.reduced_chi2() < before) ranking_.push_back({best.effects, best.reduced_chi2(), bic_difference(best, baseline_), 0, best.score});
    if (!what_remains(best).found) break;
    if (!best.effects.empty() && enough && enough(best)) {
      sufficient = best;
      return;
    }
    if (best.effects.size() == most_effects) break;
    if (decays_decide(best) && best.reduced_chi2() > twice_the_noise) break;  // trajectories that are not followed tell nothing of a second effect, in minutes each
    if (!sufficient && nonlinear(best) && best.excess() < (1 - enough_to_name) * baseline_.excess() && leaves_nothing(best)) sufficient = best;
    tell(best.effects.empty() ? "trying what may be missing" : "trying what may be missing beside " + best.effects.back());
    Trials tried = try_one_more(best, hopeless);
    for (const Trial& t : tried)
      if (is_first(best) && brings_a_law(t) && bic_difference(t, baseline_) > decisive) hopeless.push_back(t.effects.back());
    if (best.effects.empty()) try_with_all_modes(tried);
    std::erase_if(tried, [&](const Trial& t) { return !leaves_nothing(t) && takes_nothing(t, best); });
    if (tried.empty()) break;
    const Trial next = tried.front();
    if (!(is_first(best) || plausible(next)) || bic_difference(next, best) > -decisive) break;
    if (next.excess() < half_of_it * best.excess()) hopeless.clear();
    best = next;
    if (!stopped_) best = settled(without_superfluous(next));
    std::move(tried.begin(), tried.end(), std::back_inserter(tried_));
  }
}

Trial Selection::best_set(const std::function<bool(const Trial&)>& enough, const Trial* begun) {
  Trial best = begun ? *begun : baseline_;
  std::optional<Trial> sufficient;  // what noise or the rig's description explain the rest of; or a law that is followed all but exactly: what it leaves has a name only where that leaves nothing
  try {
    if (begun) {
      ranking_.push_back({best.effects, best.reduced_chi2(), bic_difference(best, baseline_), 0, 0});
      best = settled(without_superfluous(best));
    }
    grow(best, enough, sufficient);
  } catch (const OutOfTime&) {
    stop();
  }
  if (sufficient && what_remains(best).found) return *sufficient;
  return bic_difference(best, baseline_) > -decisive ? baseline_ : best;  // of lines alone
}

std::optional<Trial> Selection::explained_without_a_law(const std::function<bool(const Trial&)>& enough, bool promising) {
  tell("trying what may be missing, without a law");
  double most = 0;
  for (const Trial& t : screened_alone()) most = std::max(most, t.score);
  Trials linear;
  std::copy_if(screened_alone().begin(), screened_alone().end(), std::back_inserter(linear), [&](const Trial& t) { return (t.score > quarter_of_it * most) == promising && !nonlinear(t); });
  fit_linear(linear);
  keep_distinct(linear);
  std::erase_if(linear, [](const Trial& t) { return t.reduced_chi2() > nearly_explained || !plausible(t); });
  const auto first = std::find_if(linear.begin(), linear.end(), [&](const Trial& t) { return !what_remains(t).found || enough(t); });
  if (first == linear.end()) return std::nullopt;
  return std::move(*first);
}

/// Probabilities: exp(-BIC/2) over the sum of it over all.
std::vector<Candidate> Selection::ranking() const {
  std::vector<Candidate> all = ranking_, ranking;
  std::stable_sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) { return a.delta_bic < b.delta_bic; });
  for (Candidate& c : all) {
    const auto known = std::find_if(ranking.begin(), ranking.end(), [&](const Candidate& r) { return same_set(r.effects, c.effects); });
    if (known == ranking.end()) ranking.push_back(std::move(c));
    else known->score = std::max(known->score, c.score);  // what it promised where it was first looked at
  }
  double sum = 0;
  for (Candidate& c : ranking) sum += c.probability = std::exp(-0.5 * (c.delta_bic - ranking.front().delta_bic));
  for (Candidate& c : ranking) c.probability /= sum;
  return ranking;
}

void leave_out_what_explains_nothing(const Strings& named, const std::vector<Strings>& unrefuted, std::vector<Candidate>& ranking) {
  const auto winner = std::find_if(ranking.begin(), ranking.end(), [&](const Candidate& c) { return same_set(c.effects, named); });
  if (winner == ranking.end()) return;
  const auto explains = [&](const Candidate& c) { return std::any_of(unrefuted.begin(), unrefuted.end(), [&](const Strings& set) { return same_set(c.effects, set); }); };
  double sum = 0;
  for (auto c = ranking.begin(); c != ranking.end(); ++c) sum += c->probability = c >= winner || explains(*c) ? std::exp(-0.5 * (c->delta_bic - winner->delta_bic)) : 0;
  for (Candidate& c : ranking) c.probability /= sum;
}

}  // namespace unrig
