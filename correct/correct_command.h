#pragma once

namespace unrig {

/// `unrig correct --rig rig.toml --fit fit.json RUN -o corrected.csv [--indicial indicial.csv]`
int correct_command(int argc, char** argv);

}  // namespace unrig
