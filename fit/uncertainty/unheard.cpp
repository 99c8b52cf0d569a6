#include "fit/uncertainty/unheard.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Stiffness and damping of the normal or of the torsional modes.
struct Resonance {
  std::vector<std::size_t> unknowns;  ///< those that are free, the stiffness first
  MatrixXd covariance;                ///< of these
  double damping = 0;                 ///< found or held

  double error_of_stiffness() const { return std::sqrt(covariance(0, 0)); }
};

/// Of a beam.
std::optional<Resonance> resonance(const JointProblem& joint, const ParameterUncertainty& uncertainty, bool torsion) {
  const auto is_its = [&](const Unknown& u, Role role) {
    const Parameter& p = joint.parameter(u);
    return p.mode < 0 && p.role == role && p.torsion == torsion;
  };
  Resonance found;
  std::vector<Index> rows;
  for (const Role role : {Role::stiffness, Role::damping})
    for (std::size_t a = 0; a < uncertainty.free.size(); ++a) {
      const auto i = static_cast<std::size_t>(uncertainty.free[a]);
      if (is_its(joint.unknowns()[i], role)) found.unknowns.push_back(i), rows.push_back(static_cast<Index>(a));
    }
  if (found.unknowns.empty() || joint.parameter(joint.unknowns()[found.unknowns.front()]).role != Role::stiffness) return std::nullopt;
  found.covariance = uncertainty.white_covariance(rows, rows);
  for (const Unknown& u : joint.unknowns())
    if (is_its(u, Role::damping)) found.damping = u.value;
  return found;
}

/// A line of energy E over the noise tells its stiffness to some 4 to 7 / sqrt(E) of its width (Cramer-Rao), and the noise has none of more than E = 30 or so: what is known to a fifth of
/// the width was not read off one. The width is the damping ratio or what the length of the record leaves, 1 / (omega T), whose least is that of the highest of these modes.
bool is_loud(const JointProblem& joint, const Resonance& r) {
  constexpr double part = 0.2;
  const Unknown& stiffness = joint.unknowns()[r.unknowns.front()];
  const Basis& basis = joint.model().basis();
  const bool torsion = joint.parameter(stiffness).torsion;
  const double highest = std::sqrt(stiffness.value) * basis.omega.segment(torsion ? basis.normal_modes : 0, torsion ? basis.torsion_modes : basis.normal_modes).maxCoeff();
  double longest = 0;
  for (const RunResidual& run : joint.runs()) longest = std::max(longest, run.run().dt * static_cast<double>(run.run().samples()));
  return r.error_of_stiffness() < part * std::max(r.damping, 1 / (highest * longest)) * stiffness.value;
}

/// chi-square with the resonance held where it is now and all else at its least; a bound from above where that would take long.
double least_chi2(JointProblem joint, const Resonance& r) {
  for (const std::size_t i : r.unknowns) joint.unknowns()[i].held = true;
  JointProblem::SolveOptions options;
  options.iterations = 8;
  options.precision = 0.1;
  return joint.solve(options).chi2;
}

/// Where else the resonance could be as well, in words; empty where it is heard.
std::string elsewhere(JointProblem& joint, const Resonance& r, const StartValues& starts, double variance) {
  constexpr double heard = 25, claimed = 16, share_kept = 0.25;
  constexpr double hopeless = 8 * heard;  // the other unknowns take up a rise that the noise could have made by some times, not all of it
  constexpr std::array<double, 9> factors{1.0, 0.5, 0.6, 0.7, 0.8, 1.25, 1.4, 1.7, 2.0};
  const auto unknown = [&](std::size_t k) -> Unknown& { return joint.unknowns()[r.unknowns[k]]; };
  const auto count = static_cast<Index>(r.unknowns.size());
  VectorXd found(count), there(count);
  for (Index k = 0; k < count; ++k) found[k] = unknown(static_cast<std::size_t>(k)).value;
  const auto go = [&](const VectorXd& values) {
    for (Index k = 0; k < count; ++k) unknown(static_cast<std::size_t>(k)).value = values[k];
  };
  const double here = joint.chi2();
  std::string text;
  for (const bool damping_found : {true, false}) {
    if (!damping_found && count < 2) continue;
    for (const double factor : factors) {
      there = found;
      there[0] = std::clamp(factor * found[0], joint.parameter(unknown(0)).lower, joint.parameter(unknown(0)).upper);
      if (!damping_found) there[1] = start_of(joint.parameter(unknown(1)), starts);
      const double promised = (there - found).dot(r.covariance.ldlt().solve(there - found)), most = std::min(heard, share_kept * promised);
      if (!(promised > claimed)) continue;
      go(there);
      double rise = (joint.chi2() - here) / variance;
      if (rise >= most && rise < hopeless) rise = (least_chi2(joint, r) - here) / variance;
      if (!(rise < most)) continue;
      for (Index k = 0; k < count; ++k)
        if (there[k] != found[k]) text += fmt::format("{}{} = {:.3g} in place of {:.3g}", text.empty() ? "" : " and ", joint.parameter(unknown(static_cast<std::size_t>(k))).name, there[k], found[k]);
      go(found);
      return text + (rise > 0 ? fmt::format(" chi-square is only {:.2g} higher", rise) : " chi-square is no higher");
    }
  }
  go(found);
  return text;
}

}  // namespace

bool hold_unheard(JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts) {
  double freedom = 0;
  for (const RunResidual& run : joint.runs()) freedom += run.is_aside() ? 0 : static_cast<double>(run.degrees_of_freedom());
  const double variance = std::max(1.0, joint.chi2() / freedom);
  bool held = false;
  for (const bool torsion : {false, true}) {
    const std::optional<Resonance> r = resonance(joint, uncertainty, torsion);
    if (!r || is_loud(joint, *r)) continue;
    const std::string with = elsewhere(joint, *r, starts, variance);
    if (with.empty()) continue;
    for (const std::size_t i : r->unknowns) {
      Unknown& u = joint.unknowns()[i];
      u.why_held = "The noise drowns this resonance: with " + with;
      u.value = start_of(joint.parameter(u), starts);
      u.held = held = true;
    }
  }
  return held;
}

}  // namespace unrig
