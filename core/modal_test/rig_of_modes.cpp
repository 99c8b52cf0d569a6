#include "core/modal_test/rig_of_modes.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

struct Value {
  double value = 0, std = 0;
};

/// Which function is the gauge, and which the motion where the force acts; -1: none.
struct Parts {
  Index gauge = -1, driving = -1;
  bool driving_is_known = false;  ///< by its nodes
  std::vector<Index> motions;
};

Parts parts_of(const std::vector<FrequencyResponse>& functions) {
  Parts parts;
  bool has_nodes = false;
  for (std::size_t j = 0; j < functions.size(); ++j) {
    const FrequencyResponse& f = functions[j];
    const Index at = static_cast<Index>(j);
    if (f.response == Measured::gauge) {
      if (parts.gauge >= 0) throw InputError(f.place, fmt::format("\"{}\" is a second function of a gauge, beside \"{}\"", f.name, functions[static_cast<std::size_t>(parts.gauge)].name), "wanted one gauge at most, and motions", "A rig has one gauge; give the others' functions to a rig of their own.");
      parts.gauge = at;
      continue;
    }
    parts.motions.push_back(at);
    has_nodes = has_nodes || f.has_nodes;
    if (f.driving_point && parts.driving < 0) parts.driving = at, parts.driving_is_known = true;
  }
  if (parts.driving < 0 && !has_nodes && !parts.motions.empty()) parts.driving = parts.motions.front();
  return parts;
}

/// What a mode is in the rig file: g(f, zeta, residues) with the standard deviation sqrt(grad' C grad).
struct Mode {
  Value frequency, damping_ratio, mass, gauge_gain;
  std::vector<double> shape;
};

Mode mode_of(const ModalFit& fit, std::size_t k, const Parts& parts) {
  const FittedMode& fitted = fit.modes[k];
  const Index size = 2 + fitted.residue.size();
  const Eigen::MatrixXd covariance = fit.covariance.block(fit.place(k), fit.place(k), size, size);
  const auto error = [&](const VectorXd& slope) { return std::sqrt(std::max(0.0, slope.dot(covariance * slope))); };
  Mode mode;
  mode.frequency = {fitted.frequency, error(VectorXd::Unit(size, 0))};
  mode.damping_ratio = {fitted.damping_ratio, error(VectorXd::Unit(size, 1))};
  mode.mass = {1, 0};
  if (parts.driving >= 0) {
    const double r = fitted.residue[parts.driving];
    mode.mass = {1 / r, error(VectorXd::Unit(size, 2 + parts.driving)) / (r * r)};
  }
  if (parts.gauge >= 0) {
    const double r = fitted.residue[parts.gauge], m = mode.mass.value;
    VectorXd slope = m * VectorXd::Unit(size, 2 + parts.gauge);
    if (parts.driving >= 0) slope -= r * m * m * VectorXd::Unit(size, 2 + parts.driving);
    mode.gauge_gain = {r * m, error(slope)};
  }
  for (const Index j : parts.motions) mode.shape.push_back(fitted.residue[j] * mode.mass.value);
  return mode;
}

/// As many digits as the error has a use for.
std::string digits(const Value& v) {
  const int least = 4, found = v.std > 0 && v.value != 0 ? 2 + static_cast<int>(std::ceil(std::log10(std::abs(v.value) / v.std))) : 6;
  return fmt::format("{:.{}g}", v.value, std::clamp(found, least, 9));
}

void check_masses(const std::vector<FrequencyResponse>& functions, const std::vector<Mode>& modes, const Parts& parts) {
  const auto negative = [](const Mode& mode) { return !(mode.mass.value > 0) || !std::isfinite(mode.mass.value); };
  const auto count = std::count_if(modes.begin(), modes.end(), negative);
  if (parts.driving < 0 || count == 0) return;
  const FrequencyResponse& f = functions[static_cast<std::size_t>(parts.driving)];
  const auto first = std::find_if(modes.begin(), modes.end(), negative);
  if (count == static_cast<std::ptrdiff_t>(modes.size()))
    throw InputError(f.place, fmt::format("every mode of \"{}\" has a negative mass", f.name), "wanted motion and force positive in one direction", "Turn the sign of the function.");
  throw InputError(f.place, fmt::format("the mode at {:.5g} Hz has a negative mass by \"{}\"", first->frequency.value, f.name), "wanted a motion where the force acts, in its direction", "Give the function of the point that was struck first, or only that of the gauge.");
}

