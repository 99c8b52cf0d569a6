#pragma once

namespace unrig {

/// `unrig batch campaigns.toml -o table.csv [--report page.html] [--shard i/n] [--cases FOLDER]`
int batch_command(int argc, char** argv);

}  // namespace unrig
