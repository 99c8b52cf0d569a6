#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/error.h"
#include "correct/report/fit_traces.h"
#include "correct/report/result_files.h"
#include "correct/report/rig_sections.h"
#include "fit/diagnose/diagnosis_files.h"
#include "fit/fit_json.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;

/// What "before" is in a diagnosis (fit/diagnose/diagnose.h).
constexpr const char* rig_alone = "the rig with nothing added, fitted with less weight for the runs that it cannot explain";

json member(const json& object, const char* key, json otherwise) { return object.is_object() && object.contains(key) && !object[key].is_null() ? object[key] : otherwise; }

std::vector<double> doubles(const json& values) {
  std::vector<double> out;
  for (const json& v : values) out.push_back(v.is_number() ? v.get<double>() : std::nan(""));
  return out;
}

VectorXd vector(const json& values) {
  const std::vector<double> v = doubles(values);
  return Eigen::Map<const VectorXd>(v.data(), static_cast<Index>(v.size()));
}

/// The first of these members that is there.
json any_of(const json& object, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (json found = member(object, key, nullptr); !found.is_null()) return found;
  return json::array();
}

std::string listed(const json& names) {
  std::string text;
  for (const json& name : names) text += (text.empty() ? "" : ", ") + (name.is_string() ? name.get<std::string>() : name.dump());
  return text;
}

void add_verdicts(ReportPage& page, const json& result, const std::string& about) {
  const json mismatch = member(result, "mismatch", json::object()), missing = member(result, "missing", json::array());
  const double p = number_of(mismatch, "p_value");
  if (const std::string verdict = text_of(result, "verdict"); !verdict.empty())  // in the words of `unrig diagnose` itself
    return page.add_verdict(!mismatch.value("found", false) ? Tone::good : missing.empty() || result.value("unexplained", false) ? Tone::open : Tone::bad, verdict, about);
  const std::string chance = std::isfinite(p) ? fmt::format(" (p = {:.2g})", p) : "";
  if (!mismatch.value("found", false)) {
    page.add_verdict(Tone::good, "Nothing is missing: the rig model explains these recordings" + chance + ".", about);
  } else if (missing.empty()) {
    page.add_verdict(Tone::bad, "Something is missing" + chance + ", and no known effect explains it.", about);
  } else {
    std::string what;
    for (const json& m : missing) what += fmt::format("{}{} (probability {})", what.empty() ? "" : ", ", text_of(m, "effect"), plain(number_of(m, "probability"), 3));
    page.add_verdict(Tone::bad, "Missing physics: " + what + ".", about);
  }
  if (!missing.empty() && result.value("unexplained", false)) page.add_verdict(Tone::open, "A significant mismatch remains that no known effect removes.", about);
  for (const json& set : member(result, "equivalent", json::array()))
    page.add_verdict(Tone::open, "These recordings cannot tell apart: " + listed(set) + ".", about);
}

/// "0.2 to 1.4 s": pairs, one per place of the mismatch.
std::string range(const json& pairs, std::size_t i, const char* unit) {
  if (i >= pairs.size() || !pairs[i].is_array() || pairs[i].size() != 2) return "";
  const std::vector<double> ends = doubles(pairs[i]);
  return fmt::format("{} to {} {}", plain(ends[0], 4), plain(ends[1], 4), unit);
}

/// Where a run's mismatch is: in time [s], in frequency [Hz], or in both.
struct Place {
  std::optional<std::pair<double, double>> time, frequency;
};

std::vector<Place> places_in(const json& mismatch, const std::string& file) {
  const json runs = member(mismatch, "runs", json::array()), time = member(mismatch, "time", json::array()), frequency = member(mismatch, "frequency", json::array());
  const auto pair = [](const json& list, std::size_t i) -> std::optional<std::pair<double, double>> {
    if (i >= list.size() || !list[i].is_array() || list[i].size() != 2 || !list[i][0].is_number() || !list[i][1].is_number()) return std::nullopt;
    return std::pair{list[i][0].get<double>(), list[i][1].get<double>()};
  };
  std::vector<Place> found;
  for (std::size_t i = 0; i < runs.size(); ++i)
    if (runs[i].is_string() && runs[i].get<std::string>() == file) found.push_back({pair(time, i), pair(frequency, i)});
  return found;
}

