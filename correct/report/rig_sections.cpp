#include "correct/report/rig_sections.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <limits>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "core/rig/structure.h"
#include "correct/report/fit_traces.h"
#include "correct/report/result_files.h"
#include "fit/apparent_mass/rig_frequencies.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double within = 0.05;
constexpr double far_below = 0.05, beyond = 1.3;  ///< where the axis begins, of the lowest mode, and ends, of the highest

/// Pa s at 20 degrees: water by IAPWS R12-08, air by Sutherland's formula; not a number of any other medium.
double viscosity_of(const std::string& medium) {
  if (medium == "water") return 1.0016e-3;
  if (medium == "air") return 1.813e-5;
  return std::nan("");
}

/// Even in the logarithm, and 40 more round each mode.
VectorXd frequencies(const std::vector<double>& modes) {
  constexpr int even = 500, near_a_mode = 40;
  const double low = far_below * modes.front(), high = beyond * modes.back();
  std::set<double> all;
  for (int k = 0; k <= even; ++k) all.insert(low * std::pow(high / low, static_cast<double>(k) / even));
  for (const double mode : modes)
    for (int k = -near_a_mode / 2; k <= near_a_mode / 2; ++k) all.insert(mode * (1 + 0.002 * k));
  const std::vector<double> sorted(all.begin(), all.end());
  return Eigen::Map<const VectorXd>(sorted.data(), static_cast<Index>(sorted.size()));
}

std::string in_words(const Run& run) {
  const std::string medium = run.medium.empty() ? fmt::format("{:.4g} kg/m³", run.density) : run.medium;
  return run.speed > 0 ? fmt::format("{}, {:.3g} m/s", medium, run.speed) : medium;
}

void add_responses(ReportPage& page, const Rig& rig, const FittedRig& fit, const std::vector<Run>& runs) {
  std::vector<std::pair<std::string, RigResponse>> found;
  for (const Run& run : runs) {
    const std::string name = in_words(run);
    if (std::any_of(found.begin(), found.end(), [&](const auto& other) { return other.first == name; })) continue;
    RigResponse response = rig_response(rig, fit, run);
    if (response.frequency.size() > 0) found.emplace_back(name, std::move(response));
  }
  if (found.empty()) return;
  std::set<double> all;
  for (const auto& [name, response] : found) all.insert(response.frequency.begin(), response.frequency.end());
  const std::vector<double> sorted(all.begin(), all.end());
  const VectorXd x = Eigen::Map<const VectorXd>(sorted.data(), static_cast<Index>(sorted.size()));
  Plot size{"Frequency response of the rig", "frequency [Hz]", "gauge over its answer to a slow load", x, {}, "frequency response"}, lag = size;
  lag.title = "Phase of the frequency response";
  lag.y_label = "phase [deg]";
  std::vector<std::vector<std::string>> rows;
  constexpr std::size_t colours = 5;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const auto& [name, response] = found[k];
    VectorXd amplitude = VectorXd::Constant(x.size(), std::nan("")), phase = amplitude;
    double turned = 0, before = 0;
    Index i = 0;
    for (Index j = 0; j < x.size(); ++j) {
      if (i + 1 < response.frequency.size() && response.frequency[i + 1] <= x[j]) while (i + 1 < response.frequency.size() && response.frequency[i + 1] <= x[j]) ++i;
      if (x[j] < response.frequency[0] || x[j] > response.frequency[response.frequency.size() - 1]) continue;
      const Index next = std::min(i + 1, response.frequency.size() - 1);
      const double share = next > i ? (x[j] - response.frequency[i]) / (response.frequency[next] - response.frequency[i]) : 0;
      const std::complex<double> h = response.answer[i] * (1 - share) + response.answer[next] * share;
      amplitude[j] = std::abs(h);
      const double angle = std::arg(h) * 180 / pi;
      if (std::isfinite(before)) turned -= 360 * std::round((angle - before) / 360);
      before = angle;
      phase[j] = angle + turned;
    }
    const int colour = static_cast<int>(k % colours);
    size.curves.push_back({name, colour, amplitude, {}, k >= colours});
    lag.curves.push_back({name, colour, phase, {}, k >= colours});
    std::string modes;
    for (const double mode : response.modes) modes += fmt::format("{}{:.4g}", modes.empty() ? "" : ", ", mode);
    rows.push_back({name, modes, plain(response.usable, 3)});
  }
  const RigResponse& last = found.back().second;  // the stream, where there is one
  for (std::size_t k = 0; k < last.modes.size(); ++k) size.marks.emplace_back(last.modes[k], fmt::format("{}: {:.3g} Hz", k + 1, last.modes[k]));
  size.boxes.push_back({x[0], last.usable, "within 5 %"});
  size.log_x = size.log_y = lag.log_x = true;
  size.height = 320;
  lag.height = 180;
  size.caption = fmt::format("{} over frequency. Boxed: where the gauge reads the load itself within 5 %, {}; dotted: modes there. Above it the reading is the rig's, and `unrig correct` takes it out.",
                             rig.is_modal() ? "Answer of the gauge to a force on every mode" : "Answer of the gauge to a normal force that is spread evenly over the strips", found.back().first);
  page.add_plot(size);
  page.add_plot(lag);
  page.add_table("Modes and usable band of the gauge", {"in", "modes [Hz]", "within 5 % up to [Hz]"}, rows, "Of the fitted rig, up to half the sampling rate.");
}

