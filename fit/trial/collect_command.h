#pragma once

namespace unrig {

/// `unrig collect part1.json part2.json ... -o all.json`
int collect_command(int argc, char** argv);

}  // namespace unrig
