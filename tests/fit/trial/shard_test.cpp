#include "fit/trial/shard.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <string>
#include <utility>

#include "core/files/error.h"

namespace unrig {
namespace {

/// The variables of a scheduler, set while this lives; all others unset.
class Scheduler {
 public:
  explicit Scheduler(const std::map<std::string, std::string>& values) {
    clear();
    for (const auto& [name, value] : values) setenv(name.c_str(), value.c_str(), 1);
  }
  ~Scheduler() { clear(); }
  Scheduler(const Scheduler&) = delete;
  Scheduler& operator=(const Scheduler&) = delete;

 private:
  static void clear() {
    for (const char* name : {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE"}) unsetenv(name);
  }
};

using Shard = std::pair<std::size_t, std::size_t>;

TEST(Shard, IsAllWhereNothingSaysOtherwise) {
  const Scheduler none({});
  EXPECT_EQ(shard_of(""), Shard(1, 1));
}

TEST(Shard, IsTheTaskOfASlurmArrayWhereverTheArrayBegins) {
  for (const int first : {0, 1, 5}) {
    const Scheduler slurm({{"SLURM_ARRAY_TASK_ID", std::to_string(first + 2)}, {"SLURM_ARRAY_TASK_MIN", std::to_string(first)}, {"SLURM_ARRAY_TASK_COUNT", "7"}});
    EXPECT_EQ(shard_of(""), Shard(3, 7)) << first;
  }
}

TEST(Shard, IsTheRankUnderOpenMpi) {
  const Scheduler mpi({{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "2"}});
  EXPECT_EQ(shard_of(""), Shard(2, 2));
}

TEST(Shard, OfTheCommandLineStandsAboveTheEnvironment) {
  const Scheduler mpi({{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "2"}});
  EXPECT_EQ(shard_of("3/64"), Shard(3, 64));
}

TEST(Shard, RefusesWhatNamesNoPart) {
  for (const char* option : {"0/3", "4/3", "3", "a/b", "1/", "-1/3"}) EXPECT_THROW(shard_of(option), InputError) << option;
  const Scheduler gap({{"SLURM_ARRAY_TASK_ID", "9"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "3"}});  // --array=1,5,9
  EXPECT_THROW(shard_of(""), InputError);
}

}  // namespace
}  // namespace unrig
