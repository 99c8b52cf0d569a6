#include "core/rig/stated_errors.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/rig/rig_chain.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double not_negative(const TomlTable& table, std::string_view key, double value) {
  if (!(value >= 0)) table.fail(key, fmt::format("{} is {}", table.full_name(key), value), "wanted a standard deviation, zero or more");
  return value;
}

double percent(const TomlTable& table, std::string_view key) { return table.has(key) ? not_negative(table, key, table.number(key)) / 100 : 0; }

/// A standard deviation in the unit of its number: text with a unit, or a plain number where the number is plain. A scale without offset: a difference of temperatures is none of a rig.
double deviation(const TomlTable& table, std::string_view key, const std::string& si) {
  return not_negative(table, key, si == "1" && !table.has_text(key) ? table.number(key) : table.quantity(key, si));
}

void refuse_both(const TomlTable& table, std::string_view one, std::string_view other) {
  if (table.has(one) && table.has(other)) table.fail(other, fmt::format("{} and {} stand side by side", one, other), "wanted one of them");
}

/// The errors of a file, as they are found.
class Found {
 public:
  /// Each entry of an array by its own error, and all of them by one that they share.
  void array(const std::string& group, std::vector<Given> numbers, const VectorXd& own, const VectorXd& shared) {
    const bool together = !shared.isZero(0);
    if (together) begin_deviation(group + " (common)", true);
    const Index of_all = deviations_ - 1;
    for (std::size_t k = 0; k < numbers.size(); ++k) {
      const auto at = static_cast<Index>(k);
      numbers[k].std = std::hypot(own[at], shared[at]);
      if (!(numbers[k].std > 0)) continue;
      all_.numbers.push_back(numbers[k]);
      const auto row = static_cast<Index>(all_.numbers.size()) - 1;
      if (shared[at] != 0) entries_.push_back({row, of_all, shared[at]});
      if (own[at] == 0) continue;
      begin_deviation(group, false);
      entries_.push_back({row, deviations_ - 1, own[at]});
    }
  }

  void scalar(Given number, bool common = true) {
    if (!(number.std > 0)) return;
    begin_deviation(number.name, common);
    entries_.push_back({static_cast<Index>(all_.numbers.size()), deviations_ - 1, number.std});
    all_.numbers.push_back(std::move(number));
  }

  Givens& all() { return all_; }
  std::shared_ptr<const Givens> givens() {
    if (all_.numbers.empty()) return nullptr;
    all_.spread = MatrixXd::Zero(static_cast<Index>(all_.numbers.size()), deviations_);
    for (const Entry& e : entries_) all_.spread(e.row, e.deviation) = e.size;
    return std::make_shared<const Givens>(std::move(all_));
  }

 private:
  struct Entry {
    Index row, deviation;
    double size;
  };
  void begin_deviation(const std::string& group, bool common) {
    all_.group.push_back(group);
    all_.common.push_back(common);
    ++deviations_;
  }
  Givens all_;
  std::vector<Entry> entries_;
  Index deviations_ = 0;
};

std::vector<Given> entries(GivenNumber number, const std::string& name, const std::string& unit, const VectorXd& values) {
  std::vector<Given> all;
  for (Index k = 0; k < values.size(); ++k) all.push_back({number, k, -1, fmt::format("{}[{}]", name, k + 1), unit, values[k], 0});
  return all;
}