std::vector<Box> boxes_of(const std::vector<Place>& places, std::optional<std::pair<double, double>> Place::* side) {
  std::vector<Box> boxes;
  for (const Place& place : places)
    if (const auto& ends = place.*side) boxes.push_back({ends->first, ends->second, "mismatch"});
  return boxes;
}

void add_places(ReportPage& page, const json& mismatch) {
  const json runs = member(mismatch, "runs", json::array()), time = member(mismatch, "time", json::array()), frequency = member(mismatch, "frequency", json::array());
  if (const std::string summary = text_of(mismatch, "summary"); !summary.empty()) page.add_text(summary);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < std::max({runs.size(), time.size(), frequency.size()}); ++i)
    rows.push_back({i < runs.size() ? file_name(listed(json::array({runs[i]}))) : "", range(time, i, "s"), range(frequency, i, "Hz")});
  if (!rows.empty()) page.add_table("Where the mismatch is", {"run", "time", "frequency"}, rows);
}

void add_ranking(ReportPage& page, const json& ranking) {
  std::vector<std::vector<std::string>> rows;
  for (const json& r : ranking)
    rows.push_back({text_of(r, "effect"), plain(number_of(r, "score"), 4), plain(number_of(r, "reduced_chi2"), 4), plain(number_of(r, "delta_bic"), 5), plain(number_of(r, "probability"), 3), text_of(r, "search")});
  if (!rows.empty()) page.add_table("Ranking of the effects", {"effect", "score", "reduced chi-square", "change of BIC", "probability", "search"}, rows,
                   "Score: the share of the excess of chi-square that one linear step in the effect's parameters promised to remove, which decided what was fitted in full; 0 for what joined the search later. "
                   "The more negative the change of BIC, the more the effect explains for its parameters. Search: failed where it left more than without the effect, which says nothing of the effect; "
                   "ruled out by the free decays, where the other runs were not fitted.");
}

std::string acts_on_in_words(const std::string& acts_on) {
  if (acts_on == "normal") return "a force at the calibration element";
  if (acts_on == "torsion") return "a moment about the pitch axis";
  if (acts_on == "lift") return "a normal force on each strip";
  if (acts_on == "gauge") return "the gauge's reading";
  if (acts_on == "mount") return "an acceleration of the mount";
  return acts_on;
}

/// A law that was found in the recordings: what it is, where it was learnt, and what else would have done.
void add_law(ReportPage& page, const json& m, const json& law) {
  const std::string kind = text_of(m, "class").empty() ? text_of(law, "class") : text_of(m, "class"), memory = text_of(law, "memory"), acts_on = text_of(law, "acts_on");
  page.add_equation("law", (acts_on == "torsion" ? "M = " : acts_on == "gauge" ? "gauge += " : acts_on == "mount" ? "a = " : "F = ") + text_of(law, "force"), text_of(m, "source"));
  if (!memory.empty()) page.add_equation("memory", "z' = " + memory, "z has no dimension and begins at 0");
  page.add_text(fmt::format("{}found in these recordings; it is {}.", kind.empty() ? "A law " : "A law of the class \"" + kind + "\", ", acts_on_in_words(acts_on)));
  std::vector<std::vector<std::string>> learnt, rivals;
  const json ranges = member(law, "learnt_on", json::object());
  for (const auto& [symbol, range] : ranges.items())
    if (range.is_array() && range.size() == 3) learnt.push_back({symbol, plain(range[0].is_number() ? range[0].get<double>() : std::nan("")), plain(range[1].is_number() ? range[1].get<double>() : std::nan("")), range[2].is_string() ? range[2].get<std::string>() : ""});
  if (!learnt.empty()) page.add_table("Learnt on", {"symbol", "from", "to", "unit"}, learnt, "Outside of these ranges the law is a guess.");
  for (const json& r : member(law, "rivals", json::array())) rivals.push_back({text_of(r, "force"), plain(number_of(r, "distance_sigma"), 3), plain(number_of(r, "log_odds"), 4)});
  if (!rivals.empty())
    page.add_table("Rivals of the law", {"force", "distance [standard deviations]", "log of the odds"}, rivals,
                   "Distance: between the rival's force and the law's over what the runs visited, in standard deviations of the latter. Odds: of the law against the rival; near 0 the recordings cannot tell them apart.");
}

