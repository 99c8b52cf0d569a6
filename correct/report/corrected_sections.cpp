#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/files/heard_warnings.h"
#include "core/files/text_file.h"
#include "core/rig/fingerprint.h"
#include "core/files/csv_table.h"
#include "core/files/units.h"
#include "core/model/wagner.h"
#include "correct/estimate/how_far_to_trust.h"
#include "correct/estimate/uncertainty_budget.h"
#include "correct/report/fit_traces.h"
#include "correct/report/result_files.h"
#include "correct/report/rig_sections.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The column, in the unit of the file; null where it is absent. Throws InputError where it holds text, or has a unit that is none.
const CsvColumn* find(const CsvTable& table, const std::string& name) {
  for (const CsvColumn& c : table.columns) {
    if (c.name != name) continue;
    if (!c.text.empty()) throw InputError({table.file, c.text_line}, fmt::format("the column \"{}\" holds \"{}\"", name, c.text), "wanted numbers", "");
    if (!c.unit.empty()) si_unit(c.unit, {table.file, table.header_line}, fmt::format("the column \"{}\"", name));
    return &c;
  }
  return nullptr;
}

const CsvColumn& column(const CsvTable& table, const char* name) {
  if (const CsvColumn* found = find(table, name)) return *found;
  throw InputError({table.file, table.header_line}, fmt::format("no column \"{}\"", name), "wanted a file that `unrig correct` wrote", "");
}

/// Of increasing values without a gap: time, semichords.
const VectorXd& increasing(const CsvTable& table, const CsvColumn& c) {
  for (Index k = 0; k < c.value.size(); ++k)
    if (!std::isfinite(c.value[k]) || (k > 0 && !(c.value[k] > c.value[k - 1])))
      throw InputError(table.place(k), fmt::format("\"{}\" is {} after {}", c.name, c.value[k], k > 0 ? c.value[k - 1] : std::nan("")), "wanted increasing numbers", "");
  if (c.value.size() < 2) throw InputError({table.file, table.header_line}, fmt::format("{} rows", c.value.size()), "wanted at least two", "");
  return c.value;
}

/// How many standard deviations the band has to either side: as many as hold the whole curve with 95 %, where the table says how many these are; otherwise two.
double band_factor(const CsvTable& table, const std::string& name) {
  const CsvColumn *band = find(table, name + "_band95"), *std = find(table, name + "_std");
  Index k = 0;
  const double most = std && std->value.size() > 0 ? std->value.maxCoeff(&k) : 0;
  return band && most > 0 && band->value[k] > 0 ? band->value[k] / most : 2;
}

/// The page draws two of `std` to either side.
VectorXd band_of(const VectorXd& std, double factor) { return std * (factor / 2); }

std::string caption_of_band(double factor) {
  return factor == 2 ? "The band is two standard deviations at each point." : fmt::format("The band, {:.2f} standard deviations, holds the whole curve with 95 %.", factor);
}

constexpr Index of_a_long_record = 1000000;  // a table of the response does not say how long its record was

/// The verdict in the tone of what a reader must know first.
void add_verdict(ReportPage& page, const HowFarToTrust& trust, Index samples, Tone tone, const std::string& text, const std::string& about) {
  if (!trust.no_answer.empty()) return page.add_verdict(Tone::bad, "Not to be trusted, see below. " + text, about);
  if (trust.misses_something(samples))
    return page.add_verdict(Tone::bad, fmt::format("Something is missing from the rig of the fit: gauge and angle are explained to a reduced chi-square of {} only. {}", plain(trust.reduced_chi2, 3), text), about);
  if (!trust.warnings.empty()) return page.add_verdict(Tone::open, text + " See the warnings below.", about);
  page.add_verdict(tone, text, about);
}

void add_warnings(ReportPage& page, const HowFarToTrust& trust) {
  if (!trust.no_answer.empty()) page.add_text("No trustworthy answer: " + trust.no_answer);
  for (const std::string& warning : trust.warnings) page.add_text("Warning: " + warning);
  add_provenance(page, trust.made_by.provenance);
}