/// `key.std_percent`, `key.std`, `key.std_values` and `key.common_std_percent` of an array with these values.
void take_array(const TomlTable& table, const std::string& key, GivenNumber number, const std::string& si, const VectorXd& values, Found& found) {
  if (!table.has(key)) {
    for (const std::string& statement : {key + "_std", key + "_std_percent"})
      if (table.has(statement)) table.fail(statement, fmt::format("{} is not given", table.full_name(key)), "wanted the number that the standard deviation belongs to");
    return;
  }
  if (table.has_text(key)) {  // one value for all elements
    refuse_both(table, key + "_std", key + "_std_percent");
    double std = percent(table, key + "_std_percent") * std::abs(values[0]);
    if (table.has(key + "_std")) std = deviation(table, key + "_std", si);
    return found.scalar({number, -1, -1, table.full_name(key), si, values[0], std});
  }
  const TomlTable array = table.table(key);
  refuse_both(array, "std_percent", "std");
  refuse_both(array, "std_percent", "std_values");
  refuse_both(array, "std", "std_values");
  VectorXd own = percent(array, "std_percent") * values.cwiseAbs();
  if (array.has("std")) own.setConstant(deviation(array, "std", si));
  if (array.has("std_values")) {
    const double scale = unit_scale(array.text("unit"), si, array.place("unit"), array.full_name("unit")).factor * array.number_or("scale", 1);
    own = std::abs(scale) * array.numbers("std_values");
    if (own.size() != values.size()) array.fail("std_values", fmt::format("{} has {} values", array.full_name("std_values"), own.size()), fmt::format("wanted {}, one per element", values.size()));
    for (const double one : own) not_negative(array, "std_values", one);
  }
  found.array(table.full_name(key), entries(number, table.full_name(key), si, values), own, percent(array, "common_std_percent") * values);
}

/// A measured flexibility: A_ij = A_ji is one number, and its standard deviation that of either entry.
void take_flexibility(const TomlTable& table, GivenNumber number, const std::string& si, const Chain& chain, Found& found) {
  if (!table.has("flexibility")) return;
  const double shared = percent(table.table("flexibility"), "common_std_percent");
  if (chain.flexibility_std.size() == 0 && shared == 0) return;
  std::vector<Given> numbers;
  std::vector<double> own, together;
  for (Index j = 0; j < chain.flexibility.cols(); ++j)
    for (Index i = 0; i <= j; ++i) {
      const double value = chain.flexibility(i, j);
      numbers.push_back({number, i, j, fmt::format("{}[{}][{}]", table.full_name("flexibility"), i + 1, j + 1), si, value, 0});
      own.push_back(chain.flexibility_std.size() > 0 ? chain.flexibility_std(i, j) : 0);
      together.push_back(shared * value);
    }
  const auto count = static_cast<Index>(numbers.size());
  found.array(table.full_name("flexibility"), std::move(numbers), Eigen::Map<const VectorXd>(own.data(), count), Eigen::Map<const VectorXd>(together.data(), count));
}

void take_scalar(const TomlTable& table, const std::string& key, GivenNumber number, const std::string& si, double value, Found& found, Index row = -1) {
  const std::string absolute = key + "_std", relative = key + "_std_percent";
  if (!table.has(absolute) && !table.has(relative)) return;
  if (!table.has(key)) table.fail(table.has(absolute) ? absolute : relative, fmt::format("{} is not given", table.full_name(key)), "wanted the number that the standard deviation belongs to");
  refuse_both(table, absolute, relative);
  const double std = table.has(absolute) ? deviation(table, absolute, si) : percent(table, relative) * std::abs(value);
  found.scalar({number, row, -1, table.full_name(key), si, value, std});
}

/// An error of the density is one of all masses and moments of inertia that follow from it, together.
void take_density(const TomlTable& normal, const NormalLayout& layout, const Rig& rig, bool with_inertia, Found& found) {
  if (!normal.has("density")) {
    for (const char* key : {"density_std", "density_std_percent"})
      if (normal.has(key)) normal.fail(key, "normal.density is not given", "wanted the number that the standard deviation belongs to");
    return;
  }
  if (!normal.has_text("density")) {
    for (const char* key : {"std", "std_percent", "std_values", "common_std_percent"})
      if (normal.table("density").has(key)) normal.fail("density", fmt::format("normal.density.{} of densities that differ", key), "wanted the error of one density, density_std_percent", "Give `mass` with its own errors instead.");
    return;
  }
  refuse_both(normal, "density_std", "density_std_percent");
  const double density = normal.quantity("density", "kg/m^3");
  const double relative = normal.has("density_std") ? deviation(normal, "density_std", "kg/m^3") / density : percent(normal, "density_std_percent");
  const VectorXd mass = mass_by_density(normal, layout);
  std::vector<Given> numbers = entries(GivenNumber::mass, "normal.mass", "kg", rig.normal.inertia);
  VectorXd shared = relative * mass;
  if (with_inertia) {
    const VectorXd inertia = inertia_by_density(normal, layout, rig.rigid_from);
    const std::vector<Given> more = entries(GivenNumber::inertia, "torsion.inertia", "kg.m^2", rig.torsion.inertia);
    numbers.insert(numbers.end(), more.begin(), more.end());
    shared.conservativeResize(mass.size() + inertia.size());
    shared.tail(inertia.size()) = relative * inertia;
  }
  found.array("normal.density", numbers, VectorXd::Zero(shared.size()), shared);
}

