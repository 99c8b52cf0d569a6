#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "fit/search/arrival.h"
#include "fit/fit.h"
#include "fit/givens/stated_numbers.h"
#include "fit/givens/inexact_uncertainty.h"

namespace unrig {

/// A fit of parameters theta and stated numbers g together: least of
///
///   chi-square(theta, g) + sum over numbers ((g - stated) / std)^2,
///
/// the numbers by way of their independent deviations z (fit/givens/stated_numbers.h). Gauss-Newton steps in both, the rig made anew at each g and theta fitted to it, until the next step is shorter
/// than 0.05 of its own standard deviations, or than a third and of no use.
class InexactRig {
 public:
  /// `stated` must outlive this. The numbers begin as they are stated or, where `off` is not empty, as many standard deviations off.
  explicit InexactRig(const FitProblem& stated, Eigen::VectorXd off = {});

  /// How far chi-square + z^T z would fall by one step in parameters and deviations from a fit at the present numbers, were both linear.
  double promises(const Arrival& arrival);
  /// The fit at the numbers that this step leads to, theta at its best there. This object stays where it is; it keeps the runs.
  Arrival after_the_promised_step(const Arrival& arrival);
  /// From a fit at the present numbers to the best of both. The runs of `arrival` are this object's from then on. It ends, too, where a step promises
  /// less than `worth` of what is left above the noise.
  void search(Arrival& arrival, double worth = 0);

  /// Rig, runs and numbers as they stand at the end of a search; errors of the numbers as stated.
  Rig rig() const { return numbers_.rig_at(z_); }
  std::vector<Run> runs() const;
  std::vector<FittedGiven> numbers() const;
  const StatedNumbers& stated_numbers() const { return numbers_; }
  const Eigen::VectorXd& deviations() const { return z_; }
  /// What the deviations z cost in twice the logarithm of the evidence at the end of a search, by Laplace's approximation: z^T z + ln det(I + K), K what the runs say of z with the parameters eliminated
  /// (D. J. C. MacKay, Neural Computation 4 (1992) 415).
  double cost_of_deviations(const Arrival& arrival) const;

  /// Covariance of the unknowns, numbers included, at the end of a search.
  InexactUncertainty uncertainty(const Arrival& arrival) const { return inexact_uncertainty(arrival.joint, &*slopes_); }
  /// The numbers as they came out, their covariance with the parameters as `result` has them, and warnings of those that are pulled far.
  void describe(const JointProblem& joint, const InexactUncertainty& uncertainty, FitResult& result) const;

 private:
  struct Step {
    Eigen::VectorXd unknowns, deviations;
    double length = 0;    ///< in its own standard deviations
  };
  Step next_step(const Arrival& arrival) const;
  struct Candidate {
    Eigen::VectorXd z;
    std::shared_ptr<const FitProblem> problem;  ///< whose runs the arrival looks at
    Arrival arrival;
    double cost() const { return arrival.joint.chi2() + z.squaredNorm(); }
  };
  Candidate moved(const Arrival& from, const Step& step, double part) const;

  const FitProblem* stated_;
  StatedNumbers numbers_;
  Eigen::VectorXd z_;
  std::shared_ptr<const FitProblem> problem_;  ///< at z_; none before the first step
  std::shared_ptr<const FitProblem> one_step_;  ///< behind after_the_promised_step
  std::optional<NumberSlopes> slopes_;
};

}  // namespace unrig