/// The lowest and the largest of the finite values.
std::pair<double, double> span_of(const VectorXd& x) {
  const auto there = x.array().isFinite();
  return {there.select(x.array(), std::numeric_limits<double>::infinity()).minCoeff(), there.select(x.array(), -std::numeric_limits<double>::infinity()).maxCoeff()};
}

/// The scale of the gauge and of the circulatory load: the inertial spike of the whole load, while the angle changes, may be many times that. Nothing where it is not.
std::optional<std::pair<double, double>> without_spike(const VectorXd& gauge, const VectorXd& circulatory, const VectorXd& load) {
  const auto [gauge_low, gauge_high] = span_of(gauge);
  const auto [low, high] = span_of(circulatory);
  const auto [load_low, load_high] = span_of(load);
  const double bottom = std::min(gauge_low, low), top = std::max(gauge_high, high), margin = 0.08 * (top - bottom);
  if (!(top > bottom) || !std::isfinite(top - bottom) || (load_low > bottom - margin && load_high < top + margin)) return std::nullopt;
  return std::pair{bottom - margin, top + margin};
}

/// Error budget of a load: its variance over time by where it comes from, and the same in numbers. Nothing where an earlier version wrote the table.
void add_budget(ReportPage& page, const CsvTable& table, const std::string& load, const std::string& called, const std::string& group) {
  static const std::map<std::string, std::string> meaning{{"gauge", "noise of the gauge"}, {"angle", "noise of the angle"}, {"calibration", "calibration of the gauge"}, {"parameters", "parameters of the fit"},
                                                          {"givens", "stated numbers of rig file and head"}, {"regularisation", "regularisation"}};
  const CsvColumn &time = column(table, "time"), &std = column(table, (load + "_std").c_str());
  Plot plot{"Error budget of the " + called, labelled("time", time.unit), "share of the variance", time.value, {}, group};
  std::vector<std::string> header{"", "time", "standard deviation"};
  for (std::size_t s = 0; s < share_names.size(); ++s) {
    const CsvColumn* share = find(table, load + "_share_" + share_names[s]);
    if (constexpr double seen = 5e-4; !share || !(share->value.array() > seen).any()) continue;
    plot.curves.push_back({meaning.at(share_names[s]), static_cast<int>(s), share->value});
    header.push_back(meaning.at(share_names[s]));
  }
  if (plot.curves.empty()) return;
  plot.stacked = true;
  plot.height = 220;
  plot.caption = "How much of the band's variance (one standard deviation squared) at each time comes from what; the shares sum to one. The error of the gauge's zero is in its noise. What is not named here has less than 0.05 % of it throughout.";
  page.add_plot(plot);
  Index widest = 0;
  std.value.maxCoeff(&widest);
  const Index last = time.value.size() - 1;
  std::vector<std::vector<std::string>> rows;
  for (const auto& [where, k] : std::vector<std::pair<std::string, Index>>{{"at the start", 0}, {"where the band is widest", widest}, {"at the end", last}}) {
    rows.push_back({where, plain(time.value[k], 4) + " " + time.unit, plain(std.value[k], 3) + " " + std.unit});
    for (const Curve& curve : plot.curves) rows.back().push_back(std::isfinite(curve.value[k]) ? fmt::format("{:.1f} %", 100 * curve.value[k]) : "—");
  }
  page.add_table("", header, rows);
}

/// What a table was made from, as far as its files are found and have not changed since.
struct Origin {
  std::optional<Rig> rig;
  std::optional<FittedRig> fit;
  std::optional<Run> run;
};

