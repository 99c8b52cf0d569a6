#pragma once
#include <cstddef>
#include <string>
#include <utility>

namespace unrig {

/// Which part of a study this call is to compute, (i, n) with 1 <= i <= n: `option` as "i/n"; if it is empty, task and count of a Slurm array job
/// (SLURM_ARRAY_TASK_ID, _MIN, _COUNT), or rank and size under Open MPI (OMPI_COMM_WORLD_RANK, _SIZE); else all, (1, 1).
/// Throws InputError for anything else.
std::pair<std::size_t, std::size_t> shard_of(const std::string& option);

}  // namespace unrig
