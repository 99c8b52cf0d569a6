#include "fit/check/check_files.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "core/run/release.h"

namespace unrig {
namespace {

using nlohmann::ordered_json;
constexpr double degree = std::numbers::pi / 180;

ordered_json quantity(double value, const char* unit) { return {{"value", std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr)}, {"unit", unit}}; }

ordered_json json_of(const RigInMedium& medium, bool modal) {
  ordered_json modes = ordered_json::array();
  for (const RigMode& mode : medium.modes) modes.push_back({{"frequency", mode.hertz}, {"unit", "Hz"}, {"damping_ratio", mode.damping_ratio}});
  ordered_json json{{"medium", medium.medium}, {"density", quantity(medium.density, "kg/m^3")}, {"speed", quantity(medium.speed, "m/s")}, {"modes", modes}};
  if (modal) return json;
  json["apparent_mass"] = quantity(medium.apparent_mass, "kg");
  json["load_per_degree"] = quantity(medium.load_per_degree, "N");
  json["gauge_per_degree"] = quantity(medium.gauge_per_degree, "N");
  return json;
}

ordered_json json_of(const RigSummary& rig) {
  ordered_json media = ordered_json::array();
  for (const RigInMedium& medium : rig.media) media.push_back(json_of(medium, rig.modal));
  ordered_json json{{"name", rig.name}, {"mass", quantity(rig.mass, "kg")}, {"media", media}};
  if (rig.modal) return json;
  json["deflection_per_newton"] = quantity(rig.deflection, "m/N");
  json["gauge_per_newton"] = quantity(rig.gauge_per_newton, "1");
  return json;
}

ordered_json json_of(const ChannelSummary& c) {
  return {{"name", c.name}, {"unit", c.unit}, {"minimum", c.minimum}, {"maximum", c.maximum}, {"mean", c.mean}, {"noise", c.noise},
          {"white_share", c.white_share ? ordered_json(*c.white_share) : ordered_json(nullptr)}, {"missing", c.missing}, {"clipped", c.clipped}, {"bad", c.bad}, {"spikes", c.spikes}};
}

ordered_json json_of(const RunSummary& run) {
  ordered_json channels = ordered_json::array();
  for (const ChannelSummary& channel : run.channels) channels.push_back(json_of(channel));
  ordered_json json{{"file", run.file}, {"kind", run.kind}, {"medium", run.medium}, {"density", quantity(run.density, "kg/m^3")}, {"speed", quantity(run.speed, "m/s")}, {"samples", run.samples},
                    {"rate", quantity(run.rate, "Hz")}, {"duration", quantity(run.duration, "s")}, {"resampled", run.resampled}};
  if (run.hold) json["release"] = quantity(run.hold->release, "s"), json["held"] = run.hold->samples;
  json["ringing"] = run.ringing > 0 ? quantity(run.ringing, "Hz") : ordered_json(nullptr);
  json["motion"] = run.moves ? ordered_json{{"begin", quantity(run.motion_begin, "s")}, {"end", quantity(run.motion_end, "s")}, {"onset", quantity(run.onset / degree, "deg")}, {"step", quantity(run.step / degree, "deg")}}
                             : ordered_json(nullptr);
  json["channels"] = channels;
  return json;
}

std::string channel_line(const ChannelSummary& c) {
  const bool angle = c.unit == "rad";
  const double to = angle ? degree : 1;
  std::string line = fmt::format("    {:<14} {:>6} {:>12.5g} {:>12.5g} {:>12.5g} {:>10.3g}", c.name, angle ? "deg" : c.unit, c.minimum / to, c.maximum / to, c.mean / to, c.noise / to);
  line += c.white_share ? fmt::format(" {:>6.0f} %", 100 * *c.white_share) : fmt::format(" {:>8}", "-");
  for (const auto& [count, what] : {std::pair{c.missing, "missing"}, std::pair{c.clipped, "clipped"}, std::pair{c.bad, "bad"}, std::pair{c.spikes, "spikes"}})
    if (count > 0) line += fmt::format("  {} {}", count, what);
  return line + "\n";
}

std::string report(const RigSummary& rig) {
  std::string text = fmt::format("rig \"{}\": {:.4g} kg{}\n", rig.name, rig.mass, rig.modal ? " (modal masses)" : "");
  if (!rig.modal) {
    text += fmt::format("  1 N at element {} deflects it by {:.4g} mm\n", rig.loaded_element, 1000 * rig.deflection);
    if (rig.gauge_per_newton > 0) text += fmt::format("  1 N spread over the strips reads {:.4g} N at the gauge\n", rig.gauge_per_newton);
  }
  for (const RigInMedium& m : rig.media) {
    text += m.density > 0 ? fmt::format("  in {} ({:g} kg/m^3, {:g} m/s):", m.medium, m.density, m.speed) : "  in vacuum:";
    for (const RigMode& mode : m.modes) text += fmt::format(" {:.4g} Hz ({:.2g} %)", mode.hertz, 100 * mode.damping_ratio);
    text += "\n";
    if (m.density > 0 && !rig.modal) text += fmt::format("    apparent mass {:.4g} kg{}\n", m.apparent_mass, m.speed > 0 ? fmt::format("; a degree at slope 2 pi lifts {:.4g} N, and the gauge reads {:.4g} N", m.load_per_degree, m.gauge_per_degree) : "");
  }
  return text;
}

std::string report(const RunSummary& run) {
  std::string text = fmt::format("{}: {} in {}, {} samples at {:.5g} Hz, {:.4g} s{}\n", run.file, run.kind, run.medium.empty() ? "a fluid" : run.medium, run.samples, run.rate, run.duration, run.resampled ? ", resampled" : "");
  if (run.moves) text += fmt::format("    rests until {:.4g} s, moves until {:.4g} s, from {:.4g} deg by {:.4g} deg\n", run.motion_begin, run.motion_end, run.onset / degree, run.step / degree);
  if (run.hold) text += "    " + said_of(*run.hold) + "\n";
  if (run.ringing > 0) text += fmt::format("    rings at {:.4g} Hz\n", run.ringing);
  text += fmt::format("    {:<14} {:>6} {:>12} {:>12} {:>12} {:>10} {:>8}\n", "channel", "unit", "minimum", "maximum", "mean", "noise", "white");
  for (const ChannelSummary& channel : run.channels) text += channel_line(channel);
  return text;
}

std::string report(const Foreseen& f) {
  const std::string name = f.name + (f.run.empty() ? "" : " (" + base_name(f.run) + ")");
  if (f.determined) return fmt::format("    {:<44} to {:.2g} {}\n", name, f.std_error, f.unit == "1" ? "" : f.unit);
  return fmt::format("    {:<44} not: {}\n", name, f.advice);
}

}  // namespace