/// The files are the words of the command that made the table; the fingerprints say which is what, and that they are those.
Origin origin_of(const MadeBy& made, const std::string& table, const ReportOptions& options) {
  Origin origin;
  std::string word;
  std::vector<std::string> words;
  bool quoted = false;
  for (const char c : made.provenance.command + " ") {
    if (c == '\'') quoted = !quoted;
    else if (!quoted && (c == ' ' || c == '=')) words.push_back(std::exchange(word, ""));
    else word += c;
  }
  for (const std::string& name : words) {
    const auto file = found_file(name, table, options);
    if (!file) continue;
    const HeardWarnings silence;
    try {
      if (file->ends_with(".toml")) {
        if (Rig rig = read_rig(*file); fingerprint(rig) == made.rig) origin.rig = std::move(rig);
      } else if (file->ends_with(".json")) {
        if (FittedRig fit = read_fit(*file); fingerprint(fit) == made.fit) origin.fit = std::move(fit);
      } else if (origin.rig && !origin.run) {
        if (Run run = read_run(*file); fingerprint(run, *origin.rig) == made.run) origin.run = std::move(run);
      }
    } catch (const InputError&) {
      continue;  // another file of that name
    }
  }
  return origin;
}

}  // namespace

void add_corrected(ReportPage& page, const std::string& text, const std::string& path, const ReportOptions& options) {
  const CsvTable table = read_csv(text, 1, path);
  const CsvColumn& time = column(table, "time");
  const VectorXd& t = increasing(table, time);
  const CsvColumn &gauge = column(table, "gauge"), &load = column(table, "normal_force"), &load_std = column(table, "normal_force_std"),
                  &circulatory = column(table, "circulatory"), &circulatory_std = column(table, "circulatory_std");
  const std::string name = file_name(path), time_label = labelled("time", time.unit);
  const Index last = t.size() - 1;
  const double dt = (t[last] - t[0]) / static_cast<double>(last);

  const HowFarToTrust trust = HowFarToTrust::of_table(table);
  const bool is_told = std::isfinite(trust.reduced_chi2) || !trust.warnings.empty() || !trust.no_answer.empty();
  add_verdict(page, trust, t.size(), is_told ? Tone::good : Tone::open,
              fmt::format("A rigid rig would have felt a circulatory load of {} {} at the end of the record, after {} {} before the motion.", with_error(circulatory.value[last], circulatory_std.value[last]),
                          load.unit, plain(circulatory.value[0], 4), load.unit),
              name);
  page.add_section("Correction: " + name);
  add_warnings(page, trust);
  const Origin origin = origin_of(trust.made_by, path, options);
  std::vector<double> modes;
  if (origin.rig && origin.fit && origin.run) {
    tell_conditions(page, *origin.rig, *origin.fit, *origin.run);
    modes = modes_of(fitted_model(*origin.rig, *origin.fit, *origin.run));
  }
  page.add_text(is_told ? fmt::format("Gauge and angle are explained to a reduced chi-square of {}; 1 is their noise.", plain(trust.reduced_chi2, 4))
                        : "Warning: the file does not say how well gauge and angle are explained: `unrig correct` of an earlier version wrote it. Correct the run again.");
  const double of_load = band_factor(table, "normal_force"), of_circulatory = band_factor(table, "circulatory");
  Plot both{"Gauge and the load of a rigid rig", time_label, labelled("load", load.unit), t,
            {{"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, band_of(load_std.value, of_load)}}, name,
            "The gauge reads the equivalent force at the calibration station, the load is the whole normal force: even at rest they differ by the ratio of their levers. " + caption_of_band(of_load), false,
            false, 320};
  both.y_range = without_spike(gauge.value, circulatory.value, load.value);
  if (both.y_range)
    both.caption += fmt::format(" The inertial load while the angle changes, {} to {} {}, is outside of the scale.", plain(load.value.minCoeff(), 3), plain(load.value.maxCoeff(), 3), load.unit);
  page.add_plot(both);
  if (const CsvColumn* left = find(table, "unexplained"))
    page.add_plot({"Residual of the gauge", time_label, labelled("recording − model", left->unit), t, {{"residual", 1, left->value}}, name,
                   "What neither the load nor the rig's answer to it accounts for. More than noise here is missing from the load above.", false, false, 180, {}, gauge.value});
  page.add_plot({"Gauge and the circulatory part of the load", time_label, labelled("load", circulatory.unit), t,
                 {{"gauge reading", 0, gauge.value}, {"circulatory load", 2, circulatory.value, band_of(circulatory_std.value, of_circulatory)}}, name, caption_of_band(of_circulatory)});
  add_budget(page, table, "circulatory", "circulatory load", name);
  add_budget(page, table, "normal_force", "load of a rigid rig", name);
  const CsvColumn &cn = column(table, "cn"), &cn_std = column(table, "cn_std");
  Plot coefficient{"Normal-force coefficient", "time [semichords since the motion began]", "C_N", increasing(table, column(table, "semichords")),
                   {{"C_N", 1, cn.value, band_of(cn_std.value, of_load)}}, "", caption_of_band(of_load)};
  Index largest = 0;
  if (load.value.cwiseAbs().maxCoeff(&largest) > 0) {
    const VectorXd of_circulation = circulatory.value * (cn.value[largest] / load.value[largest]);
    coefficient.y_range = without_spike(of_circulation, of_circulation, cn.value);
  }
  page.add_plot(coefficient);
  add_spectra(page, "Spectra before and after the correction", dt, load.unit, {"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, {}, true},
              "Amplitude of the whole record, mean removed, Hann window. What the rig adds stands in the reading only.", modes);
}

void add_modal_load(ReportPage& page, const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const CsvColumn& time = column(table, "time");
  const VectorXd& t = increasing(table, time);
  const CsvColumn &gauge = column(table, "gauge"), &load = column(table, "normal_force"), &load_std = column(table, "normal_force_std"), &inputs = column(table, "from_inputs");
  const std::string name = file_name(path), time_label = labelled("time", time.unit);
  const double dt = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  const auto rms = [](const VectorXd& x) { return std::sqrt(x.array().isFinite().select(x.array().square(), 0).sum() / static_cast<double>(std::max<Index>(1, x.array().isFinite().count()))); };

  const HowFarToTrust trust = HowFarToTrust::of_table(table);
  add_verdict(page, trust, of_a_long_record, Tone::good,
              fmt::format("A rigid rig that does not move would have read {} {} r.m.s., give or take {}; the gauge reads {}, of which the measured inputs account for {}.", plain(rms(load.value), 4), load.unit,
                          plain(rms(load_std.value), 2), plain(rms(gauge.value), 4), plain(rms(inputs.value), 4)),
              name);
  page.add_section("Correction: " + name);
  add_warnings(page, trust);
  const double of_load = band_factor(table, "normal_force");
  page.add_plot({"Gauge and the load of a rigid rig", time_label, labelled("reading", load.unit), t, {{"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, band_of(load_std.value, of_load)}}, name,
                 "The rig is known only as modes: the load is what the gauge would read of it if the rig were rigid and its mount at rest. " + caption_of_band(of_load), false, false, 320});
  page.add_plot({"Gauge and what the measured inputs do to it", time_label, labelled("reading", gauge.unit), t,
                 {{"gauge reading", 0, gauge.value}, {"from the measured inputs", 2, inputs.value}}, name, "Inputs are the motion of the mount and a measured force."});
  page.add_plot({"The load alone", time_label, labelled("load", load.unit), t, {{"rigid-rig load", 1, load.value, band_of(load_std.value, of_load)}}, name,
                 "With its band, on a scale of its own. The load is smoothed as far as the noise demands: what is faster than its bandwidth is left out."});
  add_budget(page, table, "normal_force", "load", name);
  add_spectra(page, "Spectra before and after the correction", dt, load.unit, {"gauge reading", 0, gauge.value}, {"reading less what the inputs do", 1, gauge.value - inputs.value},
              "Amplitude of the whole record, mean removed, Hann window. What stands out of both is a load, or a mode that the rig file does not have.");
}

void add_indicial(ReportPage& page, const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const VectorXd& s = increasing(table, column(table, "semichords"));
  const VectorXd &value = column(table, "indicial").value, &std = column(table, "indicial_std").value;
  Index first = 0;
  while (first < s.size() && !(s[first] > 0)) ++first;  // the axis is logarithmic
  const Index rows = s.size() - first;
  const VectorXd x = s.tail(rows), wagners = x.unaryExpr([](double at) { return wagner_exact(at); });
  const double factor = band_factor(table, "indicial");
  Index within = 0, known = 0;
  for (Index k = 0; k < rows; ++k) {
    const double off = (value[first + k] - wagners[k]) / std[first + k];
    if (!(std[first + k] > 0) || !std::isfinite(off)) continue;
    ++known;
    if (std::abs(off) <= factor) ++within;
  }
  if (known == 0) throw InputError({path, 1}, "no row has a standard deviation", "wanted an indicial response that `unrig correct --indicial` wrote", "");
  const std::string name = file_name(path), range = fmt::format("from {:.3g} to {:.3g} semichords", x[0], x[rows - 1]);
  const HowFarToTrust trust = HowFarToTrust::of_table(table);
  if (within == known)
    add_verdict(page, trust, of_a_long_record, Tone::good, fmt::format("The indicial response agrees with Wagner's function, which lies within its 95 % band all the way {}.", range), name);
  else
    add_verdict(page, trust, of_a_long_record, Tone::open,
                fmt::format("The indicial response departs from Wagner's function, which lies within its 95 % band over {:.0f} % of the points {}.", 100 * static_cast<double>(within) / static_cast<double>(known), range), name);
  page.add_section("Indicial response: " + name);
  add_warnings(page, trust);
  page.add_plot({"Indicial response against Wagner's", "distance since the step [semichords]", "response over its limit", x,
                 {{"estimated", 1, value.tail(rows), band_of(std.tail(rows), factor)}, {"Wagner (exact)", 0, wagners, {}, true}}, "",
                 "Nothing in the estimate assumes Wagner's shape. " + caption_of_band(factor) + " Neighbouring points move together.", true, false, 340});
}

void add_indicials(ReportPage& page, const std::vector<std::string>& paths) {
  if (paths.size() < 2) return;
  struct OfAStep {
    std::string name;
    VectorXd s, value, std;
  };
  std::vector<OfAStep> all;
  std::set<double> grid;
  for (const std::string& path : paths) {
    const CsvTable table = read_csv(read_text(path), 1, path);
    const double factor = band_factor(table, "indicial");
    all.push_back({file_name(path), increasing(table, column(table, "semichords")), column(table, "indicial").value, band_of(column(table, "indicial_std").value, factor)});
    for (const double s : all.back().s)
      if (s > 0) grid.insert(s);
  }
  const std::vector<double> sorted(grid.begin(), grid.end());
  const VectorXd x = Eigen::Map<const VectorXd>(sorted.data(), static_cast<Index>(sorted.size()));
  Plot plot{"Indicial responses of all steps", "distance since the step [semichords]", "response over its limit", x, {}};
  constexpr std::size_t colours = 4;  // and the grey of Wagner's
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto& [name, s, value, std] = all[k];
    VectorXd y = VectorXd::Constant(x.size(), std::nan("")), band = y;
    Index i = 0;
    for (Index j = 0; j < x.size(); ++j) {
      if (x[j] < s[0] || x[j] > s[s.size() - 1]) continue;
      while (i + 2 < s.size() && s[i + 1] < x[j]) ++i;
      const double share = (x[j] - s[i]) / (s[i + 1] - s[i]);
      y[j] = value[i] + share * (value[i + 1] - value[i]);
      band[j] = std[i] + share * (std[i + 1] - std[i]);
    }
    plot.curves.push_back({name, 1 + static_cast<int>(k % colours), y, band, k >= colours});
  }
  plot.curves.push_back({"Wagner (exact)", 0, x.unaryExpr([](double at) { return wagner_exact(at); }), {}, true});
  plot.log_x = true;
  plot.height = 340;
  plot.caption = "Steps of one airfoil at one speed have one response as long as the fluid is linear; where bands part, angle or size of the step matters. Each band as in the response's own plot; between its points straight lines.";
  page.add_section("Indicial responses of all steps");
  page.add_plot(plot);
}

}  // namespace unrig
