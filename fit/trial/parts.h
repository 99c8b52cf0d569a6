#pragma once
#include <fmt/format.h>

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/files/error.h"

namespace unrig {

/// What one shard of a study computed.
template <class Case>
struct Part {
  std::string path;
  std::string study;        ///< tells one study from another
  std::size_t planned = 0;  ///< cases of the whole study, numbered from 0
  std::vector<std::pair<std::size_t, Case>> cases;
};

/// How messages about parts speak of their cases.
struct PartsOf {
  std::string one, many, same;  ///< "trial", "trials", and what makes two studies the same
};

/// The cases of a whole study in their order, whatever the number and order of its parts.
/// `same(a, b)` says whether two outcomes of one case are the same.
/// Throws InputError where the parts are of different studies, disagree on a case, or leave one out.
template <class Case, class Same>
std::vector<Case> all_cases(const std::vector<Part<Case>>& parts, const PartsOf& of, const Same& same) {
  std::map<std::size_t, std::pair<const Case*, const Part<Case>*>> known;
  for (const Part<Case>& part : parts) {
    if (part.study != parts.front().study) throw InputError({part.path, 0}, "another study than " + parts.front().path, "wanted " + of.same, "Collect each study by itself.");
    for (const auto& [number, one] : part.cases) {
      const auto [before, fresh] = known.emplace(number, std::pair{&one, &part});
      if (!fresh && !same(*before->second.first, one))
        throw InputError({part.path, 0}, fmt::format("another outcome of {} {} than {}", of.one, number, before->second.second->path), "wanted the same from the same version and input", "Run both shards again with one program.");
    }
  }
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < parts.front().planned; ++i)
    if (!known.contains(i)) missing.push_back(i);
  if (!missing.empty())
    throw InputError({parts.back().path, 0}, fmt::format("{} of {} {} are in none of the files, the first is number {}", missing.size(), parts.front().planned, of.many, missing.front()), "wanted all shards", "Run the shards that are missing.");
  std::vector<Case> all;
  for (const auto& [number, one] : known)
    if (number < parts.front().planned) all.push_back(*one.first);
  return all;
}

}  // namespace unrig