void add_missing(ReportPage& page, const json& missing, const std::string& title) {
  std::vector<std::vector<std::string>> rows;
  for (const json& m : missing) {
    const std::string effect = text_of(m, "effect");
    if (const json law = member(m, "law", json::object()); !law.empty()) add_law(page, m, law);
    else if (const std::string equation = text_of(m, "equation"); !equation.empty()) page.add_equation(effect, equation, text_of(m, "source"));
    if (const std::string advice = text_of(m, "advice"); !advice.empty()) page.add_text(advice + ".");
    for (const json& p : member(m, "parameters", json::array())) {
      const std::string stated = p.contains("stated") ? " (the file says " + plain(number_of(p, "stated"), 6) + ")" : "";
      rows.push_back({effect, text_of(p, "name"), with_error(number_of(p, "value"), number_of(p, "std_error")) + stated, text_of(p, "unit") == "1" ? "" : text_of(p, "unit")});
    }
  }
  if (!rows.empty()) page.add_table(title, {"effect", "parameter", "value ± one standard error", "unit"}, rows);
}

/// The set of effects that comes closest where none is named.
void add_closest(ReportPage& page, const json& closest) {
  const json effects = member(closest, "effects", json::array());
  if (effects.empty()) return;
  page.add_text(fmt::format("The set that comes closest removes {:.0f} % of the excess, {}:", 100 * number_of(closest, "share_of_excess_removed"), text_of(closest, "not_named")));
  add_missing(page, effects, "Parameters of the set that comes closest");
}

/// In numbers what would explain what is left.
void add_forces(ReportPage& page, const json& forces) {
  std::vector<std::vector<std::string>> rows;
  for (const json& f : forces)
    rows.push_back({file_name(text_of(f, "run")), with_error(number_of(f, "rms"), number_of(f, "standard_deviation")), plain(number_of(f, "reading_as_force"), 4), text_of(f, "unit"),
                    f.value("out_of_proportion", false) ? "out of proportion: no load. Where the rig hardly answers a force, noise and errors of the description read as a large one" : ""});
  if (!rows.empty()) page.add_table("The force that would explain what is left", {"run", "force (r.m.s.) ± its error", "all that the gauge reads, as a steady force", "unit", "remark"}, rows);
}

/// What the rig's parameters would have been without the effect.
void add_price(ReportPage& page, const json& shifts) {
  std::vector<std::vector<std::string>> rows;
  for (const json& s : shifts) {
    const double with = number_of(s, "with"), without = number_of(s, "without"), error = number_of(s, "std_error");
    rows.push_back({text_of(s, "name"), file_name(text_of(s, "run")), plain(without, 6), with_error(with, error), text_of(s, "unit") == "1" ? "" : text_of(s, "unit"), plain((without - with) / error, 3), plain(100 * (without / with - 1), 3)});
  }
  if (!rows.empty())
    page.add_table("The price of not knowing", {"parameter", "of run", "without the effect", "with it, ± one standard error", "unit", "off, in standard errors", "off [%]"}, rows,
                   "The load of a rigid rig is wrong by as much as the slope of the normal force and the steady normal force are, in percent, and its build-up by what stiffness and apparent mass leave of the rig in it.");
}

void add_improvement(ReportPage& page, const json& improvement) {
  std::vector<std::vector<std::string>> fitted, predicted;
  for (const json& r : member(improvement, "runs", json::array())) {
    const double before = number_of(r, "rms_before"), after = number_of(r, "rms_after"), noise = number_of(r, "noise");
    const std::string channel = text_of(r, "channel");
    const bool held_out = member(r, "heldout", false).get<bool>();
    const std::string kind = held_out ? "held out" : member(r, "set_aside", false).get<bool>() ? "set aside" : "fitted";
    (held_out ? predicted : fitted).push_back({file_name(text_of(r, "file")) + (channel.empty() || channel == "gauge" ? "" : ", " + channel), kind, plain(before, 4), plain(after, 4), plain(noise, 4), text_of(r, "unit"),
                                               plain(before / noise, 3), plain(after / noise, 3)});
  }
  const std::vector<std::string> header{"run", "", "before (r.m.s.)", "after (r.m.s.)", "noise (std)", "unit", "before / noise", "after / noise"};
  if (!fitted.empty())
    page.add_table("Residuals before and after", header, fitted,
                   fmt::format("Before: the rig with nothing added. BIC {} before, {} after.", plain(number_of(improvement, "bic_before"), 7), plain(number_of(improvement, "bic_after"), 7)));
  if (!predicted.empty()) page.add_table("Runs that were held out", header, predicted, fmt::format("Predicted: parameters are kept, and only the run's own states, offsets and phases are estimated. Before: by {}.", rig_alone));
}

