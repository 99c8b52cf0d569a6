#pragma once
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "fit/laws/dictionary.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// The law of a force that no effect on the list explains.
///
/// 1. Every form of the dictionary, its force sent through the rig onto the readings beside all unknowns of the fit (Screening): the share of chi-square that it promises to first order. At several shapes where the first
///    promises something.
/// 2. The coefficients of those that promise most, and where they are seen decisively the shapes, from states that the free decays ask for beside unknown accelerations (beside_unknown_forces, screen).
/// 3. These are fitted with all their parameters free: to the free decays first, then to all runs unless they leave more than ten times its noise of the decays; runs that are driven from first guesses. All are held against
///    each other by BIC.
/// 4. Where the best leaves something that is no noise of a colour and that the rig's description does not explain, a second law is looked for beside it, of the list first, then of the dictionary, and what that makes
///    superfluous is taken away.
///
/// Before anything else was tried (Among::laws_and_forms) laws are looked for where one of them promises most of all effects, signals included, to first order, and only what promises half as much: laws of the list, then
/// forms, which are their rivals; no forms where a signal promises to leave nothing.
///
/// Where no law of the list takes all but a few per cent of it, and the decays show it, a curve of the state is looked for (curve_of_state.h), formulas and laws of the list are asked for anew along the states that go with it,
/// and all these are followed. What others know to explain the runs (Known) has only rivals: no curve is asked for, and no second law.
///
/// Where more than ten times the noise is left a step to first order says little. If the decays show the mismatch, laws and forms are then asked for by evidence: their forces along the states that the decays ask for, regressed on the
/// innovations of a filter for which the force is unknown (screen). Laws of the list come first, each from where the regression has it, then the two with most evidence together.
///
/// Source: M. Alvarez, D. Luengo and N. Lawrence, Latent force models, AISTATS (2009); S. L. Brunton, J. L. Proctor and J. N. Kutz, PNAS 113 (2016) 3932, whose candidates are regressed on derivatives, here on readings.
class LawSearch {
 public:
  /// Which are fitted: those of the dictionary, or laws of the list too.
  enum class Among { forms, laws_and_forms };

  using Asked = std::function<bool(const Trial&)>;
  /// What others have found before.
  struct Known {
    std::vector<Trial> screened;  ///< effects of the list beside the base, each by itself
    std::vector<Trial> explain;   ///< laws of the list that leave nothing
    std::function<bool()> otherwise;  ///< asked where no law of the list leaves nothing: whether anything else does
  };
  /// `problem` lives as long as what is found, and its rig gets the laws that are tried. `leaves_something`: whether a fit does; `is_no_law`: whether
  /// noise of a colour explains that, or the rig's description.
  LawSearch(FitProblem& problem, const Trial& base, Asked leaves_something, Asked is_no_law, Among among, Known known = {});

  /// All sets that were fitted in full, `base` with one law more or two, the best first; empty where no form explains anything. Where the limits of the search are reached, those that were followed by then.
  std::vector<Trial> search();
  /// Those that the free decays speak against: they were followed no further.
  const std::vector<Trial>& refuted() const { return refuted_; }
  /// Whether forms of the dictionary were looked for beside `base`.
  bool asked_forms() const { return asked_forms_; }

 private:
  /// Largest share of what a fit leaves that was promised to first order; least chi-square that a signal promised to leave.
  struct Promised {
    double by_a_law = 0, by_a_signal = 0, left_by_a_signal = INFINITY;
  };
  /// Sets with one law more, as they are to be fitted.
  struct Prospects {
    std::vector<Trial> laws;
    Promised promised;
  };
  /// A law that the free decays ask for.
  struct AskedFor {
    Form form;
    double evidence = 0;  ///< twice the log likelihood beyond that without a law, less BIC's for its parameters
  };
  std::vector<AskedFor> asked_along(const BesideUnknownForces& beside) const;
  void keep_most_evident(std::vector<AskedFor>& asked) const;
  bool ask_for_a_curve();
  void keep_laws_of(const Trial& base);
  Trial begun_with(const std::vector<AskedFor>& asked) const;
  void in_order_of_parameters(std::vector<Trial>& tried) const;
  Prospects rivals_asked_for();
  std::vector<Trial> screened_beside_base(const std::vector<std::string>& ids) const;
  Prospects prospects(const Trial& base, std::vector<Trial> screened, const Promised& known, double least = half_of_it) const;
  Prospects rivals_promised();
  bool signals_leave_nothing(const Promised& promised) const;
  std::vector<double> screen_forms(const Trial& base, const Screening& screening, std::vector<Form>& forms, const std::vector<std::size_t>& which);
  std::vector<std::string> forms_worth_a_fit(const Trial& base, const Promised& known);
  std::vector<std::string> of_the_list(const Trial& base) const;
  void follow_decays(Trial& trial, const Trial& base, bool from_here) const;
  bool is_explained(const Trial& trial);
  void settle_first();
  void follow(std::vector<Trial> tried, const Trial& base, bool from_here);
  void try_all(std::vector<Trial> trials, const Trial& base, bool from_here = true);
  bool goes_by_evidence() const;
  bool list_leaves_nothing() const;
  bool any_explains();
  bool goes_on();
  void ask_decays();
  void follow_what_decays_ask_for();
  void try_the_first_two();
  void follow_the_list();
  void look_for_a_curve();
  void follow_rivals();
  void look_for_a_second();
  void take_away();
  void settle_rivals();
  void tell(const std::string& what) const {
    if (problem_.progress) problem_.progress(what);
  }

  FitProblem& problem_;
  const Trial& base_;
  Asked leaves_something_, is_no_law_;
  Among among_;
  Known known_;
  std::vector<Trial> found_;  // all that were followed, the best first
  std::vector<Trial> refuted_;
  std::vector<AskedFor> asked_;  // by the decays, the most evident first
  std::vector<Trial> dear_;      // laws that are followed in small steps, behind all others of the list
  Promised promised_;
  std::optional<BesideUnknownForces> beside_;  // what that is told along
  bool has_curve_ = false;  // among what was asked for
  std::vector<std::string> explained_;  // last effects of sets that are known to leave nothing but noise of a colour or the rig's description
  bool asked_forms_ = false;
};

}  // namespace unrig