void add_shapes(ReportPage& page, const Rig& rig, const Basis& basis, const NaturalFrequencies& natural, const std::string& caption) {
  constexpr Index shown = 5;
  Plot bending{"Mode shapes: displacement", "distance from the clamp [m]", "displacement", rig.station, {}, "mode shapes"}, twist = bending;
  twist.title = "Mode shapes: twist";
  twist.y_label = "twist × semichord";
  for (Index k = 0; k < std::min<Index>(shown, natural.hertz.size()); ++k) {
    const VectorXd h = basis.normal * natural.shape.col(k), turn = basis.twist * natural.shape.col(k) * rig.semichord();
    Index at = 0;
    const double largest = std::max(h.cwiseAbs().maxCoeff(&at), turn.cwiseAbs().maxCoeff());
    if (!(largest > 0)) continue;
    const double scale = std::copysign(largest, h[at]);
    const std::string name = fmt::format("{}: {:.4g} Hz", k + 1, natural.hertz[k]);
    bending.curves.push_back({name, static_cast<int>(k), h / scale, {}, k % 2 == 1});
    twist.curves.push_back({name, static_cast<int>(k), turn / scale, {}, k % 2 == 1});
  }
  bending.caption = twist.caption = caption + " One scale for displacement and twist times semichord, of which the larger is 1.";
  bending.height = twist.height = 220;
  page.add_plot(bending);
  page.add_plot(twist);
}

void add_fitted_shapes(ReportPage& page, const Rig& rig, const FittedRig& fit, const Run& run) {
  const FittedModel fitted = fitted_model(rig, fit, run);
  const auto value = [&](const char* name) { return fitted.theta[fitted.model.index(name)]; };
  const NaturalFrequencies natural =
      natural_frequencies(undamped_system(fitted.rig, fitted.model.basis(), run.density), {value("normal.stiffness_scale"), value("torsion.stiffness_scale"), value("apparent_mass_coefficient")});
  add_shapes(page, rig, fitted.model.basis(), natural, fmt::format("Undamped, at rest in {}, with the fitted stiffness and apparent mass.", in_words(run).substr(0, in_words(run).find(','))));
}

}  // namespace

void add_drawing(ReportPage& page, const Rig& rig) {
  if (rig.is_modal() || rig.station.size() < 2) return;
  const Index n = rig.station.size();
  const double ahead = -rig.pitch_axis * rig.chord, aft = (1 - rig.pitch_axis) * rig.chord, half = rig.strip_length / 2;
  // Elements, and the edges of the strips a hair inside and outside of them.
  std::set<double> places{0.0};
  for (const double s : rig.station) places.insert(s);
  for (const int element : rig.submerged)
    for (const double side : {-1.0, 1.0})
      for (const double hair : {0.999, 1.001}) places.insert(std::max(0.0, rig.station[element - 1] + side * hair * half));
  const std::vector<double> sorted(places.begin(), places.end());
  const VectorXd x = Eigen::Map<const VectorXd>(sorted.data(), static_cast<Index>(sorted.size()));
  const VectorXd none = VectorXd::Constant(x.size(), std::nan(""));
  VectorXd leading = none, trailing = none, elements = none, masses = none;
  for (Index k = 0; k < x.size(); ++k) {
    const auto in = [&](int element) { return std::abs(x[k] - rig.station[element - 1]) <= half; };
    if (std::any_of(rig.submerged.begin(), rig.submerged.end(), in)) leading[k] = ahead, trailing[k] = aft;
    for (Index i = 0; i < n; ++i)
      if (x[k] == rig.station[i]) elements[k] = 0, masses[k] = rig.mass_centre[i];
  }
  Plot plot{"The rig", "distance from the clamp [m]", "aft of the pitch axis [m]", x,
            {{"pitch axis", 0, VectorXd::Zero(x.size())}, {"leading edge", 1, leading}, {"trailing edge", 1, trailing, {}, true}, {"elements", 0, elements, {}, false, true}, {"mass centres", 2, masses, {}, false, true}}};
  plot.curves[1].name = "leading edge of the strips";
  plot.curves[2].name = "their trailing edge";
  if (rig.gauge_element > 0) plot.marks.emplace_back(rig.station[rig.gauge_element - 1], "gauge");
  if (rig.calibration_element > 0) plot.marks.emplace_back(rig.station[rig.calibration_element - 1], "calibration");
  for (const Sensor& s : rig.sensors) plot.marks.emplace_back(rig.station[std::min<Index>(s.element, n) - 1], s.column);
  std::sort(plot.marks.begin(), plot.marks.end());
  plot.caption = "Seen along the normal force, the clamp at the left; the two axes have their own scales.";
  page.add_plot(plot);
}

