#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/error.h"
#include "core/law/law_effect.h"
#include "correct/report/fit_traces.h"
#include "correct/report/result_files.h"
#include "correct/report/rig_sections.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;

/// Below this probability a residual is no white noise (the test that chooses the standard errors, fit/fit.h).
constexpr double coloured_below = 0.01;

struct Told {
  Tone tone;
  std::string text;
};

Told verdict(const json& fit) {
  if (!fit.value("converged", true)) return {Tone::bad, "The fit did not converge: " + text_of(fit, "message")};
  std::size_t white = 0, determined = 0;
  std::string coloured;
  const json runs = fit.value("runs", json::array()), parameters = fit.at("parameters");
  for (const json& run : runs) {
    if (run.value("whiteness", 1.0) >= coloured_below)
      ++white;
    else
      coloured += (coloured.empty() ? "" : ", ") + file_name(text_of(run, "file"));
  }
  for (const json& p : parameters) determined += p.value("identified", true) ? 1 : 0;
  std::string text = fmt::format("The model explains {} of {} recordings down to white noise (reduced chi-square {:.3g} over all)", white, runs.size(), number_of(fit, "reduced_chi2"));
  if (!coloured.empty()) text += "; something regular is left in " + coloured;
  text += fmt::format("; {} of {} parameters are determined.", determined, parameters.size());
  return {coloured.empty() && determined == parameters.size() ? Tone::good : Tone::open, text};
}

void add_parameters(ReportPage& page, const json& parameters) {
  std::vector<std::vector<std::string>> rows;
  for (const json& p : parameters) {
    const std::string unit = text_of(p, "unit");
    std::string remark = p.value("identified", true) ? "" : "not determined. ";
    remark += text_of(p, "advice");
    rows.push_back({text_of(p, "name"), file_name(text_of(p, "run")), with_error(number_of(p, "value"), number_of(p, "std_error")), unit == "1" ? "" : unit,
                    plain(number_of(p, "start")), remark});
  }
  page.add_table("Parameters", {"parameter", "of run", "value ± one standard error", "unit", "started from", "remark"}, rows);
}

/// Laws of one's own at work, and how far the fitted runs took what they look at.
void add_laws(ReportPage& page, const FittedRig& fit) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& effect : fit.laws) {
    const Law& law = law_of(*effect);
    page.add_equation(law.name, effect->equation, law.file);
    for (const auto& [symbol, range] : law.learnt_on) {
      const auto s = index_of(symbol);
      rows.push_back({law.name, std::string(symbol_names[s]), plain(range.lower), plain(range.upper), symbol_units[s]});
    }
  }
  if (!rows.empty()) page.add_table("Laws learnt on", {"law", "symbol", "from", "to", "unit"}, rows, "Outside of these ranges a law is a guess: simulate and correct refuse it.");
}

void add_runs(ReportPage& page, const json& runs) {
  std::vector<std::vector<std::string>> rows;
  for (const json& run : runs) {
    const json channels = run.contains("channels") ? run["channels"] : json::array({run});
    for (const json& c : channels) {
      const double left = number_of(c, "rms_residual"), noise = number_of(c, "noise");
      rows.push_back({file_name(text_of(run, "file")), text_of(c, "name"), plain(number_of(c, "samples"), 9), plain(left, 4), plain(noise, 4), text_of(c, "unit"), plain(left / noise, 3),
                      &c == &channels.front() ? plain(number_of(run, "reduced_chi2"), 4) : "", &c == &channels.front() ? plain(number_of(run, "whiteness"), 2) : ""});
    }
  }
  page.add_table("Recordings", {"run", "channel", "samples", "residual (r.m.s.)", "noise (std)", "unit", "ratio", "reduced chi-square", "white with probability"}, rows,
                 "Reduced chi-square and the test for white noise are of all channels of a run together.");
}

