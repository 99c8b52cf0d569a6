#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/rig/beam_flexibility.h"
#include "core/rig/drawn_sections.h"
#include "core/rig/rig.h"
#include "core/files/toml_table.h"

namespace unrig {

/// Where the elements of the table [normal] lie, and their cross-sections where they are drawn.
struct NormalLayout {
  Eigen::VectorXd station;                ///< m from the clamp; without `station`, the middle of each element
  Eigen::VectorXd length;                 ///< m; empty where none is given
  std::optional<DrawnSections> sections;  ///< of `normal.section`
};

/// Reads `station`, `length` and `section`. Throws InputError for stations that do not increase, and where nothing says how many elements there are.
NormalLayout read_normal_layout(const TomlTable& normal);

/// What was not given and what is taken in its place, for one note: "torsion.modes = 1".
using Assumed = std::vector<std::string>;

/// Reads the table [normal] but for its layout and `mass_centre`. Masses are `mass`; or, of sections, density times area times length, with `mass_per_length` and `added_mass`.
/// Keys and errors: core/rig/rig.h, read_rig.
Chain read_normal_chain(const TomlTable& normal, const NormalLayout& layout, std::vector<std::string>& warnings, Assumed& assumed);

/// The beam of a table [normal], and the shaft of a table [torsion] of `elements`, that is given by its drawing (core/rig/rig.h).
SteppedBeam drawn_beam(const TomlTable& normal, const NormalLayout& layout);
SteppedBeam drawn_shaft(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, Eigen::Index elements);

/// Reads the table [torsion] but for `rigid_from`, the element that carries the normal elements from the same number on. Elements take station, length and section from
/// `normal` where the table has none, and moments of inertia about the pitch axis from its density: rho I_p times length.
Chain read_torsion_chain(const TomlTable& torsion, const TomlTable& normal, const NormalLayout& layout, int rigid_from, std::vector<std::string>& warnings, Assumed& assumed);

/// What the density alone gives of mass per normal element [kg], and of inertia per torsional element [kg m^2].
Eigen::VectorXd mass_by_density(const TomlTable& normal, const NormalLayout& layout);
Eigen::VectorXd inertia_by_density(const TomlTable& normal, const NormalLayout& layout, int rigid_from);

}  // namespace unrig
