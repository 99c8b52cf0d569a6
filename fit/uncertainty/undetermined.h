#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "fit/likelihood/joint_problem.h"
#include "fit/uncertainty/uncertainty.h"

namespace unrig {

/// What recordings cannot say: which unknowns of a joint fit are held, what the others owe to them; which combinations are determined: fit/uncertainty/determined.h.

/// Unknowns that no run responds to, or only through a combination of others, are held where they are. Of a degenerate set the masses go first:
/// a free decay fixes stiffness and damping per mass, and the mass of a structure is what is best known from drawings. False, and nothing held but modes that no run is sampled for, where the model does not stay finite, which
/// tells nothing.
bool hold_undetermined(JointProblem& joint);

/// A damping over the critical one, not in N s/m.
bool is_damping_ratio(const Parameter& parameter);

/// How far an unknown may be off where nothing but the rig file says what it is: half of itself, for a damping ratio 0.2.
double ignorance(const Parameter& parameter, double value);

/// Start values by parameter name, where they are not the model's.
using StartValues = std::map<std::string, double>;
double start_of(const Parameter& parameter, const StartValues& starts);

/// Unknowns that the data hardly touch (an error of half of themselves, of a quarter for a damping ratio) go back to their start value and are held there, so that they cannot bend the others. One at a time, the weakest
/// first: of two that are only determined together, one is enough. Returns whether any was held.
bool hold_weak(JointProblem& joint, const ParameterUncertainty& uncertainty, const StartValues& starts);

/// How a finished fit depends on the values that some unknowns are held at.
struct HeldInfluence {
  std::vector<std::size_t> held;  ///< unknowns that are held although the runs respond to them
  Eigen::MatrixXd slope;          ///< all unknowns x held: d unknown / d held along the least of chi-square; zero for those that are held
  Eigen::MatrixXd shift;          ///< the same times the ignorance of the held one
};
HeldInfluence held_influence(const JointProblem& joint);

/// "normal_force_slope (step_a.csv)", without folders.
std::string short_name(const JointProblem& joint, const Unknown& unknown);

/// What to record to determine an unknown that these runs do not: the parameter's own advice, or what its role asks for beside the runs that there are.
std::string what_to_record(const JointProblem& joint, const Unknown& unknown);

}  // namespace unrig
