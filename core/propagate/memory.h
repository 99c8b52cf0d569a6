#pragma once
#include "core/model/aeroelastic_model.h"

namespace unrig {

/// The memory that law `i` of a system is the rate of (append_memory in core/effects/effect.h): a state that nothing else drives. -1 where the law is a force.
inline Eigen::Index memory_of(const LinearSystem& system, Eigen::Index i) {
  const Eigen::VectorXd drives = system.B.value.col(system.B.cols() - static_cast<Eigen::Index>(system.feedback.size()) + i);
  Eigen::Index memory = 0;
  drives.cwiseAbs().maxCoeff(&memory);
  return drives == Eigen::VectorXd::Unit(system.states(), memory) && system.A.value.row(memory).isZero(0) ? memory : -1;
}

}  // namespace unrig
