#include "core/import/channel_list.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Core>
#include <fmt/format.h>

#include "core/files/error.h"
#include "core/run/motion.h"
#include "core/files/units.h"

namespace unrig {
namespace {

struct ChannelRange {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity(), mean = 0;
  std::size_t missing = 0;
};

ChannelRange range_of_channel(const std::vector<double>& values) {
  ChannelRange range;
  std::size_t count = 0;
  for (const double x : values) {
    if (!std::isfinite(x)) continue;
    range.low = std::min(range.low, x);
    range.high = std::max(range.high, x);
    range.mean += (x - range.mean) / static_cast<double>(++count);
  }
  range.missing = values.size() - count;
  return range;
}

std::string cell(double x) { return std::isfinite(x) ? fmt::format("{:.5g}", x) : "-"; }

std::string remarks_of(const RecordedChannel& channel, std::size_t missing) {
  std::string text;
  const auto add = [&](const std::string& remark) { text += (text.empty() ? "  " : ", ") + remark; };
  if (!channel.label.empty()) add(fmt::format("\"{}\"", channel.label));
  if (!channel.remark.empty()) add(channel.remark);
  if (missing > 0) add(fmt::format("{} missing", missing));
  if (!channel.raw.empty()) add("UNSCALED: " + channel.raw);
  return text;
}

}  // namespace

double rate_of_times(const RecordedChannel& channel) {
  const std::vector<double>& t = channel.value;
  if (t.size() < 3 || channel.unit.empty()) return 0;
  const double step = (t.back() - t.front()) / static_cast<double>(t.size() - 1);
  if (!(step > 0) || !std::isfinite(step)) return 0;
  constexpr double uneven = 0.5;  // steps: printed with few digits, and still nothing else than the column of times
  for (std::size_t k = 0; k < t.size(); ++k)
    if (!(std::abs(t[k] - t.front() - step * static_cast<double>(k)) < uneven * step)) return 0;
  try {
    return 1 / (step * unit_scale(channel.unit, "s", {}, channel.name).factor);
  } catch (const InputError&) {
    return 0;
  }
}

std::string channel_list(const Recording& recording) {
  double rate = 0;
  for (const RecordedChannel& channel : recording.channels)
    if (rate == 0) rate = rate_of_times(channel);
  std::size_t width = 24;
  for (const RecordedChannel& channel : recording.channels) width = std::max(width, std::min<std::size_t>(channel.name.size(), 60));
  std::string text = fmt::format("{}: {}, {} channels\n  {:<{}} {:>9} {:>8} {:>11} {:>12} {:>12} {:>12} {:>10}\n", recording.file, recording.format, recording.channels.size(), "channel", width, "samples", "unit",
                                 "rate", "minimum", "maximum", "mean", "noise");
  for (const RecordedChannel& channel : recording.channels) {
    const ChannelRange range = range_of_channel(channel.value);
    const double hertz = channel.step > 0 ? 1 / channel.step : rate;
    // A column of times has none: its steps would pass for those of a converter.
    const double noise = rate_of_times(channel) > 0 ? std::nan("") : noise_level(Eigen::Map<const Eigen::VectorXd>(channel.value.data(), static_cast<Eigen::Index>(channel.value.size())));
    const bool known = range.missing < channel.value.size();
    text += fmt::format("  {:<{}} {:>9} {:>8} {:>11} {:>12} {:>12} {:>12} {:>10}{}\n", channel.name, width, channel.value.size(), channel.unit.empty() ? "-" : channel.unit,
                        hertz > 0 ? fmt::format("{:.6g} Hz", hertz) : "-", cell(range.low), cell(range.high), known ? cell(range.mean) : "-", cell(noise), remarks_of(channel, range.missing));
  }
  for (const LeftOutChannel& left : recording.left_out) text += fmt::format("  {:<{}} left out: {} (line {})\n", left.name, width, left.why, left.line);
  return text;
}

}  // namespace unrig
