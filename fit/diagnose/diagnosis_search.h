#pragma once
#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "fit/diagnose/description_beside.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/exact_model.h"
#include "fit/diagnose/explanation.h"
#include "fit/diagnose/law_answer.h"
#include "fit/diagnose/rig_description.h"
#include "fit/diagnose/search_limits.h"
#include "fit/diagnose/selection.h"
#include "fit/givens/number_parameters.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// Which physics was left out: the steps of a diagnosis (diagnose), each called once, in the order in which they stand here. Each goes on from what those before it have found, and does nothing where nothing is left to
/// be found.
class DiagnosisSearch {
 public:
  /// The best fit with nothing missing; numbers of the files that state an uncertainty are parameters of it and of every other. Looks at the problem as long as it lives. Throws NoAnswer where the runs are too short for any.
  explicit DiagnosisSearch(const DiagnoseProblem& problem);
  DiagnosisSearch(const DiagnosisSearch&) = delete;
  DiagnosisSearch& operator=(const DiagnosisSearch&) = delete;

  /// The levels of white noise, without lines of mains.
  void settle_noise();
  /// Noise of a colour: whether it explains the mismatch, and better than effects in white noise do.
  void ask_about_noise();
  /// The numbers of the files, where a step in them promises to explain the mismatch.
  void ask_about_description();
  /// Effects without a law, where the mismatch is too large for a law to explain it as well.
  void try_without_a_law();
  /// A law that shows in the force on the states. Where one leaves nothing, no set of effects is looked for.
  void look_for_a_law();
  /// The set of effects that explains the runs, from the laws that take most of the mismatch on; in the noise of a colour that a set leaves all over again.
  void look_for_effects();
  /// The numbers of the files against these.
  void weigh_description();
  /// The law of what remains, or of which the one that was found may be the stand-in.
  void look_for_the_law_of_what_remains();
  /// The answer.
  Diagnosis told();

 private:
  void tell(const char* what) const {
    if (problem_.progress) problem_.progress(what);
  }
  Setting files() const { return {&fit_problem_, &files_.heldout}; }
  void begin_selection();
  bool take_noise_of_description();
  void begin_anew_in_noise_of(Trial set);
  bool noise_or_rig_explain(const Trial& set);
  bool is_no_law(const Trial& set);
  bool begin_without_a_law(bool promising);
  void hold_laws_in_the_noise_they_leave();
  void keep_law_unless_challenged();
  void look_for_forms_beside(const Trial& base, LawSearch::Known known);
  void tell_missing(Diagnosis& d);

  const DiagnoseProblem& problem_;
  const bool numbers_stated_, may_find_laws_;
  const std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  SearchLimits limits_;
  FilesToFit files_;
  FitProblem& fit_problem_ = files_.problem;
  Trial baseline_;
  Mismatch mismatch_;
  bool in_colour_ = false;             // noise of a colour was taken for the baseline's
  bool begun_anew_ = false;            // that of what a set leaves
  std::optional<RigDescription> description_;
  bool description_explains_ = false;  // with nothing beside it
  bool asked_beside_ = false;          // the description beside a set that it explains
  DescriptionBeside description_beside_;
  std::optional<FoundSet> beside_description_;  // the effects there
  std::unique_ptr<Selection> selection_;
  std::optional<Trial> begun_;  // where the search among all effects goes on from
  FoundSet found_;
  bool described_ = false;  // what was found is of the numbers put right
  std::vector<Trial> laws_tried_;
  bool asked_forms_ = false;
  std::optional<Laws> laws_;
  std::unique_ptr<ExactModel> exact_;  // of a trial
};

}  // namespace unrig
