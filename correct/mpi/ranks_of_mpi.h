#pragma once
#include <memory>

#include "fit/trial/shard.h"

namespace unrig {

/// The ranks of an MPI job: rank 0 hands out the pieces of a study, beside its own work, to whoever has done the last one. So one long piece holds nobody up.
///
/// A thread of rank 0 answers, by messages. A counter that the others fetch from a window of rank 0 would wait, over a network, until rank 0 calls MPI again: after its own case.
class RanksOfMpi {
 public:
  RanksOfMpi();
  /// Waits until every rank has come here: a rank that fails leaves the others to finish, and their files are written before the job ends.
  ~RanksOfMpi();
  RanksOfMpi(const RanksOfMpi&) = delete;
  RanksOfMpi& operator=(const RanksOfMpi&) = delete;

  /// Begins MPI. All ranks call it, once, with the same `count`. What it returns is to be used while this lives.
  /// Where MPI knows of one rank only, since another MPI started them: the shard of this rank.
  Pieces share(std::size_t count);

 private:
  struct Job;
  std::unique_ptr<Job> job_;
};

}  // namespace unrig
