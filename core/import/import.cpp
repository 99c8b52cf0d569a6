#include "core/import/import.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/near_word.h"
#include "core/files/scan.h"
#include "core/run/column_names.h"
#include "core/import/bridge.h"
#include "core/import/delimited.h"
#include "core/import/lvm.h"
#include "core/import/mat5.h"
#include "core/import/mat73.h"
#include "core/import/tdms.h"
#include "core/import/uff.h"
#include "core/run/run.h"
#include "core/run/run_text.h"
#include "core/files/text_file.h"
#include "core/files/text_kind.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {
namespace {

constexpr const char* known_formats = "wanted TDMS, MATLAB 5 or 7.3, universal file 58, a LabVIEW measurement file, or text";
constexpr const char* mapping_advice = "`unrig import --help` shows an example.";

TomlTable parse_mapping(const std::string& text, const std::string& file) {
  refuse_other_kinds(text, file, TextKind::mapping);
  TomlTable mapping = TomlTable::parse(text, file, mapping_advice);
  if (!mapping.has("unrig_import") || mapping.integer("unrig_import") != 1)
    mapping.fail("unrig_import", "the file does not say that it is a mapping", "wanted `unrig_import = 1`", mapping_advice);
  mapping.allow_only({"unrig_import", "run", "time", "column", "format"});
  return mapping;
}

/// By its name; else by what the file calls it elsewhere.
const RecordedChannel& source_of(const TomlTable& table, const Recording& recording) {
  const std::string name = table.text("source");
  const auto is_it = [&](const auto& channel) { return channel.name == name; };
  const auto is_called_so = [&](const RecordedChannel& channel) { return channel.label == name; };
  auto found = std::find_if(recording.channels.begin(), recording.channels.end(), is_it);
  if (found == recording.channels.end() && std::count_if(recording.channels.begin(), recording.channels.end(), is_called_so) == 1)
    found = std::find_if(recording.channels.begin(), recording.channels.end(), is_called_so);
  const auto left_out = std::find_if(recording.left_out.begin(), recording.left_out.end(), is_it);
  if (std::count_if(recording.channels.begin(), recording.channels.end(), is_it) + std::count_if(recording.left_out.begin(), recording.left_out.end(), is_it) > 1)
    table.fail("source", fmt::format("{} holds more than one channel \"{}\"", recording.file, name), "wanted a name that only one of them has; rename the others in the recording");
  if (left_out != recording.left_out.end()) {
    const InputError::Place named = table.place("source");
    throw InputError({recording.file, left_out->line}, fmt::format("{}, in the column \"{}\"", left_out->why, name),
                     fmt::format("wanted numbers only, as {}:{} makes it a column of the run", named.file, named.line), left_out->advice);
  }
  if (found != recording.channels.end()) return *found;
  std::vector<std::string> names;
  for (const RecordedChannel& channel : recording.channels) names.push_back("\"" + channel.name + "\"");
  constexpr std::size_t most = 40;
  if (names.size() > most) names.resize(most);
  table.fail("source", fmt::format("{} holds no channel \"{}\"", recording.file, name), fmt::format("wanted one of: {}", fmt::join(names, ", ")));
}

/// "deg" and "°", "N/m" and "newton/metre".
bool same_unit(const std::string& a, const std::string& b) try {
  const InputError::Place nowhere{"", 0};
  const std::string si = si_unit(a, nowhere, a);
  if (si != si_unit(b, nowhere, b)) return false;
  const UnitScale one = unit_scale(a, si, nowhere, a), other = unit_scale(b, si, nowhere, b);
  return one(0) == other(0) && one(1) == other(1);
} catch (const InputError&) {
  return false;  // a unit that UDUNITS does not know
}

/// The channel's unit: the file's, or the mapping's where the file gives none. A contradiction is an error: one of the two is wrong.
std::string unit_of(const TomlTable& table, const RecordedChannel& channel) {
  const std::string told = table.text_or("unit", "");
  const bool of_gravity = (channel.unit == "g" || channel.unit == "G") && same_unit(told, "gravity");  // as makers of accelerometers write it; to UDUNITS it is a gram
  if (!told.empty() && !channel.unit.empty() && told != channel.unit && !of_gravity && !same_unit(told, channel.unit))
    table.fail("unit", fmt::format("the unit is \"{}\" here and \"{}\" in the file, for \"{}\"", told, channel.unit, channel.name), "wanted the same, or none here",
               "Where the file is wrong, mend it there: nobody can see it in the run file any more.");
  const std::string unit = told.empty() ? channel.unit : told;
  if (unit.empty()) table.fail("source", fmt::format("the file gives no unit for \"{}\"", channel.name), "wanted `unit`", "The unit of a number without dimension is \"1\".");
  return unit;
}

double volts_or(const TomlTable& bridge, const char* key, double otherwise) { return bridge.has(key) ? bridge.quantity(key, "V") : otherwise; }

Bridge read_bridge(const TomlTable& table) {
  table.allow_only({"kind", "gauge_factor", "poisson", "excitation", "initial_voltage", "gauge_resistance", "lead_resistance", "shunt_gain", "shunt_reading", "shunt_expected"});
  Bridge bridge;
  try {
    bridge.kind = bridge_from_name(table.text("kind"));
  } catch (const std::invalid_argument& e) {
    table.fail("kind", e.what(), "wanted one of these");
  }
  bridge.gauge_factor = table.number("gauge_factor");
  bridge.poisson = table.number_or("poisson", 0);
  bridge.excitation = table.quantity("excitation", "V");
  bridge.initial_voltage = volts_or(table, "initial_voltage", 0);
  bridge.gauge_resistance = table.has("gauge_resistance") ? table.quantity("gauge_resistance", "ohm") : 0;
  bridge.lead_resistance = table.has("lead_resistance") ? table.quantity("lead_resistance", "ohm") : 0;
  if (table.has("shunt_reading") != table.has("shunt_expected") || (table.has("shunt_gain") && table.has("shunt_reading")))
    table.fail("shunt_gain", "the shunt calibration is incomplete or given twice", "wanted shunt_gain, or shunt_reading with shunt_expected");
  bridge.shunt_gain = table.has("shunt_reading") ? table.quantity("shunt_expected", "V") / table.quantity("shunt_reading", "V") : table.number_or("shunt_gain", 1);
  if (const std::string wrong = what_is_wrong(bridge); !wrong.empty()) table.fail("kind", wrong, "wanted a bridge that can scale a voltage");
  return bridge;
}

struct Column {
  std::string name, unit, source;
  std::vector<double> value;
};

Column read_column(const TomlTable& table, const Recording& recording) {
  table.allow_only({"name", "source", "unit", "raw", "bridge"});
  const RecordedChannel& channel = source_of(table, recording);
  Column column{table.text("name"), "", channel.name, channel.value};
  if (column.name.empty() || column.name.find_first_of(",[]\"\n\r") != std::string::npos) table.fail("name", fmt::format("the name \"{}\"", column.name), "wanted a name without comma, bracket or quote");
  const bool raw = table.boolean_or("raw", false);
  if (!channel.raw.empty() && !raw)
    table.fail("source", fmt::format("\"{}\" holds unscaled readings of a converter: {}", channel.name, channel.raw), "wanted physical values",
               "`raw = true` takes them as counts, for a calibration in N per count.");
  if (channel.raw.empty() && raw) table.fail("raw", fmt::format("\"{}\" is no raw channel", channel.name), "wanted `raw` only for unscaled readings");
  if (raw && table.text_or("unit", "1") != "1") table.fail("unit", "counts have no unit", "wanted \"1\" or nothing", "The run's calibration says how much a count is.");
  column.unit = raw ? "1" : unit_of(table, channel);
  if (!table.has("bridge")) return column;
  if (raw) table.fail("bridge", "counts are no volts", "wanted a scaled channel for a bridge");
  const Bridge bridge = read_bridge(table.table("bridge"));
  const UnitScale volts = unit_scale(column.unit, "V", table.place("bridge"), channel.name);
  for (double& x : column.value) x = bridge.strain(volts(x));
  column.unit = "1";
  return column;
}

Column read_time(const TomlTable& mapping, const Recording& recording, const std::vector<Column>& columns) {
  const std::size_t samples = columns.front().value.size();
  Column time{"time", "s", "", {}};
  const auto even = [&](double start, double step) {
    for (std::size_t k = 0; k < samples; ++k) time.value.push_back(start + step * static_cast<double>(k));
  };
  if (!mapping.has("time")) {
    const auto channel = std::find_if(recording.channels.begin(), recording.channels.end(), [&](const RecordedChannel& c) { return c.name == columns.front().source; });
    if (!(channel->step > 0)) mapping.fail("time", "the file gives no sampling interval", "wanted a table [time] with a source or a rate", mapping_advice);
    for (const Column& column : columns)
      for (const RecordedChannel& other : recording.channels)
        if (other.name == column.source && (other.step != channel->step || other.start != channel->start))
          mapping.fail("column", fmt::format("\"{}\" and \"{}\" are sampled differently", channel->name, other.name), "wanted channels of one clock");
    even(channel->start, channel->step);
    return time;
  }
  const TomlTable table = mapping.table("time");
  table.allow_only({"source", "unit", "rate", "start"});
  if (table.has("source") == table.has("rate")) table.fail("source", "the table [time] has both or neither of source and rate", "wanted one of them");
  if (table.has("rate")) {
    even(table.has("start") ? table.quantity("start", "s") : 0, 1 / table.positive_quantity("rate", "Hz"));
    return time;
  }
  const RecordedChannel& channel = source_of(table, recording);
  time.value = channel.value;
  time.unit = unit_of(table, channel);
  time.source = channel.name;
  return time;
}

/// What no command reads, or only where the rig file says so, is kept in the run and easily overlooked.
void warn_of_names(const TomlTable& mapping, const std::string& mapping_file, const std::vector<Column>& columns, std::vector<std::string>& warnings) {
  std::vector<std::string> names;
  for (const Column& column : columns) names.push_back(column.name);
  const auto has = [&](std::string_view name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  const std::vector<std::string_view> read = columns_with_a_meaning();
  for (const TomlTable& table : mapping.tables("column")) {
    const std::string name = table.text("name");
    const std::string meant = std::find(read.begin(), read.end(), name) == read.end() ? meant_column(name, names) : "";
    if (!meant.empty())
      warnings.push_back(fmt::format("{}:{}: no command reads the column \"{}\", unless a [[sensor]] of the rig file names it; did you mean \"{}\"?", mapping_file, table.place("name").line, name, meant));
  }
  if (!has("gauge") && !has("alpha"))
    warnings.push_back(fmt::format("{}: the run has neither a column \"gauge\" nor \"alpha\"; its readings count only where a [[sensor]] of the rig file names their column", mapping_file));
}

/// Keys of a run file's head, and the SI unit of those that are quantities; "text", or "number".
constexpr std::pair<const char*, const char*> head_keys[] = {{"name", "text"}, {"kind", "text"}, {"medium", "text"}, {"density", "kg/m^3"}, {"speed", "m/s"}, {"calibration", "text"}, {"force_calibration", "text"},
                                  {"density_std", "kg/m^3"}, {"density_std_percent", "number"}, {"density_error", "text"}, {"speed_std", "m/s"}, {"speed_std_percent", "number"}, {"speed_error", "text"},
                                  {"calibration_std", "text"}, {"calibration_std_percent", "number"}, {"calibration_error", "text"}, {"force_calibration_std", "text"},
                                  {"force_calibration_std_percent", "number"}, {"force_calibration_error", "text"}, {"clock_std_percent", "number"}, {"clock_error", "text"}};

bool is_head_key(std::string_view name) {
  return std::any_of(std::begin(head_keys), std::end(head_keys), [&](const auto& key) { return name == key.first; });
}

/// The run file's head: what the command line sets, else what [run] says.
std::string head(const TomlTable& mapping, const Recording& recording, const std::vector<RunSetting>& settings) {
  std::string text = "# unrig_run = 1\n";
  text += fmt::format("# # imported from {} ({})\n", toml_string(recording.file), recording.format);
  const bool has_run = mapping.has("run") || settings.empty();
  if (has_run)
    for (const std::string& key : mapping.table("run").keys())
      if (!is_head_key(key)) mapping.table("run").fail(key, fmt::format("the key \"run.{}\" is unknown", key), "wanted a key of a run file's head: name, kind, medium, density, speed, calibration, force_calibration, or what says how well these are known");
  for (const auto& [name, unit] : head_keys) {
    const std::string key = name;
    const bool number = std::string_view(unit) == "number";
    const auto set = std::find_if(settings.rbegin(), settings.rend(), [&](const RunSetting& s) { return s.key == key; });
    if (set != settings.rend()) text += fmt::format("# {} = {}\n", key, number ? set->value : toml_string(set->value));
    else if (has_run && mapping.table("run").has(key)) text += number ? fmt::format("# {} = {}\n", key, mapping.table("run").number(key)) : fmt::format("# {} = {}\n", key, toml_string(mapping.table("run").text(key)));
  }
  return text;
}

DelimitedFormat read_format(const TomlTable& mapping) {
  DelimitedFormat format;
  if (!mapping.has("format")) return format;
  const TomlTable table = mapping.table("format");
  table.allow_only({"delimiter", "decimal", "thousands", "missing", "skip_lines", "header"});
  format.delimiter = table.text_or("delimiter", "");
  if (format.delimiter.size() > 1 && format.delimiter != "blanks") table.fail("delimiter", fmt::format("the delimiter is \"{}\"", format.delimiter), "wanted one character, or \"blanks\"");
  format.decimal = table.text_or("decimal", "");
  if (table.has("decimal") && format.decimal != "." && format.decimal != ",") table.fail("decimal", fmt::format("the decimal sign is \"{}\"", format.decimal), "wanted \".\" or \",\"");
  format.thousands = table.text_or("thousands", "");
  constexpr std::array signs = {".", ",", " ", "'"};
  if (table.has("thousands") && std::find(signs.begin(), signs.end(), format.thousands) == signs.end())
    table.fail("thousands", fmt::format("thousands are set off by \"{}\"", format.thousands), "wanted \".\", \",\", \" \" or \"'\"");
  if (!format.thousands.empty() && format.thousands == format.decimal) table.fail("thousands", "decimal sign and sign of the thousands are the same", "wanted two different ones");
  if (table.has("missing")) format.missing = table.texts("missing");
  if (table.has("skip_lines")) format.skip_lines = table.integer("skip_lines");
  if (format.skip_lines < 0) table.fail("skip_lines", fmt::format("skip_lines is {}", format.skip_lines), "wanted zero or more");
  if (table.has("header")) format.header = table.boolean_or("header", true);
  return format;
}

}  // namespace

RunSetting run_setting(const std::string& text) {
  const InputError::Place place{"--set", 0};
  const std::size_t equals = text.find('=');
  RunSetting setting{text.substr(0, equals), equals == std::string::npos ? "" : text.substr(equals + 1)};
  const auto key = std::find_if(std::begin(head_keys), std::end(head_keys), [&](const auto& one) { return setting.key == one.first; });
  if (key == std::end(head_keys)) {
    std::vector<std::string> names;
    for (const auto& one : head_keys) names.emplace_back(one.first);
    const std::string meant = nearest_word(setting.key, names);
    throw InputError(place, fmt::format("\"{}\" sets no key of a run file's head", text), fmt::format("wanted KEY=VALUE, KEY one of: {}", fmt::join(names, ", ")), meant.empty() ? "" : "Did you mean " + meant + "?");
  }
  if (setting.value.empty()) throw InputError(place, fmt::format("\"{}\" gives {} no value", text, setting.key), "wanted KEY=VALUE", "");
  const std::string_view unit = key->second;
  double value = 0;
  if (unit == "number") {
    const char* const end = setting.value.data() + setting.value.size();
    if (read_number(setting.value.data(), end, value) != end || !std::isfinite(value)) throw InputError(place, fmt::format("{} is \"{}\"", setting.key, setting.value), "wanted a number", "");
  } else if (unit != "text") {
    value = quantity(setting.value, unit, place, setting.key);
    if (value < 0) throw InputError(place, fmt::format("{} is {} {}", setting.key, value, unit), "wanted zero or more", "");
  } else if (setting.key == "kind" && setting.value != "step" && setting.value != "pluck" && setting.value != "forced" && setting.value != "moved") {
    throw InputError(place, fmt::format("kind is \"{}\"", setting.value), "wanted step, pluck, forced or moved", "");
  }
  return setting;
}

Imported import_recording(const Recording& recording, const std::string& mapping_text, const std::string& mapping_file, const std::vector<RunSetting>& settings) {
  const TomlTable mapping = parse_mapping(mapping_text, mapping_file);
  Imported out;
  out.warnings = recording.warnings;
  for (const LeftOutChannel& left : recording.left_out) out.warnings.push_back(fmt::format("{}:{}: the column \"{}\" is left out: {}", recording.file, left.line, left.name, left.why));
  std::vector<Column> columns;
  for (const TomlTable& table : mapping.tables("column")) {
    columns.push_back(read_column(table, recording));
    if (columns.back().value.size() != columns.front().value.size())
      table.fail("source", fmt::format("\"{}\" has {} samples, \"{}\" has {}", columns.back().source, columns.back().value.size(), columns.front().source, columns.front().value.size()),
                 "wanted channels of one length");
    const auto missing = std::count_if(columns.back().value.begin(), columns.back().value.end(), [](double x) { return !std::isfinite(x); });
    out.columns.push_back(fmt::format("{} [{}] from {}{}", columns.back().name, columns.back().unit, columns.back().source, missing == 0 ? "" : fmt::format(", {} missing", missing)));
  }
  columns.insert(columns.begin(), read_time(mapping, recording, columns));
  if (columns[0].value.size() != columns[1].value.size())
    mapping.fail("time", fmt::format("the time has {} samples, \"{}\" has {}", columns[0].value.size(), columns[1].source, columns[1].value.size()), "wanted as many");
  out.samples = columns[0].value.size();
  warn_of_names(mapping, mapping_file, columns, out.warnings);

  out.text = head(mapping, recording, settings);
  for (std::size_t c = 0; c < columns.size(); ++c) out.text += fmt::format("{}{} [{}]", c == 0 ? "" : ",", columns[c].name, columns[c].unit);
  out.text += '\n';
  auto write = std::back_inserter(out.text);
  for (std::size_t k = 0; k < out.samples; ++k)
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const double x = columns[c].value[k];
      if (std::isfinite(x)) fmt::format_to(write, "{:.12g}", x);
      else out.text += "nan";
      out.text += c + 1 < columns.size() ? ',' : '\n';
    }
  const Run run = parse_run(out.text, mapping_file);  // what it refuses must not be written
  out.warnings.insert(out.warnings.end(), run.warnings.begin(), run.warnings.end());
  return out;
}

