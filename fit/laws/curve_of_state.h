#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "fit/fit.h"
#include "fit/laws/dictionary.h"
#include "fit/search/effect_search.h"

namespace unrig {

/// Columns of a regression, and what they leave.
struct SelectedColumns {
  std::vector<Eigen::Index> columns;
  Eigen::VectorXd coefficient;  ///< of least squares on these, in their order
  double left = 0;              ///< sum of squares
};
/// Forward, each time the column that takes most of the sum of squares, and backward, what that made worth less than its `price`; at most `most`. `products`: [columns | readings]' [columns | readings].
SelectedColumns select_columns(const Eigen::MatrixXd& products, double price, std::size_t most);

/// What no formula fits: a surface over displacement and velocity of the first normal mode, the sum of as many terms as the evidence asks for.
struct CurveOfState {
  Form form;                   ///< starts where the regression on the decays has it
  double evidence = 0;         ///< twice the log likelihood of the decays beyond that without a law, less the price of its terms
  BesideUnknownForces beside;  ///< the states along which it was found
};

/// -f = sum of c_i g_i(x) h_i(v), at most twelve terms. g: powers, absolute values, and truncated powers max(0, x - s) and its cube, even, odd and on one side; h: powers, truncated ones by themselves, and tanh(v / s) for friction; over x and v in
/// units of what the runs reach. Terms are added one at a time, and taken away again, by what they are worth in the regression on the decays (law_regression.h); each costs the extended BIC, ln(samples) +
/// 2 ln(terms to choose from). With the sum at work the decays ask for other states, and along these for other terms: four times, or until the terms are the same. The sum with the most evidence is told.
///
/// `beside`: what the decays ask for without it. Empty where the first sum has not the evidence `least`, where the
/// last one explains the decays along the states that go with the one before, with a hundredth of the unknown force beside it, worse than such a force does alone, of a rig that the decays do not move, and where `base` has one.
/// Source: J. H. Friedman, Annals of Statistics 19 (1991) 1 (products of truncated powers, forward and backward); J. Chen and Z. Chen, Biometrika 95 (2008) 759 (with gamma = 1).
std::optional<CurveOfState> curve_of_state(const FitProblem& problem, const Trial& base, const BesideUnknownForces& beside, double least);

}  // namespace unrig
