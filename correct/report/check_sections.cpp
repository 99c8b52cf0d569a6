#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/files/heard_warnings.h"
#include "core/files/text_file.h"
#include "core/rig/rig.h"
#include "correct/report/result_files.h"
#include "correct/report/rig_sections.h"

namespace unrig {
namespace {

using nlohmann::json;

/// A quantity of check.json, with its unit.
std::string quantity(const json& object, const char* key, int digits = 4) {
  if (!object.contains(key) || object.at(key).is_null()) return "—";
  const json& q = object.at(key);
  const std::string unit = text_of(q, "unit");
  return plain(number_of(q, "value"), digits) + (unit == "1" ? "" : " " + unit);
}

void add_verdict(ReportPage& page, const json& suspicions, const std::string& name) {
  const auto grave = std::find_if(suspicions.begin(), suspicions.end(), [](const json& s) { return s.at("grave").get<bool>(); });
  if (grave != suspicions.end()) return page.add_verdict(Tone::bad, "What was given cannot be right. " + text_of(*grave, "text"), name);
  if (!suspicions.empty()) return page.add_verdict(Tone::open, text_of(suspicions.front(), "text"), name);
  page.add_verdict(Tone::good, "Rig file and recordings are plausible.", name);
}

void add_media(ReportPage& page, const json& rig) {
  std::vector<std::string> header{"mode"};
  std::vector<std::vector<std::string>> modes, loads;
  for (const json& medium : rig.at("media")) {
    const double speed = number_of(medium.at("speed"), "value");
    header.push_back(text_of(medium, "medium") + (speed > 0 ? ", " + quantity(medium, "speed") : ""));
    std::size_t k = 0;
    for (const json& mode : medium.at("modes")) {
      if (k == modes.size()) modes.push_back({fmt::format("{}", k + 1)});
      modes[k].resize(header.size() - 1);
      modes[k++].push_back(fmt::format("{} Hz ({} %)", plain(number_of(mode, "frequency"), 4), plain(100 * number_of(mode, "damping_ratio"), 2)));
    }
    if (number_of(medium.at("density"), "value") > 0)
      loads.push_back({header.back(), quantity(medium, "density"), quantity(medium, "apparent_mass"), speed > 0 ? quantity(medium, "load_per_degree") : "—", speed > 0 ? quantity(medium, "gauge_per_degree") : "—"});
  }
  for (auto& row : modes) row.resize(header.size());
  page.add_table("Modes (damping ratio)", header, modes, "Before any fit, with the stiffness of the rig file and the damping that a fit starts from.");
  if (!loads.empty() && !loads.front()[2].starts_with("—")) page.add_table("Loads", {"in", "density", "apparent mass", "load of a degree", "which the gauge reads as"}, loads, "At a slope of 2 pi per radian.");
}

void add_runs(ReportPage& page, const json& runs) {
  if (runs.empty()) return;
  std::vector<std::vector<std::string>> rows, channels;
  for (const json& run : runs) {
    const std::string name = file_name(text_of(run, "file"));
    const json motion = run.value("motion", json());
    rows.push_back({name, text_of(run, "kind"), text_of(run, "medium"), quantity(run, "density"), quantity(run, "speed"), plain(number_of(run, "samples"), 9), quantity(run, "rate"), quantity(run, "duration"), quantity(run, "ringing"),
                    motion.is_object() ? fmt::format("{} to {}, by {}", quantity(motion, "begin"), quantity(motion, "end"), quantity(motion, "step")) : "—"});
    for (const json& c : run.at("channels")) {
      const bool angle = text_of(c, "unit") == "rad";
      const auto number = [&](const char* key, int digits) { return plain(number_of(c, key) * (angle ? 180 / std::numbers::pi : 1), digits); };
      std::string left_out;
      for (const char* what : {"missing", "clipped", "bad", "spikes"})
        if (const double count = number_of(c, what); count > 0) left_out += fmt::format("{}{} {}", left_out.empty() ? "" : ", ", plain(count, 9), what);
      channels.push_back({name, text_of(c, "name"), angle ? "deg" : text_of(c, "unit"), number("minimum", 5), number("maximum", 5), number("mean", 5), number("noise", 3),
                          std::isfinite(number_of(c, "white_share")) ? plain(100 * number_of(c, "white_share"), 3) + " %" : "—", left_out});
    }
  }
  page.add_table("Recordings", {"run", "kind", "medium", "density", "speed", "samples", "rate", "length", "rings at", "moves"}, rows);
  page.add_table("Channels", {"run", "channel", "unit", "minimum", "maximum", "mean", "noise", "white", "left out"}, channels, "Noise: standard deviation of its white part, in the channel's unit.");
}

void add_determined(ReportPage& page, const json& result) {
  if (result.contains("not_foreseen")) page.add_text("What these runs can determine: " + text_of(result, "not_foreseen") + ".");
  std::vector<std::vector<std::string>> rows;
  for (const json& p : result.at("determined")) {
    const std::string unit = text_of(p, "unit"), run = text_of(p, "run");
    rows.push_back({text_of(p, "name"), run.empty() ? "" : file_name(run), plain(number_of(p, "value")), plain(number_of(p, "std_error"), 2), unit == "1" ? "" : unit, p.at("determined").get<bool>() ? "yes" : "no: " + text_of(p, "advice")});
  }
  if (!rows.empty())
    page.add_table("What these runs can determine", {"parameter", "of run", "near", "standard error", "unit", "determined"}, rows, "One standard deviation that white noise would leave; no fit was made.");
}

}  // namespace

void add_check(ReportPage& page, const json& result, const std::string& path, const ReportOptions& options) {
  const std::string name = file_name(path);
  const json& rig_told = result.at("rig");
  add_verdict(page, result.at("suspicions"), name);
  page.add_section("Check: " + name);
  add_provenance(page, result);
  for (const json& s : result.at("suspicions")) page.add_text(text_of(s, "text"));
  page.add_text(fmt::format("Rig \"{}\": mass {}{}.", text_of(rig_told, "name"), quantity(rig_told, "mass"),
                            rig_told.contains("deflection_per_newton") ? fmt::format("; a newton where the calibration weight hung deflects it by {} mm, and one over the strips reads as {} N", plain(1000 * number_of(rig_told.at("deflection_per_newton"), "value"), 4), quantity(rig_told, "gauge_per_newton")) : ""));
  const std::string recorded = text_of(result, "rig_file");
  if (const auto file = found_file(recorded, path, options)) {
    const HeardWarnings silence;
    const Rig rig = read_rig(*file);
    page.tell_rig(fmt::format("{} ({})", rig.name.empty() ? file_name(rig.file) : rig.name, rig.file));
    add_drawing(page, rig);
    double highest = 0;
    for (const json& mode : rig_told.at("media").front().at("modes")) highest = std::max(highest, number_of(mode, "frequency"));
    if (highest > 0) add_described_shapes(page, rig, 1.01 * highest);
  } else {
    page.add_text("Warning: the rig file " + recorded + " is no longer there; `--data` says where. Its picture is left out.");
  }
  add_media(page, rig_told);
  add_runs(page, result.at("runs"));
  add_determined(page, result);
}

}  // namespace unrig