void add_time_frequency(ReportPage& page, const json& map, const std::vector<Place>& places) {
  HeatMap heat{"Residual over time and frequency", "time [s]", "frequency [Hz]", labelled("power", text_of(map, "unit")), doubles(any_of(map, {"time"})), doubles(any_of(map, {"frequency"})), {}};
  const json power = any_of(map, {"power"});
  const std::size_t columns = heat.x.size(), lines = heat.y.size();
  const bool by_time = power.size() == columns && power.size() != lines;
  const auto fits = [&](std::size_t outer, std::size_t inner) {
    return power.size() == outer && std::all_of(power.begin(), power.end(), [&](const json& row) { return row.size() == inner; });
  };
  if (columns == 0 || lines == 0 || !fits(by_time ? columns : lines, by_time ? lines : columns)) return page.add_text("Warning: the time-frequency map is incomplete and left out.");
  heat.z.assign(lines, std::vector<double>(columns));
  for (std::size_t j = 0; j < lines; ++j)
    for (std::size_t i = 0; i < columns; ++i) {
      const json& z = by_time ? power[i][j] : power[j][i];
      heat.z[j][i] = z.is_number() ? z.get<double>() : std::nan("");
    }
  heat.log_z = true;
  heat.caption = fmt::format("Of {}.", rig_alone);
  for (const Place& place : places)
    if (place.time && place.frequency) heat.boxes.push_back({place.time->first, place.time->second, place.frequency->first, place.frequency->second});
  if (!heat.boxes.empty()) heat.caption += " Boxed: where most of the mismatch is.";
  if (member(map, "noise_above", false).get<bool>()) heat.caption += " Higher frequencies hold nothing but noise.";
  page.add_map(heat);
}

/// Force over displacement and velocity: a grid (one row per velocity) or single samples.
void add_restoring_force(ReportPage& page, const json& map) {
  const json x = any_of(map, {"displacement", "x"}), y = any_of(map, {"velocity", "y"}), z = any_of(map, {"force", "z"});
  const std::string x_label = labelled("displacement", text_of(map, "displacement_unit")), y_label = labelled("velocity", text_of(map, "velocity_unit")),
                    z_label = labelled("recording − model", text_of(map, "force_unit").empty() ? text_of(map, "unit") : text_of(map, "force_unit"));
  const bool grid = !z.empty() && z.front().is_array();
  if (z.empty() || (grid ? z.size() != y.size() : z.size() != x.size() || z.size() != y.size())) return page.add_text("Warning: the restoring-force map is incomplete and left out.");
  if (grid) {
    HeatMap heat{"What the model lacks, by the state of the rig", x_label, y_label, z_label, doubles(x), doubles(y), {}, fmt::format("Mean over cells of displacement and velocity of the first normal mode, of {}; grey where the rig never was.", rig_alone), false, true};
    for (const json& row : z) heat.z.push_back(doubles(row));
    return page.add_map(heat);
  }
  for (const auto& [values, label] : {std::pair{&x, &x_label}, std::pair{&y, &y_label}}) {
    const VectorXd at = vector(*values), force = vector(z);
    std::vector<Index> order(static_cast<std::size_t>(at.size()));
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return at[a] < at[b]; });
    page.add_plot({"Missing force against " + label->substr(0, label->find(' ')), *label, z_label, at(order), {{"missing force", 1, force(order), {}, false, true}}});
  }
}

/// A channel of a run: the recording, the model with nothing added and the one with what was found.
struct DiagnosedTrace {
  std::string channel, unit;
  VectorXd time, measured, before, after, force, force_std;
};

