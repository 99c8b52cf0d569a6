#include "fit/apparent_mass/rig_frequencies.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "fit/solver/least_squares.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

enum : Index { normal_scale, torsion_scale, mass_coefficient };

constexpr double scan_tolerance = 0.04;   // of a frequency
constexpr double match_tolerance = 0.03;
constexpr double ratio_width = 0.5;       // of ln(k_t / k_n)
constexpr double strong = 0.1;            // of the strongest vibration

MatrixXd stiffness_of(const UndampedSystem& s, const RigScales& scales) {
  return scales[normal_scale] * s.normal_stiffness + scales[torsion_scale] * s.torsion_stiffness;
}

/// A pair (observed, mode) that may belong together.
struct Pair {
  double distance;  // |ln| of the ratio of frequencies
  Index observed, mode;
};

/// Nearest pairs first, each frequency and each mode once.
std::vector<Pair> nearest_pairs(const ObservedRun& run, const VectorXd& hertz, double tolerance) {
  std::vector<Pair> all, taken;
  for (std::size_t i = 0; i < run.observed.size(); ++i) {
    if (run.observed[i].folded > 0) continue;
    for (Index j = 0; j < hertz.size() && hertz[j] < run.sampling / 2; ++j) {
      const double distance = std::abs(std::log(run.observed[i].hertz / hertz[j]));
      if (distance < tolerance) all.push_back({distance, static_cast<Index>(i), j});
    }
  }
  std::sort(all.begin(), all.end(), [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  for (const Pair& pair : all)
    if (std::none_of(taken.begin(), taken.end(), [&](const Pair& t) { return t.observed == pair.observed || t.mode == pair.mode; }))
      taken.push_back(pair);
  return taken;
}

double score(const ObservedRun& run, const VectorXd& hertz) {
  double sum = 0;
  for (const Pair& pair : nearest_pairs(run, hertz, scan_tolerance)) sum += 1 - pair.distance * pair.distance / (scan_tolerance * scan_tolerance);
  return sum;
}

/// Strong vibrations, any of which may be the lowest mode.
std::vector<double> anchors(const ObservedRun& run) {
  double strongest = 0;
  for (const ObservedFrequency& f : run.observed) strongest = std::max(strongest, f.strength);
  std::vector<double> hertz;
  for (const ObservedFrequency& f : run.observed)
    if (f.strength >= strong * strongest) hertz.push_back(f.hertz);
  return hertz;
}

/// Scales with k_t = ratio k_n that put the lowest mode on these two frequencies; nothing where the fluid would need negative mass.
std::optional<RigScales> scales_for(const ObservedRun& dry, const ObservedRun& wet, double ratio, double dry_hertz, double wet_hertz) {
  if (wet_hertz >= dry_hertz) return {};
  double ca = 1;
  constexpr int rounds = 20;
  for (int round = 0; round < rounds; ++round) {
    // All frequencies go with the square root of the stiffness; that of the dry run depends on C_a by a thousandth or less.
    const double lowest_dry = natural_frequencies(dry.system, {1, ratio, ca}).hertz[0];
    const double kn = std::pow(dry_hertz / lowest_dry, 2);
    const NaturalFrequencies at = natural_frequencies(wet.system, {kn, ratio * kn, ca});
    // Newton in C_a on 1 / f^2, which for a single mode is linear in it.
    const double inverse_square = std::pow(at.hertz[0], -2);
    const double slope = -2 * inverse_square * at.slope(0, mass_coefficient) / at.hertz[0];
    const double step = (std::pow(wet_hertz, -2) - inverse_square) / slope;
    ca = std::max(ca + step, 0.02 * ca);
    if (!(ca > 1e-3 && ca < 1e3)) return {};
    if (std::abs(step) < 1e-6 * ca) return RigScales(kn, ratio * kn, ca);
  }
  return {};
}

std::optional<RigScales> scan(const ObservedRun& dry, const ObservedRun& wet) {
  constexpr double span = 2.7726;  // ln 16
  constexpr double step = 0.06;    // 3 % of a torsional frequency
  constexpr double per_ratio = 0.05;  // a torsion off by a factor e against the rig file must explain this much of a frequency more
  std::optional<RigScales> best;
  double best_score = 0;
  for (const double dry_hertz : anchors(dry)) {
    for (const double wet_hertz : anchors(wet)) {
      for (double log_ratio = -span; log_ratio <= span; log_ratio += step) {
        const auto scales = scales_for(dry, wet, std::exp(log_ratio), dry_hertz, wet_hertz);
        if (!scales) continue;
        const double value = score(dry, natural_frequencies(dry.system, *scales).hertz) + score(wet, natural_frequencies(wet.system, *scales).hertz) -
                             per_ratio * log_ratio * log_ratio;
        if (best && value <= best_score) continue;
        best = scales;
        best_score = value;
      }
    }
  }
  return best;
}

struct Solution {
  RigScales scales;
  Eigen::Matrix3d covariance;  // of the logarithms
  double chi2 = 0;
  Index rows = 0;
};

/// (observed - model) / error of all matched frequencies, and the prior; unknowns: ln k_n, ln k_t, ln C_a. `common_error`: relative error of every frequency, in place of their own.
Solution solve(const ObservedRun& dry, const ObservedRun& wet, const RigScales& start, std::optional<double> common_error, double error_scale = 1) {
  const auto matched = [](const ObservedRun& run) { return std::count_if(run.observed.begin(), run.observed.end(), [](const ObservedFrequency& f) { return f.mode.has_value(); }); };
  LeastSquaresProblem problem;
  for (const auto& [name, scale] : {std::pair("ln k_n", start[normal_scale]), std::pair("ln k_t", start[torsion_scale]), std::pair("ln C_a", start[mass_coefficient])})
    problem.unknowns.push_back({name, std::log(scale)});
  ResidualTerm term;
  term.unknowns = {0, 1, 2};
  term.size = matched(dry) + matched(wet) + 1;
  term.evaluate = [&](const VectorXd& logs, VectorXd& residual, MatrixXd* jacobian) {
    const RigScales scales = logs.array().exp();
    Index row = 0;
    const auto add = [&](double value, const Eigen::RowVector3d& slope) {
      residual[row] = value;
      if (jacobian != nullptr) jacobian->row(row) = slope;
      ++row;
    };
    for (const ObservedRun* run : {&dry, &wet}) {
      const NaturalFrequencies model = natural_frequencies(run->system, scales);
      if (!model.hertz.allFinite()) return false;
      for (const ObservedFrequency& f : run->observed) {
        if (!f.mode) continue;
        const double error = common_error ? *common_error * f.hertz : error_scale * f.std_error;
        add((f.hertz - model.hertz[*f.mode]) / error, -model.slope.row(*f.mode).cwiseProduct(scales.transpose()) / error);
      }
    }
    add((logs[torsion_scale] - logs[normal_scale]) / ratio_width, Eigen::RowVector3d(-1, 1, 0) / ratio_width);
    return true;
  };
  problem.terms.push_back(std::move(term));
  LeastSquaresOptions options;
  options.effort = LeastSquaresOptions::Effort::once;
  const LeastSquaresPoint point = solve_least_squares(problem, options).point;
  const Eigen::Matrix3d information = point.jacobian.transpose() * point.jacobian;
  return {point.values.array().exp(), information.ldlt().solve(Eigen::Matrix3d::Identity()), point.chi2(), point.residual.size()};
}

/// Takes the matches at these scales; returns whether any changed.
bool rematch(ObservedRun& run, const RigScales& scales) {
  const std::vector<Pair> pairs = nearest_pairs(run, natural_frequencies(run.system, scales).hertz, match_tolerance);
  bool changed = false;
  for (std::size_t i = 0; i < run.observed.size(); ++i) {
    const auto pair = std::find_if(pairs.begin(), pairs.end(), [&](const Pair& p) { return p.observed == static_cast<Index>(i); });
    const std::optional<Index> mode = pair == pairs.end() ? std::nullopt : std::optional<Index>(pair->mode);
    changed |= mode != run.observed[i].mode;
    run.observed[i].mode = mode;
  }
  return changed;
}

bool lowest_is_matched(const ObservedRun& run) {
  return std::any_of(run.observed.begin(), run.observed.end(), [](const ObservedFrequency& f) { return f.mode == Index{0}; });
}

/// Vibrations still without a mode that are one above the Nyquist frequency, folded down by the sampling.
void match_folded(ObservedRun& run, const Solution& solution) {
  const NaturalFrequencies model = natural_frequencies(run.system, solution.scales);
  for (ObservedFrequency& f : run.observed) {
    if (f.mode) continue;
    const double damped = std::sqrt(std::max(0.0, f.hertz * f.hertz - std::pow(f.decay / (2 * pi), 2)));
    for (const auto& [folded, hertz] : {std::pair{1, run.sampling - damped}, std::pair{2, run.sampling + damped}}) {
      const double natural = std::hypot(hertz, f.decay / (2 * pi));
      for (Index j = 0; j < model.hertz.size(); ++j) {
        const bool free = std::none_of(run.observed.begin(), run.observed.end(), [&](const ObservedFrequency& o) { return o.mode == j; });
        // Folding leaves the error in Hz, so that only a close match says anything; 3 % of such a frequency is wide as a barn.
        if (f.mode || !free || model.hertz[j] < run.sampling / 2 || std::abs(natural - model.hertz[j]) > 3 * f.std_error + 0.002 * natural) continue;
        f.mode = j;
        f.folded = folded;
        f.hertz = natural;
      }
    }
  }
}

}  // namespace

NaturalFrequencies natural_frequencies(const UndampedSystem& s, const RigScales& scales) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(stiffness_of(s, scales), s.mass + scales[mass_coefficient] * s.fluid_mass);
  NaturalFrequencies f;
  f.shape = eigen.eigenvectors();
  const VectorXd omega2 = eigen.eigenvalues();
  f.hertz = omega2.cwiseSqrt() / (2 * pi);
  const auto quadratic = [&](const MatrixXd& m) -> VectorXd { return (f.shape.transpose() * m * f.shape).diagonal(); };
  f.slope.resize(f.hertz.size(), 3);
  f.slope.col(normal_scale) = quadratic(s.normal_stiffness);
  f.slope.col(torsion_scale) = quadratic(s.torsion_stiffness);
  f.slope.col(mass_coefficient) = -omega2.cwiseProduct(quadratic(s.fluid_mass));
  f.slope = (8 * pi * pi * f.hertz).cwiseInverse().asDiagonal() * f.slope;  // d f = d omega^2 / (8 pi^2 f)
  return f;
}

