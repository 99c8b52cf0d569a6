#include "fit/diagnose/diagnosis_files.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "core/law/learnt_range.h"
#include "fit/fit_files.h"
#include "fit/fit_json.h"
#include "fit/uncertainty/out_of_proportion.h"

namespace unrig {
namespace {

using nlohmann::ordered_json;

ordered_json number(double x) { return std::isfinite(x) ? ordered_json(x) : ordered_json(nullptr); }

ordered_json mismatch_json(const Mismatch& m) {
  ordered_json channels = ordered_json::array();
  for (const ChannelMismatch& c : m.channels) channels.push_back({{"run", c.run}, {"channel", c.channel}, {"power_over_noise", number(c.energy)}, {"p_value", number(c.p_value)}});
  ordered_json states = ordered_json::array();
  for (const std::optional<StateDependence>& s : m.state) states.push_back(s ? ordered_json{{"state", s->state}, {"share", number(s->share)}, {"standard_deviation", number(s->standard)}, {"correlation", number(s->follows)}} : ordered_json(nullptr));
  return {{"found", m.found}, {"p_value", number(m.p_value)}, {"runs", m.runs}, {"time", m.time}, {"frequency", m.frequency}, {"depends_on", states}, {"summary", m.summary}, {"channels", channels}};
}

/// Four digits: maps are to look at. NaN becomes null.
ordered_json list(const Eigen::VectorXd& values) {
  ordered_json out = ordered_json::array();
  for (const double x : values) out.push_back(std::isfinite(x) ? ordered_json::parse(fmt::format("{:.4g}", x)) : ordered_json(nullptr));
  return out;
}

ordered_json rows(const Eigen::MatrixXd& values) {
  ordered_json out = ordered_json::array();
  for (Eigen::Index i = 0; i < values.rows(); ++i) out.push_back(list(values.row(i)));
  return out;
}

/// "map": power over bands and windows, and of a run with a mismatch the missing force over velocities and displacements.
ordered_json map_json(const ResidualMaps& m) {
  ordered_json map = {{"channel", m.channel}, {"time_frequency", {{"time", list(m.time_frequency.time)}, {"frequency", list(m.time_frequency.frequency)}, {"power", rows(m.time_frequency.power)}, {"unit", "noise = 1"}, {"noise_above", m.time_frequency.noise_above}}}};
  if (m.force)
    map["restoring_force"] = {{"displacement", list(m.force->displacement)}, {"displacement_unit", m.force->displacement_unit}, {"velocity", list(m.force->velocity)}, {"velocity_unit", m.force->velocity_unit},
                              {"force", rows(m.force->force)}, {"force_unit", m.force->force_unit}};
  return map;
}

std::string set_name(const std::vector<std::string>& effects) { return effects.empty() ? "nothing missing" : fmt::format("{}", fmt::join(effects, " + ")); }

std::string cannot_tell(const std::vector<std::string>& set, const std::optional<SeparatingRecording>& by) {
  std::string text = "These runs cannot tell it from " + set_name(set) + ". ";
  if (!by) return text + "No simple variation of these runs would.";
  return text + fmt::format("A recording that would: {} (the two would differ by {:.2g} times the noise; in the run as recorded, by {:.2g}).", by->what, by->difference, by->now);
}

std::string why_not_named(Naming naming) {
  switch (naming) {
    case Naming::removes_too_little: return "too little to be named";
    case Naming::only_signals: return "but leaves a mismatch, and its amplitudes are free in every run: they take a share of anything at these frequencies";
    case Naming::does_not_predict: return "but does not predict runs that were not fitted";
    case Naming::named: break;
  }
  return "";
}

const char* name_of(SearchOutcome search) {
  switch (search) {
    case SearchOutcome::complete: return "complete";
    case SearchOutcome::ruled_out: return "ruled out";
    case SearchOutcome::failed: break;
  }
  return "failed";
}

/// Behind a set in the list of those tried.
const char* in_words(SearchOutcome search) {
  switch (search) {
    case SearchOutcome::complete: return "";
    case SearchOutcome::ruled_out: return "  ruled out by the free decays, not fitted to the other runs";
    case SearchOutcome::failed: break;
  }
  return "  the search lost its way: no verdict on this set";
}

/// What a search that failed could not follow, and what that means for the verdict; empty where none did.
std::string search_words(const Diagnosis& d) {
  if (d.search != SearchOutcome::failed) return "";
  std::vector<std::string> sets;
  for (const std::vector<std::string>& set : d.not_followed)
    if (!set.empty()) sets.push_back(set_name(set));
  std::string text;
  if (sets.size() < d.not_followed.size()) text = "The rig with nothing added was searched from a fit that leaves far more than another does. ";
  if (!sets.empty()) text += fmt::format("With {} added the search ended with more left than without: it lost its way, and whether that explains these runs is not known. ", fmt::join(sets, "; "));
  return text + "Unexplained is what the search left, not what all effects leave. Look at rig file and runs, diagnose fewer runs, or name candidates with --effects.";
}

bool is_rig_description(const MissingEffect& m) { return m.effect == rig_description_id; }

/// "normal.mass[13] = 0.871 +/- 0.004 kg where the rig file says 0.86".
std::string moved_number(const FittedParameter& p) {
  return fmt::format("{} = {:.5g} +/- {:.2g}{} where {} {:.5g}", p.name, p.value, p.std_error, p.unit == "1" ? "" : " " + p.unit, p.run.empty() ? "the rig file says" : "the run " + base_name(p.run) + " says", p.start);
}

/// The verdict where the rig's description is what is missing, alone or beside effects.
std::string verdict_on_rig(const MissingEffect& rig, const std::vector<std::string>& others) {
  const std::string more = rig.parameters.size() > 1 ? fmt::format(", and {} more below", rig.parameters.size() - 1) : "", number = moved_number(rig.parameters.front());
  if (others.empty()) return fmt::format("Missing is nothing but an exact rig file: {}{}.", number, more);
  return fmt::format("Missing is {}, and an exact rig file: {}{}.", fmt::join(others, " and "), number, more);
}

std::string formula(const Law& law) { return fmt::format("{}{}", law.force_text, law.memory_text.empty() ? "" : ", z' = " + law.memory_text); }

std::string verdict(const Diagnosis& d) {
  if (!d.mismatch.found) return "Nothing is missing: " + d.mismatch.summary + ".";
  if (d.missing.empty())
    return d.search == SearchOutcome::failed ? "There is a mismatch, and the search for what removes it failed in part: unexplained." : "There is a mismatch that no known effect removes: unexplained.";
  std::vector<std::string> ids;
  for (const MissingEffect& m : d.missing)
    if (!is_rig_description(m)) ids.push_back(m.law ? fmt::format("a law on no list, {} ({}: {})", m.law->law.name, m.law->law.acts_on == ActsOn::torsion ? "moment" : "force", formula(m.law->law)) : m.effect);
  if (const auto rig = std::find_if(d.missing.begin(), d.missing.end(), is_rig_description); rig != d.missing.end()) return verdict_on_rig(*rig, ids);
  return fmt::format("Missing is {}{}.", fmt::join(ids, " and "), d.unexplained ? "; something remains unexplained" : "");
}

/// A law is told by its formula, whatever the name that the program gave it.
std::string told_id(const MissingEffect& m) { return m.law ? "law" : m.effect; }

ordered_json law_json(const FoundLaw& found) {
  ordered_json law = {{"name", found.law.name}, {"acts_on", to_string(found.law.acts_on)}, {"class", found.law.is_curve() ? "curve" : found.law.kind()}, {"force", found.law.force_text}};
  if (!found.law.memory_text.empty()) law["memory"] = found.law.memory_text;
  law["text"] = found.law.text;
  law["learnt_on"] = learnt_json<ordered_json>(found.law.learnt_on);
  law["rivals"] = ordered_json::array();
  for (const Rival& r : found.rivals) {
    ordered_json rival = {{"effects", r.effects}, {"force", r.force}};
    if (!r.memory.empty()) rival["memory"] = r.memory;
    if (!r.text.empty()) rival["text"] = r.text;
    rival["distance_sigma"] = number(r.distance);
    rival["log_odds"] = number(r.log_odds);
    law["rivals"].push_back(rival);
  }
  return law;
}

ordered_json effects_json(const std::vector<MissingEffect>& effects) {
  ordered_json list = ordered_json::array();
  for (const MissingEffect& m : effects) {
    ordered_json parameters = ordered_json::array();
    for (const FittedParameter& p : m.parameters) {
      ordered_json one = {{"name", p.name}, {"value", number(p.value)}, {"std_error", number(p.std_error)}, {"unit", p.unit}};
      if (is_rig_description(m)) one["stated"] = number(p.start);
      if (!p.run.empty()) one["run"] = p.run;
      parameters.push_back(one);
    }
    list.push_back({{"effect", told_id(m)}, {"probability", number(m.probability)}, {"equation", m.equation}, {"source", m.source}, {"parameters", parameters}});
    if (!m.kind.empty()) list.back()["class"] = m.law && m.law->law.is_curve() ? "curve" : m.kind;
    if (m.law) list.back()["law"] = law_json(*m.law);
    if (!m.advice.empty()) list.back()["advice"] = m.advice;
  }
  return list;
}

ordered_json explanations_json(const std::vector<StatedExplanation>& explanations) {
  ordered_json list = ordered_json::array();
  for (const StatedExplanation& e : explanations) list.push_back({{"effects", e.effects}, {"probability", number(e.probability)}});
  return list;
}

/// "[[Explanations]] one of these with 0.95: mains-hum (0.93), something else (0.07)".
std::string explanations_text(const std::vector<StatedExplanation>& explanations) {
  std::vector<std::string> each;
  for (const StatedExplanation& e : explanations) {
    const bool other = e.effects == std::vector<std::string>{something_else};
    each.push_back(fmt::format("{} ({:.3g})", e.effects.empty() ? "nothing missing" : other ? "something else" : set_name(e.effects), e.probability));
  }
  return fmt::format("[[Explanations]] one of these, with a probability of {}\n    {}\n", explanations_hold, fmt::join(each, "; "));
}

std::string law_words(const FoundLaw& found) {
  std::string text;
  for (const auto& [symbol, range] : found.law.learnt_on) text += fmt::format("    learnt where {}; beyond, it is a guess, which simulate and correct refuse\n", told(symbol, range));
  for (const Rival& r : found.rivals) text += fmt::format("    these runs cannot refute {}: {:.1f} standard deviations away, odds 1 to {:.3g}\n", r.force + (r.memory.empty() ? "" : ", z' = " + r.memory), r.distance, std::exp(r.log_odds));
  if (found.rivals.empty()) text += "    of the forms that were tried these runs refute every other\n";
  return text;
}

std::string effects_text(const std::vector<MissingEffect>& effects) {
  std::string text;
  for (const MissingEffect& m : effects) {
    text += fmt::format("[[{}]] probability {:.4f}\n    {}{}\n", told_id(m), m.probability, m.equation, m.source.empty() ? "" : "    (" + m.source + ")");
    for (const FittedParameter& p : m.parameters) {
      if (is_rig_description(m)) {
        text += "    " + moved_number(p) + "\n";
        continue;
      }
      const std::string error = p.std_error > 0 ? fmt::format(" +/- {:.2g}", p.std_error) : std::string();
      text += fmt::format("    {} = {:.6g}{} {}{}{}\n", p.name, p.value, error, p.unit, p.run.empty() ? "" : " (" + base_name(p.run) + ")", p.identified ? "" : " (not identified)");
    }
    if (m.law) text += law_words(*m.law);
    if (!m.advice.empty()) text += "    " + m.advice + ".\n";
  }
  return text;
}

/// What part a run had.
const char* kind_of(const ImprovedRun& run) {
  if (run.left_out) return "left out";
  if (run.heldout) return "held out";
  return run.aside ? "set aside" : "fitted";
}

}  // namespace

std::string to_json(const Diagnosis& d) {
  ordered_json runs = ordered_json::array(), ranking = ordered_json::array();
  for (const ImprovedRun& r : d.runs) {
    runs.push_back({{"file", r.file}, {"channel", r.channel}, {"heldout", r.heldout}, {"left_out", r.left_out}, {"set_aside", r.aside}, {"rms_before", number(r.rms_before)}, {"rms_after", number(r.rms_after)}, {"noise", number(r.noise)}, {"unit", r.unit}});
    for (const ResidualMaps& m : d.maps)
      if (m.run == r.file && m.channel == r.channel && !r.heldout && !r.left_out) runs.back()["map"] = map_json(m);
  }
  for (const Candidate& c : d.ranking)
    ranking.push_back({{"effect", set_name(c.effects)}, {"score", number(c.score)}, {"reduced_chi2", number(c.reduced_chi2)}, {"delta_bic", number(c.delta_bic)}, {"probability", number(c.probability)}, {"search", name_of(c.search)}});
  ordered_json forces = ordered_json::array();
  for (const MissingForce& f : d.missing_force) {
    std::vector<double> value(f.value.begin(), f.value.end());
    for (double& v : value) v = std::round(v / f.standard_deviation * 100) / 100 * f.standard_deviation;  // to a hundredth of its error
    forces.push_back({{"run", f.run}, {"unit", "N"}, {"at", "calibration element"}, {"dt", f.dt}, {"standard_deviation", number(f.standard_deviation)}, {"rms", number(f.rms())}, {"reading_as_force", number(f.as_read)},
                      {"out_of_proportion", f.out_of_proportion()}, {"value", value}});
  }
  ordered_json shifts = ordered_json::array();
  for (const FittedParameter& b : d.before.parameters)
    for (const FittedParameter& a : d.after.parameters)
      if (!d.after.effects.empty() && a.name == b.name && a.run == b.run && a.identified)
        shifts.push_back({{"name", a.name}, {"run", a.run}, {"without", number(b.value)}, {"with", number(a.value)}, {"std_error", number(a.std_error)}, {"unit", a.unit}});
  ordered_json separated = ordered_json::array();
  for (const std::optional<SeparatingRecording>& s : d.separated_by)
    separated.push_back(s ? ordered_json{{"recording", s->what}, {"difference_over_noise", number(s->difference)}, {"as_recorded", number(s->now)}} : ordered_json(nullptr));
  ordered_json json = {{"unrig", "diagnosis"},
                       {"program", d.after.program},
                       {"command", d.after.command},
                       {"rig_fingerprint", d.after.rig_fingerprint},
                       {"verdict", verdict(d)},
                       {"mismatch", mismatch_json(d.mismatch)},
                       {"missing", effects_json(d.missing)},
                       {"explanations", explanations_json(d.explanations)},
                       {"holds", explanations_hold},
                       {"equivalent", d.equivalent},
                       {"separated_by", separated},
                       {"unexplained", d.unexplained},
                       {"search", name_of(d.search)},
                       {"not_followed", d.not_followed},
                       {"search_summary", search_words(d)},
                       {"closest", {{"effects", effects_json(d.closest)}, {"share_of_excess_removed", number(d.removed_by_closest)}, {"not_named", d.closest.empty() ? "" : why_not_named(d.naming)}}},
                       {"remaining", mismatch_json(d.remaining)},
                       {"improvement", {{"bic_before", number(d.bic_before)}, {"bic_after", number(d.bic_after)}, {"runs", runs}}},
                       {"price_of_ignorance", shifts},
                       {"ranking", ranking},
                       {"missing_force", forces},
                       {"fit", ordered_json::parse(to_json(d.after, d.laws))}};
  json["work"] = number(d.work);
  if (d.stopped) json["stopped"] = true;
  return json.dump(2) + "\n";
}

std::string report(const Diagnosis& d) {
  std::string text = verdict(d) + "\n";
  if (d.mismatch.found) text += fmt::format("[[Mismatch]] p = {:.2g}\n    {}\n", d.mismatch.p_value, d.mismatch.summary);
  text += effects_text(d.missing);
  for (std::size_t i = 0; i < d.equivalent.size(); ++i) text += "    " + cannot_tell(d.equivalent[i], d.separated_by[i]) + "\n";
  text += explanations_text(d.explanations);
  if (d.unexplained) text += "[[Unexplained]]\n    " + d.remaining.summary + "\n";
  if (const std::string words = search_words(d); !words.empty()) text += "    " + words + "\n";
  if (d.stopped) text += fmt::format("[[Stopped]]\n    {}\n", stopped_words);
  for (const std::string& sentence : out_of_proportion(d.after.parameters)) text += "    " + sentence + "\n";
  if (!d.closest.empty()) text += fmt::format("    The set that comes closest removes {:.0f} % of the excess, {}:\n", 100 * d.removed_by_closest, why_not_named(d.naming)) + effects_text(d.closest);
  for (const MissingForce& f : d.missing_force) {
    text += fmt::format("    what is left of {} would be explained by a force of {:.3g} N r.m.s. at the calibration element, known to {:.2g} N (diagnosis file: missing_force)\n", base_name(f.run), f.rms(), f.standard_deviation);
    if (f.out_of_proportion())
      text += fmt::format("        out of proportion: all that the gauge reads there is {:.3g} N r.m.s. Do not take it for a load: where the rig hardly answers a force, noise, errors of the signal and of the rig's description all read as a large one\n", f.as_read);
  }
  text += "[[Improvement]] r.m.s. of the residual: the rig alone -> with what was found (of runs that were not fitted: predicted, from a fit of the rig alone with less weight for runs that it cannot explain)\n";
  for (const ImprovedRun& r : d.runs)
    text += fmt::format("    {:<20} {:<8} {:9.4g} -> {:9.4g} {} (noise {:.4g})\n", base_name(r.file) + (r.channel == "gauge" ? "" : ": " + r.channel), kind_of(r), r.rms_before, r.rms_after, r.unit, r.noise);
  if (std::any_of(d.runs.begin(), d.runs.end(), [](const ImprovedRun& r) { return r.aside; }))
    text += "    set aside: it crosses the corners of a law for so long that no search follows it to its end; it is judged by what laws leave of it that are trusted to within some per cent, and had no part in the fit\n";
  if (d.ranking.size() > 1) {
    text += "[[Tried]] reduced chi-square, BIC against nothing missing\n";
    for (const Candidate& c : d.ranking) text += fmt::format("    {:<36} {:10.4g} {:12.5g}{}\n", set_name(c.effects), c.reduced_chi2, c.delta_bic, in_words(c.search));
  }
  return text;
}

}  // namespace unrig
