#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/rig/beam_flexibility.h"
#include "core/rig/rig.h"
#include "core/files/toml_table.h"

namespace unrig {

/// Reads the table [normal] but for `station` and `mass_centre`. Keys and errors: core/rig/rig.h, read_rig.
Chain read_normal_chain(const TomlTable& normal, const Eigen::VectorXd& station, std::vector<std::string>& warnings);

/// The beam of a table [normal], and the shaft of a table [torsion], that is given by its drawing (core/rig/rig.h).
SteppedBeam drawn_beam(const TomlTable& normal, const Eigen::VectorXd& station);
SteppedBeam drawn_shaft(const TomlTable& torsion, const TomlTable& normal);

/// Reads the table [torsion] but for `rigid_from`. Elements take station and length from `normal` where the table has none.
Chain read_torsion_chain(const TomlTable& torsion, const TomlTable& normal, std::vector<std::string>& warnings);

}  // namespace unrig