DiagnosedTrace read_trace(const json& t, const std::string& unit) {
  const auto values = [&](const char* key) { return vector(member(t, key, json::array())); };
  return {"", unit, values("time"), values("measured"), values("before"), values("after"), values("missing_force"), values("missing_force_std")};
}

void add_diagnosed_traces(ReportPage& page, const DiagnosedTrace& trace, const std::string& file, const std::vector<Place>& places, const std::vector<double>& modes) {
  const auto& [channel, unit, time, measured, before, after, force, force_std] = trace;
  const std::string of = channel.empty() ? "" : channel + ": ";
  const auto fits = [&time = time](const VectorXd& x) { return x.size() == time.size() && time.size() > 1; };
  if (!fits(measured)) return;
  Plot records{of + "recording and models", "time [s]", labelled("reading", unit), time, {{"recording", 0, measured}}, file};
  Plot left{of + "residuals", "time [s]", labelled("recording − model", unit), time, {}, file};
  left.height = 200;
  records.boxes = left.boxes = boxes_of(places, &Place::time);
  const auto add = [&, &measured = measured](const char* name, int colour, const VectorXd& model, bool dashed) {
    if (!fits(model)) return;
    records.curves.push_back({fmt::format("model {}", name), colour, model, {}, dashed});
    left.curves.push_back({fmt::format("residual {}", name), colour, measured - model});
  };
  add("with nothing added", 2, before, true);
  add("with what was found", 1, after, true);
  page.add_plot(records);
  if (!left.curves.empty()) page.add_plot(left);
  if (fits(force)) page.add_plot({"Force that the model lacks", "time [s]", labelled("missing force", "N"), time, {{"missing force", 3, force, fits(force_std) ? force_std : VectorXd()}}, file});
  const double dt = (time[time.size() - 1] - time[0]) / static_cast<double>(time.size() - 1);
  if (fits(before) && fits(after))
    add_spectra(page, of + "spectra of the residual before and after", dt, unit, {"residual with nothing added", 2, measured - before},
                {"residual with what was found", 1, measured - after}, "Amplitude of the whole record, mean removed, Hann window.", modes, boxes_of(places, &Place::frequency));
}

/// The two models that a diagnosis compares, and where its recordings are.
struct Models {
  Rig rig;
  FittedRig before, after;
};

/// The fit stands in the file; what the parameters were without the effect is its price of ignorance. Nothing where the rig is not found.
std::optional<Models> read_models(ReportPage& page, const json& result, const std::string& path, const ReportOptions& options) {
  const json fit = member(result, "fit", json::object());
  if (fit.empty()) return std::nullopt;
  const auto rig_file = found_file(text_of(fit, "rig"), path, options);
  if (!rig_file) {
    const std::string text = fmt::format("The rig \"{}\" is not found, so that recordings and models are left out; --data FOLDER says where recordings and rig are.", text_of(fit, "rig"));
    warn(path + ": " + text);
    page.add_text("Warning: " + text);
    return std::nullopt;
  }
  Models models{read_rig(*rig_file), {}, read_fit(fit, path)};
  if (!can_be_drawn(page, models.after, models.rig, path)) return std::nullopt;
  models.before = models.after;
  models.before.effects.clear();
  for (const json& p : member(result, "price_of_ignorance", json::array()))
    for (FittedParameter& parameter : models.before.parameters)
      if (const double without = number_of(p, "without"); std::isfinite(without) && parameter.name == text_of(p, "name") && parameter.run == text_of(p, "run")) parameter.value = without;
  return models;
}

/// The load cells and whatever else was fitted, without the angle, which both models follow.
void add_models(ReportPage& page, const Models& models, const Run& run, const std::string& path, const std::vector<Place>& places) {
  warn_of_another(page, models.after, models.rig, run, path);
  const std::vector<FitTrace> after = fit_traces(models.rig, models.after, run);
  const std::vector<FitTrace> before = models.after.effects.empty() ? after : fit_traces(models.rig, models.before, run);
  const VectorXd time = VectorXd::LinSpaced(run.samples(), run.start, run.time(run.samples() - 1));
  const std::vector<double> modes = modes_of(fitted_model(models.rig, models.after, run));
  for (std::size_t c = 0; c < after.size(); ++c)
    if (after[c].name != "alpha") {
      add_diagnosed_traces(page, {after[c].name, after[c].unit, time, after[c].measured, models.after.effects.empty() ? VectorXd() : before[c].model, after[c].model, {}, {}}, run.file, places, modes);
      add_residual_checks(page, after[c].name, after[c].measured - after[c].model, after[c].noise, run.dt);
    }
}

