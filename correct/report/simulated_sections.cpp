#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/run/motion.h"
#include "core/run/run.h"
#include "correct/report/result_files.h"
#include "fit/simulate/simulated_run.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// What was assumed: one row for each parameter, the rest as it stands in the file.
void add_recipe(ReportPage& page, const std::vector<std::string>& remarks) {
  std::vector<std::vector<std::string>> rows;
  for (const std::string& remark : remarks) {
    const std::size_t equals = remark.find(" = ");
    if (equals == std::string::npos) {
      page.add_text(remark + ".");
      continue;
    }
    const std::string value = remark.substr(equals + 3), unit = value.substr(std::min(value.size(), value.find(' ') + 1));
    rows.push_back({remark.substr(0, equals), value.substr(0, value.find(' ')), unit == "1" ? "" : unit});
  }
  if (!rows.empty()) page.add_table("Parameters", {"parameter", "value", "unit"}, rows);
}

/// Angles are read in degrees.
struct Shown {
  VectorXd value;
  std::string unit;
};
Shown shown(const Channel& channel) { return channel.unit == "rad" ? Shown{channel.value * (180 / std::numbers::pi), "deg"} : Shown{channel.value, channel.unit}; }

struct Difference {
  double scatter = 0, constant = 0, varies = 0, noise = 0;
};

/// Where both have a number.
Difference difference(const VectorXd& recorded, const VectorXd& simulated) {
  std::vector<Index> there;
  for (Index k = 0; k < recorded.size(); ++k)
    if (std::isfinite(recorded[k]) && std::isfinite(simulated[k])) there.push_back(k);
  if (there.size() < 8) return {std::nan(""), std::nan(""), std::nan(""), std::nan("")};
  const VectorXd reading = recorded(there), off = reading - simulated(there);
  const auto scatter = [](const VectorXd& x) { return std::sqrt((x.array() - x.mean()).square().mean()); };
  return {scatter(off), off.mean(), scatter(reading), noise_level(reading)};
}

/// The recording that was simulated, where it is found and on the same samples.
std::optional<Run> recording_of(ReportPage& page, const Run& run, const std::string& name, const std::string& path, const ReportOptions& options) {
  if (name.empty()) return std::nullopt;
  std::string missing;
  if (const auto file = found_file(name, path, options)) {
    Run recorded = read_run(*file);
    const double end = std::abs(recorded.start + recorded.dt * static_cast<double>(recorded.samples()) - run.start - run.dt * static_cast<double>(run.samples()));
    if (recorded.samples() == run.samples() && std::abs(recorded.start - run.start) < 0.5 * run.dt && end < 0.5 * run.dt) return recorded;
    missing = fmt::format("The recording \"{}\" has other samples than the simulated run, which is drawn without it.", *file);
  } else {
    missing = fmt::format("The recording \"{}\" is not found, so that the simulated run is drawn without it; --data FOLDER says where it is.", name);
  }
  warn(path + ": " + missing);
  page.add_text("Warning: " + missing);
  return std::nullopt;
}

void add_channel(ReportPage& page, const Run& run, const Channel& channel, const Channel* recorded) {
  const VectorXd time = VectorXd::LinSpaced(run.samples(), run.start, run.time(run.samples() - 1));
  const auto [value, unit] = shown(channel);
  const std::string label = labelled(channel.name, unit);
  if (!recorded) return page.add_plot({channel.name + ": simulated", "time [s]", label, time, {{"simulated", 1, value}}, run.file});
  const VectorXd reading = shown(*recorded).value;
  const Difference d = difference(reading, value);
  page.add_plot({channel.name + ": recording and simulation", "time [s]", label, time, {{"recording", 0, reading}, {"simulated", 1, value, {}, true}}, run.file});
  page.add_plot({channel.name + ": difference", "time [s]", labelled("recording − simulated", unit), time, {{"difference", 2, reading - value}}, run.file,
                 fmt::format("{} {} r.m.s. beside a constant of {} {}; the recording varies by {} {} r.m.s., its noise is {} {}.", plain(d.scatter, 4), unit, plain(d.constant, 4), unit, plain(d.varies, 4), unit,
                             plain(d.noise, 3), unit),
                 false, false, 180, {}, reading});
  add_spectra(page, channel.name + ": spectra of recording and difference", run.dt, unit, {"recording", 0, reading}, {"difference", 2, reading - value},
              "Amplitude of the whole record, mean removed, Hann window. What stands out of the difference is not in the simulation.");
}

/// The gauge, or else the first that the rig's sensors name.
const Channel* answer_of(const Run& run) {
  if (const Channel* gauge = run.find("gauge")) return gauge;
  const std::vector<std::string_view> given = columns_with_a_meaning();
  for (const Channel& channel : run.channels)
    if (std::find(given.begin(), given.end(), channel.name) == given.end()) return &channel;
  return nullptr;
}

void add_verdict(ReportPage& page, const Run& run, const std::optional<Run>& recorded, const std::string& about) {
  const Channel* answer = answer_of(run);
  if (!answer) return;
  const Channel* reading = recorded ? recorded->find(answer->name) : nullptr;
  const std::string range = fmt::format("Simulated, the {} goes from {} to {} {}", answer->name, plain(answer->value.minCoeff(), 4), plain(answer->value.maxCoeff(), 4), answer->unit);
  if (!reading) return page.add_verdict(Tone::told, range + ".", about);
  constexpr double to_its_noise = 1.2;
  const Difference d = difference(reading->value, answer->value);
  page.add_verdict(d.scatter < to_its_noise * d.noise ? Tone::good : Tone::open,
                   fmt::format("{}; the recorded one differs by {} {} r.m.s. beside a constant of {} {}, with a noise of {} {}.", range, plain(d.scatter, 3), answer->unit, plain(d.constant, 3), answer->unit,
                               plain(d.noise, 3), answer->unit),
                   about);
}

}  // namespace

void add_simulated(ReportPage& page, const std::string& text, const std::string& path, const ReportOptions& options) {
  const Run run = parse_run(text, path);
  const SimulatedRun simulated = *simulated_run(text);
  page.add_section("Simulation: " + file_name(path));
  add_provenance(page, simulated.made_by.provenance);
  add_recipe(page, simulated.recipe);
  const std::optional<Run> recorded = recording_of(page, run, simulated.of_run, path, options);
  add_verdict(page, run, recorded, file_name(path));
  for (const Channel& channel : run.channels)
    if (channel.name != "weight" && channel.value.array().isFinite().any()) add_channel(page, run, channel, recorded ? recorded->find(channel.name) : nullptr);
}

}  // namespace unrig
