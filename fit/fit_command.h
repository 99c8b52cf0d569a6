#pragma once

namespace unrig {

/// `unrig fit --rig rig.toml RUN... -o fit.json`
int fit_command(int argc, char** argv);

}  // namespace unrig