/// What the file says of one run, wherever it says it: improvement.runs, or lists of their own.
void add_run(ReportPage& page, const json& result, const json& run, const std::optional<Models>& models, const std::string& path, const ReportOptions& options) {
  const std::string file = text_of(run, "file");
  json all = run;
  for (const char* list : {"runs", "map", "maps", "traces"}) {
    const json items = member(result, list, json::array());
    if (!items.is_array()) continue;
    for (const json& item : items) {
      if (!item.is_object() || text_of(item, "file") != file) continue;
      if (item.contains("measured")) all["traces"] = item;
      if (item.contains("time_frequency") || item.contains("restoring_force")) all["map"] = item;
      for (const char* key : {"traces", "map"})
        if (item.contains(key)) all[key] = item[key];
    }
  }
  const json traces = member(all, "traces", json::object()), map = member(all, "map", json::object());
  const auto recording = models && !run.value("left_out", false) ? found_file(file, path, options) : std::nullopt;
  if (traces.empty() && map.empty() && !recording) return;
  page.add_section("Recording: " + file_name(file));
  const std::vector<Place> places = places_in(member(result, "mismatch", json::object()), file);
  if (!traces.empty())
    add_diagnosed_traces(page, read_trace(traces, text_of(traces, "unit").empty() ? text_of(run, "unit") : text_of(traces, "unit")), file, places, {});
  else if (recording)
    add_models(page, *models, read_run(*recording), path, places);
  if (const json m = member(map, "time_frequency", json::object()); !m.empty()) add_time_frequency(page, m, places);
  if (const json m = member(map, "restoring_force", json::object()); !m.empty()) add_restoring_force(page, m);
}

}  // namespace

void add_diagnosis(ReportPage& page, const json& result, const std::string& path, const ReportOptions& options) {
  if (!result.contains("mismatch") || !result.contains("missing")) throw InputError({path, 0}, "no \"mismatch\" or no \"missing\"", "wanted a diagnosis.json written by `unrig diagnose`", "");
  add_verdicts(page, result, file_name(path));
  page.add_section("Diagnosis: " + file_name(path));
  const json improvement = member(result, "improvement", json::object());
  page.add_heading("Where it is");
  add_places(page, result["mismatch"]);
  page.add_heading("What it is");
  add_missing(page, result["missing"], "Parameters of what was missing");
  add_closest(page, member(result, "closest", json::object()));
  if (const std::string search = text_of(result, "search_summary"); !search.empty()) page.add_text("Warning: " + search);
  if (result.value("stopped", false)) page.add_text(std::string("Warning: ") + stopped_words);
  page.add_heading("Before and after");
  add_improvement(page, improvement);
  page.add_heading("What it does to the load");
  add_price(page, member(result, "price_of_ignorance", json::array()));
  add_forces(page, member(result, "missing_force", json::array()));
  page.add_heading("What else was tried");
  add_ranking(page, member(result, "ranking", json::array()));
  page.add_heading("");
  add_provenance(page, result);
  const std::optional<Models> models = read_models(page, result, path, options);
  if (models) {
    std::vector<Run> found;
    for (const std::string& name : models->after.runs)
      if (const auto file = found_file(name, path, options)) found.push_back(read_run(*file));
    for (const Run& run : found) tell_conditions(page, models->rig, models->after, run);
    for (const json& run : member(improvement, "runs", json::array()))
      if (const std::string name = text_of(run, "file"); std::find(models->after.runs.begin(), models->after.runs.end(), name) == models->after.runs.end())
        if (const auto file = found_file(name, path, options)) tell_conditions(page, models->rig, models->after, read_run(*file));  // held out
    add_fitted_rig(page, models->rig, models->after, found);
  }
  std::string drawn;  // a run has one entry for each of its channels
  for (const json& run : member(improvement, "runs", json::array())) {
    if (text_of(run, "file") == drawn && run.contains("channel")) continue;
    add_run(page, result, run, models, path, options);
    drawn = text_of(run, "file");
  }
}

}  // namespace unrig
