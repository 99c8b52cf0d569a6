#include "core/rig/rig_chain.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <stdexcept>

#include "core/rig/beam_flexibility.h"
#include "core/rig/flexibility.h"
#include "core/files/units.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd positive(const TomlTable& chain, std::string_view key, std::string_view si, VectorXd values) {
  for (Index k = 0; k < values.size(); ++k) {
    if (values[k] > 0) continue;
    chain.fail(key, fmt::format("{} of element {} is {:.6g} {}", chain.full_name(key), k + 1, values[k], si), "wanted a value above zero");
  }
  return values;
}

VectorXd positive_quantities(const TomlTable& chain, std::string_view key, std::string_view si, Index count) {
  return positive(chain, key, si, chain.quantities(key, si, count));
}

int read_modes(const TomlTable& chain, Index elements) {
  const std::string wanted = fmt::format("wanted \"all\" or a number from 1 to {}, the number of elements", elements);
  if (chain.has_text("modes")) {
    if (chain.text("modes") == "all") return 0;
    chain.fail("modes", fmt::format("{} is \"{}\"", chain.full_name("modes"), chain.text("modes")), wanted);
  }
  const int modes = chain.integer("modes");
  if (modes < 1 || modes > elements) chain.fail("modes", fmt::format("{} is {}", chain.full_name("modes"), modes), wanted);
  return modes;
}

// ------------------------------------------------------------------------------------------------------ printed or measured

/// The uncertainty of a measured flexibility; empty where none is given. Entries across the diagonal are averaged, which bounds the
/// uncertainty of their mean from above.
MatrixXd read_std(const TomlTable& given, const MatrixXd& rows, double scale) {
  if (given.has("std_rows") && given.has("std_percent")) {
    given.fail("std_percent", "std_rows and std_percent stand side by side", "wanted one of them");
  }
  MatrixXd std;
  if (given.has("std_rows")) std = scale * given.square("std_rows", rows.rows());
  if (given.has("std_percent")) std = given.number("std_percent") / 100 * rows.cwiseAbs();
  if (std.size() > 0 && !(std.array() >= 0).all()) {
    const char* key = given.has("std_rows") ? "std_rows" : "std_percent";
    given.fail(key, fmt::format("{} holds a negative value", given.full_name(key)), "wanted standard deviations, zero or more");
  }
  return (std + std.transpose()) / 2;
}

void read_given_flexibility(const TomlTable& chain, std::string_view si, Chain& result, std::vector<std::string>& warnings) {
  const TomlTable given = chain.table("flexibility");
  given.allow_only({"unit", "scale", "rows", "std_rows", "std_percent", "common_std_percent"});
  const double unit = unit_scale(given.text("unit"), si, given.place("unit"), given.full_name("unit")).factor;
  const double scale = unit * given.number_or("scale", 1);
  const MatrixXd rows = scale * given.square("rows", result.inertia.size());
  result.flexibility_std = read_std(given, rows, scale);
  result.flexibility = checked_flexibility({given.place("rows"), chain.full_name("flexibility"), rows, result.flexibility_std}, warnings);
}

// ------------------------------------------------------------------------------------------------------ from drawings

/// The compliance of a clamp that is given as a spring; 0, a rigid clamp, where it is not given.
double compliance(const TomlTable& chain, std::string_view key, std::string_view si) {
  return chain.has(key) ? 1 / chain.positive_quantity(key, si) : 0;
}

/// Runs a calculation of core/rig/beam_flexibility.h and gives its complaints the place of `key`.
template <typename Calculation>
auto at_place(const TomlTable& table, std::string_view key, const std::string& wanted, Calculation calculation) {
  try {
    return calculation();
  } catch (const std::invalid_argument& error) {
    table.fail(key, fmt::format("{}: {}", table.full_name(key), error.what()), wanted);
  }
}

constexpr const char* end_to_end = "wanted elements laid end to end from the clamp, each with its station inside";

double torsion_constant(const TomlTable& section) {
  const std::string shape = section.text("shape");
  if (shape == "circular") {
    section.allow_only({"shape", "diameter"});
    return circular_torsion_constant(section.positive_quantity("diameter", "m"));
  }
  if (shape == "rectangular") {
    section.allow_only({"shape", "a", "b"});
    return rectangular_torsion_constant(section.positive_quantity("a", "m"), section.positive_quantity("b", "m"));
  }
  section.fail("shape", fmt::format("{} is \"{}\"", section.full_name("shape"), shape), "wanted \"circular\" or \"rectangular\"");
}

VectorXd torsion_constants(const TomlTable& torsion, Index count) {
  if (torsion.has("section") == torsion.has("polar_moment")) {
    torsion.fail("section",
                 fmt::format("[torsion] has {} of the keys section and polar_moment", torsion.has("section") ? "both" : "neither"),
                 "wanted one of them");
  }
  if (torsion.has("polar_moment")) return positive_quantities(torsion, "polar_moment", "m^4", count);
  if (!torsion.has_array("section")) return VectorXd::Constant(count, torsion_constant(torsion.table("section")));
  const std::vector<TomlTable> sections = torsion.tables("section");
  if (static_cast<Index>(sections.size()) != count) {
    torsion.fail("section", fmt::format("torsion.section has {} sections", sections.size()),
                 fmt::format("wanted {}, one per element", count));
  }
  VectorXd constants(count);
  for (Index k = 0; k < count; ++k) constants[k] = torsion_constant(sections[static_cast<std::size_t>(k)]);
  return constants;
}

