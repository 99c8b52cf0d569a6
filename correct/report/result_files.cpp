#include "correct/report/result_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>

#include "core/numerics/spectrum.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;

std::optional<std::string> found_file(const std::string& recorded, const std::string& result_file, const ReportOptions& options) {
  namespace fs = std::filesystem;
  if (recorded.empty()) return std::nullopt;
  const fs::path path = recorded, beside = fs::path(result_file).parent_path();
  std::vector<fs::path> places{path, beside / path, beside / path.filename()};
  if (!options.data_folder.empty()) places = {fs::path(options.data_folder) / path, fs::path(options.data_folder) / path.filename()};
  std::error_code ignored;
  for (const fs::path& place : places)
    if (fs::is_regular_file(place, ignored)) return place.string();
  return std::nullopt;
}

std::string file_name(const std::string& path) { return std::filesystem::path(path).filename().string(); }

std::string plain(double x, int digits) { return std::isfinite(x) ? fmt::format("{:.{}g}", x, digits) : "—"; }

std::string with_error(double value, double std_error) {
  if (!std::isfinite(value)) return "—";
  if (!(std_error > 0) || !std::isfinite(std_error)) return plain(value, 6);
  const auto power_of = [](double x) { return static_cast<int>(std::floor(std::log10(x))); };
  const int decimals = 1 - power_of(std_error), power = power_of(std::max(std::abs(value), std_error));
  if (decimals < 0 || decimals > 12) {
    const double scale = std::pow(10.0, power);
    return fmt::format("({:.{}f} ± {:.{}f})e{}", value / scale, decimals + power, std_error / scale, decimals + power, power);
  }
  return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, std_error, decimals);
}

double number_of(const json& object, const char* key) {
  return object.contains(key) && object[key].is_number() ? object[key].get<double>() : std::nan("");
}

std::string text_of(const json& object, const char* key) {
  return object.contains(key) && object[key].is_string() ? object[key].get<std::string>() : "";
}

void add_provenance(ReportPage& page, const Provenance& made) {
  if (!made.program.empty()) page.tell_command(fmt::format("Made by {}: {}", made.program, made.command));
}

void add_provenance(ReportPage& page, const json& result) { add_provenance(page, Provenance{text_of(result, "program"), text_of(result, "command")}); }

void add_warnings(ReportPage& page, const json& result) {
  for (const json& warning : result.value("warnings", json::array()))
    if (warning.is_string()) page.add_text("Warning: " + warning.get<std::string>());
}

std::string labelled(const std::string& name, const std::string& unit) { return unit.empty() || unit == "1" ? name : name + " [" + unit + "]"; }

namespace {

/// Gaps bridged by straight lines, the mean removed.
VectorXd whole(VectorXd x) {
  Index last = -1;
  for (Index k = 0; k < x.size(); ++k) {
    if (!std::isfinite(x[k])) continue;
    for (Index i = last + 1; i < k; ++i) x[i] = last < 0 ? x[k] : x[last] + (x[k] - x[last]) * static_cast<double>(i - last) / static_cast<double>(k - last);
    last = k;
  }
  if (last < 0) return VectorXd::Zero(x.size());
  for (Index i = last + 1; i < x.size(); ++i) x[i] = x[last];
  return x.array() - x.mean();
}

}  // namespace

void add_spectra(ReportPage& page, const std::string& title, double dt, const std::string& unit, const Curve& before, const Curve& after,
                 const std::string& caption, const std::vector<double>& modes, const std::vector<Box>& boxes) {
  const Index samples = std::min(before.value.size(), after.value.size());
  if (samples < 8 || !(dt > 0)) return;
  constexpr double beyond_the_last = 1.3;
  Plot plot{title, "frequency [Hz]", labelled("amplitude", unit), {}, {before, after}};
  for (Curve& curve : plot.curves) {
    const Spectrum spectrum = amplitude_spectrum(whole(curve.value.head(samples)), dt);
    Index lines = spectrum.line.size() - 1;  // line 0 is what is left of the mean
    if (!modes.empty()) lines = std::clamp<Index>(static_cast<Index>(std::ceil(beyond_the_last * modes.back() / spectrum.frequency(1))), std::min<Index>(8, lines), lines);
    curve.value = spectrum.line.segment(1, lines).cwiseAbs();
    // A logarithmic axis has no place for zero: exact zeros stand where rounding would.
    curve.value = curve.value.cwiseMax(1e-12 * std::max(curve.value.maxCoeff(), 1e-300));
    plot.x = VectorXd::LinSpaced(lines, spectrum.frequency(1), spectrum.frequency(lines));
  }
  plot.log_x = plot.log_y = true;
  plot.caption = caption;
  plot.boxes = boxes;
  for (std::size_t k = 0; k < modes.size(); ++k) plot.marks.emplace_back(modes[k], fmt::format("{}: {:.3g} Hz", k + 1, modes[k]));
  if (!modes.empty()) plot.caption += " Dotted: the modes of the fitted rig in this fluid and stream, effects aside.";
  page.add_plot(plot);
}

}  // namespace unrig
