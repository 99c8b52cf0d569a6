#include "correct/segments/load_in_legs.h"

#include "core/rig/bridge.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

double steady_per_reading(const Rig& rig) { return 1 / reading_of_unit_load(rig, gauge_levers(rig)); }

RigidLoad load_at(const RunResidual& residual, const VectorXd& theta, const VectorXd& c, const std::vector<Index>& at, const RigidLoad::State& from) {
  RigidLoad load = rigid_load(residual.model(), residual.conditions(), theta, residual.motion(), residual.run().dt, c.head(residual.motion().unknowns()), at, from);
  const double steady = steady_per_reading(residual.model().rig()) * c[residual.first_offset()];  // the gauge comes first among the channels
  load.circulatory.array() += steady;
  load.normal_force.array() += steady;
  return load;
}

std::pair<VectorXd, VectorXd> loads_at(const RunInLegs& legs, const VectorXd& theta, const std::vector<VectorXd>& c) {
  const Index n = legs.samples(legs.size() - 1).last;
  VectorXd circulatory(n), normal_force(n);
  RigidLoad::State from;
  for (std::size_t p = 0; p < legs.size(); ++p) {
    const RigidLoad load = load_at(legs.residual(p), theta, c[p], {0}, from);
    circulatory.segment(legs.samples(p).first, legs.samples(p).length()) = load.circulatory;
    normal_force.segment(legs.samples(p).first, legs.samples(p).length()) = load.normal_force;
    from = load.behind;
  }
  return {circulatory, normal_force};
}

}  // namespace unrig