void add_correlations(ReportPage& page, const json& fit) {
  constexpr double worth_telling = 0.5;
  const json& parameters = fit.at("parameters");
  const auto label = [&](std::size_t i) {
    const std::string run = file_name(text_of(parameters[i], "run"));
    return text_of(parameters[i], "name") + (run.empty() ? "" : " (" + run + ")");
  };
  std::vector<std::vector<std::string>> rows;
  const json matrix = fit.value("correlation", json::array());
  for (std::size_t i = 0; i < std::min(matrix.size(), parameters.size()); ++i)
    for (std::size_t j = i + 1; j < std::min(matrix[i].size(), parameters.size()); ++j)
      if (matrix[i][j].is_number() && std::abs(matrix[i][j].get<double>()) >= worth_telling)
        rows.push_back({label(i), label(j), fmt::format("{:+.3f}", matrix[i][j].get<double>())});
  if (!rows.empty()) page.add_table("Correlations of 0.5 and more", {"parameter", "with", "correlation"}, rows);
  // Parameters that are held have no correlation.
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < std::min(matrix.size(), parameters.size()); ++i)
    if (parameters[i].value("identified", true) && i < matrix[i].size() && matrix[i][i].is_number() && matrix[i][i].get<double>() > 0) free.push_back(i);
  if (free.size() < 2) return;
  HeatMap map{"Correlation of the parameters", "", "", "correlation", {}, {}, {}, "Near +1 or -1 the runs determine a combination of the two better than either.", false, true};
  map.limit = 1;
  for (const std::size_t i : free) {
    map.x.push_back(static_cast<double>(map.x.size()));
    map.names.push_back(label(i));
    map.z.emplace_back();
    for (const std::size_t j : free) map.z.back().push_back(j < matrix[i].size() && matrix[i][j].is_number() ? matrix[i][j].get<double>() : std::nan(""));
  }
  map.y = map.x;
  page.add_map(map);
}

/// Angles are read in degrees.
void to_degrees(FitTrace& trace) {
  if (trace.unit != "rad") return;
  const double degrees = 180 / std::numbers::pi;
  trace.measured *= degrees;
  trace.model *= degrees;
  trace.noise *= degrees;
  trace.unit = "deg";
}

void add_traces(ReportPage& page, const Run& run, std::vector<FitTrace> traces, const std::vector<double>& modes) {
  const std::string name = file_name(run.file);
  page.add_section("Recording: " + name);
  const VectorXd time = VectorXd::LinSpaced(run.samples(), run.start, run.time(run.samples() - 1));
  for (FitTrace& trace : traces) {
    to_degrees(trace);
    const VectorXd left = trace.measured - trace.model;
    page.add_plot({trace.name + ": recording and fit", "time [s]", labelled(trace.name, trace.unit), time, {{"recording", 0, trace.measured}, {"fit", 2, trace.model, {}, true}}, run.file});
    page.add_plot({trace.name + ": residual", "time [s]", labelled("recording − fit", trace.unit), time,
                   {{"residual", 1, left}, {"noise", 0, VectorXd::Zero(time.size()), VectorXd::Constant(time.size(), trace.noise), true}}, run.file,
                   fmt::format("The band is twice the channel's own noise of {:.3g} {}, to either side.", trace.noise, trace.unit), false, false, 180, {}, trace.measured});
  }
  const FitTrace& first = traces.front();
  add_spectra(page, first.name + ": spectra before and after", run.dt, first.unit, {"recording", 0, first.measured}, {"residual", 1, first.measured - first.model},
              "Amplitude of the whole record, mean removed, Hann window. Lines that stand out of the residual are what the model does not know.", modes);
  add_residual_checks(page, first.name, first.measured - first.model, first.noise, run.dt);
}

}  // namespace

void add_fit(ReportPage& page, const json& result, const std::string& path, const ReportOptions& options) {
  const FittedRig fit = read_fit(path);  // refuses what is no fit
  const Told told = verdict(result);
  page.add_verdict(told.tone, told.text, file_name(path));
  page.add_section("Fit: " + file_name(path));
  add_parameters(page, result["parameters"]);
  page.add_text("Standard errors: " + text_of(result, "standard_errors") + ".");
  if (!fit.effects.empty()) page.add_text(fmt::format("Physics beyond the rig at work: {}.", fmt::join(fit.effects, ", ")));
  add_laws(page, fit);
  add_warnings(page, result);
  const json runs = result.value("runs", json::array());
  add_runs(page, runs);
  add_correlations(page, result);
  add_provenance(page, result);

  const auto rig_file = found_file(text_of(result, "rig"), path, options);
  const auto missing = [&](const std::string& what) {
    const std::string text = fmt::format("{} is not found, so that its plots are left out; --data FOLDER says where recordings and rig are.", what);
    warn(path + ": " + text);
    page.add_text("Warning: " + text);
  };
  if (!rig_file) return missing("The rig \"" + text_of(result, "rig") + "\"");
  const Rig rig = read_rig(*rig_file);
  if (!can_be_drawn(page, fit, rig, path)) return;
  std::vector<Run> found;
  for (const std::string& name : fit.runs) {
    const auto file = found_file(name, path, options);
    if (!file) {
      missing("The recording \"" + name + "\"");
      continue;
    }
    found.push_back(read_run(*file));
    warn_of_another(page, fit, rig, found.back(), path);
    tell_conditions(page, rig, fit, found.back());
  }
  add_fitted_rig(page, rig, fit, found);
  for (const Run& run : found) add_traces(page, run, fit_traces(rig, fit, run), modes_of(fitted_model(rig, fit, run)));
}

}  // namespace unrig
