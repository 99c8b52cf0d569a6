#pragma once

namespace unrig {

/// `unrig propose diagnosis.json --limits limits.toml -o plan.toml`
int propose_command(int argc, char** argv);

}  // namespace unrig
