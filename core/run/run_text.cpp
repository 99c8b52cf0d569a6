#include "core/run/run_text.h"

#include <fmt/format.h>

#include <cmath>
#include <iterator>
#include <string_view>

#include "core/files/units.h"

namespace unrig {
namespace {

/// The unit a channel is written in and SI per that unit: its file's where a factor is all that lies between.
struct WrittenUnit {
  std::string unit;
  double factor = 1;
};

WrittenUnit written_unit(const Channel& channel) {
  const WrittenUnit si{channel.unit, 1};
  if (channel.file_unit.empty() || channel.file_unit == channel.unit) return si;
  try {
    const UnitScale scale = unit_scale(channel.file_unit, channel.unit, {}, channel.name);
    const bool plain = scale.offset == 0 && std::abs(scale.factor - channel.factor) <= 1e-12 * std::abs(channel.factor);
    return plain ? WrittenUnit{channel.file_unit, channel.factor} : si;
  } catch (const InputError&) {  // volts that were calibrated to newtons
    return si;
  }
}

}  // namespace

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + '"';
}

std::string run_text(const Run& run, const std::vector<std::string>& remarks) {
  return whole_text([&](const TextSink& sink) { run_text(sink, run, remarks); });
}

void run_text(const TextSink& sink, const Run& run, const std::vector<std::string>& remarks) {
  std::string text = "# unrig_run = 1\n";
  for (const std::string& remark : remarks) text += "# # " + remark + "\n";
  text += fmt::format("# name = {}\n# kind = {}\n", toml_string(run.name), toml_string(to_string(run.kind)));
  if (!run.medium.empty()) text += fmt::format("# medium = {}\n", toml_string(run.medium));
  text += fmt::format("# density = \"{:.12g} kg/m^3\"\n# speed = \"{:.12g} m/s\"\n", run.density, run.speed);

  std::vector<double> factor;
  text += "time [s]";
  for (const Channel& channel : run.channels) {
    const WrittenUnit unit = written_unit(channel);
    factor.push_back(unit.factor);
    text += fmt::format(",{} [{}]", channel.name, unit.unit.empty() ? "1" : unit.unit);
  }
  text += '\n';
  sink(text);
  for (Eigen::Index k = 0; k < run.samples(); ++k) {
    text.clear();
    auto out = std::back_inserter(text);
    fmt::format_to(out, "{:.10g}", run.time(k));
    for (std::size_t c = 0; c < run.channels.size(); ++c) {
      const double value = run.channels[c].value[k] / factor[c];
      if (std::isfinite(value))
        fmt::format_to(out, ",{:.10g}", value);
      else
        text += ",nan";
    }
    text += '\n';
    sink(text);
  }
}

}  // namespace unrig
