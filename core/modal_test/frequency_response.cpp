#include "core/modal_test/frequency_response.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>

#include <fmt/format.h>

#include "core/files/csv_table.h"
#include "core/files/text_file.h"
#include "core/files/units.h"
#include "core/import/uff.h"

namespace unrig {
namespace {

using Eigen::Index;
using std::complex;

constexpr Index least_lines = 16;
constexpr int type_of_response = 4, type_of_coherence = 6;
constexpr const char* wanted = "wanted a universal file with frequency response functions (datasets 58, type 4), or a table with frequency, real and imaginary, or frequency, magnitude and phase";

/// What a ratio "m/s^2/N" is, and its scale to SI.
struct Meaning {
  Measured response;
  std::string unit;  ///< SI, of the response
  double factor;
};

Meaning meaning_of(const std::string& unit, const InputError::Place& place, const std::string& what) {
  if (unit.empty()) throw InputError(place, what + " has no unit", "wanted response per force, such as m/s^2/N, m/N or N/N", "In a table the unit stands in brackets behind the column's name.");
  const std::string ratio = "(" + unit + ").N", si = si_unit(ratio, place, what);  // of the response alone
  const auto is = [&](const char* motion) -> bool {
    try {
      unit_scale(ratio, motion, place, what);
      return true;
    } catch (const InputError&) {
      return false;
    }
  };
  for (const auto& [response, motion] : {std::pair{Measured::displacement, "m"}, std::pair{Measured::velocity, "m/s"}, std::pair{Measured::acceleration, "m/s^2"}})
    if (is(motion)) return {response, motion, unit_scale(ratio, motion, place, what).factor};
  return {Measured::gauge, si, unit_scale(ratio, si, place, what).factor};
}

/// A name that a run file's column may have.
std::string as_column(std::string text) {
  for (char& c : text)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return text.empty() ? "response" : text;
}

/// Rows that hold numbers, above 0 Hz; checked.
void take_lines(FrequencyResponse& out, const std::vector<double>& frequency, const std::vector<complex<double>>& value, const std::vector<double>& coherence) {
  std::vector<std::size_t> kept;
  for (std::size_t k = 0; k < frequency.size(); ++k) {
    const bool there = std::isfinite(frequency[k]) && std::isfinite(value[k].real()) && std::isfinite(value[k].imag()) && (coherence.empty() || std::isfinite(coherence[k]));
    if (!there || frequency[k] <= 0) continue;
    if (!kept.empty() && !(frequency[k] > frequency[kept.back()]))
      throw InputError(out.place, fmt::format("{}: {:.6g} Hz comes after {:.6g} Hz", out.name, frequency[k], frequency[kept.back()]), "wanted increasing frequencies", "");
    if (!coherence.empty() && !(coherence[k] >= 0 && coherence[k] <= 1 + 1e-6))
      throw InputError(out.place, fmt::format("{}: a coherence of {:.6g} at {:.6g} Hz", out.name, coherence[k], frequency[k]), "wanted 0 to 1", "The coherence is squared: gamma^2.");
    kept.push_back(k);
  }
  const Index lines = static_cast<Index>(kept.size());
  if (lines < least_lines) throw InputError(out.place, fmt::format("{}: {} lines above 0 Hz", out.name, lines), fmt::format("wanted {} at least", least_lines), "");
  out.frequency.resize(lines);
  out.value.resize(lines);
  if (!coherence.empty()) out.coherence.resize(lines);
  for (Index i = 0; i < lines; ++i) {
    const std::size_t k = kept[static_cast<std::size_t>(i)];
    out.frequency[i] = frequency[k];
    out.value[i] = value[k];
    if (!coherence.empty()) out.coherence[i] = std::min(1.0, coherence[k]);
  }
  if (!(out.value.cwiseAbs().maxCoeff() > 0)) throw InputError(out.place, out.name + " is 0 everywhere", "wanted a response", "");
}

std::vector<FrequencyResponse> of_universal_file(const std::string& text, const std::string& path) {
  const std::vector<UffFunction> functions = read_uff_functions(text, path);
  std::vector<FrequencyResponse> found;
  for (const UffFunction& f : functions) {
    if (f.type != type_of_response) continue;
    FrequencyResponse out;
    out.place = {path, f.line};
    out.name = as_column(f.name);
    if (const auto first = out.name.find_first_not_of('_'); first != std::string::npos && f.node > 0) out.name = "n" + out.name;
    for (const FrequencyResponse& other : found)
      if (other.name == out.name) out.name += "_2";
    const std::string unit = f.reference_unit.empty() ? f.unit : "(" + f.unit + ")/(" + f.reference_unit + ")";
    const Meaning meaning = meaning_of(f.unit.empty() ? "" : unit, out.place, "the function at " + f.name);
    out.response = meaning.response;
    out.unit = meaning.unit;
    const bool same_line = f.node == f.reference_node && std::abs(f.direction) == std::abs(f.reference_direction);
    out.has_nodes = f.node > 0 && f.reference_node > 0;
    out.driving_point = out.has_nodes && same_line && out.response != Measured::gauge;
    const double sign = out.driving_point && f.direction != f.reference_direction ? -1 : 1;
    std::vector<complex<double>> value;
    for (const complex<double>& v : f.value) value.push_back(v * meaning.factor * sign);
    std::vector<double> coherence;
    for (const UffFunction& c : functions) {
      if (c.type != type_of_coherence || c.name.substr(0, c.name.find('#')) != f.name.substr(0, f.name.find('#')) || c.reference_node != f.reference_node || c.value.size() != f.value.size()) continue;
      for (const complex<double>& v : c.value) coherence.push_back(v.real());
      break;
    }
    take_lines(out, f.abscissa, value, coherence);
    found.push_back(std::move(out));
  }
  if (found.empty()) throw InputError({path, 0}, functions.empty() ? "no dataset 58" : "no frequency response function (type 4) among its datasets 58", wanted, "Of a hammer's record itself `unrig fit` finds the modes: unrig new rig --from impact-test, without a file.");
  return found;
}

const CsvColumn* find(const CsvTable& table, const char* name) {
  for (const CsvColumn& c : table.columns)
    if (c.name == name) return &c;
  return nullptr;
}

FrequencyResponse of_table(const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const InputError::Place head{path, table.header_line};
  for (const CsvColumn& c : table.columns)
    if (!c.text.empty()) throw InputError({path, c.text_line}, fmt::format("the column \"{}\" holds \"{}\"", c.name, c.text), "wanted numbers", "");
  const CsvColumn *frequency = find(table, "frequency"), *real = find(table, "real"), *imaginary = find(table, "imaginary"), *magnitude = find(table, "magnitude"), *phase = find(table, "phase"),
                  *coherence = find(table, "coherence");
  const bool cartesian = real && imaginary;
  if (!frequency || (!cartesian && !(magnitude && phase))) throw InputError(head, frequency ? "neither real and imaginary nor magnitude and phase" : "no column \"frequency\"", wanted, "");
  if (cartesian && real->unit != imaginary->unit) throw InputError(head, fmt::format("real is in \"{}\", imaginary in \"{}\"", real->unit, imaginary->unit), "wanted one unit", "");
  FrequencyResponse out;
  out.place = head;
  out.name = as_column(std::filesystem::path(path).stem().string());
  const UnitScale hertz = unit_scale(frequency->unit, "Hz", head, "the column \"frequency\"");
  const Meaning meaning = meaning_of(cartesian ? real->unit : magnitude->unit, head, cartesian ? "the column \"real\"" : "the column \"magnitude\"");
  out.response = meaning.response;
  out.unit = meaning.unit;
  const double turn = cartesian ? 0 : unit_scale(phase->unit, "rad", head, "the column \"phase\"").factor;
  std::vector<double> f, c;
  std::vector<complex<double>> value;
  for (Index k = 0; k < frequency->value.size(); ++k) {
    f.push_back(hertz(frequency->value[k]));
    value.push_back(meaning.factor * (cartesian ? complex<double>(real->value[k], imaginary->value[k]) : magnitude->value[k] * std::exp(complex<double>(0, turn * phase->value[k]))));
    if (coherence) c.push_back(coherence->value[k]);
  }
  take_lines(out, f, value, c);
  return out;
}

}  // namespace

std::string to_string(Measured response) {
  return response == Measured::gauge ? "gauge" : response == Measured::displacement ? "displacement" : response == Measured::velocity ? "velocity" : "acceleration";
}

std::vector<FrequencyResponse> read_frequency_responses(const std::string& path) {
  const std::string text = read_text(path);
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first != std::string::npos && text.compare(first, 2, "-1") == 0) return of_universal_file(text, path);
  return {of_table(text, path)};
}

}  // namespace unrig