/// `station` or `length` of the torsion elements: their own, or those of the normal elements of the same number.
VectorXd torsion_layout(const TomlTable& torsion, const TomlTable& normal, std::string_view key, Index count) {
  if (torsion.has(key)) return torsion.quantities(key, "m", count);
  if (!normal.has(key)) {
    torsion.fail(key, fmt::format("neither [torsion] nor [normal] has the key \"{}\"", key), "wanted it for a rig from drawings");
  }
  const VectorXd all = normal.quantities(key, "m");
  if (all.size() < count) {
    torsion.fail(key, fmt::format("[torsion] has {} elements and [normal] only {}", count, all.size()),
                 fmt::format("wanted torsion.{} of its own", key));
  }
  return all.head(count);
}

/// True where the chain is given by the dimensions of its drawing; these and a flexibility exclude each other.
bool is_from_drawings(const TomlTable& chain, std::initializer_list<const char*> drawing_keys) {
  const auto given = std::find_if(drawing_keys.begin(), drawing_keys.end(), [&chain](const char* key) { return chain.has(key); });
  if (given == drawing_keys.end()) return false;
  if (chain.has("flexibility")) {
    chain.fail(*given, fmt::format("{} stands beside {}", chain.full_name(*given), chain.full_name("flexibility")),
               "wanted either the flexibility or the drawing's dimensions");
  }
  return true;
}

}  // namespace

SteppedBeam drawn_beam(const TomlTable& normal, const VectorXd& station) {
  const Index count = station.size();
  SteppedBeam beam;
  beam.station = station;
  beam.length = positive_quantities(normal, "length", "m", count);
  beam.stiffness =
      positive_quantities(normal, "youngs_modulus", "Pa", count).cwiseProduct(positive_quantities(normal, "second_moment", "m^4", count));
  beam.clamp_rotation = compliance(normal, "clamp_spring", "N.m/rad");
  beam.clamp_translation = compliance(normal, "clamp_translation", "N/m");
  return beam;
}

SteppedBeam drawn_shaft(const TomlTable& torsion, const TomlTable& normal) {
  const Index count = torsion.quantities("inertia", "kg.m^2").size();
  SteppedBeam shaft;
  shaft.station = torsion_layout(torsion, normal, "station", count);
  shaft.length = positive(torsion, "length", "m", torsion_layout(torsion, normal, "length", count));
  shaft.stiffness = positive_quantities(torsion, "shear_modulus", "Pa", count).cwiseProduct(torsion_constants(torsion, count));
  shaft.clamp_rotation = compliance(torsion, "clamp_spring", "N.m/rad");
  return shaft;
}

Chain read_normal_chain(const TomlTable& normal, const VectorXd& station, std::vector<std::string>& warnings) {
  normal.allow_only({"station", "mass", "mass_centre", "modes", "flexibility", "length", "youngs_modulus", "second_moment", "clamp_spring",
                     "clamp_translation", "mass_std", "mass_std_percent", "mass_centre_std", "mass_centre_std_percent", "length_std", "length_std_percent", "youngs_modulus_std",
                     "youngs_modulus_std_percent", "second_moment_std", "second_moment_std_percent", "clamp_spring_std", "clamp_spring_std_percent", "clamp_translation_std",
                     "clamp_translation_std_percent"});
  const Index count = station.size();
  Chain chain;
  chain.inertia = positive_quantities(normal, "mass", "kg", count);
  chain.modes = read_modes(normal, count);
  if (!is_from_drawings(normal, {"length", "youngs_modulus", "second_moment", "clamp_spring", "clamp_translation"})) {
    read_given_flexibility(normal, "m/N", chain, warnings);
    return chain;
  }
  const SteppedBeam beam = drawn_beam(normal, station);
  chain.flexibility = at_place(normal, "length", end_to_end, [&beam] { return bending_flexibility(beam); });
  return chain;
}

Chain read_torsion_chain(const TomlTable& torsion, const TomlTable& normal, std::vector<std::string>& warnings) {
  torsion.allow_only(
      {"inertia", "modes", "rigid_from", "flexibility", "station", "length", "shear_modulus", "polar_moment", "section", "clamp_spring", "length_std", "length_std_percent", "shear_modulus_std",
       "shear_modulus_std_percent", "polar_moment_std", "polar_moment_std_percent", "clamp_spring_std", "clamp_spring_std_percent"});
  Chain chain;
  chain.inertia = positive(torsion, "inertia", "kg.m^2", torsion.quantities("inertia", "kg.m^2"));
  const Index count = chain.inertia.size();
  if (count == 0) torsion.fail("inertia", "torsion.inertia has no values", "wanted one element at least");
  chain.modes = read_modes(torsion, count);
  if (!is_from_drawings(torsion, {"shear_modulus", "polar_moment", "section", "station", "length", "clamp_spring"})) {
    read_given_flexibility(torsion, "rad/(N.m)", chain, warnings);
    return chain;
  }
  const SteppedBeam shaft = drawn_shaft(torsion, normal);
  chain.flexibility = at_place(torsion, "length", end_to_end, [&shaft] { return torsion_flexibility(shaft); });
  return chain;
}

}  // namespace unrig
