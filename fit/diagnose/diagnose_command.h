#pragma once

namespace unrig {

/// `unrig diagnose --rig rig.toml RUN... [--heldout RUN]... -o diagnosis.json`
int diagnose_command(int argc, char** argv);

}  // namespace unrig
