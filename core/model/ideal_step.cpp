#include "core/model/ideal_step.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <stdexcept>
#include <vector>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

/// The system without its prescribed pitch, and how angle, rate and acceleration of the pitch enter it.
struct Driven {
  std::vector<Index> states;  // free ones, then those of a filter
  MatrixXd A, C;
  VectorXd angle, rate, acceleration;                       // into the free states
  VectorXd output_angle, output_rate, output_acceleration;  // straight into the outputs
};

Driven driven(const LinearSystem& system) {
  if (system.motion < 0) throw std::invalid_argument("an ideal step needs a system with prescribed pitch");
  const Index p = system.motion;
  std::vector<Index> states;
  for (Index i = 0; i < system.states(); ++i)
    if (i < p || i > p + 2) states.push_back(i);
  const MatrixXd &a = system.A.value, &c = system.C.value;
  const auto enters = [&](Index order) -> VectorXd { return a(states, p + order); };
  return {states, a(states, states), c(Eigen::all, states), enters(0), enters(1), enters(2), c.col(p), c.col(p + 1), c.col(p + 2)};
}

VectorXd value_at(const PoleExpansion& expansion, const VectorXcd& pole, double t) {
  const VectorXcd decay = (pole * t).array().exp();
  return expansion.steady + (expansion.residue * decay).real();
}

}  // namespace

VectorXd IdealStep::output_at(double t) const { return value_at(output, pole, t); }
VectorXd IdealStep::state_at(double t) const { return value_at(state, pole, t); }

VectorXd step_jump(const LinearSystem& system) {
  const Driven d = driven(system);
  VectorXd jump = VectorXd::Zero(system.states());
  jump(d.states) = d.rate + d.A * d.acceleration;
  jump[system.motion] = 1;
  return jump;
}

IdealStep ideal_step(const LinearSystem& system, double amplitude) {
  const Driven d = driven(system);
  const Index n = d.A.rows();
  IdealStep step;
  step.start = amplitude * (d.rate + d.A * d.acceleration);

  // x' = A x + A_p: x = steady + exp(A t) (start - steady), expanded in the eigenvectors of A.
  const VectorXd steady = -amplitude * d.A.partialPivLu().solve(d.angle);
  const Eigen::EigenSolver<MatrixXd> eigen(d.A);
  const MatrixXcd vectors = eigen.eigenvectors();
  const Eigen::PartialPivLU<MatrixXcd> basis(vectors);
  // A matrix without a full set of eigenvectors gives columns that are parallel to about the root of round-off.
  if (n > 0 && basis.rcond() < 1e-13) throw std::invalid_argument("the system's eigenvectors do not span its states");
  const VectorXcd share = basis.solve((step.start - steady).cast<std::complex<double>>());

  step.pole = eigen.eigenvalues();
  step.state = {steady, vectors * share.asDiagonal(), amplitude * d.acceleration, VectorXd::Zero(n)};
  // y = C x + C_p p + C_r p' + C_a p''
  step.output = {d.C * steady + amplitude * d.output_angle, d.C * step.state.residue, amplitude * (d.C * d.acceleration + d.output_rate),
                 amplitude * d.output_acceleration};
  return step;
}

}  // namespace unrig
