#include "correct/report/report_page.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using nlohmann::json;

constexpr Index most_rows = 6000;

/// As many digits as a plot can show; JSON knows no NaN.
json rounded(double x, int digits = 6) {
  if (!std::isfinite(x)) return nullptr;
  return std::strtod(fmt::format("{:.{}g}", x, digits).c_str(), nullptr);
}

json numbers(const Eigen::VectorXd& values, const std::vector<Index>& rows, int digits = 6) {
  json out = json::array();
  for (const Index k : rows) out.push_back(rounded(values[k], digits));
  return out;
}

json numbers(const std::vector<double>& values) {
  json out = json::array();
  for (const double x : values) out.push_back(rounded(x));
  return out;
}

/// Rows [first, last) of a plot: where its curves are lowest and highest, and how much the one that varies most does so on the plot's axis, or `busy`.
struct Stretch {
  Index first, last;
  std::vector<Index> extremes;
  double varies = 0;
  bool operator<(const Stretch& other) const { return varies < other.varies; }
};

/// The smallest and the largest number in rows [first, last) that can be drawn; -1 where there is none.
std::pair<Index, Index> extremes_of(const Eigen::VectorXd& value, bool log, Index first, Index last) {
  Index low = -1, high = -1;
  for (Index k = first; k < last; ++k) {
    if (!std::isfinite(value[k]) || (log && value[k] <= 0)) continue;
    if (low < 0 || value[k] < value[low]) low = k;
    if (high < 0 || value[k] > value[high]) high = k;
  }
  return {low, high};
}

Stretch stretch_of(const Plot& plot, Index first, Index last) {
  Stretch stretch{first, last, {}};
  const bool curves_decide = plot.busy.size() == 0;
  for (const Curve& curve : plot.curves) {
    const auto [low, high] = extremes_of(curve.value, plot.log_y, first, last);
    if (low < 0) continue;
    const double l = curve.value[low], h = curve.value[high];
    if (curves_decide) stretch.varies = std::max(stretch.varies, plot.log_y ? std::log(h / l) : h - l);
    stretch.extremes.insert(stretch.extremes.end(), {low, high});
  }
  if (!curves_decide)
    if (const auto [low, high] = extremes_of(plot.busy, false, first, last); low >= 0) stretch.varies = plot.busy[high] - plot.busy[low];
  if (stretch.extremes.empty()) stretch.extremes.push_back(first);  // a gap stays a gap
  std::sort(stretch.extremes.begin(), stretch.extremes.end());
  stretch.extremes.erase(std::unique(stretch.extremes.begin(), stretch.extremes.end()), stretch.extremes.end());
  return stretch;
}

void push_once(json& list, const json& item) {
  if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
}

const char* name_of(Tone tone) { return tone == Tone::good ? "good" : tone == Tone::bad ? "bad" : tone == Tone::open ? "open" : "told"; }

}  // namespace

ReportPage::ReportPage(const std::string& title) {
  data_ = {{"title", title}, {"version", "unrig " UNRIG_VERSION}, {"verdicts", json::array()}, {"blocks", json::array()}};
}

void ReportPage::add_verdict(Tone tone, const std::string& text, const std::string& about) {
  data_["verdicts"].push_back({{"tone", name_of(tone)}, {"text", text}, {"about", about}});
}

void ReportPage::push(json block) {
  if (!heading_.empty()) data_["blocks"].push_back({{"type", "heading"}, {"title", std::exchange(heading_, "")}});
  data_["blocks"].push_back(std::move(block));
}

void ReportPage::add_section(const std::string& title) {
  heading_.clear();
  push({{"type", "section"}, {"title", title}});
}

void ReportPage::add_text(const std::string& text) { push({{"type", "text"}, {"text", text}}); }

void ReportPage::add_table(const std::string& title, const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows,
                           const std::string& caption) {
  push({{"type", "table"}, {"title", title}, {"header", header}, {"rows", rows}, {"caption", caption}});
}

std::vector<Index> kept_rows(const Plot& plot, Index most) {
  const Index rows = plot.x.size();
  std::vector<Index> kept;
  if (rows <= most) {
    for (Index k = 0; k < rows; ++k) kept.push_back(k);
    return kept;
  }
  const Index most_stretches = std::max<Index>(2, most / std::max<Index>(1, 2 * static_cast<Index>(plot.curves.size()))), even = most_stretches / 2;
  std::vector<Stretch> stretches;  // a heap: the one that varies most comes first
  for (Index b = 0; b < even; ++b) stretches.push_back(stretch_of(plot, b * rows / even, (b + 1) * rows / even));
  std::make_heap(stretches.begin(), stretches.end());
  while (static_cast<Index>(stretches.size()) < most_stretches && stretches.front().varies > 0) {
    std::pop_heap(stretches.begin(), stretches.end());
    const Index first = stretches.back().first, last = stretches.back().last, middle = first + (last - first) / 2;
    stretches.back() = stretch_of(plot, first, middle);
    std::push_heap(stretches.begin(), stretches.end());
    stretches.push_back(stretch_of(plot, middle, last));
    std::push_heap(stretches.begin(), stretches.end());
  }
  for (const Stretch& stretch : stretches) kept.insert(kept.end(), stretch.extremes.begin(), stretch.extremes.end());
  std::sort(kept.begin(), kept.end());
  return kept;
}

