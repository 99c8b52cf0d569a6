#include "core/rig/rig_gauge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <stdexcept>

#include "core/files/csv_table.h"
#include "core/files/text_file.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

GaugeFilter read_lowpass(const TomlTable& lowpass) {
  lowpass.allow_only({"order", "cutoff", "damping_ratio"});
  const int order = lowpass.integer("order");
  if (order != 1 && order != 2) lowpass.fail("order", fmt::format("{} is {}", lowpass.full_name("order"), order), "wanted 1 or 2");
  const double cutoff = lowpass.positive_quantity("cutoff", "Hz"), damping = lowpass.number_or("damping_ratio", 1 / std::numbers::sqrt2);
  if (order == 1 && lowpass.has("damping_ratio")) lowpass.fail("damping_ratio", "a damping ratio of a low-pass of order 1", "wanted order = 2, or no damping_ratio");
  if (!(damping > 0)) lowpass.fail("damping_ratio", fmt::format("{} is {}", lowpass.full_name("damping_ratio"), damping), "wanted more than 0");
  return order == 1 ? first_order_low_pass(cutoff) : low_pass(cutoff, damping);
}

/// A column of the measured response, in SI, finite and `count` long.
VectorXd response_column(const CsvTable& table, const std::string& name, const char* si) {
  const auto found = std::find_if(table.columns.begin(), table.columns.end(), [&](const CsvColumn& c) { return c.name == name; });
  if (found == table.columns.end())
    throw InputError({table.file, table.header_line}, fmt::format("no column \"{}\"", name), "wanted frequency [Hz], gain [1] and phase [deg]", "");
  const UnitScale scale = unit_scale(found->unit, si, {table.file, table.header_line}, name);
  for (Index i = 0; i < found->value.size(); ++i)
    if (!std::isfinite(found->value[i])) throw InputError(table.place(i), fmt::format("no number in column \"{}\"", name), "wanted one in every row", "");
  return found->value.unaryExpr(scale);
}

GaugeFilter read_response(const TomlTable& gauge, Rig& rig) {
  const std::string path = (std::filesystem::path(rig.file).parent_path() / gauge.text("response")).string();
  const std::string text = read_text(path);
  const CsvTable table = read_csv(text, 1, path);
  const VectorXd frequency = response_column(table, "frequency", "Hz"), gain = response_column(table, "gain", "1"), phase = response_column(table, "phase", "rad");
  for (Index i = 0; i < frequency.size(); ++i)
    if (!(frequency[i] >= 0) || (i > 0 && frequency[i] <= frequency[i - 1]) || !(gain[i] >= 0) || !(gain[0] > 0))
      throw InputError(table.place(i), "frequencies that do not increase, or a gain that is not positive", "wanted a frequency response, gain and phase over ascending frequency", "");
  if (frequency.size() < 4) throw InputError({path, 1}, fmt::format("{} frequencies", frequency.size()), "wanted four at least", "");
  Eigen::VectorXcd measured(frequency.size());
  for (Index i = 0; i < frequency.size(); ++i) measured[i] = std::polar(gain[i] / gain[0], phase[i]);
  constexpr double told = 0.01;
  try {
    double miss = 0;
    GaugeFilter filter = measured_filter(frequency, measured, miss);
    if (miss > told) rig.warnings.push_back(fmt::format("{}: the nearest filter, of {} poles, misses the measured response by up to {:.2g} of its gain", path, filter.states(), miss));
    return filter;
  } catch (const std::invalid_argument& e) {
    throw InputError({path, 1}, e.what(), "wanted the response of a stable amplifier, phase lag negative", "");
  }
}

}  // namespace

void take_gauge_channel(const TomlTable& gauge, Rig& rig) {
  rig.calibration_uncertainty = gauge.number_or("calibration_uncertainty", 0);
  if (!(rig.calibration_uncertainty >= 0 && rig.calibration_uncertainty < 1))
    gauge.fail("calibration_uncertainty", fmt::format("{} is {}", gauge.full_name("calibration_uncertainty"), rig.calibration_uncertainty), "wanted a fraction of the reading, from 0 to 1");
  if (gauge.has("lowpass")) rig.gauge_filters.push_back(read_lowpass(gauge.table("lowpass")));
  if (gauge.has("response")) rig.gauge_filters.push_back(read_response(gauge, rig));
  if (!gauge.has("delay")) return;
  constexpr int order = 6;
  constexpr double longest = 0.01;  // s, of one all-pass
  const double time = gauge.positive_quantity("delay", "s"), stages = std::ceil(time / longest);
  constexpr int most = 20;
  if (stages > most) gauge.fail("delay", fmt::format("{} is {:g} s", gauge.full_name("delay"), time), fmt::format("wanted at most {:g} s", most * longest), "Shift the column before.");
  rig.gauge_filters.insert(rig.gauge_filters.end(), static_cast<std::size_t>(stages), delay(time / stages, order));
}

}  // namespace unrig
