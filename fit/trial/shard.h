#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <utility>

namespace unrig {

/// Which part of a study this call is to compute, (i, n) with 1 <= i <= n: `option` as "i/n"; if it is empty, task and count of a Slurm array job
/// (SLURM_ARRAY_TASK_ID, _MIN, _COUNT), or rank and size under Open MPI (OMPI_COMM_WORLD_RANK, _SIZE); else all, (1, 1).
/// Throws InputError for anything else.
std::pair<std::size_t, std::size_t> shard_of(const std::string& option);

/// The pieces of a study that this process computes.
struct Pieces {
  std::size_t most = 0;                             ///< how many they can be
  std::function<std::optional<std::size_t>()> next; ///< one at each call, in ascending order, then none; any thread may ask
};

/// Part i of n of `count` pieces: i - 1, i - 1 + n, ...
Pieces pieces_of_shard(std::size_t i, std::size_t n, std::size_t count);

/// Deals `count` pieces out among processes, to each the next when it asks.
using HandOut = std::function<Pieces(std::size_t count)>;

/// Who deals out pieces among the ranks of Open MPI. The program sets it where it is built with MPI (correct/mpi); else ranks are shards.
void set_hand_out(const HandOut& ranks);

/// What was set, where shard_of(option) goes by the rank, there are several, and mpirun started them (PMIX_RANK); else empty.
HandOut hand_out_of(const std::string& option);

}  // namespace unrig