void take_chains(const TomlTable& file, const Rig& rig, Found& found) {
  const TomlTable normal = file.table("normal"), torsion = file.table("torsion");
  const NormalLayout layout = read_normal_layout(normal);
  take_array(normal, "station", GivenNumber::station, "m", rig.station, found);
  take_array(normal, "mass", GivenNumber::mass, "kg", rig.normal.inertia, found);
  take_density(normal, layout, rig, !torsion.has("inertia"), found);
  const auto given = [](const TomlTable& table, const char* key, const char* si, Index count) { return table.has(key) ? table.quantities(key, si, count) : VectorXd(); };
  take_array(normal, "added_mass", GivenNumber::mass, "kg", given(normal, "added_mass", "kg", rig.station.size()), found);
  take_array(torsion, "added_inertia", GivenNumber::inertia, "kg.m^2", given(torsion, "added_inertia", "kg.m^2", rig.torsion.inertia.size()), found);
  take_array(normal, "mass_centre", GivenNumber::mass_centre, "m", rig.mass_centre, found);
  take_flexibility(normal, GivenNumber::normal_flexibility, "m/N", rig.normal, found);
  take_array(torsion, "inertia", GivenNumber::inertia, "kg.m^2", rig.torsion.inertia, found);
  take_flexibility(torsion, GivenNumber::torsion_flexibility, "rad/(N.m)", rig.torsion, found);
  if (!normal.has("flexibility")) {
    const SteppedBeam beam = drawn_beam(normal, layout);
    const Index count = rig.station.size();
    take_array(normal, "length", GivenNumber::normal_length, "m", beam.length, found);
    take_array(normal, "youngs_modulus", GivenNumber::youngs_modulus, "Pa", normal.quantities("youngs_modulus", "Pa", count), found);
    take_array(normal, "second_moment", GivenNumber::second_moment, "m^4", given(normal, "second_moment", "m^4", count), found);
    take_scalar(normal, "clamp_spring", GivenNumber::normal_clamp_spring, "N.m/rad", 1 / beam.clamp_rotation, found);
    take_scalar(normal, "clamp_translation", GivenNumber::clamp_translation, "N/m", 1 / beam.clamp_translation, found);
    found.all().normal_beam = beam;
  }
  if (!torsion.has("flexibility")) {
    const Index count = rig.torsion.inertia.size();
    const SteppedBeam shaft = drawn_shaft(torsion, normal, layout, count);
    take_array(torsion, "station", GivenNumber::torsion_station, "m", shaft.station, found);
    take_array(torsion, "length", GivenNumber::torsion_length, "m", shaft.length, found);
    take_array(torsion, "shear_modulus", GivenNumber::shear_modulus, "Pa", given(torsion, "shear_modulus", "Pa", count), found);
    take_array(torsion, "polar_moment", GivenNumber::polar_moment, "m^4", given(torsion, "polar_moment", "m^4", count), found);
    take_scalar(torsion, "clamp_spring", GivenNumber::torsion_clamp_spring, "N.m/rad", 1 / shaft.clamp_rotation, found);
    found.all().torsion_beam = shaft;
    found.all().torsion_has_station = torsion.has("station");
    found.all().torsion_has_length = torsion.has("length");
  }
}

