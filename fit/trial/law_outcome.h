#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/law/law.h"
#include "fit/diagnose/diagnose.h"

namespace unrig {

/// A law or an effect of the list, with its numbers.
struct ToldLaw {
  struct Value {
    std::string name, unit;
    double value = 0;
  };
  std::string effect;         ///< its id
  std::string kind;           ///< class of physics: Effect::kind, of a law without a formula of its own "curve"
  std::string force, memory;  ///< of an effect of the list its equation
  std::vector<Value> parameters = {};
  std::map<std::string, double> scales = {};  ///< symbols are divided by these [SI]
};
ToldLaw told(const Law& law);

/// What a diagnosis made of a law that was hidden.
struct LawOutcome {
  ToldLaw hidden;
  bool outside = false;              ///< no line of the dictionary can say it
  double noise = 0;                  ///< of the gauge [N]
  std::vector<ToldLaw> named;        ///< without the rig's description where files are misread
  std::size_t rivals = 0;            ///< sets that are called as good as what is named
  bool class_right = false;          ///< something of the hidden law's class is named
  bool equation_right = false;       ///< what is named is the hidden law alone, or one that says the same
  bool among_rivals = false;         ///< a rival is
  bool in_company = false;           ///< the hidden law is named, beside something that is not there
  bool unexplained = false;
  std::optional<double> exact_left;  ///< reduced chi-square of a fit from the truth; none: the diagnosis failed
  std::optional<double> ahead;       ///< twice the log likelihood of that fit less that of the best set that was tried without the hidden law
  std::optional<double> behind;      ///< the same less that of what is named, or comes closest
  std::optional<double> heldout;     ///< r.m.s. left of a run that was not fitted over what that fit leaves, of the run where it is largest

  bool right() const { return equation_right || among_rivals; }
  bool wrong_alone() const { return !named.empty() && !right(); }
  bool curve() const;  ///< nothing but curves is named
};

/// Whether both say the same: one form, or one and its other name ("spring with a power" with p = 3 within a tenth and cubic-stiffness). The linear part of a law is the rig's stiffness and damping, and counts for nothing.
bool say_the_same(const ToldLaw& a, const ToldLaw& b);

/// `misread`: whether files are off, so that rig-description is no wrong name.
LawOutcome judged(const Law& hidden, bool outside, double noise, bool misread, const Diagnosis& d);

/// Over campaigns with laws.
struct LawCounts {
  int campaigns = 0, right = 0, among_rivals = 0, class_right = 0, wrong_alone = 0, in_company = 0, unexplained = 0, nothing = 0;  ///< `right`: the equation; of the wrong ones some have the hidden law in company; the last two: nothing is named
  int decided = 0, decided_right = 0;     ///< an exact model of the truth is ahead by 10 or more; of these right or among the rivals
  double median_rivals = 0;               ///< where something is named
  int most_rivals = 0;
  int heldout = 0, heldout_within = 0;    ///< campaigns that tell; at most 1.2 times what the truth leaves
  int curve = 0;                          ///< named so
  int outside = 0, outside_right = 0;     ///< of laws outside the dictionary: a curve or unexplained, and the held-out run within 1.2 times
};
LawCounts count_laws(const std::vector<const LawOutcome*>& outcomes);

}  // namespace unrig
