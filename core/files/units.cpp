#include "core/files/units.h"

#include <fmt/format.h>
#include <udunits2.h>

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <numbers>
#include <optional>
#include <vector>

#include "core/files/scan.h"

namespace unrig {
namespace {

struct FreeUnit {
  void operator()(ut_unit* unit) const { ut_free(unit); }
};
using Unit = std::unique_ptr<ut_unit, FreeUnit>;

/// Powers of the base units in a unit. The radian is one of them here, although UDUNITS counts it as dimensionless.
using Powers = std::map<std::string, int>;

/// UDUNITS' parser keeps global state: whoever calls it holds this lock.
std::mutex& udunits_lock() {
  static std::mutex lock;
  return lock;
}

Unit parse(ut_system* system, const std::string& text) { return Unit(ut_parse(system, text.c_str(), UT_UTF8)); }

/// The unit database with the aliases of correct/manual/run_files.md; `lb` is the pound mass in it already.
ut_system* open_database() {
  ut_set_error_message_handler(ut_ignore);  // failures are reported by exception, not on standard error
  ut_system* system = ut_read_xml(nullptr);
  if (!system) throw std::runtime_error("the unit database of UDUNITS-2 cannot be read; UDUNITS2_XML_PATH should name its udunits2.xml");
  ut_map_symbol_to_unit("deg", UT_ASCII, parse(system, "degree").get());
  ut_map_name_to_unit("lbm", UT_ASCII, parse(system, "pound").get());
  return system;
}

Unit parse(const std::string& text) {
  static ut_system* const system = open_database();
  return parse(system, text);
}

ut_status visit_basic(const ut_unit* unit, void* powers) {
  (*static_cast<Powers*>(powers))[ut_get_symbol(unit, UT_ASCII)] += 1;
  return UT_SUCCESS;
}
ut_status visit_product(const ut_unit*, int count, const ut_unit* const* units, const int* exponents, void* powers) {
  for (int k = 0; k < count; ++k) (*static_cast<Powers*>(powers))[ut_get_symbol(units[k], UT_ASCII)] += exponents[k];
  return UT_SUCCESS;
}
ut_status visit_scaled(const ut_unit*, double, const ut_unit* underlying, double, void* powers);
ut_status visit_timestamp(const ut_unit*, const ut_unit*, double, void*) { return UT_BAD_ARG; }
ut_status visit_logarithm(const ut_unit*, double, const ut_unit*, void*) { return UT_BAD_ARG; }

constexpr ut_visitor powers_visitor = {visit_basic, visit_product, visit_scaled, visit_timestamp, visit_logarithm};

ut_status visit_scaled(const ut_unit*, double, const ut_unit* underlying, double, void* powers) {
  return ut_accept_visitor(underlying, &powers_visitor, powers);
}

/// Nothing for a calendar or a logarithmic unit, which no quantity of a rig has.
std::optional<Powers> powers_of(const ut_unit* unit) {
  Powers powers;
  if (ut_accept_visitor(unit, &powers_visitor, &powers) != UT_SUCCESS) return std::nullopt;
  std::erase_if(powers, [](const auto& base) { return base.second == 0; });
  return powers;
}

Powers without_radian(Powers powers) {
  powers.erase("rad");
  return powers;
}

int radians(const Powers& powers) {
  const auto found = powers.find("rad");
  return found == powers.end() ? 0 : found->second;
}

std::string dimension(std::string_view si) {
  static const std::map<std::string_view, const char*> names = {
      {"1", "a number without dimension"},
      {"rad", "an angle"},
      {"s", "a time"},
      {"Hz", "a frequency"},
      {"m", "a length"},
      {"m/s", "a speed"},
      {"m/s^2", "an acceleration"},
      {"m^4", "a second moment of area"},
      {"kg", "a mass"},
      {"kg/m^3", "a density"},
      {"kg.m^2", "a moment of inertia"},
      {"N", "a force"},
      {"N.m", "a moment"},
      {"Pa", "a modulus"},
      {"N/m", "a force per displacement"},
      {"m/N", "a deflection per force"},
      {"N.m/rad", "a moment per angle"},
      {"rad/(N.m)", "a twist per moment"},
  };
  const auto name = names.find(si);
  return name == names.end() ? fmt::format("a unit that converts to {}", si)
                             : fmt::format("{} (a unit that converts to {})", name->second, si);
}

/// A unit of a file and its powers; throws InputError where UDUNITS does not know it or it is no plain unit.
struct ParsedUnit {
  ParsedUnit(std::string_view text, const std::string& wanted, const InputError::Place& place, std::string_view what) {
    const std::string clean(trimmed(text));
    if (clean.empty()) throw InputError(place, fmt::format("{} has no unit", what), "wanted " + wanted, "");
    unit = parse(clean);
    if (!unit) {
      throw InputError(place, fmt::format("{} has the unknown unit \"{}\"", what, clean), "wanted " + wanted,
                       "Units are spelt as in UDUNITS-2, for instance \"N.m\", \"lbf\", \"kg/m^3\".");
    }
    const auto found = powers_of(unit.get());
    if (!found) {
      throw InputError(place, fmt::format("{} has the calendar or logarithmic unit \"{}\"", what, clean), "wanted " + wanted, "");
    }
    powers = *found;
  }
  Unit unit;
  Powers powers;
};

/// Counts and percents are dimensionless as the radian is, but no angle.
bool is_taken_for_angle(std::string_view unit, const Powers& from, const Powers& to) {
  const bool wants_angle = to.size() == 1 && radians(to) == 1;
  return wants_angle && from.empty() && trimmed(unit) != "1";
}

/// UDUNITS' converter as slope and offset. The offset is taken at 0 and the slope over a long stretch, so that it keeps its digits.
UnitScale linear(const ut_unit* from, const ut_unit* to) {
  const std::unique_ptr<cv_converter, void (*)(cv_converter*)> converter(
      ut_get_converter(const_cast<ut_unit*>(from), const_cast<ut_unit*>(to)), cv_free);
  const double offset = cv_convert_double(converter.get(), 0.0);
  if (offset == 0) return {cv_convert_double(converter.get(), 1.0), 0};
  const double far = 1e6;
  return {(cv_convert_double(converter.get(), far) - offset) / far, offset};
}

}  // namespace

UnitScale unit_scale(std::string_view unit, std::string_view si, const InputError::Place& place, std::string_view what) {
  const std::lock_guard guard(udunits_lock());
  const ParsedUnit from(unit, dimension(si), place, what);
  const ParsedUnit to(si, "an SI unit", place, what);
  if (without_radian(from.powers) != without_radian(to.powers) || is_taken_for_angle(unit, from.powers, to.powers)) {
    throw InputError(place, fmt::format("{} has the unit \"{}\"", what, trimmed(unit)), "wanted " + dimension(si), "");
  }
  UnitScale scale = linear(from.unit.get(), to.unit.get());
  // To UDUNITS 1 rad/s is 1 Hz; to everybody who writes a frequency in rad/s or rpm it is 1/(2 pi) of one.
  const bool wants_frequency = to.powers == Powers{{"s", -1}};
  if (wants_frequency && radians(from.powers) == 1) scale.factor /= 2 * std::numbers::pi;
  return scale;
}

Measure split_quantity(std::string_view text, const InputError::Place& place, std::string_view what) {
  const std::string_view clean = trimmed(text);
  const std::string advice = "Write number and unit, for instance \"0.6096 m/s\".";
  Measure measure;
  const char* end = read_number(clean.data(), clean.data() + clean.size(), measure.value);
  if (end == clean.data() || !std::isfinite(measure.value)) {
    throw InputError(place, fmt::format("{} is \"{}\"", what, clean), "wanted a finite number and a unit", advice);
  }
  const std::string_view unit = trimmed(clean.substr(static_cast<std::size_t>(end - clean.data())));
  if (unit.empty()) throw InputError(place, fmt::format("{} = \"{}\" has no unit", what, clean), "wanted a number and a unit", advice);
  // UDUNITS would multiply a second number in: "4.4.5 N" must not become 2.2 N. A reciprocal unit such as "1/s" is no second number.
  const bool reciprocal = unit == "1" || unit.starts_with("1/");
  if (!reciprocal && std::string_view("0123456789.+-,").find(unit.front()) != std::string_view::npos) {
    throw InputError(place, fmt::format("{} = \"{}\" holds \"{}\" after its number", what, clean, unit), "wanted one number and a unit",
                     advice);
  }
  measure.unit = unit;
  return measure;
}

double quantity(std::string_view text, std::string_view si, const InputError::Place& place, std::string_view what) {
  const Measure measure = split_quantity(text, place, what);
  return unit_scale(measure.unit, si, place, what)(measure.value);
}

std::string si_unit(std::string_view unit, const InputError::Place& place, std::string_view what) {
  const std::lock_guard guard(udunits_lock());
  // Customary spellings; a unit that is none of them is spelt in base units.
  static const std::vector<std::pair<Powers, std::string>> customary = [] {
    std::vector<std::pair<Powers, std::string>> units;
    for (const char* text :
         {"1",   "rad", "s",   "Hz",  "rad/s",   "rad/s^2",   "m", "m/s", "m/s^2", "m^4", "kg",    "kg/m^3", "kg.m^2", "N",
          "N.m", "Pa",  "N/m", "m/N", "N.m/rad", "rad/(N.m)", "V", "N/V", "N.m/V", "V/m", "V/rad", "A",      "K",      "W"}) {
      units.emplace_back(powers_of(parse(text).get()).value(), text);
    }
    return units;
  }();
  const Powers powers = ParsedUnit(unit, "a unit that UDUNITS-2 knows", place, what).powers;
  for (const auto& [of, text] : customary) {
    if (of == powers) return text;
  }
  std::string product;
  for (const auto& [base, power] : powers) product += fmt::format("{}{}^{}", product.empty() ? "" : ".", base, power);
  return product;
}

}  // namespace unrig
