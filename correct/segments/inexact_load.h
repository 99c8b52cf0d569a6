#pragma once
#include <Eigen/Core>

#include "correct/correct.h"
#include "correct/estimate/prior.h"
#include "correct/segments/run_in_legs.h"
#include "fit/givens/fitted_numbers.h"

namespace unrig {

/// A correction that is done, as far as what follows needs it.
struct FinishedCorrection {
  RunInLegs& legs;
  const AeroelasticModel& model;
  const Search& best;
  const FittedNumbers& numbers;
  Eigen::VectorXd semichords;  ///< of the indicial response
};

/// Widens the bands of load, response and slope by what the stated numbers leave uncertain: along each direction of theirs (fit/givens/fitted_numbers.h), the parameters of the rig going with them, rig and run
/// are made anew and the free parameters found again by one Gauss-Newton step. It counts as the rig's part.
///
/// Differences over a hundredth of a standard deviation: the answer bends by less than a hundredth of itself, and rounding is far below. The factors of simultaneous bands stay those without it.
void add_numbers(const FinishedCorrection& done, CorrectResult& result);

}  // namespace unrig