Recording read_recording(const std::string& path, const std::string& mapping_text, const std::string& mapping_file) {
  std::string bytes = read_text(path);
  const TomlTable mapping = parse_mapping(mapping_text, mapping_file);
  if (bytes.starts_with("PK\x03\x04") || bytes.starts_with("\xD0\xCF\x11\xE0"))
    throw InputError({path, 0}, "this is an Excel workbook (.xlsx, .xls), or another packed file", known_formats, "Export the sheet as CSV (in Excel: save as \"CSV UTF-8\").");
  if (bytes.starts_with("TDSm")) return read_tdms(bytes, path);
  if (bytes.size() > 520 && bytes.compare(512, 4, "\x89HDF") == 0) return read_mat73(path);
  if (bytes.starts_with("MATLAB")) return read_mat5(bytes, path);
  const bool octaves = bytes.starts_with("\x89HDF") && bytes.find("OCTAVE_NEW_FORMAT") != std::string::npos;
  if (bytes.starts_with("\x89HDF") && !octaves) return read_mat73(path);  // as h5py writes it
  for (const auto& [start, what] : {std::pair{"\x89HDF", "the file is in Octave's own form of HDF5 (`save -hdf5`)"}, {"Octave-1-", "the file is in Octave's own binary format"}, {"# Created by Octave", "the file is in Octave's own text format"}})
    if (bytes.starts_with(start)) throw InputError({path, 0}, what, "wanted a MATLAB file of version 5 or 7.3", "Save it again with `save -v7 FILE`.");
  const std::string_view first = std::string_view(bytes).substr(0, bytes.find('\n'));
  if (first.find_first_not_of(" \r") != std::string_view::npos && first.substr(first.find_first_not_of(" ")).starts_with("-1") && first.size() <= 82 && first.find_first_of(",;\t") == std::string_view::npos)
    return read_uff(bytes, path);
  bytes = in_utf8(std::move(bytes));
  if (bytes.find('\0') != std::string::npos) throw InputError({path, 0}, "the file is binary, and in no format that is known here", known_formats, "");
  if (is_lvm(bytes)) return read_lvm(bytes, path, read_format(mapping));
  return read_delimited(bytes, path, read_format(mapping));
}

}  // namespace unrig