void ReportPage::add_plot(const Plot& plot) {
  for (const Curve& curve : plot.curves)
    if (curve.value.size() != plot.x.size() || (curve.std.size() > 0 && curve.std.size() != plot.x.size()))
      throw std::invalid_argument("the curve \"" + curve.name + "\" is not as long as its plot");
  if (plot.busy.size() > 0 && plot.busy.size() != plot.x.size()) throw std::invalid_argument("what says where to look is not as long as its plot");
  const std::vector<Index> rows = kept_rows(plot, most_rows);
  std::string caption = plot.caption;
  if (static_cast<Index>(rows.size()) < plot.x.size())
    caption += fmt::format("{}Drawn from {} of {} samples: the extremes of every stretch, of shorter ones where more happens.", caption.empty() ? "" : " ", rows.size(), plot.x.size());
  json block = {{"type", "plot"},         {"title", plot.title},    {"x_label", plot.x_label}, {"y_label", plot.y_label}, {"group", plot.group},
                {"caption", caption},     {"log_x", plot.log_x},    {"log_y", plot.log_y},     {"height", plot.height},   {"series", json::array()},
                {"x", numbers(plot.x, rows, 9)}};
  for (const Curve& curve : plot.curves) {
    json series = {{"name", curve.name}, {"colour", curve.colour}, {"dashed", curve.dashed}, {"points", curve.points}, {"v", numbers(curve.value, rows)}};
    if (curve.std.size() > 0) series["std"] = numbers(curve.std, rows, 3);
    block["series"].push_back(series);
  }
  for (const Box& box : plot.boxes) block["boxes"].push_back({{"from", rounded(box.from)}, {"to", rounded(box.to)}, {"name", box.name}});
  if (plot.stacked) block["stacked"] = true;
  if (plot.y_range) block["y_range"] = {rounded(plot.y_range->first), rounded(plot.y_range->second)};
  for (const auto& [x, name] : plot.marks) block["marks"].push_back({{"x", rounded(x)}, {"name", name}});
  push(block);
}

void ReportPage::add_map(const HeatMap& map) {
  json z = json::array();
  for (const std::vector<double>& row : map.z) z.push_back(numbers(row));
  json block = {{"type", "map"},          {"title", map.title},  {"x_label", map.x_label}, {"y_label", map.y_label}, {"z_label", map.z_label}, {"x", numbers(map.x)}, {"y", numbers(map.y)}, {"z", z},
                {"caption", map.caption}, {"log_z", map.log_z},  {"signed", map.is_signed}};
  for (const MapBox& box : map.boxes) block["boxes"].push_back({{"from", rounded(box.from)}, {"to", rounded(box.to)}, {"low", rounded(box.low)}, {"high", rounded(box.high)}});
  if (!map.names.empty()) block["x_names"] = block["y_names"] = map.names;
  if (map.limit > 0) block["limit"] = map.limit;
  push(block);
}

void ReportPage::add_bars(const std::string& title, const std::string& label, const std::vector<Bar>& bars, const std::string& caption) {
  json rows = json::array();
  for (const Bar& b : bars) rows.push_back({{"name", b.name}, {"value", rounded(b.value)}, {"low", rounded(b.low)}, {"high", rounded(b.high)}, {"text", b.text}, {"colour", b.colour}});
  push({{"type", "bars"}, {"title", title}, {"label", label}, {"caption", caption}, {"rows", rows}});
}

void ReportPage::add_heading(const std::string& title) { heading_ = title; }

void ReportPage::add_equation(const std::string& name, const std::string& equation, const std::string& source) {
  push({{"type", "equation"}, {"name", name}, {"text", equation}, {"source", source}});
}

void ReportPage::tell_date(const std::string& date) { data_["head"]["date"] = date; }

void ReportPage::tell_rig(const std::string& rig) { push_once(data_["head"]["rigs"], rig); }

void ReportPage::tell_command(const std::string& command) { push_once(data_["head"]["made"], command); }

void ReportPage::tell_run(const RunFacts& run) {
  json& table = data_["head"]["conditions"];
  if (table.is_null())
    table = {{"title", "Conditions"}, {"header", {"run", "kind", "medium", "density [kg/m³]", "speed [m/s]", "reduced frequency", "Reynolds number", "length [s]"}}, {"rows", json::array()},
             {"caption", "Reduced frequency: π f c / U, f the lowest frequency of the rig in that fluid. Reynolds number with the chord; viscosity of water and air at 20 °C (1.0016e-3 and 1.813e-5 Pa s), by the run's medium."}};
  const auto number = [](double x, int digits) { return std::isfinite(x) ? fmt::format("{:.{}g}", x, digits) : std::string("—"); };
  push_once(table["rows"], {run.file, run.kind, run.medium, number(run.density, 5), number(run.speed, 4), number(run.reduced_frequency, 3), number(run.reynolds_number, 3), number(run.seconds, 4)});
}

std::string ReportPage::html() const {
  // "<" within the data could end the script element.
  std::string data;
  for (const char c : data_.dump(-1, ' ', false, json::error_handler_t::replace)) {
    if (c == '<')
      data += "\\u003c";
    else
      data += c;
  }
  std::string page = report_page_template;
  const std::string place = "/*UNRIG_DATA*/";
  page.replace(page.find(place), place.size(), data);
  return page;
}

}  // namespace unrig
