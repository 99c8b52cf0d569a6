#pragma once
#include <Eigen/Core>
#include <vector>

#include "fit/fit.h"
#include "fit/search/arrival.h"

namespace unrig {

/// A rig and its runs, to be searched for what is missing.
struct FilesToFit {
  FitProblem problem;         ///< no number of it states an uncertainty
  std::vector<Run> heldout;
  Eigen::MatrixXd directions; ///< of the errors of the numbers, in standard deviations: one column for each that is a parameter of the model (Rig::deviations)
};

/// The numbers that state an uncertainty as parameters of every model of the rig: linear about `exact`, the fit to the numbers as they are stated (without what of the rig it has led astray: a law that is missing may), and known to what is stated. Of the independent directions of their
/// errors those are parameters that the runs tell better than the files, with the model's own parameters eliminated; what the others do is not seen.
FilesToFit with_numbers_as_parameters(const FitProblem& stated, const std::vector<Run>& heldout, Arrival exact);

/// How many standard deviations each number is off where a fit with such parameters stands.
Eigen::VectorXd deviations_at(const FilesToFit& files, const JointProblem& fit);

}  // namespace unrig