void take_modes(const TomlTable& file, const Rig& rig, Found& found) {
  Index m = 0;
  for (const TomlTable& table : file.tables("modal")) {
    const ModalMode& mode = rig.modal[static_cast<std::size_t>(m)];
    take_scalar(table, "mass", GivenNumber::modal_mass, "kg", mode.mass, found, m);
    take_scalar(table, "frequency", GivenNumber::modal_frequency, "Hz", mode.frequency, found, m);
    take_scalar(table, "damping_ratio", GivenNumber::modal_damping_ratio, "1", mode.damping_ratio, found, m);
    if (table.has("gauge_gain")) take_scalar(table, "gauge_gain", GivenNumber::modal_gauge_gain, "(" + mode.gauge_unit + ")/m", mode.gauge_gain, found, m);
    ++m;
  }
}

/// Whether the runs of a campaign share the error of this number.
bool is_common(const TomlTable& head, const std::string& key) {
  const std::string whose = head.text_or(key + "_error", "common");
  if (whose != "common" && whose != "own") head.fail(key + "_error", fmt::format("{}_error is \"{}\"", key, whose), "wanted \"common\", the same error in all runs that say so, or \"own\"");
  return whose == "common";
}

void take_calibration(const TomlTable& head, const std::string& key, GivenNumber number, Found& found) {
  if (!head.has(key)) {
    for (const std::string& statement : {key + "_std", key + "_std_percent"})
      if (head.has(statement)) head.fail(statement, key + " is not given", "wanted the number that the standard deviation belongs to");
    return;
  }
  const Measure stated = split_quantity(head.text(key), head.place(key), key);
  refuse_both(head, key + "_std", key + "_std_percent");
  double std = percent(head, key + "_std_percent") * std::abs(stated.value);
  if (head.has(key + "_std")) {
    const std::string statement = key + "_std";
    const Measure given = split_quantity(head.text(statement), head.place(statement), statement);
    const std::string si = si_unit(stated.unit, head.place(key), key);
    std = not_negative(head, statement, unit_scale(given.unit, si, head.place(statement), statement).factor * given.value / unit_scale(stated.unit, si, head.place(key), key).factor);
  }
  found.scalar({number, -1, -1, key, stated.unit, stated.value, std}, is_common(head, key));
}

}  // namespace

std::shared_ptr<const Givens> stated_errors(const TomlTable& file, const Rig& rig) {
  Found found;
  if (rig.is_modal()) {
    take_modes(file, rig, found);
    return found.givens();
  }
  take_chains(file, rig, found);
  const TomlTable section = file.table("section");
  take_scalar(section, "chord", GivenNumber::chord, "m", rig.chord, found);
  take_scalar(section, "pitch_axis", GivenNumber::pitch_axis, "1", rig.pitch_axis, found);
  take_scalar(file.table("submerged"), "strip_length", GivenNumber::strip_length, "m", rig.strip_length, found);
  return found.givens();
}

std::shared_ptr<const Givens> stated_errors_of_run(const TomlTable& head, const Run& run) {
  Found found;
  const auto take = [&](const std::string& key, GivenNumber number, const std::string& si, double value) {
    Found one;
    take_scalar(head, key, number, si, value, one);
    const bool common = is_common(head, key);
    if (!one.all().numbers.empty() && value != 0) found.scalar(one.all().numbers.front(), common);
  };
  take("speed", GivenNumber::speed, "m/s", run.speed);
  take("density", GivenNumber::density, "kg/m^3", run.density);
  take_calibration(head, "calibration", GivenNumber::calibration, found);
  take_calibration(head, "force_calibration", GivenNumber::force_calibration, found);
  found.scalar({GivenNumber::clock, -1, -1, "clock", "1", 1, percent(head, "clock_std_percent")}, is_common(head, "clock"));
  return found.givens();
}

}  // namespace unrig