std::string head(const std::vector<FrequencyResponse>& functions, const Parts& parts, const std::string& command) {
  std::string text = "# Made by: " + command + "\n# Errors are one standard deviation, of the functions' noise. Lines that begin with \"# ?\" ask what only you know. Then: unrig check --rig THIS_FILE\n";
  text += "unrig_rig = 1\n# ? What do reports call the rig?\nname = \"rig from its frequency response functions\"\n\n";
  if (parts.driving < 0 && parts.motions.empty()) text += "# Only the gauge's response was measured: the scale of each mode's displacement is free, and its mass is put down as 1 kg. A force where the hammer struck and the gauge do not see the difference.\n\n";
  if (parts.driving < 0 && !parts.motions.empty()) text += "# No motion was measured where the hammer struck: the scale of each mode's displacement is free, and its mass is put down as 1 kg.\n\n";
  for (const Index j : parts.motions) {
    const FrequencyResponse& f = functions[static_cast<std::size_t>(j)];
    if (j == parts.driving && !parts.driving_is_known) text += fmt::format("# ? Is \"{}\" where the hammer struck, and in its direction? The masses rest on it.\n", f.name);
    text += fmt::format("# ? What is the column of \"{}\" called in your recordings?\n[[sensor]]\ncolumn = \"{}\"\nreads = \"{}\"\n\n", f.name, f.name, to_string(f.response));
  }
  return text;
}

}  // namespace

RigOfModes rig_of_modes(const std::vector<FrequencyResponse>& functions, const ModalFit& fit, const std::string& command) {
  const Parts parts = parts_of(functions);
  std::vector<Mode> modes;
  for (std::size_t k = 0; k < fit.modes.size(); ++k) modes.push_back(mode_of(fit, k, parts));
  check_masses(functions, modes, parts);

  RigOfModes rig{head(functions, parts, command), "", {}};
  const std::string gauge_unit = parts.gauge >= 0 ? functions[static_cast<std::size_t>(parts.gauge)].unit : "";
  rig.report = fmt::format("    mode           frequency [Hz]             damping ratio              mass [kg]{}\n", parts.gauge >= 0 ? fmt::format("    gauge gain [{}/m]", gauge_unit) : "");
  const auto with_error = [](const Value& v) { return v.std > 0 ? fmt::format("{} +- {:.2g}", digits(v), v.std) : digits(v); };
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const Mode& m = modes[k];
    const auto line = [&](const char* key, const Value& v, const std::string& unit) {
      const auto quoted = [&](const std::string& number) { return unit.empty() ? number : fmt::format("\"{} {}\"", number, unit); };
      std::string text = fmt::format("{} = {}\n", key, quoted(digits(v)));
      if (v.std > 0 && std::isfinite(v.std)) text += fmt::format("{}_std = {}\n", key, quoted(fmt::format("{:.2g}", v.std)));
      return text;
    };
    rig.text += "[[modal]]\n" + line("mass", m.mass, "kg") + line("frequency", m.frequency, "Hz") + line("damping_ratio", m.damping_ratio, "");
    if (parts.gauge >= 0) rig.text += line("gauge_gain", m.gauge_gain, gauge_unit + "/m");
    std::string shape;
    for (const double s : m.shape) shape += fmt::format("{}{:.5g}", shape.empty() ? "" : ", ", s);
    if (!shape.empty()) rig.text += "sensor_shape = [" + shape + "]\n";
    rig.report += fmt::format("    {:>4} {:>24} {:>25} {:>22}{}\n", k + 1, with_error(m.frequency), with_error(m.damping_ratio), with_error(m.mass), parts.gauge >= 0 ? fmt::format(" {:>22}", with_error(m.gauge_gain)) : "");
  }
  for (std::size_t j = 0; j < functions.size(); ++j) rig.report += fmt::format("    of {} ({}) {:.2g} % is left (r.m.s.)\n", functions[j].name, to_string(functions[j].response), 100 * fit.share_left[j]);
  if (fit.outside > 0) rig.report += fmt::format("    {} more outside of the band, left out\n", fit.outside);
  if (fit.reduced_chi2 > 0) rig.report += fmt::format("    reduced chi-square {:.3g} with the errors of the coherence\n", fit.reduced_chi2);
  for (const FrequencyResponse& f : functions) {
    if (f.coherence.size() == 0) rig.warnings.push_back(fmt::format("{}: no coherence of \"{}\": its lines weigh alike, and the errors are from what is left of them", f.place.file, f.name));
    else if (f.coherence.minCoeff() >= 1 - 1e-6) rig.warnings.push_back(fmt::format("{}: the coherence of \"{}\" is 1 throughout, as of a single blow, and says nothing; the errors are from what is left", f.place.file, f.name));
  }
  for (std::size_t j = 0; j < functions.size(); ++j)
    if (constexpr double much = 0.1; fit.share_left[j] > much) rig.warnings.push_back(fmt::format("{}: {:.0f} % of \"{}\" is explained by no mode; look at its coherence, or ask for more with --modes", functions[j].place.file, 100 * fit.share_left[j], functions[j].name));
  return rig;
}

}  // namespace unrig
