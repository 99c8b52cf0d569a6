#include "fit/trial/shard.h"

#include <atomic>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <string_view>

#include "core/files/error.h"

namespace unrig {
namespace {

std::optional<std::size_t> whole_number(std::string_view text) {
  std::size_t value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  return failure == std::errc() && end == text.data() + text.size() && !text.empty() ? std::optional(value) : std::nullopt;
}

/// A whole number in the environment; none where it is not set.
std::optional<std::size_t> environment(const char* name) {
  const char* text = std::getenv(name);
  if (text == nullptr) return std::nullopt;
  const std::optional<std::size_t> value = whole_number(text);
  if (!value) throw InputError({name, 0}, std::string("\"") + text + "\"", "wanted a whole number", "Name the shard with --shard i/n.");
  return value;
}

HandOut& among_ranks() {
  static HandOut hand_out;
  return hand_out;
}

}  // namespace

std::pair<std::size_t, std::size_t> shard_of(const std::string& option) {
  if (!option.empty()) {
    const std::size_t slash = option.find('/');
    const auto i = whole_number(std::string_view(option).substr(0, slash));
    const auto n = slash == std::string::npos ? std::nullopt : whole_number(std::string_view(option).substr(slash + 1));
    if (!i || !n || *i < 1 || *i > *n) throw InputError({"--shard", 0}, "\"" + option + "\"", "wanted i/n with i from 1 to n", "The third of seven is 3/7.");
    return {*i, *n};
  }
  if (const auto task = environment("SLURM_ARRAY_TASK_ID")) {
    const std::size_t first = environment("SLURM_ARRAY_TASK_MIN").value_or(1), count = environment("SLURM_ARRAY_TASK_COUNT").value_or(1);
    if (*task < first || *task - first >= count)
      throw InputError({"SLURM_ARRAY_TASK_ID", 0}, "task " + std::to_string(*task) + " of " + std::to_string(count) + " from " + std::to_string(first), "wanted an array without gaps", "Name the shard with --shard i/n.");
    return {*task - first + 1, count};
  }
  if (const auto rank = environment("OMPI_COMM_WORLD_RANK")) return {*rank + 1, environment("OMPI_COMM_WORLD_SIZE").value_or(1)};
  return {1, 1};
}

Pieces pieces_of_shard(std::size_t i, std::size_t n, std::size_t count) {
  const auto asked = std::make_shared<std::atomic<std::size_t>>(0);
  const std::size_t most = i > count ? 0 : (count - i) / n + 1;
  return {most, [=]() -> std::optional<std::size_t> {
            const std::size_t k = (*asked)++;
            return k < most ? std::optional(i - 1 + k * n) : std::nullopt;
          }};
}

void set_hand_out(const HandOut& ranks) { among_ranks() = ranks; }

HandOut hand_out_of(const std::string& option) {
  const bool by_rank = option.empty() && !environment("SLURM_ARRAY_TASK_ID") && environment("OMPI_COMM_WORLD_RANK") && environment("PMIX_RANK");
  return by_rank && shard_of(option).second > 1 ? among_ranks() : HandOut();
}

}  // namespace unrig
