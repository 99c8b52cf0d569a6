#include "fit/diagnose/diagnosis_search.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "fit/diagnose/diagnosis_description.h"
#include "fit/diagnose/reliability.h"
#include "fit/fit_description.h"
#include "fit/givens/stated_numbers.h"
#include "fit/search/decays_first.h"
#include "fit/search/noise_of_trial.h"

namespace unrig {
namespace {

using Eigen::Index;

/// So short that nothing missing could be seen: "nothing is missing" would be no answer.
void refuse_short_runs(const JointProblem& joint) {
  check_lengths(joint);
  Index observations = 0, variables = 0;
  for (const Unknown& u : joint.unknowns()) variables += u.held ? 0 : 1;
  for (const RunResidual& run : joint.runs()) observations += run.observations(), variables += run.linear_unknowns();
  if (const std::string why = too_few_samples(observations, variables); !why.empty()) throw NoAnswer(why);
}

FilesToFit files_to_fit(const DiagnoseProblem& problem) {
  FitProblem files;
  files.rig = problem.rig;
  files.runs = problem.runs;
  files.circulation = problem.circulation;
  if (!states_errors(problem.rig, problem.runs)) return {std::move(files), problem.heldout, {}};
  if (problem.progress) problem.progress("looking at the stated uncertainties");
  return with_numbers_as_parameters(files, problem.heldout, fit_baseline(files).arrival);
}

Trial fit_with_nothing_missing(const DiagnoseProblem& problem, const FitProblem& files) {
  if (problem.progress) problem.progress("fitting the rig with nothing missing");
  Trial baseline = fit_baseline(files);
  refuse_short_runs(baseline.arrival.joint);
  return baseline;
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

/// The exact model of a trial, against what was tried before laws.
std::unique_ptr<ExactModel> held_against(const HiddenLaw& hidden, const FitProblem& files, const Trial& base, const Selection& selection, const FoundSet& found) {
  auto exact = std::make_unique<ExactModel>(hidden, files, base);
  for (const Trial& t : selection.tried()) exact->hold_against(t);
  exact->hold_against(found.best);
  return exact;
}

}  // namespace

DiagnosisSearch::DiagnosisSearch(const DiagnoseProblem& problem)
    : problem_(problem),
      numbers_stated_(states_errors(problem.rig, problem.runs)),
      may_find_laws_(problem.laws && problem.effects.empty()),
      limits_(problem),
      files_(files_to_fit(problem)),
      baseline_(fit_with_nothing_missing(problem, fit_problem_)),
      mismatch_(locate_mismatch(baseline_.arrival.joint)),
      asked_beside_(numbers_stated_),
      description_beside_(problem),
      found_{files(), baseline_, 0, {}, {}, false} {}

/// All is held against the baseline as it is by now.
void DiagnosisSearch::begin_selection() {
  mismatch_ = locate_mismatch(baseline_.arrival.joint);
  selection_ = std::make_unique<Selection>(problem_, fit_problem_, baseline_);
  found_ = look_at(problem_, files(), baseline_, files(), baseline_, 0);
}

void DiagnosisSearch::settle_noise() {
  limits_.spend([&] {
    if (std::optional<Trial> with = Selection(problem_, fit_problem_, baseline_).with_known_lines()) take_levels_of(baseline_, std::move(*with));
  });
  mismatch_ = locate_mismatch(baseline_.arrival.joint);
}

void DiagnosisSearch::ask_about_noise() {
  if (!mismatch_.found) return;
  if (Trial coloured = baseline_; explained_by_noise(coloured)) {
    tell("noise of a colour explains what is left; asking whether effects explain it better");
    in_colour_ = true;
    limits_.spend([&] { in_colour_ = !effects_beat_noise(problem_, fit_problem_, baseline_, coloured); });
    if (in_colour_) baseline_ = std::move(coloured);
  } else {
    in_noise_of_most(baseline_);
  }
  mismatch_ = locate_mismatch(baseline_.arrival.joint);
}

/// What is far from explained by a step in the numbers is asked about last (weigh_description).
void DiagnosisSearch::ask_about_description() {
  const double above_noise = std::max(nearly_explained, baseline_.reduced_chi2()) - 1, far_away = 1 - (nearly_explained - 1) / above_noise;
  if (mismatch_.found && !numbers_stated_) limits_.spend([&] { description_ = describe_rig(problem_, baseline_, std::max(half_of_it, far_away)); });
  if (description_ && description_->from)  // noise of a colour is the answer where effects have no better one
    limits_.spend([&] {
      if (effects_beat_noise(problem_, fit_problem_, baseline_, *description_->from)) description_.reset();
    });
  if (take_noise_of_description()) in_colour_ = true;
  description_explains_ = description_ && description_->left < explained && !what_remains(description_->trial).found;
  begin_selection();
  if (description_explains_) selection_->hold_against(description_->trial);
}

/// Numbers that were asked for in noise of a colour: that is the baseline's from then on.
bool DiagnosisSearch::take_noise_of_description() {
  if (!description_ || !description_->from) return false;
  baseline_ = *std::exchange(description_->from, std::nullopt);
  return true;
}

/// Whether what a set leaves is explained by noise of a colour, in which all is to be held against each other anew, or by the rig's description beside it.
bool DiagnosisSearch::noise_or_rig_explain(const Trial& set) {
  if (Trial there = set; !in_colour_ && explained_by_noise(there)) {
    begin_anew_in_noise_of(std::move(there));
    return true;
  }
  if (asked_beside_ || description_explains_) return false;
  std::optional<RigDescription> rig = description_beside_.explains(set);
  if (!rig) return false;
  if (rig->from) {
    begin_anew_in_noise_of(std::move(*rig->from));
    return true;
  }
  asked_beside_ = true;
  FoundSet with = laws_beside(*rig, problem_, files(), baseline_, *selection_, &set);
  if (!with.explains()) return false;
  description_ = rig;
  with.setting = description_->setting();
  beside_description_ = std::move(with);
  return true;
}

void DiagnosisSearch::begin_anew_in_noise_of(Trial set) {
  Trial same = baseline_;
  take_noise_of(same, set);
  baseline_ = std::move(same);
  begun_ = std::move(set);
  description_beside_.forget();
  in_colour_ = begun_anew_ = true;
}

/// Whether noise of a colour explains what a law leaves, or the rig's description.
bool DiagnosisSearch::is_no_law(const Trial& set) {
  Trial there = set;
  return explained_by_noise(there) || (!asked_beside_ && !description_explains_ && set.reduced_chi2() < nearly_explained && description_beside_.explains(set));
}

/// Whether an effect without a law explains the runs, from which the search for effects begins then. `promising`: one that promises much to first order, or another.
bool DiagnosisSearch::begin_without_a_law(bool promising) {
  std::optional<Trial> found = selection_->explained_without_a_law([&](const Trial& set) { return noise_or_rig_explain(set); }, promising);
  if (!begun_) begun_ = std::move(found);  // else in the noise of a colour that it leaves
  return begun_.has_value();
}

/// A mismatch is too large for a law to explain it too where another effect does.
void DiagnosisSearch::try_without_a_law() {
  if (mismatch_.found && !description_explains_ && baseline_.reduced_chi2() > nearly_explained)
    limits_.spend([&] { begin_without_a_law(true); });
}

void DiagnosisSearch::look_for_a_law() {
  if (may_find_laws_ && mismatch_.found && !description_explains_ && !begun_)
    limits_.spend([&] {
      tell("looking for a law in the force that is missing");
      // Far from the truth a step tells little of a filter or of further modes.
      const auto otherwise = [&] { return baseline_.reduced_chi2() > nearly_explained && begin_without_a_law(false); };
      LawsTried searched = search_laws(fit_problem_, baseline_, baseline_, LawSearch::Among::laws_and_forms, [&](const Trial& set) { return is_no_law(set); }, *selection_, {{}, {}, otherwise});
      laws_tried_ = std::move(searched.tried);
      asked_forms_ = searched.forms;
      if (begun_anew_) laws_tried_.clear();  // held against each other in another noise
      if (begun_) return;
      hold_laws_in_the_noise_they_leave();
      if (!none_leaves_nothing(laws_tried_)) keep_law_unless_challenged();
    });
  if (!laws_) fit_problem_.rig.laws.clear();
}

/// Where noise of a colour is what the best of them leaves all are held against each other in it.
void DiagnosisSearch::hold_laws_in_the_noise_they_leave() {
  if (!none_leaves_nothing(laws_tried_) || laws_tried_.empty() || in_colour_) return;
  Trial best = laws_tried_.front();
  if (!explained_by_noise(best)) return;
  take_noise_of(baseline_, best);
  in_colour_ = true;
  begin_selection();
  laws_tried_ = in_noise_of(best, laws_tried_, baseline_, *selection_);
}

/// No effect but laws was fitted so far: one with fewer parameters may take as much.
void DiagnosisSearch::keep_law_unless_challenged() {
  laws_ = choose_law(problem_, fit_problem_, files(), baseline_, laws_tried_, *selection_, found_);
  if (!laws_) return;
  Trial better = selection_->challenged(found_.best);
  if (same_set(better.effects, found_.best.effects)) return;
  laws_.reset();
  found_ = look_at(problem_, files(), baseline_, files(), baseline_, 0);
  laws_tried_.insert(laws_tried_.begin(), std::move(better));
}

void DiagnosisSearch::look_for_effects() {
  if (laws_) return;
  // Laws of the list that take most of the mismatch.
  const auto takes_most = [&](const Trial& t) { return std::none_of(t.effects.begin(), t.effects.end(), is_law_id) && t.excess() < half_of_it * baseline_.excess() && bic_difference(t, baseline_) < -decisive; };
  if (const auto first = std::find_if(laws_tried_.begin(), laws_tried_.end(), takes_most); !begun_ && first != laws_tried_.end()) begun_ = *first;
  const auto enough = [&](const Trial& set) { return beside_description_ || noise_or_rig_explain(set); };
  Trial best = begun_ ? *begun_ : baseline_;
  limits_.spend([&] { best = selection_->best_set(enough, begun_ ? &*begun_ : nullptr); });
  if (begun_anew_) {
    tell("trying what may be missing, in noise of the colour that is left");
    begin_selection();
    best = baseline_;
    limits_.spend([&] { best = selection_->best_set(enough, &*begun_); });
  }
  found_ = look_at(problem_, files(), baseline_, files(), std::move(best), 0);
}

void DiagnosisSearch::weigh_description() {
  if (mismatch_.found && !numbers_stated_ && !description_ && !found_.explains()) limits_.spend([&] { description_ = describe_rig(problem_, baseline_); });
  if (take_noise_of_description()) begin_selection();
  described_ = description_ && unrig::weigh_description(problem_, files(), baseline_, *description_, std::move(beside_description_), *selection_, limits_, found_);
  if (described_ && laws_) {
    laws_.reset();
    fit_problem_.rig.laws.clear();
  }
  if (problem_.hidden) exact_ = held_against(*problem_.hidden, described_ ? *description_->problem : fit_problem_, described_ ? description_->trial : baseline_, *selection_, found_);
}

void DiagnosisSearch::look_for_forms_beside(const Trial& base, LawSearch::Known known) {
  for (Trial& t : search_laws(fit_problem_, baseline_, base, LawSearch::Among::forms, [&](const Trial& set) { return is_no_law(set); }, *selection_, std::move(known)).tried) laws_tried_.push_back(std::move(t));
}

void DiagnosisSearch::look_for_the_law_of_what_remains() {
  const bool one_law = found_.best.effects.size() == 1 && brings_a_law(found_.best);  // forms may be its rivals
  if (may_find_laws_ && mismatch_.found && !laws_ && !described_ && (!found_.explains() || one_law))
    limits_.spend([&] {
      tell("looking for the law of what is missing");
      // Forms were held against laws of the list before, and are looked for beside what takes most of the mismatch below.
      if (!asked_forms_ && (one_law || found_.best.excess() > half_of_it * baseline_.excess())) look_for_forms_beside(baseline_, one_law && !none_leaves_nothing({found_.best}) ? LawSearch::Known{{}, {found_.best}, {}} : LawSearch::Known());
      const bool were_looked_for = begun_ && same_set(begun_->effects, found_.best.effects);
      if (!found_.best.effects.empty() && !were_looked_for && !found_.explains()) look_for_forms_beside(found_.best, {});
      laws_ = choose_law(problem_, fit_problem_, files(), baseline_, laws_tried_, *selection_, found_);
    });
  if (!laws_) fit_problem_.rig.laws.clear();  // a search that was stopped leaves its forms there
  if (!exact_) return;
  for (const Trial& t : laws_tried_) exact_->hold_against(t);
}

/// What is named, or comes closest.
void DiagnosisSearch::tell_missing(Diagnosis& d) {
  const Trial& best = found_.best;
  if (!described_ && !best.effects.empty()) d.naming = naming_of(best, baseline_, found_.clean(), found_.predicts);
  if ((described_ || !best.effects.empty()) && d.naming == Naming::named) {
    tell_equivalent(found_, described_, selection_->tried(), problem_.verdict_only, d);
    std::vector<std::vector<std::string>> unrefuted = d.equivalent;
    if (laws_)
      for (const Rival& r : laws_->rivals) unrefuted.push_back(r.effects);
    unrefuted.push_back(best.effects);
    if (described_) unrefuted.back().push_back(rig_description_id);
    leave_out_what_explains_nothing(unrefuted.back(), unrefuted, d.ranking);
  }
  if (described_) d.missing.push_back(missing_description(*description_, found_, fit_problem_, d));
  if (best.effects.empty()) return;
  if (d.naming != Naming::named) d.removed_by_closest = 1 - best.excess() / baseline_.excess();
  std::vector<MissingEffect>& set = d.naming == Naming::named ? d.missing : d.closest;
  for (MissingEffect& m : effects_of(found_, fit_problem_.rig, d)) set.push_back(std::move(m));
  if (laws_ && !problem_.verdict_only) tell_laws(fit_problem_, *laws_, found_, set, d);
}

Diagnosis DiagnosisSearch::told() {
  Diagnosis d;
  d.mismatch = mismatch_;
  if (exact_) d.truth = exact_->told(*found_.setting.heldout);
  d.ranking = selection_->ranking();
  d.remaining = found_.remaining;
  d.unexplained = mismatch_.found && !found_.explains();
  if (d.unexplained)
    for (const Candidate& c : d.ranking)
      if (c.search == SearchOutcome::failed) d.not_followed.push_back(c.effects);
  if (!problem_.verdict_only) {
    tell("describing the result");
    d.maps = residual_maps(baseline_.arrival.joint, mismatch_.runs);
    describe(problem_, files_, baseline_, limits_, found_, d);
    for (const ImprovedRun& run : found_.unseen) d.runs.push_back(run);
    if (d.unexplained) d.missing_force = missing_forces(found_.best.arrival.joint);
  } else if (!found_.best.effects.empty()) {
    tell_fit(problem_, files_, limits_, found_);
  }
  if (!d.not_followed.empty()) d.search = SearchOutcome::failed;
  tell_missing(d);
  const double right = share_of_right(d);
  for (MissingEffect& m : d.missing) m.probability *= right;
  d.explanations = explanations_of(d);
  d.stopped = limits_.are_reached();
  d.work = limits_.work();
  d.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
  return d;
}

}  // namespace unrig
