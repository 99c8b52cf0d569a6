#include "fit/laws/found_law.h"

#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"

namespace unrig {
namespace {

/// How far the runs took a symbol.
FoundLaw::Learnt learnt(Symbol symbol, const Reach& r) {
  switch (symbol) {
    case Symbol::x: return {-r.x, r.x, "m"};
    case Symbol::v: return {-r.v, r.v, "m/s"};
    case Symbol::a: return {-r.a, r.a, "m/s^2"};
    case Symbol::twist: return {-r.twist, r.twist, "rad"};
    case Symbol::twist_rate: return {-r.twist_rate, r.twist_rate, "rad/s"};
    case Symbol::alpha: return {-r.alpha, r.alpha, "rad"};
    case Symbol::t: return {0, r.seconds, "s"};
    default: return {0, 0, ""};
  }
}

/// The law with its parameters at these values, as far as there are any.
Law at_values(Law law, const std::function<const double*(const std::string&)>& value_of) {
  for (Parameter& p : law.parameters)
    if (const double* value = value_of(law.id() + "." + p.name); value && std::isfinite(*value)) p.start = std::clamp(*value, p.lower, p.upper);
  law.text = law_text(law);
  return law;
}

}  // namespace

FoundLaw found_law(const Rig& rig, const std::string& id, const FitResult& fit, const Reach& reach) {
  const auto value_of = [&](const std::string& name) -> const double* {
    for (const FittedParameter& p : fit.parameters)
      if (p.name == name) return &p.value;
    return nullptr;
  };
  FoundLaw found{at_values(law_of(effect(rig, id)), value_of), {}, {}};
  for (std::size_t s = 0; s < symbol_count; ++s) {
    const auto symbol = static_cast<Symbol>(s);
    if (!found.law.uses(symbol)) continue;
    if (FoundLaw::Learnt range = learnt(symbol, reach); !range.unit.empty()) found.learnt_on.emplace(symbol_names[s], std::move(range));
  }
  return found;
}

std::vector<Rival> rivals(const std::vector<Trial>& tried, const std::function<bool(const Trial&)>& leaves_something, double decisive) {
  std::vector<Rival> all;
  for (std::size_t i = 1; i < tried.size(); ++i) {
    const Trial& t = tried[i];
    const double behind = bic_difference(t, tried.front());
    if (!(behind < decisive) || leaves_something(t)) continue;
    const Effect& e = effect(t.arrival.joint.model().rig(), t.effects.back());
    Rival rival{t.effects, e.equation, "", "", std::sqrt(std::max(0.0, deviance_difference(t, tried.front()))), 0.5 * behind};
    if (is_law_id(e.id)) {
      const auto value_of = [&](const std::string& name) -> const double* {
        for (const Unknown& u : t.arrival.joint.unknowns())
          if (t.arrival.joint.parameter(u).name == name) return &u.value;
        return nullptr;
      };
      const Law law = at_values(law_of(e), value_of);
      rival.force = law.force_text;
      rival.memory = law.memory_text;
      rival.text = law.text;
    }
    all.push_back(std::move(rival));
  }
  return all;
}

}  // namespace unrig
