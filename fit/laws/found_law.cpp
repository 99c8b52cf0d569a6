#include "fit/laws/found_law.h"

#include <algorithm>
#include <cmath>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "fit/likelihood/law_reach.h"

namespace unrig {
namespace {

/// The law with its parameters at these values, infinite where there is none, and learnt where these runs went.
Law at_values(Law law, const std::vector<double>& values, const std::map<std::string, LearntOn>& reach) {
  for (std::size_t k = 0; k < law.parameters.size(); ++k) {
    Parameter& p = law.parameters[k];
    if (std::isfinite(values[k])) p.start = std::clamp(values[k], p.lower, p.upper);
  }
  if (const auto learnt_on = reach.find(law.id()); learnt_on != reach.end()) law.learnt_on = learnt_on->second;
  law.text = law_text(law);
  return law;
}

}  // namespace

FoundLaw found_law(const Rig& rig, const std::string& id, const FitResult& fit) {
  const Law law = law_of(effect(rig, id));
  std::vector<double> values(law.parameters.size(), INFINITY);
  for (const FittedParameter& p : fit.parameters)
    if (p.effect == id) values[static_cast<std::size_t>(p.place)] = p.value;
  return {at_values(law, values, fit.learnt_on), {}};
}

std::vector<Rival> rivals(const std::vector<Trial>& tried, const std::function<bool(const Trial&)>& leaves_something) {
  std::vector<Rival> all;
  for (std::size_t i = 1; i < tried.size(); ++i) {
    const Trial& t = tried[i];
    const double behind = bic_difference(t, tried.front());
    if (!(behind < decisive) || leaves_something(t)) continue;
    const Effect& e = effect(t.arrival.joint.model().rig(), t.effects.back());
    Rival rival{t.effects, e.equation, "", "", std::sqrt(std::max(0.0, deviance_difference(t, tried.front()))), 0.5 * behind};
    if (is_law_id(e.id)) {
      const Law starts = law_of(e);
      std::vector<double> values(starts.parameters.size(), INFINITY);
      for (const Unknown& u : t.arrival.joint.unknowns())
        if (const Parameter& p = t.arrival.joint.parameter(u); p.effect == e.id) values[static_cast<std::size_t>(p.place)] = u.value;
      const Law law = at_values(starts, values, reach_of_laws(t.arrival.joint));
      rival.force = law.force_text;
      rival.memory = law.memory_text;
      rival.text = law.text;
    }
    all.push_back(std::move(rival));
  }
  return all;
}

}  // namespace unrig
