#include "core/import/import_template.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <vector>

#include "core/files/error.h"
#include "core/files/near_word.h"
#include "core/files/units.h"
#include "core/import/channel_list.h"
#include "core/run/run_text.h"

namespace unrig {
namespace {

bool says(const std::string& name, std::initializer_list<const char*> words) {
  return std::any_of(words.begin(), words.end(), [&](const char* word) { return name.find(word) != std::string::npos; });
}

/// The channel's SI unit; empty where it has none, or one that is unknown.
std::string si_of(const RecordedChannel& channel) try {
  return channel.unit.empty() ? "" : si_unit(channel.unit, {}, channel.name);
} catch (const InputError&) {
  return "";
}

/// Of an accelerometer the acceleration of gravity, to UDUNITS a gram.
bool says_g(const RecordedChannel& channel) { return channel.unit == "g" || channel.unit == "G"; }

/// What of a channel tells what it is.
std::string words_of(const RecordedChannel& channel) { return in_small_letters(channel.name + " " + channel.label); }

bool is_time(const RecordedChannel& channel) { return rate_of_times(channel) > 0 || (si_of(channel) == "s" && says(words_of(channel), {"time", "zeit", "stamp", "temps"})); }

/// The run's column that a channel probably is: by its unit, and where that leaves a choice by its name. Empty: none with a meaning.
std::string meaning_of(const RecordedChannel& channel) {
  const std::string si = si_of(channel), words = words_of(channel);
  const bool unknown = si.empty() || si == "1";
  if (si == "rad" || (unknown && says(words, {"alpha", "angle", "aoa", "incidence", "pitch", "winkel", "encoder"}))) return "alpha";
  if ((si == "N" || si == "V" || unknown) && says(words, {"hammer", "impact", "shaker"})) return "force";
  if (si == "N" || ((si == "V" || unknown) && says(words, {"gauge", "bridge", "load", "strain", "balance", "cell", "kraft", "lift", "force"}))) return "gauge";
  if (si == "m/s^2" || si == "m.s-2" || says_g(channel)) return "acc";
  return "";
}

/// A name for a column without a meaning: the channel's own, in letters that a header takes.
std::string plain_name(const RecordedChannel& channel) {
  std::string name = in_small_letters(channel.label.empty() ? channel.name.substr(channel.name.rfind('/') + 1) : channel.label);
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  return name.empty() ? "channel" : name;
}

std::string range_of(const RecordedChannel& channel) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const double x : channel.value)
    if (std::isfinite(x)) low = std::min(low, x), high = std::max(high, x);
  if (!(low <= high)) return "no number in it";
  return fmt::format("{} samples, {:.5g} to {:.5g} {}", channel.value.size(), low, high, channel.unit);
}

struct Named {
  const RecordedChannel* channel;
  std::string name;
};

/// Channels of one length and clock, each with a name of its own.
std::vector<Named> columns_of(const Recording& recording, const RecordedChannel* time, std::vector<const RecordedChannel*>& left) {
  std::vector<Named> named;
  const auto taken = [&](const std::string& name) { return name == "time" || name == "weight" || std::any_of(named.begin(), named.end(), [&](const Named& n) { return n.name == name; }); };
  for (const RecordedChannel& channel : recording.channels) {
    if (&channel == time) continue;
    const RecordedChannel& like = time ? *time : named.empty() ? channel : *named.front().channel;
    const bool same_clock = time || (like.step == channel.step && like.start == channel.start);
    const bool twice = std::count_if(recording.channels.begin(), recording.channels.end(), [&](const RecordedChannel& other) { return other.name == channel.name; }) > 1;
    const bool numbers = std::any_of(channel.value.begin(), channel.value.end(), [](double x) { return std::isfinite(x); });
    if (like.value.size() != channel.value.size() || !same_clock || twice || !numbers || is_time(channel)) {
      left.push_back(&channel);
      continue;
    }
    std::string name = meaning_of(channel);
    if (name.empty() || taken(name)) name = plain_name(channel);
    const std::string stem = name;
    for (int k = 2; taken(name); ++k) name = fmt::format("{}_{}", stem, k);
    named.push_back({&channel, name});
  }
  return named;
}

