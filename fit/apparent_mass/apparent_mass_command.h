#pragma once

namespace unrig {

/// `unrig apparent-mass --rig rig.toml --dry DRY.csv --wet WET.csv -o apparent.json`
int apparent_mass_command(int argc, char** argv);

}  // namespace unrig
