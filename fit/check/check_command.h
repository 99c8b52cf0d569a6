#pragma once

namespace unrig {

/// `unrig check`: are rig file and recordings plausible, and what can they determine?
int check_command(int argc, char** argv);

}  // namespace unrig