std::string to_json(const Checked& checked) {
  ordered_json json{{"unrig", "check"}, {"program", checked.made.program}, {"command", checked.made.command}, {"rig_file", checked.rig_file}, {"rig", json_of(checked.rig)}};
  json["runs"] = ordered_json::array();
  for (const RunSummary& run : checked.runs) json["runs"].push_back(json_of(run));
  json["suspicions"] = ordered_json::array();
  for (const Suspicion& s : checked.suspicions) json["suspicions"].push_back({{"where", s.where}, {"causes", s.causes}, {"factor", s.factor}, {"grave", s.grave}, {"text", s.text}});
  json["determined"] = ordered_json::array();
  for (const Foreseen& f : checked.foreseen) {
    ordered_json one{{"name", f.name}, {"value", f.value}, {"std_error", std::isfinite(f.std_error) ? ordered_json(f.std_error) : ordered_json(nullptr)}, {"unit", f.unit}, {"determined", f.determined}};
    if (!f.run.empty()) one["run"] = f.run;
    if (!f.advice.empty()) one["advice"] = f.advice;
    json["determined"].push_back(std::move(one));
  }
  if (!checked.not_foreseen.empty()) json["not_foreseen"] = checked.not_foreseen;
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string report(const Checked& checked) {
  std::string text = report(checked.rig);
  for (const RunSummary& run : checked.runs) text += report(run);
  if (!checked.foreseen.empty()) {
    text += "what these runs can determine (one standard deviation that white noise would leave):\n";
    for (const Foreseen& f : checked.foreseen) text += report(f);
  }
  if (!checked.not_foreseen.empty()) text += "what these runs can determine: " + checked.not_foreseen + "\n";
  return text;
}

}  // namespace unrig
