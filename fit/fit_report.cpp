#include "fit/fit_report.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include <fmt/format.h>

#include "core/files/text_file.h"
#include "core/law/learnt_range.h"
#include "core/run/release.h"

namespace unrig {
namespace {

template <class Named>
std::string label(const Named& p) { return p.run.empty() ? p.name : p.name + " (" + base_name(p.run) + ")"; }

/// The numbers of the rig file and of the runs' heads, before and after.
std::string report_givens(const FitResult& r) {
  if (r.givens.empty()) return "";
  std::size_t width = 0;
  for (const FittedGiven& g : r.givens) width = std::max(width, label(g).size());
  std::string text = "[[Givens]] (value, in brackets as stated; shift, and standard deviation after, in stated standard deviations)\n";
  for (const FittedGiven& g : r.givens)
    text += fmt::format("    {:<{}} {: .6g} +/- {:.3g}{} (stated {:.6g} +/- {:.3g}) shift {:+.2f}, after {:.2f}\n", label(g) + ":", width + 1, g.value, g.std_error, g.unit == "1" ? "" : " " + g.unit, g.stated, g.stated_std,
                        (g.value - g.stated) / g.stated_std, g.std_error / g.stated_std);
  return text;
}

/// How far the runs took what the laws at work look at.
std::string report_reach(const FitResult& r) {
  std::string text;
  for (const auto& [id, learnt_on] : r.learnt_on)
    for (const auto& [symbol, range] : learnt_on) text += fmt::format("    {:<18} = where {}\n", id, told(symbol, range));
  return text.empty() ? text : "[[Laws]] (learnt on; beyond, simulate and correct refuse them)\n" + text;
}

std::string left_out(const FittedChannel& c) {
  const auto spikes = c.spikes + static_cast<Eigen::Index>(c.bad);
  return (spikes ? fmt::format(", {} spikes left out", spikes) : "") + (c.clipped ? fmt::format(", {} clipped readings left out", c.clipped) : "");
}

}  // namespace

std::string report(const FitResult& r, double least) {
  std::string text = "[[Fit Statistics]]\n";
  const auto line = [&](const char* name, const std::string& value) { text += fmt::format("    {:<18} = {}\n", name, value); };
  line("# fitting method", "Levenberg-Marquardt (Ceres), linear unknowns eliminated");
  line("# function evals", fmt::format("{}", r.evaluations));
  line("# data points", fmt::format("{}", r.observations));
  line("# variables", fmt::format("{}", r.variables));
  line("chi-square", fmt::format("{:.4f}", r.chi2));
  line("reduced chi-square", fmt::format("{:.5f}", r.reduced_chi2()));
  line("Akaike info crit", fmt::format("{:.2f}", r.aic()));
  line("Bayesian info crit", fmt::format("{:.2f}", r.bic()));
  line("standard errors", r.coloured ? "residuals coloured: from their own spectra (for white ones in brackets)" : "residuals white");
  for (const ChannelColour& one : r.noise_colour) {
    std::string corners;
    for (const double corner : one.colour.corner) corners += fmt::format("{}{:.2g}", corners.empty() ? "" : ", ", corner);
    std::string shares = fmt::format("{}: {:.2g} % of its variance in parts that are correlated, with corners at {} Hz", one.channel, 100 * one.colour.power.sum() / one.colour.variance(), corners);
    if (one.colour.falling.size() > 0) shares += fmt::format("; {:.2g} % falls towards half the sampling rate, as behind a filter against aliasing", 100 * one.colour.falling.sum() / one.colour.variance());
    line("noise colour", shares);
  }
  if (!r.no_answer.empty()) text += "    NO TRUSTWORTHY ANSWER: " + r.no_answer + "\n";

  std::size_t width = 0;
  for (const FittedParameter& p : r.parameters) width = std::max(width, label(p).size());
  text += "[[Variables]]\n";
  for (const FittedParameter& p : r.parameters) {
    const std::string unit = p.unit == "1" ? "" : " " + p.unit;
    if (std::isfinite(p.std_error))
      text += fmt::format("    {:<{}} {: .7g} +/- {:.3g}{} ({:.2f}%) (init = {:.6g}){}{}\n", label(p) + ":", width + 1, p.value, p.std_error, unit,
                          100 * std::abs(p.std_error / p.value), p.start, r.coloured && p.std_error_white > 0 ? fmt::format(" [{:.3g}]", p.std_error_white) : "", p.identified ? "" : " NOT IDENTIFIED");
    else
      text += fmt::format("    {:<{}} {: .7g}{} (fixed)\n", label(p) + ":", width + 1, p.value, unit);
    if (!p.advice.empty()) text += fmt::format("    {:<{}}  {}\n", "", width + 1, p.advice);
  }

  if (!r.determined.empty()) text += "[[Determined]]\n";
  for (const DeterminedCombination& c : r.determined) text += fmt::format("    {} = {:.7g} +/- {:.3g}. {}\n", c.combination, c.value, c.std_error, c.settled_by);
  if (!r.profiles.empty()) text += "[[Profile likelihood]]\n";
  for (const ProfiledParameter& p : r.profiles)
    for (const ProfileInterval& i : p.intervals) text += fmt::format("    {:<{}} {}\n", &i == &p.intervals.front() ? label(p) + ":" : "", width + 1, i.text);

  text += report_reach(r);
  text += report_givens(r);
  std::vector<std::tuple<double, std::string>> pairs;
  for (Eigen::Index i = 0; i < r.correlation.rows(); ++i)
    for (Eigen::Index j = i + 1; j < r.correlation.cols(); ++j)
      if (std::abs(r.correlation(i, j)) >= least)
        pairs.emplace_back(-std::abs(r.correlation(i, j)), fmt::format("    C({}, {}) = {:+.4f}\n", label(r.parameters[static_cast<std::size_t>(i)]),
                                                                       label(r.parameters[static_cast<std::size_t>(j)]), r.correlation(i, j)));
  std::sort(pairs.begin(), pairs.end());
  text += fmt::format("[[Correlations]] (unreported correlations are < {:.3f})\n", least);
  for (const auto& [strength, what] : pairs) text += what;

  text += "[[Runs]]\n";
  for (const FittedRun& run : r.runs) {
    text += fmt::format("    {}: {} samples, reduced chi-square {:.3f}{}{}\n", base_name(run.file), run.samples, run.reduced_chi2(), run.aside ? ", set aside: no part in the fit" : "",
                        run.hold ? ", " + said_of(*run.hold) : "");
    for (const FittedChannel& c : run.channels)
      text += fmt::format("        {:<6} residual {:.4g} {}, noise {:.4g} {}{}{}\n", c.name, c.rms_residual, c.unit, c.noise, c.unit,
                          c.missing ? fmt::format(", {} missing", c.missing) : "", left_out(c));
  }
  return text;
}

}  // namespace unrig
