#pragma once

namespace unrig {

/// `unrig collect part1.json part2.json ... -o all.json`, and of a batch `-o table.csv [--report page.html]`.
int collect_command(int argc, char** argv);

}  // namespace unrig
