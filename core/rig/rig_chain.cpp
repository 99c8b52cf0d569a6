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

/// `modes`; where it is not given `fallback`, 0 for all.
int read_modes(const TomlTable& chain, Index elements, int fallback, Assumed& assumed) {
  if (!chain.has("modes")) {
    assumed.push_back(fmt::format("{} = {}", chain.full_name("modes"), fallback == 0 ? "\"all\"" : std::to_string(fallback)));
    return fallback;
  }
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

VectorXd torsion_constants(const TomlTable& torsion, const NormalLayout& layout, Index count) {
  if (torsion.has("section") && torsion.has("polar_moment")) torsion.fail("section", "[torsion] has both of the keys section and polar_moment", "wanted one of them");
  if (torsion.has("polar_moment")) return positive_quantities(torsion, "polar_moment", "m^4", count);
  if (torsion.has("section")) return read_sections(torsion, SectionsOf::torsion, count).torsion_constants();
  if (!layout.sections) torsion.fail("section", "[torsion] has neither of the keys section and polar_moment", "wanted one of them, or sections of [normal]");
  return layout.sections->torsion_constants().head(count);
}

/// `station` or `length` of the torsion elements: their own, or those of the normal elements of the same number.
VectorXd torsion_layout(const TomlTable& torsion, const VectorXd& of_normal, std::string_view key, Index count) {
  if (torsion.has(key)) return torsion.quantities(key, "m", count);
  if (of_normal.size() == 0) {
    torsion.fail(key, fmt::format("neither [torsion] nor [normal] has the key \"{}\"", key), "wanted it for a rig from drawings");
  }
  if (of_normal.size() < count) {
    torsion.fail(key, fmt::format("[torsion] has {} elements and [normal] only {}", count, of_normal.size()),
                 fmt::format("wanted torsion.{} of its own", key));
  }
  return of_normal.head(count);
}

/// Isotropic, Poisson's ratio 0.3: G = E / (2 (1 + 0.3)).
constexpr double young_over_shear = 2.6;

VectorXd shear_moduli(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, Index count) {
  if (torsion.has("shear_modulus") || !normal.has("youngs_modulus") || count > layout.station.size()) return positive_quantities(torsion, "shear_modulus", "Pa", count);
  return positive_quantities(normal, "youngs_modulus", "Pa", layout.station.size()).head(count) / young_over_shear;
}

// ------------------------------------------------------------------------------------------------------ masses of sections

/// Refuses `keys` beside `given`, which already says it all.
void refuse_beside(const TomlTable& chain, std::string_view given, std::initializer_list<const char*> keys) {
  for (const char* key : keys)
    if (chain.has(key)) chain.fail(key, fmt::format("{} stands beside {}", chain.full_name(key), chain.full_name(given)), "wanted one of them: what is given in whole needs no parts");
}

VectorXd not_negative(const TomlTable& chain, std::string_view key, std::string_view si, Index count) {
  if (!chain.has(key)) return VectorXd::Zero(count);
  VectorXd values = chain.quantities(key, si, count);
  for (Index k = 0; k < count; ++k)
    if (!(values[k] >= 0)) chain.fail(key, fmt::format("{} of element {} is {:.6g} {}", chain.full_name(key), k + 1, values[k], si), "wanted zero or more");
  return values;
}

VectorXd densities(const TomlTable& normal, const NormalLayout& layout) {
  if (!normal.has("density")) return VectorXd::Zero(layout.station.size());
  if (!layout.sections) normal.fail("density", "normal.density without normal.section", "wanted cross-sections, or normal.mass in its place");
  return positive_quantities(normal, "density", "kg/m^3", layout.station.size());
}

/// What each torsional element carries: the normal element of its number, the last one all outboard too.
VectorXd carried(const VectorXd& by_element, int rigid_from) {
  VectorXd sums = by_element.head(rigid_from);
  sums[rigid_from - 1] = by_element.tail(by_element.size() - rigid_from + 1).sum();
  return sums;
}

/// The chain's inertia must be positive where it is put together.
VectorXd put_together(const TomlTable& chain, const char* what, const char* si, const VectorXd& values) {
  for (Index k = 0; k < values.size(); ++k)
    if (!(values[k] > 0)) chain.fail("section", fmt::format("{} of element {} is {:.6g} {}", chain.full_name(what), k + 1, values[k], si),
                                     fmt::format("wanted a value above zero: by normal.density, {0}_per_length of a section, {1}, or {2} in their place", what, chain.full_name(fmt::format("added_{}", what)), chain.full_name(what)));
  return values;
}

VectorXd read_masses(const TomlTable& normal, const NormalLayout& layout) {
  const Index count = layout.station.size();
  if (normal.has("mass") || !layout.sections) {
    refuse_beside(normal, "mass", {"density", "added_mass"});
    return positive_quantities(normal, "mass", "kg", count);
  }
  const VectorXd by_length = layout.sections->mass_per_length.cwiseProduct(layout.length);
  return put_together(normal, "mass", "kg", mass_by_density(normal, layout) + by_length + not_negative(normal, "added_mass", "kg", count));
}

VectorXd read_inertias(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, int rigid_from) {
  if (torsion.has("inertia") || !layout.sections) {
    refuse_beside(torsion, "inertia", {"added_inertia"});
    VectorXd given = positive(torsion, "inertia", "kg.m^2", torsion.quantities("inertia", "kg.m^2"));
    if (given.size() == 0) torsion.fail("inertia", "torsion.inertia has no values", "wanted one element at least");
    return given;
  }
  const VectorXd by_length = carried(layout.sections->inertia_per_length.cwiseProduct(layout.length), rigid_from);
  return put_together(torsion, "inertia", "kg m^2", inertia_by_density(normal, layout, rigid_from) + by_length + not_negative(torsion, "added_inertia", "kg.m^2", rigid_from));
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

NormalLayout read_normal_layout(const TomlTable& normal) {
  NormalLayout layout;
  const Index told = normal.has("station") ? normal.quantities("station", "m").size() : normal.has("length") && !normal.has_text("length") ? normal.quantities("length", "m").size() : 0;
  if (normal.has("station") && told == 0) normal.fail("station", "normal.station has no values", "wanted one element at least");
  if (normal.has("section")) layout.sections = read_sections(normal, SectionsOf::normal, told);
  const Index count = layout.sections ? layout.sections->elements() : told;
  if (layout.sections && layout.sections->length.size() > 0) {
    if (normal.has("length")) normal.fail("length", "normal.length stands beside lengths of the sections", "wanted one of them");
    layout.length = layout.sections->length;
  } else if (normal.has("length") && count > 0) {
    layout.length = positive_quantities(normal, "length", "m", count);
  } else if (layout.sections) {
    normal.fail("section", "neither normal.length nor the sections have a length", "wanted `length` in each section, of its elements together, or normal.length");
  }
  if (normal.has("station")) {
    layout.station = normal.quantities("station", "m");
  } else if (count > 0) {
    layout.station.resize(count);
    double begin = 0;
    for (Index k = 0; k < count; begin += layout.length[k], ++k) layout.station[k] = begin + layout.length[k] / 2;
  } else {
    normal.quantities("station", "m");  // says that it is missing
  }
  double inboard = 0;
  for (Index k = 0; k < layout.station.size(); ++k) {
    if (!(layout.station[k] > inboard)) {
      normal.fail("station", fmt::format("normal.station of element {} is {:.6g} m, after {:.6g} m", k + 1, layout.station[k], inboard),
                  "wanted distances from the clamp that increase");
    }
    inboard = layout.station[k];
  }
  return layout;
}

VectorXd mass_by_density(const TomlTable& normal, const NormalLayout& layout) {
  VectorXd mass = densities(normal, layout);
  for (Index k = 0; layout.sections && k < mass.size(); ++k) mass[k] *= layout.sections->section[static_cast<std::size_t>(k)].area * layout.length[k];
  return mass;
}

VectorXd inertia_by_density(const TomlTable& normal, const NormalLayout& layout, int rigid_from) {
  VectorXd inertia = densities(normal, layout);
  for (Index k = 0; layout.sections && k < inertia.size(); ++k) inertia[k] *= layout.sections->section[static_cast<std::size_t>(k)].polar_second_moment * layout.length[k];
  return carried(inertia, rigid_from);
}

SteppedBeam drawn_beam(const TomlTable& normal, const NormalLayout& layout) {
  const Index count = layout.station.size();
  SteppedBeam beam;
  beam.station = layout.station;
  beam.length = layout.length.size() > 0 ? layout.length : positive_quantities(normal, "length", "m", count);
  if (layout.sections && normal.has("second_moment")) normal.fail("second_moment", "normal.second_moment stands beside normal.section", "wanted one of them");
  beam.stiffness = positive_quantities(normal, "youngs_modulus", "Pa", count)
                       .cwiseProduct(layout.sections ? layout.sections->second_moments() : positive_quantities(normal, "second_moment", "m^4", count));
  beam.clamp_rotation = compliance(normal, "clamp_spring", "N.m/rad");
  beam.clamp_translation = compliance(normal, "clamp_translation", "N/m");
  return beam;
}

SteppedBeam drawn_shaft(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, Index count) {
  SteppedBeam shaft;
  shaft.station = torsion_layout(torsion, layout.station, "station", count);
  shaft.length = positive(torsion, "length", "m", torsion_layout(torsion, layout.length, "length", count));
  shaft.stiffness = shear_moduli(torsion, normal, layout, count).cwiseProduct(torsion_constants(torsion, layout, count));
  shaft.clamp_rotation = compliance(torsion, "clamp_spring", "N.m/rad");
  return shaft;
}

Chain read_normal_chain(const TomlTable& normal, const NormalLayout& layout, std::vector<std::string>& warnings, Assumed& assumed) {
  normal.allow_only({"station", "mass", "mass_centre", "modes", "flexibility", "length", "section", "density", "added_mass", "youngs_modulus", "second_moment", "clamp_spring",
                     "clamp_translation", "mass_std", "mass_std_percent", "mass_centre_std", "mass_centre_std_percent", "length_std", "length_std_percent", "density_std", "density_std_percent",
                     "added_mass_std", "added_mass_std_percent", "youngs_modulus_std", "youngs_modulus_std_percent", "second_moment_std", "second_moment_std_percent", "clamp_spring_std",
                     "clamp_spring_std_percent", "clamp_translation_std", "clamp_translation_std_percent"});
  Chain chain;
  chain.inertia = read_masses(normal, layout);
  chain.modes = read_modes(normal, layout.station.size(), 0, assumed);
  if (!is_from_drawings(normal, {"length", "section", "youngs_modulus", "second_moment", "clamp_spring", "clamp_translation"})) {
    read_given_flexibility(normal, "m/N", chain, warnings);
    return chain;
  }
  const SteppedBeam beam = drawn_beam(normal, layout);
  chain.flexibility = at_place(normal, "length", end_to_end, [&beam] { return bending_flexibility(beam); });
  return chain;
}

Chain read_torsion_chain(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, int rigid_from, std::vector<std::string>& warnings, Assumed& assumed) {
  torsion.allow_only({"inertia", "modes", "rigid_from", "flexibility", "station", "length", "shear_modulus", "polar_moment", "section", "added_inertia", "clamp_spring", "length_std",
                      "length_std_percent", "shear_modulus_std", "shear_modulus_std_percent", "polar_moment_std", "polar_moment_std_percent", "added_inertia_std", "added_inertia_std_percent",
                      "clamp_spring_std", "clamp_spring_std_percent"});
  Chain chain;
  chain.inertia = read_inertias(torsion, normal, layout, rigid_from);
  const Index count = chain.inertia.size();
  chain.modes = read_modes(torsion, count, 1, assumed);
  const bool drawn = is_from_drawings(torsion, {"shear_modulus", "polar_moment", "section", "station", "length", "clamp_spring"});
  if (!drawn && (torsion.has("flexibility") || !layout.sections)) {
    read_given_flexibility(torsion, "rad/(N.m)", chain, warnings);
    return chain;
  }
  if (!torsion.has("shear_modulus") && normal.has("youngs_modulus")) assumed.push_back(fmt::format("torsion.shear_modulus = normal.youngs_modulus / {}", young_over_shear));
  const SteppedBeam shaft = drawn_shaft(torsion, normal, layout, count);
  chain.flexibility = at_place(torsion, "length", end_to_end, [&shaft] { return torsion_flexibility(shaft); });
  return chain;
}

}  // namespace unrig
