#include "fit/diagnose/diagnose.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <memory>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "core/rig/fingerprint.h"
#include "fit/diagnose/as_given.h"
#include "fit/diagnose/description_beside.h"
#include "fit/diagnose/exact_model.h"
#include "fit/diagnose/explanation.h"
#include "fit/diagnose/law_answer.h"
#include "fit/diagnose/reliability.h"
#include "fit/diagnose/rig_description.h"
#include "fit/diagnose/search_limits.h"
#include "fit/diagnose/selection.h"
#include "fit/laws/law_search.h"
#include "fit/search/decays_first.h"
#include "fit/search/effect_search.h"
#include "fit/search/noise_of_trial.h"
#include "fit/fit_description.h"
#include "fit/givens/inexact_rig.h"
#include "fit/likelihood/run_order.h"

namespace unrig {
namespace {

using Eigen::Index;

/// The fit with nothing missing and every run at its full weight, from where the baseline stands; `thorough`: or from first guesses and the starts around them, as `unrig fit` searches, where that leaves less. Whether it
/// leaves so much less that the baseline, from which all else was searched, was no place to begin from.
struct PlainFit {
  Arrival arrival;
  bool baseline_was_lost = false;
};
PlainFit plain_fit(const FitProblem& problem, const Arrival& baseline, bool thorough) {
  PlainFit plain{baseline};
  for (RunResidual& run : plain.arrival.joint.runs()) run.temper(1);
  solve(plain.arrival);
  if (!thorough) return plain;
  Arrival anew = arrive(problem, baseline.model);
  const double before = plain.arrival.joint.chi2(), after = anew.joint.chi2();
  plain.baseline_was_lost = after < hardly_less * before;
  if (after < before) plain.arrival = std::move(anew);
  return plain;
}

/// With noise and motions looked at again, where that is worth it and does not take too long; otherwise as the search left it.
FitResult told(const Arrival& found, const FitProblem& problem, Settle settle, const SearchLimits& limits) {
  FitResult fit;
  Arrival looked_at_again = found, as_it_is = found;
  if (settle != Settle::nothing && limits.describe([&] { fit = describe_fit(looked_at_again, problem, settle); })) return fit;
  fit = describe_fit(as_it_is, problem, Settle::nothing);
  if (settle != Settle::nothing) fit.warnings.push_back("what was found is told as the search left it: to look at noise and motions again would have taken too long");
  return fit;
}

/// Both fits in full, and what they leave of the fitted runs. Of an explanation with the rig's description put right `d.after` is the fit with its laws to the rig as the files have it: no fit is told that
/// belongs to a rig in no file.
void describe(const FitProblem& fit_problem, const Trial& baseline, const SearchLimits& limits, FoundSet& e, Diagnosis& d) {
  const Trial& best = e.best;
  const bool described = e.setting.problem != &fit_problem;
  const auto settled = [](const Trial& trial) { return trial.reduced_chi2() < twice_the_noise ? Settle::noise : Settle::nothing; };
  FitProblem after = *e.setting.problem;
  after.effects = best.effects;
  Arrival before_arrival = baseline.arrival;
  if (d.mismatch.found) {
    PlainFit plain = plain_fit(fit_problem, baseline.arrival, d.unexplained && !has_colour(baseline.arrival.joint));  // first guesses know of none
    before_arrival = std::move(plain.arrival);
    if (plain.baseline_was_lost) d.not_followed.insert(d.not_followed.begin(), std::vector<std::string>{});
  }
  d.before = told(before_arrival, fit_problem, d.mismatch.found ? Settle::nothing : Settle::noise, limits);  // a fit that explains nothing deserves no refinement
  e.fit = best.effects.empty() && !described ? d.before : told(best.arrival, after, settled(best), limits);
  d.after = e.fit;
  if (described && best.effects.empty()) d.after = d.before;
  if (described && !best.effects.empty()) {
    FitProblem as_filed = fit_problem;
    as_filed.effects = best.effects;
    Trial trial = prepare(as_filed, baseline, best.effects);
    fit_fully(trial, 6);
    d.after = told(trial.arrival, as_filed, settled(trial), limits);
  }
  d.bic_after = bic_difference(best, baseline) + e.cost + (d.bic_before = d.before.bic());
  for (std::size_t r = 0; r < fit_problem.runs.size(); ++r) {
    for (std::size_t c = 0; c < d.before.runs[r].channels.size(); ++c) {
      const FittedChannel &b = d.before.runs[r].channels[c], &a = e.fit.runs[r].channels[c];
      if (b.name == "alpha") continue;
      d.runs.push_back({fit_problem.runs[r].file, b.name, b.unit, false, false, b.rms_residual, a.rms_residual, std::min(a.noise, b.noise), e.fit.runs[r].aside});
    }
  }
}

/// Whether the search has taken the size of an effect (its first parameter) to zero: another one does its work.
bool is_idle(const JointProblem& joint, const std::string& id) {
  for (const Unknown& u : joint.unknowns())
    if (joint.parameter(u).effect == id) return u.value == 0;
  return false;
}

double probability_of(const std::string& id, const std::vector<Candidate>& ranking) {
  double sum = 0;
  for (const Candidate& c : ranking)
    if (std::find(c.effects.begin(), c.effects.end(), id) != c.effects.end()) sum += c.probability;
  return sum;
}

/// The effects of the best set, with their parameters.
std::vector<MissingEffect> effects_of(const FoundSet& found, const Rig& rig, const Diagnosis& d) {
  const Trial& best = found.best;
  std::vector<MissingEffect> set;
  for (const std::string& id : best.effects) {
    if (is_idle(best.arrival.joint, id)) continue;
    const Effect& e = effect(rig, id);
    MissingEffect m{id, probability_of(id, d.ranking), e.equation, is_law_id(id) ? std::string() : e.source, {}};
    m.kind = e.kind;
    for (const FittedParameter& p : found.fit.parameters)
      if (p.effect == id) m.parameters.push_back(p);
    set.push_back(m);
  }
  return set;
}

/// The sets of `tried` that are as good as the best, each once, in whatever order its effects were found.
void name_equivalent(const FoundSet& found, bool described, const std::vector<Trial>& tried, bool verdict_only, Diagnosis& d) {
  const Trial& best = found.best;
  const auto set_of = [](const Trial& t) { return std::set<std::string>(t.effects.begin(), t.effects.end()); };
  std::set<std::set<std::string>> named;
  if (!described) named.insert(set_of(best));
  for (const Trial& t : tried) {
    const bool other = t.effects.size() <= best.effects.size() + (described ? 1 : 0) && !named.contains(set_of(t));
    if (!other || bic_difference(t, best) - found.cost >= decisive) continue;
    named.insert(set_of(t));
    d.equivalent.push_back(t.effects);
    d.separated_by.push_back(verdict_only ? std::nullopt : separating_recording(best.arrival, t.arrival));
  }
}

/// So short that nothing missing could be seen: "nothing is missing" would be no answer.
void refuse_short_runs(const JointProblem& joint) {
  check_lengths(joint);
  Index observations = 0, variables = 0;
  for (const Unknown& u : joint.unknowns()) variables += u.held ? 0 : 1;
  for (const RunResidual& run : joint.runs()) observations += run.observations(), variables += run.linear_unknowns();
  if (const std::string why = too_few_samples(observations, variables); !why.empty()) throw NoAnswer(why);
}

/// A fit to numbers that are taken for known from here on: the ones that the fit with nothing missing found. Its recordings are those of the files.
void describe_numbers(const DiagnoseProblem& problem, const std::vector<FittedGiven>& numbers, FitResult& fit) {
  if (fit.parameters.empty()) return;
  for (std::size_t r = 0; r < fit.runs.size(); ++r) fit.runs[r].fingerprint = fingerprint(problem.runs[r], problem.rig);
  fit.rig_fingerprint = fingerprint(problem.rig);
  const auto parameters = static_cast<Index>(fit.parameters.size()), count = static_cast<Index>(numbers.size());
  Eigen::VectorXd deviation(parameters);
  for (Index i = 0; i < parameters; ++i) {
    const double error = fit.parameters[static_cast<std::size_t>(i)].std_error;
    deviation[i] = std::isfinite(error) ? error : 0;
  }
  fit.givens = numbers;
  for (FittedGiven& g : fit.givens) g.std_error = 0;
  fit.joint_covariance = Eigen::MatrixXd::Zero(parameters + count, parameters + count);
  fit.joint_covariance.topLeftCorner(parameters, parameters) = deviation.asDiagonal() * fit.correlation * deviation.asDiagonal();
  fit.warnings.push_back("the numbers that state their uncertainty stand at what the fit with nothing missing made of them; standard errors are those with these numbers known");
}

/// BIC of the readings, comparable between noises: -2 ln likelihood with each run's own variance, n ln(variance) - 2 ln(density of the noise where all innovations are 0), plus ln(samples) per variable. The states of a
/// whitening filter are among the variables, as many as its noise has powers.
double bic_in_its_noise(const Trial& trial) {
  double sum = 0, samples = 0;
  for (std::size_t r = 0; r < trial.variance.size(); ++r) {
    const RunResidual& run = trial.arrival.joint.runs()[r];
    double count = 0;
    for (std::size_t c = 0; c < run.channels().size(); ++c) count += static_cast<double>((run.channel_weight(c).array() > 0).count());
    sum += count * std::log(trial.variance[r]) - 2 * run.log_noise_density();
    samples += count;
  }
  return sum + trial.variables * std::log(samples);
}

/// The effects that are to be tried, without those that wander: in white noise such a force takes the colour of those runs in which it acts for its own, and of noise that explains all runs none is left for it.
DiagnoseProblem without_wandering(DiagnoseProblem problem) {
  if (problem.effects.empty())
    for (const Effect& e : effects()) problem.effects.push_back(e.id);
  std::erase_if(problem.effects, [&](const std::string& id) { return effect(problem.rig, id).noise != nullptr; });
  return problem;
}

/// Whether effects in white noise explain all that a fit leaves, and better than noise of a colour does.
bool effects_beat_noise(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& white, const Trial& coloured) {
  const DiagnoseProblem steady = without_wandering(problem);
  if (steady.effects.empty()) return false;
  Selection selection(steady, fit_problem, white);
  selection.hold_against(coloured);
  const Trial best = selection.best_set();
  return !best.effects.empty() && !what_remains(best).found && bic_in_its_noise(best) - bic_in_its_noise(coloured) < -decisive;
}

/// `numbers_known`: what their files state of their uncertainty has been allowed for.
Diagnosis diagnose_in_order(const DiagnoseProblem& problem, bool numbers_known = false);

/// Of a rig or of runs that state uncertainties: with the numbers that fit the runs best, nothing missing, within what is stated. What they explain is not looked for.
Diagnosis diagnose_inexact(const DiagnoseProblem& problem) {
  FitProblem stated;
  stated.rig = problem.rig;
  stated.runs = problem.runs;
  stated.circulation = problem.circulation;
  stated.progress = problem.progress;
  Arrival arrival = arrive(stated, std::make_shared<const AeroelasticModel>(model_of(stated.rig, stated.runs, stated.circulation)));
  InexactRig inexact(stated);
  inexact.search(arrival);
  DiagnoseProblem at = problem;
  at.rig = inexact.rig();
  at.runs = inexact.runs();
  at.rig.givens = nullptr;
  for (Run& run : at.runs) run.givens = nullptr;
  const std::vector<FittedGiven> numbers = inexact.numbers();
  Diagnosis d = diagnose_in_order(at, true);
  for (FitResult* fit : {&d.before, &d.after}) describe_numbers(problem, numbers, *fit);
  return d;
}

/// The candidate among all others, in words and with what it does to the load.
MissingEffect missing_description(const RigDescription& description, const FoundSet& found, const FitProblem& fit_problem, const Diagnosis& d) {
  MissingEffect m = description.as_missing();
  m.probability = probability_of(m.effect, d.ranking);
  if (const double change = found.fit.parameters.empty() ? 0 : change_of_load(fit_problem, d.before, *description.problem, found.fit); change != 0)
    m.advice += fmt::format(". With them the loads at the ends of the steps are {:+.2g} % off those of the rig as the file has it", change);
  return m;
}

/// The exact model of a trial, against what was tried before laws.
std::unique_ptr<ExactModel> held_against(const HiddenLaw& hidden, const FitProblem& files, const Trial& base, const Selection& selection, const FoundSet& found) {
  auto exact = std::make_unique<ExactModel>(hidden, files, base);
  for (const Trial& t : selection.tried()) exact->hold_against(t);
  exact->hold_against(found.best);
  return exact;
}

Diagnosis diagnose_in_order(const DiagnoseProblem& problem, bool numbers_known) {
  if (!numbers_known && states_errors(problem.rig, problem.runs)) return diagnose_inexact(problem);
  const auto begin = std::chrono::steady_clock::now();
  SearchLimits limits(problem);
  const auto tell = [&](const std::string& what) {
    if (problem.progress) problem.progress(what);
  };
  FitProblem fit_problem;
  fit_problem.rig = problem.rig;
  fit_problem.runs = problem.runs;
  fit_problem.circulation = problem.circulation;

  tell("fitting the rig with nothing missing");
  Trial baseline = fit_baseline(fit_problem);
  refuse_short_runs(baseline.arrival.joint);
  Diagnosis d;
  d.mismatch = locate_mismatch(baseline.arrival.joint);
  Trial in_colour = baseline;
  const bool noise_explains = d.mismatch.found && explained_by_noise(in_colour);
  bool coloured = noise_explains;
  if (coloured) {
    tell("noise of a colour explains what is left; asking whether effects explain it better");
    limits.spend([&] { coloured = !effects_beat_noise(problem, fit_problem, baseline, in_colour); });
  }
  if (coloured) baseline = std::move(in_colour);
  if (coloured || (d.mismatch.found && !noise_explains && in_noise_of_most(baseline))) d.mismatch = locate_mismatch(baseline.arrival.joint);
  std::optional<RigDescription> description;
  // What is far from explained by a step in the rig's numbers is asked about last.
  const double above_noise = std::max(nearly_explained, baseline.reduced_chi2()) - 1, far_away = 1 - (nearly_explained - 1) / above_noise;
  if (d.mismatch.found && !numbers_known) limits.spend([&] { description = describe_rig(problem, baseline, std::max(half_of_it, far_away)); });
  // Numbers that were asked for in noise of a colour: that is the baseline's from then on.
  const auto take_noise_of_description = [&] {
    if (!description || !description->from) return false;
    baseline = *std::exchange(description->from, std::nullopt);
    d.mismatch = locate_mismatch(baseline.arrival.joint);
    return true;
  };
  if (description && description->from)  // noise of a colour is the answer where effects have no better one
    limits.spend([&] {
      if (effects_beat_noise(problem, fit_problem, baseline, *description->from)) description.reset();
    });
  coloured |= take_noise_of_description();
  const bool described_already = description && description->left < explained && !what_remains(description->trial).found;
  // What a set leaves may be noise that is not white, in which all is to be held against each other anew, or the rig's description.
  const Setting files{&fit_problem, &problem.heldout};
  auto selection = std::make_unique<Selection>(problem, fit_problem, baseline);
  if (described_already) selection->hold_against(description->trial);
  bool anew = false, asked = numbers_known;
  std::optional<FoundSet> beside;  // the rig's description and laws
  std::optional<Trial> begun;      // where the search among all effects goes on from
  DescriptionBeside described_beside(problem);
  const auto begin_anew = [&](Trial in_its_noise) {
    Trial same = baseline;
    take_noise_of(same, in_its_noise);
    baseline = std::move(same);
    begun = std::move(in_its_noise);
    described_beside.forget();
    coloured = anew = true;
  };
  const auto noise_or_rig = [&](const Trial& set) {
    if (Trial there = set; !coloured && explained_by_noise(there)) {
      begin_anew(std::move(there));
      return true;
    }
    if (asked || described_already) return false;
    std::optional<RigDescription> rig = described_beside.explains(set);
    if (!rig) return false;
    if (rig->from) {
      begin_anew(std::move(*rig->from));
      return true;
    }
    asked = true;
    FoundSet with = laws_beside(*rig, problem, files, baseline, *selection, &set);
    if (!with.explains()) return false;
    description = rig;
    with.setting = {description->problem.get(), &description->heldout};
    beside = std::move(with);
    return true;
  };
  Trial best_set = baseline;
  // A law shows in what it promises to first order, in seconds: where one leaves nothing, no set of effects is looked for.
  const bool may_find_laws = problem.laws && problem.effects.empty() && d.mismatch.found;
  std::vector<Trial> laws_tried;
  bool asked_forms = false;
  std::optional<Laws> laws;
  FoundSet found = look_at(problem, files, baseline, files, baseline, 0);
  const LawSearch::Asked is_no_law = [&](const Trial& set) {
    Trial there = set;
    return explained_by_noise(there) || (!asked && !described_already && set.reduced_chi2() < nearly_explained && described_beside.explains(set));
  };
  if (may_find_laws && !described_already)
    limits.spend([&] {
      tell("looking for a law in the force that is missing");
      LawsTried searched = search_laws(fit_problem, baseline, baseline, LawSearch::Among::laws_and_forms, is_no_law, *selection);
      laws_tried = std::move(searched.tried);
      asked_forms = searched.forms;
      if (none_leaves_nothing(laws_tried) && !laws_tried.empty() && !coloured)
        if (Trial in_its_noise = laws_tried.front(); explained_by_noise(in_its_noise)) {  // all is held against each other anew
          take_noise_of(baseline, in_its_noise);
          coloured = true;
          d.mismatch = locate_mismatch(baseline.arrival.joint);
          selection = std::make_unique<Selection>(problem, fit_problem, baseline);
          found = look_at(problem, files, baseline, files, baseline, 0);
          laws_tried = in_noise_of(in_its_noise, laws_tried, baseline, *selection);
        }
      if (none_leaves_nothing(laws_tried)) return;
      laws = choose_law(problem, fit_problem, files, baseline, laws_tried, *selection, found);
      if (!laws) return;
      // No effect but laws was fitted so far: one with fewer parameters may take as much.
      Trial better = selection->challenged(found.best);
      if (same_set(better.effects, found.best.effects)) return;
      laws.reset();
      found = look_at(problem, files, baseline, files, baseline, 0);
      laws_tried.insert(laws_tried.begin(), std::move(better));
    });
  if (!laws) fit_problem.rig.laws.clear();
  // Laws of the list that take most of the mismatch are where the search among all effects goes on from.
  const auto is_begun = [&](const Trial& t) { return std::none_of(t.effects.begin(), t.effects.end(), is_law_id) && t.excess() < half_of_it * baseline.excess() && bic_difference(t, baseline) < -decisive; };
  if (const auto first = std::find_if(laws_tried.begin(), laws_tried.end(), is_begun); first != laws_tried.end()) best_set = *first, begun = *first;
  if (!laws) limits.spend([&] { best_set = selection->best_set(noise_or_rig, begun ? &*begun : nullptr); });
  if (anew) {
    tell("trying what may be missing, in noise of the colour that is left");
    d.mismatch = locate_mismatch(baseline.arrival.joint);
    selection = std::make_unique<Selection>(problem, fit_problem, baseline);
    best_set = baseline;
    limits.spend([&] { best_set = selection->best_set(noise_or_rig, &*begun); });
  }
  if (!problem.verdict_only) d.maps = residual_maps(baseline.arrival.joint, d.mismatch.runs);
  if (!laws) found = look_at(problem, files, baseline, files, std::move(best_set), 0);
  if (d.mismatch.found && !numbers_known && !description && !found.explains()) limits.spend([&] { description = describe_rig(problem, baseline); });
  if (take_noise_of_description()) {
    selection = std::make_unique<Selection>(problem, fit_problem, baseline);
    found = look_at(problem, files, baseline, files, baseline, 0);
  }
  const bool described = description && weigh_description(problem, files, baseline, *description, std::move(beside), *selection, limits, found);
  if (described && laws) {
    laws.reset();
    fit_problem.rig.laws.clear();
  }
  std::unique_ptr<ExactModel> exact;
  if (problem.hidden) exact = held_against(*problem.hidden, described ? *description->problem : fit_problem, described ? description->trial : baseline, *selection, found);
  const bool one_law = found.best.effects.size() == 1 && brings_a_law(found.best);  // forms may be its rivals
  if (may_find_laws && !laws && !described && (!found.explains() || one_law))
    limits.spend([&] {
      tell("looking for the law of what is missing");
      const auto add_beside = [&](const Trial& base) {
        for (Trial& t : search_laws(fit_problem, baseline, base, LawSearch::Among::forms, is_no_law, *selection).tried) laws_tried.push_back(std::move(t));
      };
      // Forms were held against laws of the list before, and are looked for beside what takes most of the mismatch below.
      if (!asked_forms && (one_law || found.best.excess() > half_of_it * baseline.excess())) add_beside(baseline);
      const bool beside_it = begun && same_set(begun->effects, found.best.effects);  // laws were looked for before
      if (!found.best.effects.empty() && !beside_it && !found.explains()) add_beside(found.best);
      laws = choose_law(problem, fit_problem, files, baseline, laws_tried, *selection, found);
    });
  for (const Trial& t : laws_tried)
    if (exact) exact->hold_against(t);
  if (limits.are_reached() && !laws) fit_problem.rig.laws.clear();  // a search that was stopped leaves its forms there
  const Trial& best = found.best;
  if (exact) d.truth = exact->told(*found.setting.heldout);
  d.ranking = selection->ranking();
  d.remaining = found.remaining;
  d.unexplained = d.mismatch.found && !found.explains();

  if (d.unexplained)
    for (const Candidate& c : d.ranking)
      if (c.search == SearchOutcome::failed) d.not_followed.push_back(c.effects);

  if (!problem.verdict_only) {
    tell("describing the result");
    describe(fit_problem, baseline, limits, found, d);
    for (const ImprovedRun& run : found.unseen) d.runs.push_back(run);
    if (d.unexplained) d.missing_force = missing_forces(best.arrival.joint);
  }
  if (!d.not_followed.empty()) d.search = SearchOutcome::failed;
  if (!described && !best.effects.empty()) d.naming = naming_of(best, baseline, found.clean(), found.predicts);
  if ((described || !best.effects.empty()) && d.naming == Naming::named) {
    name_equivalent(found, described, selection->tried(), problem.verdict_only, d);
    std::vector<std::vector<std::string>> unrefuted = d.equivalent;
    if (laws)
      for (const Rival& r : laws->rivals) unrefuted.push_back(r.effects);
    unrefuted.push_back(best.effects);
    if (described) unrefuted.back().push_back(rig_description_id);
    leave_out_what_explains_nothing(unrefuted.back(), unrefuted, d.ranking);
  }
  if (described) d.missing.push_back(missing_description(*description, found, fit_problem, d));
  if (!best.effects.empty()) {
    if (d.naming != Naming::named) d.removed_by_closest = 1 - best.excess() / baseline.excess();
    std::vector<MissingEffect>& set = d.naming == Naming::named ? d.missing : d.closest;
    for (MissingEffect& m : effects_of(found, fit_problem.rig, d)) set.push_back(std::move(m));
    if (laws && !problem.verdict_only) tell_laws(fit_problem, *laws, found, set, d);
  }
  const double right = share_of_right(d);
  for (MissingEffect& m : d.missing) m.probability *= right;
  d.explanations = explanations_of(d);
  d.stopped = limits.are_reached();
  d.work = limits.work();
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return d;
}

}  // namespace

Diagnosis diagnose(const DiagnoseProblem& problem) {
  const std::vector<std::size_t> order = order_of_search(problem.runs);
  if (is_as_given(order)) return diagnose_in_order(problem);
  DiagnoseProblem ordered = problem;
  ordered.runs = in_order(problem.runs, order);
  Diagnosis d = diagnose_in_order(ordered);
  tell_as_given(GivenOrder(problem.runs), problem.runs.size(), d);
  return d;
}

}  // namespace unrig
