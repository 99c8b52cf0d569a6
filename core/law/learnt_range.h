#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "core/law/law.h"
#include "core/model/aeroelastic_model.h"
#include "core/run/run.h"

namespace unrig {

/// A symbol that a law looks at in a run, at one of the places where the law acts.
struct Sight {
  const Law* law;  ///< of the model's rig
  Symbol symbol;
  double at_rest;         ///< SI
  Eigen::VectorXd value;  ///< SI, one per sample
};

/// All symbols of all laws at work, or only those of which a law says where it was learnt. The memory is none of them: it is where the others take it.
enum class Sights { all, learnt };

/// Appends to the outputs of `system`, that of `model` under these conditions, what the laws look at: of a symbol with the row r over the states C = r and D = 0, of an acceleration
/// C = r A and D = r B. Returns what the further outputs are, in their order.
std::vector<Sight> append_sights(LinearSystem& system, const AeroelasticModel& model, const Conditions& conditions, Sights which);

/// The values, from these further outputs: samples x sights, of samples `dt` [s] apart.
void take_values(std::vector<Sight>& sights, const Eigen::MatrixXd& output, double dt);

/// Widens `known`, by the laws' ids, to all values that the sights have.
void widen(std::map<std::string, LearntOn>& known, const std::vector<Sight>& sights);

/// The same range a little wider, its ends in four digits.
Range rounded_outward(const Range& range);

/// Which symbol of which law goes beyond where the law was learnt, how far, and where in the run first: a sentence each, empty where none does.
///
/// Let pass is 5 % of the width of the range (of its largest absolute value where that is more) at either end. An error of a law within d on its range is there within 2 d where it is a polynomial
/// of third degree: d T_3(1.1) = 2.02 d, T_3 the Chebyshev polynomial, which of all grows fastest (T. J. Rivlin, Chebyshev Polynomials (1990), section 2.7). It is more than noise moves the ends of a range by.
std::vector<std::string> beyond_learnt(const std::vector<Sight>& sights, const Run& run);

/// Throws NoAnswer where something is `beyond`; with `go_on` it is added to the warnings instead.
void refuse_beyond(const std::vector<std::string>& beyond, const std::string& file, bool go_on, std::vector<std::string>& warnings);

/// Of the option --beyond.
constexpr const char* beyond_help = "go on where a law is taken beyond the range that it was learnt on, where it is a guess";

/// "v is from -0.3 to 0.28 m/s".
std::string told(Symbol symbol, const Range& range);

}  // namespace unrig
