#include "fit/trial/laboratory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <set>
#include <utility>

#include "core/effects/effect.h"
#include "core/rig/default_errors.h"
#include "fit/trial/trial_plan.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using Random = std::mt19937_64;

constexpr std::array kinds{std::pair{NoiseKind::white, "white"}, std::pair{NoiseKind::first_order, "first-order"}, std::pair{NoiseKind::pink, "pink"}, std::pair{NoiseKind::heavy_tailed, "heavy-tailed"}, std::pair{NoiseKind::quantised, "quantised"}};

/// A first-order autoregression in its steady state.
VectorXd first_order_noise(Index samples, double corner, double dt, Random& random) {
  VectorXd noise = white_noise(samples, random);
  const double memory = std::exp(-2 * pi * corner * dt), fresh = std::sqrt(1 - memory * memory);
  for (Index k = 1; k < samples; ++k) noise[k] = memory * noise[k - 1] + fresh * noise[k];
  return noise;
}

/// First-order parts of equal power, three to an octave.
VectorXd pink_noise(Index samples, double dt, Random& random) {
  const double lowest = 0.2 / (static_cast<double>(samples) * dt), octaves = std::log2(0.5 / dt / lowest);
  const int parts = std::max(1, static_cast<int>(3 * octaves));
  VectorXd noise = VectorXd::Zero(samples);
  for (int i = 0; i < parts; ++i) noise += first_order_noise(samples, lowest * std::exp2(octaves * i / parts), dt, random);
  return noise / std::sqrt(parts);
}

VectorXd heavy_tailed_noise(Index samples, Random& random) {
  constexpr double freedom = 3, variance = freedom / (freedom - 2);
  std::student_t_distribution<double> student(freedom);
  return VectorXd::NullaryExpr(samples, [&] { return student(random) / std::sqrt(variance); });
}

/// Errors of numbers whose group is misread, the others exact; `deviation` draws one of standard deviation 1.
template <typename Deviation>
VectorXd errors_of(const Givens& givens, const std::string& group, Deviation deviation) {
  VectorXd deviations = VectorXd::Zero(givens.deviations());
  for (std::size_t k = 0; k < givens.group.size(); ++k)
    if (group == as_stated || givens.group[k] == group) deviations[static_cast<Index>(k)] = deviation();
  return givens.spread * deviations;
}

/// Rig or run with errors of the usual size, which it states where all of its numbers have them.
template <typename File, typename Deviation>
File read_with_errors(File file, const std::string& group, Deviation deviation) {
  const auto usual = std::make_shared<const Givens>(usual_errors(file));
  const std::shared_ptr<const Givens> stated = std::exchange(file.givens, usual);
  File off = with_errors(file, errors_of(*usual, group, deviation));
  off.givens = group == as_stated ? std::make_shared<const Givens>(usual_errors(off)) : stated;
  return off;
}

}  // namespace

VectorXd white_noise(Index samples, Random& random) {
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(samples, [&] { return normal(random); });
}

std::string to_string(NoiseKind kind) {
  return std::find_if(kinds.begin(), kinds.end(), [&](const auto& k) { return k.first == kind; })->second;
}

Laboratory draw_laboratory(const Rig& rig, const std::vector<Run>& runs, Random& random) {
  Laboratory laboratory;
  laboratory.noise = kinds[std::uniform_int_distribution<std::size_t>(0, kinds.size() - 1)(random)].first;
  laboratory.corner = log_between(random, 1, 30);
  laboratory.share = between(random, 0.5, 1);
  laboratory.converter = laboratory.noise == NoiseKind::quantised ? log_between(random, 1, 6) : 0;
  laboratory.phase_walk = log_between(random, 0.05, 0.5);
  const bool off = std::bernoulli_distribution(0.5)(random);
  std::set<std::string> groups;
  const Givens of_rig = usual_errors(rig);
  groups.insert(of_rig.group.begin(), of_rig.group.end());
  for (const Run& run : runs) {
    const Givens of_run = usual_errors(run);
    groups.insert(of_run.group.begin(), of_run.group.end());
  }
  const auto which = std::uniform_int_distribution<std::size_t>(0, groups.size() - 1)(random);
  const bool stated = std::bernoulli_distribution(0.5)(random);
  if (off) laboratory.misread = stated ? as_stated : *std::next(groups.begin(), static_cast<std::ptrdiff_t>(which));
  return laboratory;
}

VectorXd draw_noise(const Laboratory& laboratory, Index samples, double dt, Random& random) {
  const auto mixed = [&](const VectorXd& coloured) -> VectorXd { return std::sqrt(laboratory.share) * coloured + std::sqrt(1 - laboratory.share) * white_noise(samples, random); };
  switch (laboratory.noise) {
    case NoiseKind::first_order: return mixed(first_order_noise(samples, laboratory.corner, dt, random));
    case NoiseKind::pink: return mixed(pink_noise(samples, dt, random));
    case NoiseKind::heavy_tailed: return heavy_tailed_noise(samples, random);
    case NoiseKind::white:
    case NoiseKind::quantised: break;
  }
  return white_noise(samples, random);
}

void misread(const Laboratory& laboratory, Rig& rig, std::vector<Run>& runs, Random& random) {
  if (laboratory.misread.empty()) return;
  std::normal_distribution<double> normal;
  rig = read_with_errors(rig, laboratory.misread, [&] { return normal(random); });
  const double of_all_runs = normal(random);
  for (Run& run : runs) run = read_with_errors(run, laboratory.misread, [&] { return of_all_runs; });
}

}  // namespace unrig
