#include <cmath>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/files/error.h"
#include "core/run/run.h"
#include "core/numerics/spectrum.h"
#include "correct/report/result_files.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;

std::string estimate(const json& result, const char* key) {
  const json e = result.value(key, json::object());
  return with_error(number_of(e, "value"), number_of(e, "std_error"));
}

/// Open where the recordings are not what the method takes them for, or the joint fit does not confirm it. What the rig file is warned of holds for every result of it.
Tone tone_of(const json& result) {
  const std::string rig = text_of(result, "rig") + ":";
  for (const json& warning : result.value("warnings", json::array()))
    if (warning.is_string() && !warning.get<std::string>().starts_with(rig)) return Tone::open;
  return result.contains("joint_fit") && !result["joint_fit"].value("agrees", false) ? Tone::open : Tone::good;
}

void add_modes(ReportPage& page, const json& result) {
  std::vector<std::vector<std::string>> rows;
  for (const char* which : {"dry", "wet"}) {
    const json& decay = result.at(which);
    for (const json& m : decay.contains("modes") ? decay["modes"] : json::array({decay}))
      rows.push_back({which, file_name(text_of(decay, "file")), with_error(number_of(m, "frequency"), number_of(m, "std_error")),
                      with_error(100 * number_of(m, "damping_ratio"), 100 * number_of(m, "damping_ratio_std_error")), plain(number_of(m, "model_frequency"), 7), text_of(m, "note")});
  }
  page.add_table("Vibrations", {"medium", "run", "frequency [Hz]", "damping ratio [%]", "model [Hz]", "remark"}, rows);
}

/// The gauge, or else the first channel that the analysis names.
const Channel* shown_channel(const Run& run, const json& decay) {
  for (const json& channel : decay.value("channels", json::array()))
    if (const Channel* found = run.find(text_of(channel, "name"))) return found;
  return run.find("gauge");
}

/// Zero-padded, so that a line can be read off: `length` seconds.
VectorXd amplitude(VectorXd x, double dt, double length) {
  double sum = 0;
  Index count = 0;
  for (const double v : x)
    if (std::isfinite(v)) sum += v, ++count;
  const double mean = count > 0 ? sum / static_cast<double>(count) : 0;
  for (double& v : x) v = std::isfinite(v) ? v - mean : 0;
  return amplitude_spectrum(x, dt, Window::hann, std::max<Index>(x.size(), static_cast<Index>(std::ceil(length / dt)))).line.cwiseAbs();
}

void add_two_spectra(ReportPage& page, const json& result, const Run& dry, const Run& wet, const Channel& of_dry, const Channel& of_wet) {
  const double length = 4 * std::max(static_cast<double>(dry.samples()) * dry.dt, static_cast<double>(wet.samples()) * wet.dt);
  const VectorXd in_air = amplitude(of_dry.value, dry.dt, length), in_fluid = amplitude(of_wet.value, wet.dt, length);
  const Index lines = std::min(in_air.size(), in_fluid.size()) - 1;
  const double spacing = 1 / (std::ceil(length / dry.dt) * dry.dt), other = 1 / (std::ceil(length / wet.dt) * wet.dt);
  Plot plot{"Spectra of the free decays", "frequency [Hz]", labelled("amplitude", of_dry.unit), VectorXd(lines), {{"dry", 2, VectorXd(lines)}, {"wet", 1, VectorXd(lines), {}, true}}};
  for (Index k = 0; k < lines; ++k) {  // both on the dry run's lines; padded fourfold, the nearest line is good enough to look at
    plot.x[k] = spacing * static_cast<double>(k + 1);
    plot.curves[0].value[k] = in_air[k + 1];
    plot.curves[1].value[k] = in_fluid[std::min(in_fluid.size() - 1, static_cast<Index>(std::lround(plot.x[k] / other)))];
  }
  plot.log_y = true;
  plot.height = 320;
  plot.caption = "Hann window, means removed, padded with zeros to four times the length. The lines mark the lowest fitted frequencies.";
  for (const char* which : {"dry", "wet"})
    if (const double f = number_of(result.at(which), "frequency"); std::isfinite(f)) plot.marks.emplace_back(f, fmt::format("{} {:.4g} Hz", which, f));
  page.add_plot(plot);
}

}  // namespace

void add_apparent_mass(ReportPage& page, const json& result, const std::string& path, const ReportOptions& options) {
  const std::string name = file_name(path), unit = text_of(result.at("apparent_mass"), "unit");
  const double theory = number_of(result.value("theory", json::object()), "value");
  std::string text = fmt::format("The fluid adds {} {}", estimate(result, "apparent_mass"), unit);
  if (std::isfinite(theory)) text += fmt::format(", {} times the theory's {:.4g} {} (π ρ b²)", estimate(result, "apparent_mass_coefficient"), theory, unit);
  const Tone tone = tone_of(result);
  page.add_verdict(tone, text + (tone == Tone::good ? "." : ". See what is said of it below."), name);
  page.add_section("Apparent mass: " + name);
  add_warnings(page, result);
  std::vector<std::vector<std::string>> rows{{"apparent mass", estimate(result, "apparent_mass"), unit}};
  if (std::isfinite(theory)) rows.push_back({"theory, π ρ b²", plain(theory, 6), unit});
  rows.push_back({"coefficient (over theory)", estimate(result, "apparent_mass_coefficient"), ""});
  if (result.contains("joint_fit")) rows.push_back({"the same from a joint fit of both decays", estimate(result, "joint_fit"), text_of(result["joint_fit"], "unit") == "1" ? "" : text_of(result["joint_fit"], "unit")});
  page.add_table("", {"quantity", "value ± one standard error", "unit"}, rows, "Method: " + text_of(result, "method") + ". " + text_of(result, "agreement"));
  add_modes(page, result);
  add_provenance(page, result);

  const auto dry = found_file(text_of(result.at("dry"), "file"), path, options), wet = found_file(text_of(result.at("wet"), "file"), path, options);
  if (!dry || !wet) {
    const std::string missing = "The recordings are not found, so that their spectra are left out; --data FOLDER says where they are.";
    warn(path + ": " + missing);
    return page.add_text("Warning: " + missing);
  }
  const Run in_air = read_run(*dry), in_fluid = read_run(*wet);
  const Channel *of_dry = shown_channel(in_air, result["dry"]), *of_wet = shown_channel(in_fluid, result["wet"]);
  if (of_dry && of_wet) add_two_spectra(page, result, in_air, in_fluid, *of_dry, *of_wet);
}

}  // namespace unrig
