#include "fit/force/run_states.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/effects/effect.h"
#include "core/model/run_inputs.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

std::vector<RunState> run_states(const RunResidual& run, const RunResidual::Prediction& p, const VectorXd& theta) {
  LinearSystem system = run.model().system(run.conditions(), theta, {});
  const Basis& basis = run.model().basis();
  const Rig& rig = run.model().rig();
  const RowVectorXd shape = first_mode(run.model(), system.coordinates);
  std::vector<std::string> names{"displacement", "velocity"};
  MatrixXd reads(2, system.states());
  reads << displacement_of(system, shape), rate_of(system, shape);
  if (basis.torsion_modes > 0) {
    RowVectorXd twist = RowVectorXd::Zero(system.coordinates);
    twist[basis.normal_modes] = basis.twist(rig.submerged.back() - 1, basis.normal_modes);
    reads.conservativeResize(4, Eigen::NoChange);
    reads.bottomRows(2) << displacement_of(system, twist), rate_of(system, twist);
    names.insert(names.end(), {"twist", "twist rate"});
  }
  system.C = DualMatrix(reads, theta.size());
  system.D = DualMatrix(MatrixXd::Zero(reads.rows(), system.B.cols()), theta.size());
  MatrixXd start = MatrixXd::Zero(system.states(), 1);
  const Index known = std::min(p.initial_state.size(), system.free_states());
  start.col(0).head(known) = p.initial_state.head(known);
  const MatrixXd motion =
      drive(system, exact_step(system, run.run().dt), DualMatrix(start, theta.size()), run.run().samples(), p.motion.jerk, run_inputs(run.run(), run.conditions()), Partials::none).output;
  std::vector<RunState> states;
  for (std::size_t i = 0; i < names.size(); ++i) states.push_back({names[i], motion.col(static_cast<Index>(i))});
  if (p.motion.angle.size() > 0) {
    states.push_back({"angle", p.motion.angle});
    states.push_back({"angular rate", p.motion.rate});
  }
  return states;
}

std::optional<StateDependence> depends_on(const std::vector<RunState>& states, const VectorXd& left) {
  std::vector<Index> counted;
  for (Index k = 0; k < left.size(); ++k)
    if (left[k] != 0) counted.push_back(k);
  const auto n = static_cast<double>(counted.size());
  const double excess = left.squaredNorm() - n;
  if (counted.size() < 30 || !(excess > 0)) return {};
  std::optional<StateDependence> most;
  for (const RunState& state : states) {
    std::vector<Index> order = counted;
    const auto third = order.begin() + static_cast<std::ptrdiff_t>(order.size() / 3);
    std::nth_element(order.begin(), third, order.end(), [&](Index a, Index b) { return std::abs(state.value[a]) > std::abs(state.value[b]); });
    double power = 0, product = 0, size = 0;
    for (auto k = order.begin(); k != third; ++k) power += left[*k] * left[*k] - 1;
    for (const Index k : counted) product += left[k] * state.value[k], size += state.value[k] * state.value[k];
    if (size == 0) continue;
    // The squares of white noise have variance 2; of n/3 in the third and 2n/3 outside, weighted 2/3 and -1/3.
    const StateDependence d{state.name, power / excess, std::sqrt(4 * n / 9) / excess, product / std::sqrt(size * left.squaredNorm())};
    if (!most || d.share > most->share) most = d;
  }
  constexpr double third = 1.0 / 3, deviations = 5;
  if (!most || most->share < third + deviations * most->standard) return {};
  return most;
}

std::string sentence(const StateDependence& d) {
  constexpr double clearly = 0.5;
  const std::string sign = d.follows > clearly ? ", and it goes with it" : d.follows < -clearly ? ", and it goes against it" : "";
  return fmt::format("{:.0f} % of it while the {} is in its largest third{}", 100 * std::min(1.0, d.share), d.state, sign);
}

}  // namespace unrig
