#pragma once
#include <functional>
#include <string>
#include <vector>

#include "fit/fit.h"
#include "fit/laws/dictionary.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// The law of a force that no effect on the list explains.
///
/// 1. States that the free decays ask for, beside unknown accelerations (beside_unknown_forces).
/// 2. Every form of the dictionary, its force on these states sent through the rig onto the readings (screen).
/// 3. The forms that explain most are fitted with all their parameters free: to the free decays first, then to all runs; runs that are driven from first guesses. Effects of the list that are tried only where they are
///    named are fitted too where a form of their kind is. All are held against each other by BIC.
/// 4. Where the best leaves something, a second law is looked for beside it.
///
/// Before anything else was tried (Listed::all) laws are looked for where one of them promises most of all effects, signals included, to first order (Screening), and only what promises half as much: laws of the list, one
/// and a second beside it, and forms, which are their rivals.
///
/// Source: M. Alvarez, D. Luengo and N. Lawrence, Latent force models, AISTATS (2009); S. L. Brunton, J. L. Proctor and J. N. Kutz, PNAS 113 (2016) 3932, whose candidates are regressed on derivatives, here on readings.
class LawSearch {
 public:
  /// Which laws of the list are fitted beside those of the dictionary.
  enum class Listed { only_if_named, all };

  /// `problem` lives as long as what is found, and its rig gets the laws that are tried. `leaves_something`: whether a fit does.
  LawSearch(FitProblem& problem, const Trial& base, std::function<bool(const Trial&)> leaves_something, Listed listed);

  /// All sets that were fitted in full, `base` with one law more or two, the best first; empty where no form explains anything.
  std::vector<Trial> search();

 private:
  /// Sets with one law more, as they are to be fitted.
  struct Prospects {
    std::vector<Trial> listed, forms;
  };
  Prospects prospects(const Trial& base);
  std::vector<std::string> forms_worth_a_fit(const Trial& base);
  std::vector<std::string> of_the_list(const std::vector<std::string>& forms, const Trial& base) const;
  std::vector<Trial> followed(std::vector<Trial> tried, const Trial& base) const;
  bool goes_on(const std::vector<Trial>& tried) const;
  bool may_have_rivals(const std::vector<Trial>& tried) const;

  FitProblem& problem_;
  const Trial& base_;
  std::function<bool(const Trial&)> leaves_something_;
  Listed listed_;
};

}  // namespace unrig
