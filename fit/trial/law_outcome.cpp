#include "fit/trial/law_outcome.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "core/law/law_effect.h"

namespace unrig {
namespace {

using Strings = std::vector<std::string>;

/// One physics under two names.
struct OtherName {
  std::string_view one, other;
  double power = 0;  // that makes them the same; 0: there is none
};
constexpr std::array other_names{
    OtherName{"law:spring with a power", "cubic-stiffness", 3},   OtherName{"law:damping with a power", "quadratic-drag", 2},      OtherName{"law:damping with a power", "cubic-damping", 3},
    OtherName{"law:twist with a power", "twist-stiffness", 3},    OtherName{"law:lift that bends", "lift-curve", 3},               OtherName{"law:dry friction", "coulomb-friction"},
    OtherName{"law:hysteresis of Bouc and Wen", "bouc-wen"},      OtherName{"law:damping of van der Pol", "law:damping with the amplitude", 2},
};

/// The exponent of whichever has one.
double power_of(const ToldLaw& a, const ToldLaw& b) {
  for (const ToldLaw* law : {&a, &b})
    for (const ToldLaw::Value& v : law->parameters)
      if (v.name == "p") return v.value;
  return 0;
}

ToldLaw told(const MissingEffect& m) {
  if (m.law) return told(m.law->law);
  ToldLaw all{m.effect, m.kind, m.equation, ""};
  for (const FittedParameter& p : m.parameters) all.parameters.push_back({p.name.substr(m.effect.size() + 1), p.unit, p.value});
  return all;
}

/// The only one of a set, apart from the rig's description where that is no wrong name; none where there are more.
std::optional<ToldLaw> only_one(Strings effects, const std::string& law, bool misread) {
  if (misread) std::erase(effects, rig_description_id);
  if (effects.size() != 1) return std::nullopt;
  return law.empty() ? ToldLaw{effects.front(), "", "", ""} : told(parse_law(law, "a rival"));
}

/// Sets called as good as what is named.
std::vector<std::optional<ToldLaw>> rivals_of(const Diagnosis& d, bool misread) {
  std::vector<std::optional<ToldLaw>> all;
  for (const Strings& set : d.equivalent) all.push_back(only_one(set, "", misread));
  for (const MissingEffect& m : d.missing)
    if (m.law)
      for (const Rival& r : m.law->rivals) all.push_back(only_one(r.effects, r.text, misread));
  return all;
}

/// Whether the effect of this id says what was hidden, with the numbers that it has where it is named.
bool is_hidden(const LawOutcome& o, const std::string& id) {
  const auto named = std::find_if(o.named.begin(), o.named.end(), [&](const ToldLaw& n) { return n.effect == id; });
  return say_the_same(o.hidden, named == o.named.end() ? ToldLaw{id, "", "", ""} : *named);
}

void hold_against_truth(LawOutcome& o, const Diagnosis& d) {
  if (!d.truth) return;
  o.exact_left = d.truth->reduced_chi2;
  Strings closest;
  for (const MissingEffect& m : d.missing.empty() ? d.closest : d.missing) closest.push_back(m.effect);
  std::sort(closest.begin(), closest.end());
  for (const auto& [effects, behind] : d.truth->behind) {
    if (!std::isfinite(behind)) continue;
    Strings set = effects;
    std::sort(set.begin(), set.end());
    if (set == closest) o.behind = std::min(behind, o.behind.value_or(behind));
    if (std::none_of(set.begin(), set.end(), [&](const std::string& id) { return is_hidden(o, id); })) o.ahead = std::min(behind, o.ahead.value_or(behind));
  }
  std::size_t k = 0;
  for (const ImprovedRun& run : d.runs) {
    if (!run.heldout || run.left_out || k >= d.truth->heldout.size()) continue;
    const double over = run.rms_after / d.truth->heldout[k++];
    if (std::isfinite(over)) o.heldout = std::max(over, o.heldout.value_or(over));
  }
}

bool within(const LawOutcome& o) {
  constexpr double little_more = 1.2;
  return o.heldout && *o.heldout <= little_more;
}

}  // namespace

ToldLaw told(const Law& law) {
  ToldLaw all{law.id(), law.is_curve() ? "curve" : law.kind(), law.force_text, law.memory_text};
  for (const Parameter& p : law.parameters) all.parameters.push_back({p.name, p.unit, p.start});
  for (std::size_t s = 0; s < symbol_count; ++s)
    if (law.scales[s] != 1) all.scales.emplace(symbol_names[s], law.scales[s]);
  return all;
}

bool LawOutcome::curve() const {
  return !named.empty() && std::all_of(named.begin(), named.end(), [](const ToldLaw& law) { return law.kind == "curve"; });
}

bool say_the_same(const ToldLaw& a, const ToldLaw& b) {
  if (a.effect == b.effect) return true;
  return std::any_of(other_names.begin(), other_names.end(), [&](const OtherName& n) {
    const bool named = (n.one == a.effect && n.other == b.effect) || (n.one == b.effect && n.other == a.effect);
    return named && (n.power == 0 || std::abs(power_of(a, b) - n.power) <= 0.1 * n.power);
  });
}

LawOutcome judged(const Law& hidden, bool outside, double noise, bool misread, const Diagnosis& d) {
  LawOutcome o;
  o.hidden = told(hidden);
  o.outside = outside;
  o.noise = noise;
  o.unexplained = d.unexplained;
  for (const MissingEffect& m : d.missing)
    if (!misread || m.effect != rig_description_id) o.named.push_back(told(m));
  o.class_right = std::any_of(o.named.begin(), o.named.end(), [&](const ToldLaw& n) { return n.kind == o.hidden.kind; });
  o.in_company = o.named.size() > 1 && std::any_of(o.named.begin(), o.named.end(), [&](const ToldLaw& n) { return say_the_same(o.hidden, n); });
  o.equation_right = o.named.size() == 1 && say_the_same(o.hidden, o.named.front());
  const std::vector<std::optional<ToldLaw>> rivals = rivals_of(d, misread);
  o.rivals = rivals.size();
  o.among_rivals = !o.equation_right && std::any_of(rivals.begin(), rivals.end(), [&](const auto& r) { return r && say_the_same(o.hidden, *r); });
  hold_against_truth(o, d);
  return o;
}

LawCounts count_laws(const std::vector<const LawOutcome*>& outcomes) {
  constexpr double clearly = 10;
  LawCounts n;
  std::vector<std::size_t> rivals;
  for (const LawOutcome* o : outcomes) {
    ++n.campaigns;
    n.right += o->equation_right ? 1 : 0;
    n.among_rivals += o->among_rivals ? 1 : 0;
    n.class_right += o->class_right ? 1 : 0;
    n.wrong_alone += o->wrong_alone() ? 1 : 0;
    n.in_company += o->in_company ? 1 : 0;
    n.unexplained += o->named.empty() && o->unexplained ? 1 : 0;
    n.nothing += o->named.empty() && !o->unexplained ? 1 : 0;
    n.curve += o->curve() ? 1 : 0;
    n.heldout += o->heldout ? 1 : 0;
    n.heldout_within += within(*o) ? 1 : 0;
    n.outside += o->outside ? 1 : 0;
    n.outside_right += o->outside && (o->curve() || (o->named.empty() && o->unexplained)) && within(*o) ? 1 : 0;
    if (!o->named.empty()) rivals.push_back(o->rivals);
    if (!o->ahead || *o->ahead < clearly) continue;
    ++n.decided;
    n.decided_right += o->right() ? 1 : 0;
  }
  if (rivals.empty()) return n;
  std::sort(rivals.begin(), rivals.end());
  n.median_rivals = 0.5 * static_cast<double>(rivals[(rivals.size() - 1) / 2] + rivals[rivals.size() / 2]);
  n.most_rivals = static_cast<int>(rivals.back());
  return n;
}

}  // namespace unrig
