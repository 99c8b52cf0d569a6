#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.h"
#include "core/wagner.h"
#include "correct/report/result_files.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The column, in the unit of the file. Throws InputError where it is absent or holds text.
const CsvColumn& column(const CsvTable& table, const char* name) {
  for (const CsvColumn& c : table.columns) {
    if (c.name != name) continue;
    if (!c.text.empty()) throw InputError({table.file, c.text_line}, fmt::format("the column \"{}\" holds \"{}\"", name, c.text), "wanted numbers", "");
    return c;
  }
  throw InputError({table.file, table.header_line}, fmt::format("no column \"{}\"", name), "wanted a file that `unrig correct` wrote", "");
}

/// Of increasing values without a gap: time, semichords.
const VectorXd& increasing(const CsvTable& table, const CsvColumn& c) {
  for (Index k = 0; k < c.value.size(); ++k)
    if (!std::isfinite(c.value[k]) || (k > 0 && !(c.value[k] > c.value[k - 1])))
      throw InputError(table.place(k), fmt::format("\"{}\" is {} after {}", c.name, c.value[k], k > 0 ? c.value[k - 1] : std::nan("")), "wanted increasing numbers", "");
  if (c.value.size() < 2) throw InputError({table.file, table.header_line}, fmt::format("{} rows", c.value.size()), "wanted at least two", "");
  return c.value;
}

}  // namespace

void add_corrected(ReportPage& page, const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const CsvColumn& time = column(table, "time");
  const VectorXd& t = increasing(table, time);
  const CsvColumn &gauge = column(table, "gauge"), &load = column(table, "normal_force"), &load_std = column(table, "normal_force_std"),
                  &circulatory = column(table, "circulatory"), &circulatory_std = column(table, "circulatory_std");
  const std::string name = file_name(path), time_label = labelled("time", time.unit);
  const Index last = t.size() - 1;
  const double dt = (t[last] - t[0]) / static_cast<double>(last);

  page.add_verdict(Tone::good,
                   fmt::format("A rigid rig would have felt a circulatory load of {} {} at the end of the record, after {} {} before the motion.",
                               with_error(circulatory.value[last], circulatory_std.value[last]), load.unit, plain(circulatory.value[0], 4), load.unit),
                   name);
  page.add_section("Correction: " + name);
  page.add_plot({"Gauge and the load of a rigid rig", time_label, labelled("load", load.unit), t,
                 {{"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, load_std.value}}, name,
                 "The gauge reads the equivalent force at the calibration station, the load is the whole normal force: even at rest they differ by the ratio of their levers.", false, false, 320});
  page.add_plot({"Gauge and the circulatory part of the load", time_label, labelled("load", circulatory.unit), t,
                 {{"gauge reading", 0, gauge.value}, {"circulatory load", 2, circulatory.value, circulatory_std.value}}, name});
  const CsvColumn &cn = column(table, "cn"), &cn_std = column(table, "cn_std");
  page.add_plot({"Normal-force coefficient", "time [semichords since the motion began]", "C_N", increasing(table, column(table, "semichords")),
                 {{"C_N", 1, cn.value, cn_std.value}}});
  add_spectra(page, "Spectra before and after the correction", dt, load.unit, {"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, {}, true},
              "Amplitude of the whole record, mean removed, Hann window. What the rig adds stands in the reading only.");
}

void add_modal_load(ReportPage& page, const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const CsvColumn& time = column(table, "time");
  const VectorXd& t = increasing(table, time);
  const CsvColumn &gauge = column(table, "gauge"), &load = column(table, "normal_force"), &load_std = column(table, "normal_force_std"), &inputs = column(table, "from_inputs");
  const std::string name = file_name(path), time_label = labelled("time", time.unit);
  const double dt = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  const auto rms = [](const VectorXd& x) { return std::sqrt(x.array().isFinite().select(x.array().square(), 0).sum() / static_cast<double>(std::max<Index>(1, x.array().isFinite().count()))); };

  page.add_verdict(Tone::good,
                   fmt::format("A rigid rig that does not move would have read {} {} r.m.s., give or take {}; the gauge reads {}, of which the measured inputs account for {}.", plain(rms(load.value), 4),
                               load.unit, plain(rms(load_std.value), 2), plain(rms(gauge.value), 4), plain(rms(inputs.value), 4)),
                   name);
  page.add_section("Correction: " + name);
  page.add_plot({"Gauge and the load of a rigid rig", time_label, labelled("reading", load.unit), t, {{"gauge reading", 0, gauge.value}, {"rigid-rig load", 1, load.value, load_std.value}}, name,
                 "The rig is known only as modes: the load is what the gauge would read of it if the rig were rigid and its mount at rest.", false, false, 320});
  page.add_plot({"Gauge and what the measured inputs do to it", time_label, labelled("reading", gauge.unit), t,
                 {{"gauge reading", 0, gauge.value}, {"from the measured inputs", 2, inputs.value}}, name, "Inputs are the motion of the mount and a measured force."});
  page.add_plot({"The load alone", time_label, labelled("load", load.unit), t, {{"rigid-rig load", 1, load.value, load_std.value}}, name,
                 "With its band, on a scale of its own. It is smoothed as far as the noise demands: what is faster than its bandwidth is left out."});
  add_spectra(page, "Spectra before and after the correction", dt, load.unit, {"gauge reading", 0, gauge.value}, {"reading less what the inputs do", 1, gauge.value - inputs.value},
              "Amplitude of the whole record, mean removed, Hann window. What stands out of both is a load, or a mode that the rig file does not have.");
}

void add_indicial(ReportPage& page, const std::string& text, const std::string& path) {
  const CsvTable table = read_csv(text, 1, path);
  const VectorXd& s = increasing(table, column(table, "semichords"));
  const VectorXd &value = column(table, "indicial").value, &std = column(table, "indicial_std").value;
  Index first = 0;
  while (first < s.size() && !(s[first] > 0)) ++first;  // the axis is logarithmic
  const Index rows = s.size() - first;
  const VectorXd x = s.tail(rows), wagners = x.unaryExpr([](double at) { return wagner_exact(at); });
  const VectorXd off = (value.tail(rows) - wagners).cwiseQuotient(std.tail(rows));
  Index within = 0, known = 0;
  for (Index k = 0; k < rows; ++k) {
    if (!(std[first + k] > 0) || !std::isfinite(off[k])) continue;
    ++known;
    if (std::abs(off[k]) <= 2) ++within;
  }
  if (known == 0) throw InputError({path, 1}, "no row has a standard deviation", "wanted an indicial response that `unrig correct --indicial` wrote", "");
  const double share = static_cast<double>(within) / static_cast<double>(known);
  const std::string name = file_name(path);
  page.add_verdict(Tone::open,
                   fmt::format("The indicial response lies within its 95 % band of Wagner's function over {:.0f} % of the points from {:.3g} to {:.3g} semichords.", 100 * share, x[0], x[rows - 1]), name);
  page.add_section("Indicial response: " + name);
  page.add_plot({"Indicial response against Wagner's", "distance since the step [semichords]", "response over its limit", x,
                 {{"estimated", 1, value.tail(rows), std.tail(rows)}, {"Wagner (exact)", 0, wagners, {}, true}}, "",
                 "Nothing in the estimate assumes Wagner's shape. The band is two standard deviations at each distance; neighbouring points move together.", true, false, 340});
}

}  // namespace unrig
