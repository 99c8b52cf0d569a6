#pragma once

namespace unrig {

/// `unrig simulate --rig rig.toml --run motion.csv [--fit fit.json] -o simulated.csv`
int simulate_command(int argc, char** argv);

}  // namespace unrig
