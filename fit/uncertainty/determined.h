#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

namespace unrig {

class JointProblem;
struct HeldInfluence;

/// A combination of unknowns that the runs determine, although they do not determine each by itself: x + sum of factor y, or x times powers y^factor.
struct DeterminedCombination {
  std::string combination;  ///< "modal[1].stiffness / modal[1].mass"
  double value = 0;
  double std_error = 0;
  std::vector<std::size_t> unknowns;  ///< first x, the one that follows, then the y
  std::vector<double> factor;         ///< of the y, or their exponents
  bool product = false;
  std::string settled_by;             ///< the recording that would tell them apart

  /// At other values of `unknowns`.
  double at(const std::vector<double>& values) const;
};

/// Of every unknown that a held one can shift by more than three of its own standard errors. `covariance`: of all unknowns with what is held held (zero for those).
///
/// A combination must hold where the held ones are off. The valley of chi-square is followed by refits with each held one at 0.8 and 1.25 of its value (damping ratios at half
/// and twice), and of three forms the one that changes least along it is given: powers of the held ones; a sum with the valley's mean slope; the power of another unknown
/// that follows the same held ones, x / y^e, with a simple exponent. What it still changes is added to its standard error (root sum of squares).
std::vector<DeterminedCombination> determined_combinations(const JointProblem& joint, const HeldInfluence& influence, const Eigen::MatrixXd& covariance);

}  // namespace unrig
