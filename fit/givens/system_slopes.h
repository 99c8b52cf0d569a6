#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "core/run/deviation_slopes.h"
#include "fit/givens/stated_numbers.h"

namespace unrig {

/// The slopes of a run's system, with those of what only the reading knows.
struct NumberSlope : SystemSlope {
  double unit = 0;   ///< of the logarithm of what a steady load reads
  double gauge = 0;  ///< of the gauge's calibration
};

/// The slopes of one run's system in the deviations of stated numbers, by central differences of its matrices, which depend on the numbers smoothly however long the record is.
class SystemSlopes {
 public:
  /// Of the rig alone, as effects find it, or with the effects of the fit: DeviationSlopes::whole.
  enum class Of { rig, whole };
  /// Of run `run` of `numbers`, off by z, with the parameters that the fit has for its run `like` and the modes of `basis`. Looks at all of them.
  SystemSlopes(Of what, const JointProblem& fit, std::size_t like, const Basis& basis, const StatedNumbers& numbers, const Eigen::VectorXd& z, std::size_t run, const Conditions& conditions, bool reads_a_steady_load);

  Eigen::Index states() const { return system_.states(); }
  const std::vector<std::string>& outputs() const { return channels_; }
  NumberSlope of(Eigen::Index deviation) const;
  /// Of all of them.
  std::vector<NumberSlope> all() const;

 private:
  AeroelasticModel model_of(Rig rig) const;
  void add_difference(Eigen::Index deviation, double step, double weight, NumberSlope& slope) const;

  Of what_;
  const JointProblem& fit_;
  const Basis& basis_;
  const StatedNumbers& numbers_;
  const Eigen::VectorXd& z_;
  std::size_t run_;
  bool reads_a_steady_load_;
  std::vector<std::string> channels_;
  Conditions conditions_;
  Eigen::VectorXd theta_, start_;
  LinearSystem system_;
};

}  // namespace unrig