void add_described_shapes(ReportPage& page, const Rig& rig, double nyquist) {
  if (rig.is_modal()) return;
  const Basis basis = make_basis(rig, nyquist, 0);
  add_shapes(page, rig, basis, natural_frequencies(undamped_system(rig, basis, 0), {1, 1, 1}), "Undamped, in vacuum, as the rig file describes it.");
}

void tell_conditions(ReportPage& page, const Rig& rig, const FittedRig& fit, const Run& run) {
  page.tell_rig(fmt::format("{} ({})", rig.name.empty() ? file_name(rig.file) : rig.name, rig.file));
  const double no = std::nan(""), viscosity = viscosity_of(run.medium);
  RunFacts facts{run.file, to_string(run.kind), run.medium, run.density, run.speed, no, no, run.dt * static_cast<double>(run.samples())};
  const std::filesystem::path whole = run.file;
  facts.file = (whole.parent_path().filename() / whole.filename()).string();  // runs of two campaigns bear the same names
  if (rig.chord > 0 && run.speed > 0) {
    facts.reynolds_number = run.speed * rig.chord * run.density / viscosity;
    Run still = run;
    still.speed = 0;
    if (const std::vector<double> modes = modes_of(fitted_model(rig, fit, still)); !modes.empty()) facts.reduced_frequency = pi * modes.front() * rig.chord / run.speed;
  }
  page.tell_run(facts);
}

RigResponse rig_response(const Rig& rig, const FittedRig& fit, const Run& run) {
  const FittedModel fitted = fitted_model(rig, fit, run);
  RigResponse response;
  response.modes = modes_of(fitted);
  if (response.modes.empty() || !run.find("gauge")) return response;
  const AeroelasticModel bare(fitted.model.rig(), fitted.model.basis(), fitted.model.circulation());
  Conditions conditions;
  conditions.density = run.density;
  conditions.speed = run.speed;
  conditions.force = rig.is_modal();
  conditions.ports = !rig.is_modal();
  conditions.nyquist = 0.5 / run.dt;
  const LinearSystem system = bare.system(conditions, fitted.theta.head(static_cast<Index>(bare.parameters().size())), {"gauge"});
  const Index forces = rig.is_modal() ? 1 : static_cast<Index>(rig.submerged.size());
  const VectorXd even = VectorXd::Constant(forces, 1 / static_cast<double>(forces));
  const Eigen::MatrixXd A = system.A.value;
  const VectorXcd b = (system.B.value.leftCols(forces) * even).cast<std::complex<double>>();
  const Eigen::RowVectorXcd c = system.C.value.row(0).cast<std::complex<double>>();
  const double d = system.D.value.row(0).head(forces).dot(even);
  const auto answer = [&](double hertz) {
    MatrixXcd left = -A.cast<std::complex<double>>();
    left.diagonal().array() += std::complex<double>(0, 2 * pi * hertz);
    return (c * left.partialPivLu().solve(b))(0) + d;
  };
  const VectorXd at = frequencies(response.modes);
  const std::complex<double> slow = answer(1e-3 * at[0]);
  if (!(std::abs(slow) > 0)) return response;
  response.frequency = at;
  response.answer.resize(at.size());
  for (Index k = 0; k < at.size(); ++k) response.answer[k] = answer(at[k]) / slow;
  Index last = 0;
  while (last + 1 < at.size() && std::abs(std::abs(response.answer[last + 1]) - 1) <= within) ++last;
  response.usable = at[last];
  return response;
}

void add_fitted_rig(ReportPage& page, const Rig& rig, const FittedRig& fit, const std::vector<Run>& runs) {
  if (runs.empty()) return;
  page.add_heading("The rig");
  add_responses(page, rig, fit, runs);
  if (rig.is_modal()) return;
  const auto densest = std::max_element(runs.begin(), runs.end(), [](const Run& a, const Run& b) { return a.density < b.density; });
  add_fitted_shapes(page, rig, fit, *densest);
}

}  // namespace unrig
