#include "fit/likelihood/run_order.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <tuple>

#include "core/rig/fingerprint.h"

namespace unrig {
namespace {

using Eigen::Index;

int turn_of(RunKind kind) {
  switch (kind) {
    case RunKind::pluck: return 0;
    case RunKind::forced: return 1;
    case RunKind::moved: return 2;
    case RunKind::step: break;
  }
  return 3;
}

std::vector<std::size_t> one_after_the_other(std::size_t count) {
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  return order;
}

bool have_names_of_their_own(const std::vector<Run>& runs) {
  std::set<std::string> files;
  for (const Run& run : runs) files.insert(run.file);
  return files.size() == runs.size();
}

}  // namespace

std::vector<std::size_t> order_of_search(const std::vector<Run>& runs) {
  std::vector<std::size_t> order = one_after_the_other(runs.size());
  if (!have_names_of_their_own(runs)) return order;
  const auto key = [&](std::size_t i) {
    const Run& run = runs[i];
    return std::tuple(turn_of(run.kind), run.density, conditions_of(run).onset_angle, run.speed, run.samples());
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const auto left = key(a), right = key(b);
    return left != right ? left < right : fingerprint(runs[a]) < fingerprint(runs[b]);
  });
  return order;
}

std::vector<Run> in_order(const std::vector<Run>& runs, const std::vector<std::size_t>& order) {
  std::vector<Run> ordered;
  for (const std::size_t i : order) ordered.push_back(runs[i]);
  return ordered;
}

bool is_as_given(const std::vector<std::size_t>& order) { return std::is_sorted(order.begin(), order.end()); }

GivenOrder::GivenOrder(const std::vector<Run>& runs) {
  for (std::size_t i = 0; i < runs.size(); ++i) place_.emplace(runs[i].file, i);
}

std::size_t GivenOrder::operator()(const std::string& file) const {
  const auto found = place_.find(file);
  return found == place_.end() ? place_.size() : found->second;
}

std::vector<std::size_t> GivenOrder::places_of(const std::vector<std::string>& files) const {
  std::vector<std::size_t> places = one_after_the_other(files.size());
  std::stable_sort(places.begin(), places.end(), [&](std::size_t a, std::size_t b) { return (*this)(files[a]) < (*this)(files[b]); });
  return places;
}

std::vector<std::size_t> GivenOrder::places_of(const std::vector<std::pair<std::string, std::string>>& named) const {
  std::vector<std::size_t> places = one_after_the_other(named.size());
  std::map<std::string, std::vector<std::size_t>> by_name;
  for (std::size_t i = 0; i < named.size(); ++i)
    if (!named[i].second.empty()) by_name[named[i].first].push_back(i);
  for (const auto& [name, here] : by_name) {
    std::vector<std::size_t> sorted = here;
    std::stable_sort(sorted.begin(), sorted.end(), [&](std::size_t a, std::size_t b) { return (*this)(named[a].second) < (*this)(named[b].second); });
    for (std::size_t k = 0; k < here.size(); ++k) places[here[k]] = sorted[k];
  }
  return places;
}

void tell_as_given(const GivenOrder& given, FitResult& result) {
  given.sort(result.runs, [](const FittedRun& run) { return run.file; });
  given.sort_by_name(result.profiles);

  std::vector<std::size_t> places = given.places_by_name(result.parameters);
  std::vector<std::size_t> now(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) now[places[i]] = i;
  for (DeterminedCombination& c : result.determined)
    for (std::size_t& unknown : c.unknowns) unknown = now[unknown];
  given.sort_by_name(result.parameters);
  if (result.correlation.size() > 0) result.correlation = result.correlation(places, places).eval();
  for (const std::size_t i : given.places_by_name(result.givens)) places.push_back(now.size() + i);
  given.sort_by_name(result.givens);
  if (result.joint_covariance.size() > 0) result.joint_covariance = result.joint_covariance(places, places).eval();

  // Warnings of one run begin with its file; the others stay where they are.
  std::vector<std::pair<std::string, std::string>> of_runs;
  for (const std::string& warning : result.warnings) {
    const std::string file = warning.substr(0, warning.find(": "));
    of_runs.emplace_back("", std::any_of(result.runs.begin(), result.runs.end(), [&](const FittedRun& run) { return run.file == file; }) ? file : "");
  }
  std::vector<std::string> warnings;
  for (const std::size_t i : given.places_of(of_runs)) warnings.push_back(result.warnings[i]);
  result.warnings = std::move(warnings);
}

}  // namespace unrig
