#include "core/propagate/static_state.h"

#include <Eigen/LU>
#include <numeric>
#include <vector>

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd static_state(const LinearSystem& system, const VectorXd& drive) {
  std::vector<Index> at_rest(static_cast<std::size_t>(system.free_states()));
  std::iota(at_rest.begin(), at_rest.end(), Index{0});
  at_rest.insert(at_rest.end(), system.settling.begin(), system.settling.end());
  VectorXd state = VectorXd::Zero(system.states());
  state(at_rest) = -MatrixXd(system.A.value(at_rest, at_rest)).partialPivLu().solve(VectorXd(drive(at_rest)));
  return state;
}

}  // namespace unrig
