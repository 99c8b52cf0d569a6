#include "fit/apparent_mass/apparent_mass_files.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "core/run/release.h"

namespace unrig {
namespace {

using nlohmann::json;

const char* name_of(ApparentMassMethod method) { return method == ApparentMassMethod::mode_shapes ? "mode shapes" : "frequency ratio"; }

/// JSON knows no NaN.
json number(double x) { return std::isfinite(x) ? json(x) : json(nullptr); }
json number(const std::optional<double>& x) { return x ? number(*x) : json(nullptr); }

json estimate(const std::optional<Estimate>& e) {
  return {{"value", e ? number(e->value) : json(nullptr)}, {"std_error", e ? number(e->std_error) : json(nullptr)}};
}

json mode_json(const ModeLine& line) {
  const DampedMode& m = line.measured;
  json out = {{"frequency", number(m.frequency)},
              {"std_error", number(m.frequency_error)},
              {"damping_ratio", number(m.damping_ratio)},
              {"damping_ratio_std_error", number(m.damping_ratio_error)},
              {"decay", number(m.decay)},
              {"decay_std_error", number(m.decay_error)},
              {"natural_frequency", number(m.natural_frequency)},
              {"natural_frequency_std_error", number(m.natural_error)},
              {"exponential", m.poles == 1},
              {"amplitude", json::array()},
              {"mode", line.mode > 0 ? json(line.mode) : json(nullptr)},
              {"model_frequency", line.model_frequency > 0 ? json(line.model_frequency) : json(nullptr)}};
  for (const double a : m.amplitude) out["amplitude"].push_back(number(a));
  if (!line.note.empty()) out["note"] = line.note;
  return out;
}

json run_json(const RunModes& run) {
  const DampedMode& m = run.lowest();
  json out = {{"file", run.file},
              {"fingerprint", run.fingerprint},
              {"medium", run.medium},
              {"density", {{"value", run.density}, {"unit", "kg/m^3"}}},
              {"frequency", number(m.frequency)},
              {"std_error", number(m.frequency_error)},
              {"damping_ratio", number(m.damping_ratio)},
              {"damping_ratio_std_error", number(m.damping_ratio_error)},
              {"unit", "Hz"},
              {"modes", json::array()},
              {"channels", json::array()}};
  if (run.hold) out["release"] = run.hold->release, out["held"] = run.hold->samples;
  for (const ModeLine& line : run.modes) out["modes"].push_back(mode_json(line));
  for (std::size_t c = 0; c < run.channels.size(); ++c) {
    const auto i = static_cast<Eigen::Index>(c);
    out["channels"].push_back({{"name", run.channels[c]}, {"unit", run.units[c]}, {"rms_residual", number(run.residual[i])}, {"noise", number(run.noise[i])}});
  }
  return out;
}

/// Decimals that show two digits of the error.
int decimals(double error, int otherwise = 6) {
  return std::isfinite(error) && error > 0 ? std::clamp(1 - static_cast<int>(std::floor(std::log10(error))), 0, 12) : otherwise;
}

std::string with_error(const Estimate& e) {
  const int digits = decimals(e.std_error);
  return fmt::format("{:.{}f} +- {:.{}f}", e.value, digits, e.std_error, digits);
}

std::string table(const RunModes& run) {
  std::string text = fmt::format("[[Vibrations in {}]] ({}, {:g} kg/m^3){}\n", base_name(run.file), run.medium, run.density, run.hold ? " " + said_of(*run.hold) : "");
  text += fmt::format("    {:>24}  {:>22}  {:>12}  {:>4}  {:>12}  {:>10}\n", "frequency [Hz]", "damping ratio [%]", fmt::format("amplitude [{}]", run.units.front()), "mode", "model [Hz]", "off [%]");
  for (const ModeLine& line : run.modes) {
    const DampedMode& m = line.measured;
    const bool folded = line.model_frequency > 0 && line.note.find("folded") != std::string::npos;
    std::string model = "-", off = "-";
    if (line.model_frequency > 0) model = fmt::format("{:.{}f}", line.model_frequency, decimals(m.frequency_error));
    if (line.model_frequency > 0 && !folded) off = fmt::format("{:+.{}f}", 100 * (line.model_frequency / m.frequency - 1), decimals(100 * m.frequency_error / m.frequency));
    text += fmt::format("    {:>24}  {:>22}  {:>12.4g}  {:>4}  {:>12}  {:>10}{}\n", with_error({m.frequency, m.frequency_error}),
                        with_error({100 * m.damping_ratio, 100 * m.damping_ratio_error}), m.amplitude[0], line.mode > 0 ? fmt::format("{}", line.mode) : "-", model, off,
                        line.note.empty() ? "" : "  " + line.note);
  }
  return text;
}

std::string shape_remark(const ApparentMassResult& r) {
  if (r.method == ApparentMassMethod::frequency_ratio)
    return "    The rig file gives no mode shapes, so the wet mode was taken for the dry mode with more mass; water that weighs on a part of a rig bends its shape,\n"
           "    and then this is an approximation. The result is the generalised mass of the fluid in this mode, in units of the rig file's modal mass.\n";
  const double same = r.same_shape_coefficient.value_or(std::nan(""));
  return fmt::format("    The wet mode is not the dry mode with more mass: the fluid weighs on the submerged part only and bends the shape. The plain ratio of the lowest\n"
                     "    natural frequencies, (dry/wet)^2 - 1 = {}, would give C_a = {:.4f} with the dry shape, {:+.2f} % off.\n",
                     with_error(r.mass_ratio), same, 100 * (same / r.coefficient->value - 1));
}

}  // namespace

std::string to_json(const ApparentMassResult& r, const Provenance& made) {
  json out;
  out["unrig"] = "apparent-mass";
  out["rig"] = r.rig_file;
  out["rig_fingerprint"] = r.rig_fingerprint;
  if (!made.program.empty()) out["program"] = made.program;
  if (!made.command.empty()) out["command"] = made.command;
  out["method"] = name_of(r.method);
  out["apparent_mass_coefficient"] = estimate(r.coefficient);
  out["apparent_mass"] = estimate(r.mass);
  out["apparent_mass"]["unit"] = r.mass_unit;
  out["theory"] = {{"value", number(r.theory)}, {"unit", "kg/m"}, {"formula", "pi rho b^2"}};
  out["dry"] = run_json(r.dry);
  out["wet"] = run_json(r.wet);
  out["frequency_ratio"] = {{"mass_ratio", estimate(r.mass_ratio)}, {"apparent_mass_coefficient_with_dry_shape", number(r.same_shape_coefficient)}};
  if (r.method == ApparentMassMethod::mode_shapes) {
    out["parameters"] = json::array();
    for (const FittedParameter& p : r.parameters) {
      json item = {{"name", p.name}, {"value", number(p.value)}, {"std_error", number(p.std_error)}, {"unit", p.unit}, {"identified", p.identified}};
      if (!p.advice.empty()) item["advice"] = p.advice;
      out["parameters"].push_back(item);
    }
    out["frequency_fit"] = {{"reduced_chi2", number(r.reduced_chi2)}, {"degrees_of_freedom", r.degrees_of_freedom}, {"error_scale", number(r.error_scale)}};
  }
  if (r.joint_fit) {
    out["joint_fit"] = estimate(r.joint_fit->value);
    out["joint_fit"]["quantity"] = r.method == ApparentMassMethod::mode_shapes ? "apparent_mass_coefficient" : "apparent_mass";
    out["joint_fit"]["unit"] = r.method == ApparentMassMethod::mode_shapes ? "1" : r.mass_unit;
    out["joint_fit"]["converged"] = r.joint_fit->converged;
    out["joint_fit"]["reduced_chi2"] = number(r.joint_fit->reduced_chi2);
    out["joint_fit"]["agrees"] = r.joint_fit->agrees;
    if (!r.joint_fit->message.empty()) out["joint_fit"]["message"] = r.joint_fit->message;
    out["agreement"] = r.agreement;
  }
  out["warnings"] = r.warnings;
  return out.dump(2) + "\n";
}

std::string report(const ApparentMassResult& r) {
  const bool shapes = r.method == ApparentMassMethod::mode_shapes;
  std::string text = fmt::format("[[Apparent Mass]] from the frequency shift, method: {}\n", name_of(r.method));
  const auto line = [&](const std::string& name, const std::string& value) { text += fmt::format("    {:<30} = {}\n", name, value); };
  line("apparent mass", with_error(r.mass) + " " + r.mass_unit);
  if (r.theory) line("theory, pi rho b^2", fmt::format("{:.{}f} {}", *r.theory, decimals(r.mass.std_error), r.mass_unit));
  if (r.coefficient) line("coefficient C_a (over theory)", with_error(*r.coefficient));
  if (!shapes) line("over the modal mass", with_error(r.mass_ratio));
  if (r.joint_fit && r.joint_fit->value) line(shapes ? "C_a, joint fit of both decays" : "joint fits of both decays", with_error(*r.joint_fit->value) + (shapes ? "" : " " + r.mass_unit));
  if (!r.agreement.empty()) text += "    " + r.agreement + "\n";
  if (shapes) {
    text += fmt::format("[[Rig]] fitted to the frequencies, masses held: reduced chi-square {:.3g}, {} degrees of freedom\n", r.reduced_chi2, r.degrees_of_freedom);
    for (const FittedParameter& p : r.parameters) {
      line(p.name, with_error({p.value, p.std_error}) + (p.identified ? "" : "  NOT IDENTIFIED"));
      if (!p.advice.empty()) text += "        " + p.advice + "\n";
    }
    text += "    The errors cover the recordings, not the rig file: 1 % in all of its masses is 1 % in the apparent mass.\n";
  }
  text += table(r.dry) + table(r.wet);
  return text + "[[Shape]]\n" + shape_remark(r);
}

}  // namespace unrig
