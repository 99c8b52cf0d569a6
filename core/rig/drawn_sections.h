#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/files/toml_table.h"
#include "core/rig/cross_section.h"

namespace unrig {

/// The cross-sections of a chain's elements, from the clamp, as `section` gives them: one table for all elements, or a list of tables, each for `elements` of them (default 1).
///
///     [[normal.section]]
///     elements = 8                 # the next eight
///     length = "800 mm"            # of the eight together; in place of normal.length
///     shape = "tube"               # circular (diameter), tube (outer_diameter, wall), rectangular (height, width), box (height, width, wall), other
///     outer_diameter = "40 mm"
///     wall = "2 mm"
///     [[normal.section]]
///     elements = 3
///     length = "300 mm"
///     shape = "other"              # as measured or calculated elsewhere
///     second_moment = "2e-7 m^4"
///     polar_moment = "4e-7 m^4"    # torsion constant J
///     mass_per_length = "2.5 kg/m"
///     inertia_per_length = "4.7 g.m"   # about the pitch axis
///
/// Heights are along the normal force, widths along the chord. A rectangle of [torsion] may have its sides as `a` and `b` in any order.
struct DrawnSections {
  std::vector<CrossSection> section;        ///< one per element
  Eigen::VectorXd length;                   ///< m, of each element; empty where the sections do not give it
  Eigen::VectorXd mass_per_length;          ///< kg/m of sections of the shape "other", beside what a density gives; 0 elsewhere
  Eigen::VectorXd inertia_per_length;       ///< kg m, likewise
  Eigen::Index elements() const { return static_cast<Eigen::Index>(section.size()); }
  Eigen::VectorXd second_moments() const;
  Eigen::VectorXd torsion_constants() const;
};

/// Which of their numbers are read: a table of [normal] gives bending, torsion, lengths and masses, one of [torsion] torsion only.
enum class SectionsOf { normal, torsion };

/// Reads `chain.section` for `elements` elements; for 0, as many as the sections are for. Throws InputError with file, line and key for unknown shapes, keys of another
/// shape, dimensions that are not positive or leave no hollow, and for another number of elements.
DrawnSections read_sections(const TomlTable& chain, SectionsOf of, Eigen::Index elements);

}  // namespace unrig
