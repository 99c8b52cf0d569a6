#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fit/diagnose/diagnose.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// What a fit leaves (locate_mismatch); of decays that are set aside, what laws leave of them that are trusted to within some per cent.
Mismatch what_remains(const Trial& trial);

/// Whether noise of a colour, at rest, explains all that a fit leaves; if so, the fit is in that noise from then on.
bool explained_by_noise(Trial& trial);

/// Whether white noise explains none of the runs and noise of a colour, found at rest, at least half of them: the gauge's, beside which something remains in the others. If so, the fit is in that noise from then on.
bool in_noise_of_most(Trial& trial);

/// Whether two sets have the same effects, in whichever order.
bool same_set(std::vector<std::string> a, std::vector<std::string> b);

/// How the search ended for a set with one effect more than `base`. An effect without parameters (all the modes of the rig) cannot be taken to nothing: it may leave more.
SearchOutcome search_of(const Trial& trial, const Trial& base);

/// Which set of effects explains what a baseline leaves. The set grows by one effect at a time, the best of all that are worth a fit; what others made superfluous
/// is taken away again, and each member is challenged by what was not fitted in its place. No set has more than three.
class Selection {
 public:
  /// Looks at all three as long as it lives.
  Selection(const DiagnoseProblem& problem, const FitProblem& fit_problem, const Trial& baseline);

  /// `baseline` itself where no mismatch is found or no effect is worth it. It ends, too, with a set that leaves something where `enough` says so. `begun`: a set that was found elsewhere, from which it goes on.
  Trial best_set(const std::function<bool(const Trial&)>& enough = {}, const Trial* begun = nullptr);

  /// Of effects without a law, which are fitted in a tenth to a hundredth of the work, the one that leaves nothing by itself, or something that `enough` says is explained.
  /// `promising`: of those that promise a quarter of the most to first order, otherwise of the others.
  std::optional<Trial> explained_without_a_law(const std::function<bool(const Trial&)>& enough, bool promising);

  /// `other` explains everything without an effect: a law that promises less than half of what it takes beyond a set, or a signal that promises less than a quarter, does not come out ahead beside that, and is not fitted.
  void hold_against(const Trial& other) { held_against_ = other.variance; }

  /// The baseline with those signals at frequencies that are known beforehand (Effect::bands) whose lines stand out; none where there are none.
  std::optional<Trial> with_known_lines() const;

  /// `best`, or what explains the runs better with another effect of the list in place of a member: each is challenged by those that were not fitted and promise half of what it takes.
  Trial challenged(Trial best);

  /// Effects that can act in these runs as one linear step from the baseline has them, each by itself.
  const std::vector<Trial>& screened_alone();

  /// Whether the search ended because its time was up (core/numerics/time_limit.h), which is lifted then.
  bool stopped() const { return stopped_; }
  /// Sets that were fitted in rounds from which the search went on.
  const std::vector<Trial>& tried() const { return tried_; }
  /// A set that was tried elsewhere.
  void add(Candidate candidate) { ranking_.push_back(std::move(candidate)); }
  /// All sets that were fitted and the baseline, each once as it was fitted best, the best first.
  std::vector<Candidate> ranking() const;

 private:
  Trial settled(Trial trial);
  void grow(Trial& best, const std::function<bool(const Trial&)>& enough, std::optional<Trial>& sufficient);
  void stop();
  std::vector<std::string> known_lines(const Trial& of) const;
  void take_known_lines(Trial& best);
  /// Whether nothing has been found beside them.
  bool is_first(const Trial& base) const { return base.effects.size() == lines_.size(); }
  std::vector<std::string> candidates(const std::vector<std::string>& at_work, const std::vector<std::string>& hopeless) const;
  std::vector<Trial> try_one_more(const Trial& base, const std::vector<std::string>& hopeless);
  Trial without_superfluous(Trial trial);
  void try_with_all_modes(std::vector<Trial>& tried);
  std::vector<Trial> rivals(const Trial& best, const std::string& member);
  bool is_fitted(const std::vector<std::string>& set) const;
  double taken_beyond(const Trial& base) const;
  bool takes_too_little(const Trial& screened, const Trial& base) const;
  void tell(const std::string& what) const {
    if (problem_.progress) problem_.progress(what);
  }

  const DiagnoseProblem& problem_;
  const FitProblem& fit_problem_;
  const Trial& baseline_;
  std::vector<Trial> tried_, screened_;
  std::vector<Candidate> ranking_;
  std::vector<std::string> lines_;  // signals at frequencies known beforehand that were taken out first
  bool stopped_ = false;
  std::vector<double> held_against_;  // per run: what that leaves
};

/// Probabilities of a ranking (the best first) once `named` is the answer: a set of lower BIC that is neither named nor `unrefuted` leaves something or predicts worse, and so explains nothing.
void leave_out_what_explains_nothing(const std::vector<std::string>& named, const std::vector<std::vector<std::string>>& unrefuted, std::vector<Candidate>& ranking);

}  // namespace unrig
