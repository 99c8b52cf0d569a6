#pragma once

namespace unrig {

/// `unrig new`: rig and run files to begin with.
int new_command(int argc, char** argv);

}  // namespace unrig
