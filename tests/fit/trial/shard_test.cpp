#include "fit/trial/shard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

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
    for (const char* name : {"SLURM_ARRAY_TASK_ID", "SLURM_ARRAY_TASK_MIN", "SLURM_ARRAY_TASK_COUNT", "OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "PMIX_RANK"}) unsetenv(name);
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

std::vector<std::size_t> all_of(const Pieces& pieces) {
  std::vector<std::size_t> all;
  while (const auto piece = pieces.next()) all.push_back(*piece);
  return all;
}

TEST(Pieces, OfAllShardsAreEachPieceOnce) {
  for (const std::size_t count : {0, 1, 6, 7, 8}) {
    std::vector<std::size_t> together;
    for (std::size_t i = 1; i <= 7; ++i) {
      const Pieces pieces = pieces_of_shard(i, 7, count);
      const std::vector<std::size_t> own = all_of(pieces);
      EXPECT_EQ(own.size(), pieces.most);
      EXPECT_EQ(pieces.next(), std::nullopt);
      together.insert(together.end(), own.begin(), own.end());
    }
    std::sort(together.begin(), together.end());
    std::vector<std::size_t> each(count);
    std::iota(each.begin(), each.end(), std::size_t{0});
    EXPECT_EQ(together, each);
  }
  EXPECT_EQ(all_of(pieces_of_shard(3, 4, 12)), (std::vector<std::size_t>{2, 6, 10}));
}

TEST(HandOut, IsForSeveralRanksThatMpirunStartedAndNoneThatNameTheirShard) {
  set_hand_out([](std::size_t count) { return Pieces{count, {}}; });
  using Environment = std::map<std::string, std::string>;
  const Environment started{{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "2"}, {"PMIX_RANK", "1"}};
  const auto handed_out = [](const Environment& environment, const std::string& option) {
    const Scheduler scheduler(environment);
    return static_cast<bool>(hand_out_of(option));
  };
  EXPECT_TRUE(handed_out(started, ""));
  EXPECT_FALSE(handed_out(started, "1/2"));
  EXPECT_FALSE(handed_out({}, ""));
  EXPECT_FALSE(handed_out({{"OMPI_COMM_WORLD_RANK", "1"}, {"OMPI_COMM_WORLD_SIZE", "2"}}, ""));
  EXPECT_FALSE(handed_out({{"OMPI_COMM_WORLD_RANK", "0"}, {"OMPI_COMM_WORLD_SIZE", "1"}, {"PMIX_RANK", "0"}}, ""));
  Environment in_an_array = started;
  in_an_array.insert({{"SLURM_ARRAY_TASK_ID", "1"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "3"}});
  EXPECT_FALSE(handed_out(in_an_array, ""));
  set_hand_out({});
  EXPECT_FALSE(handed_out(started, ""));
}

TEST(Shard, RefusesWhatNamesNoPart) {
  for (const char* option : {"0/3", "4/3", "3", "a/b", "1/", "-1/3"}) EXPECT_THROW(shard_of(option), InputError) << option;
  const Scheduler gap({{"SLURM_ARRAY_TASK_ID", "9"}, {"SLURM_ARRAY_TASK_MIN", "1"}, {"SLURM_ARRAY_TASK_COUNT", "3"}});  // --array=1,5,9
  EXPECT_THROW(shard_of(""), InputError);
}

}  // namespace
}  // namespace unrig
