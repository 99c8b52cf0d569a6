#include "core/import/lvm.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include <fmt/format.h>

#include "core/files/error.h"
#include "core/import/number_form.h"
#include "core/import/table_cells.h"
#include "core/files/near_word.h"
#include "core/files/scan.h"
#include "core/files/units.h"

namespace unrig {
namespace {

constexpr std::string_view lvm_begin = "LabVIEW Measurement", lvm_end_of_header = "***End_of_Header***";

/// What a header says of a key, for the file or for each channel.
using LvmHeader = std::map<std::string, std::vector<std::string>>;

/// The headers, and where the table behind them begins.
class LvmHead {
 public:
  LvmHead(std::string_view text, const std::string& file) : text_(text), file_(file) {
    next_line();  // "LabVIEW Measurement"
    read(file_keys_, "\t,;");
    const std::string separator = of_file("Separator");
    delimiter_ = separator == "Comma" ? "," : separator.size() == 1 ? separator : "\t";
    read(channel_keys_, delimiter_);
  }

  std::string of_file(const std::string& key) const {
    const auto found = file_keys_.find(key);
    return found == file_keys_.end() || found->second.empty() ? "" : found->second.front();
  }
  std::vector<std::string> of_channels(const std::string& key) const {
    const auto found = channel_keys_.find(key);
    return found == channel_keys_.end() ? std::vector<std::string>{} : found->second;
  }
  const std::string& delimiter() const { return delimiter_; }
  int lines() const { return line_; }
  std::size_t position() const { return at_; }

 private:
  std::string_view next_line() {
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    std::string_view line = text_.substr(at_, end - at_);
    at_ = std::min(end + 1, text_.size());
    ++line_;
    return line.ends_with('\r') ? line.substr(0, line.size() - 1) : line;
  }

  void read(LvmHeader& header, std::string_view delimiters) {
    while (at_ < text_.size()) {
      const std::string_view line = next_line();
      if (line.starts_with(lvm_end_of_header)) return;
      std::size_t at = line.find_first_of(delimiters);
      if (at == std::string_view::npos) continue;
      std::vector<std::string>& values = header[std::string(trimmed(line.substr(0, at)))];
      const char delimiter = line[at];
      while (at < line.size()) {
        const std::size_t end = std::min(line.find(delimiter, at + 1), line.size());
        values.emplace_back(trimmed(line.substr(at + 1, end - at - 1)));
        at = end;
      }
      while (!values.empty() && values.back().empty()) values.pop_back();
    }
    throw InputError({file_, line_}, "the header of a LabVIEW measurement file does not end", fmt::format("wanted two of them, each with {} behind it", lvm_end_of_header), "");
  }

  std::string_view text_;
  std::string file_, delimiter_;
  LvmHeader file_keys_, channel_keys_;
  std::size_t at_ = 0;
  int line_ = 0;
};

/// "Volts" -> "volts", which UDUNITS knows; empty where it knows neither.
std::string known_unit(const std::string& label) {
  for (const std::string& unit : {label, in_small_letters(label)}) {
    try {
      si_unit(unit, {}, unit);
      return unit;
    } catch (const InputError&) {  // the next one
    }
  }
  return "";
}

bool is_x(const RecordedChannel& channel) { return channel.name == "X_Value"; }

/// Whether a column of times goes on as evenly as Delta_X says.
bool agrees(const std::vector<double>& times, double step) {
  constexpr double rounding = 1e-3;  // steps, as core/run/time_grid.h has it
  if (times.size() < 2) return false;
  const double last = times.front() + step * static_cast<double>(times.size() - 1);
  return std::abs(times.back() - last) <= rounding * step * static_cast<double>(times.size() - 1);
}

void take_sampling(const LvmHead& head, char decimal, Recording& out) {
  const std::vector<std::string> steps = head.of_channels("Delta_X"), starts = head.of_channels("X0"), dimensions = head.of_channels("X_Dimension");
  const bool of_time = dimensions.empty() || dimensions.front() == "Time" || dimensions.front().empty();
  const NumberForm form{decimal, '\0', {}};
  const double step = steps.empty() ? 0 : cell_number(steps.front(), form).value_or(0), start = starts.empty() ? 0 : cell_number(starts.front(), form).value_or(0);
  for (const RecordedChannel& channel : out.channels)
    if (is_x(channel) && !agrees(channel.value, step)) return;
  for (RecordedChannel& channel : out.channels) {
    if (of_time && is_x(channel)) channel.unit = "s";
    if (of_time && step > 0 && !is_x(channel)) channel.step = step, channel.start = start;
  }
}

void take_units(const LvmHead& head, Recording& out) {
  std::vector<std::string> labels = head.of_channels("Y_Unit_Label");
  const auto measured = std::count_if(out.channels.begin(), out.channels.end(), [](const RecordedChannel& channel) { return !is_x(channel); });
  if (static_cast<std::ptrdiff_t>(labels.size()) > measured) std::erase(labels, "");  // between columns of times
  if (static_cast<std::ptrdiff_t>(labels.size()) != measured) return;
  auto label = labels.begin();
  for (RecordedChannel& channel : out.channels) {
    if (is_x(channel)) continue;
    if (channel.unit.empty()) channel.unit = known_unit(*label);
    if (channel.unit.empty() && !label->empty()) channel.remark = fmt::format("(unit label \"{}\")", *label);
    ++label;
  }
}

/// With a column of times for each channel their names repeat.
void name_times(Recording& out) {
  if (std::count_if(out.channels.begin(), out.channels.end(), is_x) < 2) return;
  for (std::size_t c = 0; c + 1 < out.channels.size(); ++c)
    if (is_x(out.channels[c])) out.channels[c].name += " of " + out.channels[c + 1].name;
}

}  // namespace

bool is_lvm(std::string_view text) { return text.starts_with(lvm_begin); }

Recording read_lvm(std::string_view text, const std::string& file, const DelimitedFormat& asked) {
  const LvmHead head(text, file);
  DelimitedFormat format = asked;
  if (format.delimiter.empty()) format.delimiter = head.delimiter();
  if (format.decimal.empty()) format.decimal = head.of_file("Decimal_Separator") == "," ? "," : ".";
  format.skip_lines = head.lines();
  format.header = true;
  const std::size_t more = text.find(lvm_end_of_header, head.position());
  if (more != std::string_view::npos) text = text.substr(0, text.rfind("\nChannels", more) + 1);
  if (text.size() < head.position()) text = text.substr(0, head.position());
  Recording out = read_delimited(text, file, format);
  out.format = "LabVIEW measurement";
  if (more != std::string_view::npos) out.warnings.push_back(fmt::format("{}: several tables under headings of their own; the first is read", file));
  take_units(head, out);
  take_sampling(head, format.decimal.front(), out);
  name_times(out);
  return out;
}

}  // namespace unrig