std::string column_text(const Named& column) {
  const RecordedChannel& channel = *column.channel;
  std::string text = fmt::format("\n# {}\n[[column]]\nname = {}\nsource = {}\n", range_of(channel), toml_string(column.name), toml_string(channel.name));
  if (!channel.raw.empty()) return text + "raw = true                   # counts of the converter that the file does not scale: the calibration above is then \"0.01 N\", say, per count\n";
  const bool gauge = column.name == "gauge" || column.name == "force";
  if (channel.unit.empty())
    text += fmt::format("# ? The file gives no unit; which is it?\nunit = \"{}\"\n", column.name == "alpha" ? "deg" : gauge ? "V" : column.name == "acc" ? "m/s^2" : "1");
  if (says_g(channel)) text += "# ? \"g\" of an accelerometer is the acceleration of gravity; of a mass delete the next line.\nunit = \"gravity\"\n";
  if (gauge && (channel.unit.empty() || si_of(channel) == "V"))
    text += "# bridge.kind = \"full-1\"      # only for bridge.gauge_factor and bridge.excitation in place of a calibration with dead weights\n";
  return text;
}

std::string run_text_of(const std::vector<Named>& columns) {
  const auto has = [&](const char* name) { return std::any_of(columns.begin(), columns.end(), [&](const Named& n) { return n.name == name; }); };
  const auto volts = [&](const char* name) {
    return std::any_of(columns.begin(), columns.end(), [&](const Named& n) { return n.name == name && (n.channel->unit.empty() || !n.channel->raw.empty() || si_of(*n.channel) == "V"); });
  };
  std::string text = "[run]\n# ? step: the shaft turns. pluck: a free decay. forced: a measured force drives the rig. moved: the mount itself moves.\n";
  text += fmt::format("kind = \"{}\"\n", has("force") ? "forced" : has("alpha") ? "step" : "pluck");
  text +=
      "# ? Which fluid, how dense, how fast? Water 998 kg/m^3, air 1.2 kg/m^3; in a still tank \"0 m/s\". For one file of many: unrig import --set speed=\"0.6 m/s\"\n"
      "medium = \"air\"\ndensity = \"1.2 kg/m^3\"\nspeed = \"0 m/s\"\n";
  for (const char* name : {"gauge", "force"})
    if (volts(name))
      text += fmt::format("# ? How much is a volt (a count) of the {}?\n# {} = \"4.4 N/V\"\n", name, std::string(name) == "gauge" ? "calibration" : "force_calibration");
  return text;
}

}  // namespace

std::string import_template(const Recording& recording) {
  const auto found = std::find_if(recording.channels.begin(), recording.channels.end(), is_time);
  const RecordedChannel* time = found == recording.channels.end() ? nullptr : &*found;
  std::vector<const RecordedChannel*> left;
  const std::vector<Named> columns = columns_of(recording, time, left);
  if (columns.empty()) throw InputError({recording.file, 0}, "the file holds no channel of numbers beside the time", "wanted a measured channel", "`unrig import FILE` lists what it holds.");

  std::string text = fmt::format("# How {} becomes a run file. Lines that begin with \"# ?\" ask what only you know.\n# Then: unrig import FILE --map THIS_FILE -o run.csv\nunrig_import = 1\n", recording.file);
  text += run_text_of(columns);
  if (time) {
    text += fmt::format("\n# {}\n[time]\nsource = {}\n", range_of(*time), toml_string(time->name));
  } else if (!(columns.front().channel->step > 0)) {
    text += "\n[time]\n# ? The file gives no time: how many samples a second?\nrate = \"1000 Hz\"\n";
  }
  text += "\n# ? Is each channel what its `name` says? Commands read alpha, gauge, force, mount_velocity, mount_acceleration and weight; others where a [[sensor]] of the rig file names\n# ? them. Delete what you do not need.";
  for (const Named& column : columns) text += column_text(column);
  for (const RecordedChannel* channel : left) text += fmt::format("\n# left out, of another length or clock, without numbers, or with a name that others have too: {} ({})\n", toml_string(channel->name), range_of(*channel));
  for (const LeftOutChannel& channel : recording.left_out) text += fmt::format("\n# left out: {}: {}\n", toml_string(channel.name), channel.why);
  return text;
}

}  // namespace unrig
