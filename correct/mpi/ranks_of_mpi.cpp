#include "correct/mpi/ranks_of_mpi.h"

#include <mpi.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <mutex>
#include <thread>

#include "core/files/error.h"

namespace unrig {
namespace {

enum Message : int { ask, piece, leave };  // tags

}  // namespace

struct RanksOfMpi::Job {
  int rank = 0, ranks = 1;
  std::uint64_t count;
  std::mutex asking;  // of all but rank 0
  bool all_given = false;
  std::atomic<std::uint64_t> given = 0;  // of rank 0
  std::thread answering;                 // likewise; meanwhile no other there calls MPI

  explicit Job(std::uint64_t pieces) : count(pieces) {
    int level = 0;  // of threads: one calls at a time
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level);
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    if (level < MPI_THREAD_SERIALIZED) throw InputError({"MPI", 0}, "it knows no threads", "wanted MPI_THREAD_SERIALIZED", "Name the shard with --shard i/n.");
    if (rank == 0) answering = std::thread([this] { answer(); });
  }

  ~Job() {
    if (rank == 0) answering.join();
    else MPI_Send(nullptr, 0, MPI_BYTE, 0, leave, MPI_COMM_WORLD);
    MPI_Finalize();
  }

  /// Looks for messages at growing intervals: a receive that waits would keep a processor busy.
  void answer() {
    using namespace std::chrono_literals;
    constexpr std::chrono::microseconds shortest = 10us, longest = 1ms;
    std::chrono::microseconds pause = shortest;
    for (int others = ranks - 1; others > 0;) {
      int there = 0;
      MPI_Status message;
      MPI_Iprobe(MPI_ANY_SOURCE, MPI_ANY_TAG, MPI_COMM_WORLD, &there, &message);
      if (!there) {
        std::this_thread::sleep_for(pause);
        pause = std::min(2 * pause, longest);
        continue;
      }
      pause = shortest;
      MPI_Recv(nullptr, 0, MPI_BYTE, message.MPI_SOURCE, message.MPI_TAG, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
      if (message.MPI_TAG == leave) {
        --others;
        continue;
      }
      const std::uint64_t next = given++;
      MPI_Send(&next, 1, MPI_UINT64_T, message.MPI_SOURCE, piece, MPI_COMM_WORLD);
    }
  }

  std::uint64_t asked() {
    const std::lock_guard guard(asking);
    std::uint64_t next = count;
    if (all_given) return next;
    MPI_Send(nullptr, 0, MPI_BYTE, 0, ask, MPI_COMM_WORLD);
    MPI_Recv(&next, 1, MPI_UINT64_T, 0, piece, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
    all_given = next >= count;
    return next;
  }
};

RanksOfMpi::RanksOfMpi() = default;
RanksOfMpi::~RanksOfMpi() = default;

Pieces RanksOfMpi::share(std::size_t count) {
  job_ = std::make_unique<Job>(count);
  if (job_->ranks == 1) {
    const auto [i, n] = shard_of("");
    return pieces_of_shard(i, n, count);
  }
  return {count, [&job = *job_]() -> std::optional<std::size_t> {
            const std::uint64_t next = job.rank == 0 ? job.given++ : job.asked();
            return next < job.count ? std::optional<std::size_t>(next) : std::nullopt;
          }};
}

}  // namespace unrig
