#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

namespace unrig {

/// The change of a run's linear system (core/model/aeroelastic_model.h) per unit of one error.
struct SystemSlope {
  Eigen::MatrixXd A, B, C, D;
};

/// How the system of one run moves with errors of the numbers of rig file and head, each in units of its standard deviation, about some values of the model's parameters.
struct DeviationSlopes {
  bool whole = false;                                          ///< of the whole system with the run's own inputs, and of none with others; otherwise of the rig alone, over all ports, before effects and what lies behind the bridge
  std::vector<std::string> outputs;                            ///< whose rows C and D have
  std::map<Eigen::Index, std::vector<SystemSlope>> by_states;  ///< of the systems with so many states, which each basis has its own of: one for each error
};

}  // namespace unrig
