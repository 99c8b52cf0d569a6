#pragma once

namespace unrig {

/// `unrig import FILE --map map.toml -o run.csv`: a laboratory's file as a run file.
int import_command(int argc, char** argv);

}  // namespace unrig