std::optional<FrequencyFit> fit_rig_frequencies(ObservedRun& dry, ObservedRun& wet) {
  const std::optional<RigScales> start = scan(dry, wet);
  if (!start) return {};
  Solution solution;
  solution.scales = *start;
  constexpr int rounds = 10;
  for (int round = 0; round < rounds; ++round) {
    const bool dry_changed = rematch(dry, solution.scales), wet_changed = rematch(wet, solution.scales);
    if (!lowest_is_matched(dry) || !lowest_is_matched(wet)) return {};
    if (!dry_changed && !wet_changed) break;
    solution = solve(dry, wet, solution.scales, 0.01);
  }
  match_folded(dry, solution);
  match_folded(wet, solution);

  solution = solve(dry, wet, solution.scales, {});
  FrequencyFit fit;
  fit.degrees_of_freedom = solution.rows - 3;
  if (fit.degrees_of_freedom > 0) fit.reduced_chi2 = solution.chi2 / static_cast<double>(fit.degrees_of_freedom);
  constexpr int scalings = 5;  // the prior does not grow, so that one is not quite enough
  for (int round = 0; round < scalings && fit.degrees_of_freedom > 0; ++round) {
    const double reduced = solution.chi2 / static_cast<double>(fit.degrees_of_freedom);
    if (reduced <= 1) break;
    fit.error_scale *= std::sqrt(reduced);
    solution = solve(dry, wet, solution.scales, {}, fit.error_scale);
  }
  fit.scales = solution.scales;
  fit.covariance = fit.scales.asDiagonal() * solution.covariance * fit.scales.asDiagonal();
  fit.torsion_identified = std::sqrt(solution.covariance(torsion_scale, torsion_scale)) < ratio_width / 2;
  return fit;
}

}  // namespace unrig
