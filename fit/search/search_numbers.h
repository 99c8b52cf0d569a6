#pragma once
#include <cstddef>

/// What steers the search for effects and laws: which are tried, which are followed, what counts as found.
/// How a single fit finds its way, what tests a remainder, and when the rig's description is asked for have numbers of their own (decays_first.cpp, arrival.cpp, mismatch.cpp, rig_description.cpp).
/// Where a source or a study is named the number rests on it; the others were set by hand, and the trials (tests/studies/TRIAL.md, LAWS.md) count what they do together.
namespace unrig {

// Evidence.
constexpr double decisive = 10;  ///< BIC: very strong evidence (Kass and Raftery, J. American Statistical Association 90 (1995) 773)

// Residual power over noise power.
constexpr double to_the_noise = 1.02;    ///< of one run: one per cent of it is chance in a few thousand samples
constexpr double explained = 1.15;       ///< of a model that leaves nothing to name
constexpr double twice_the_noise = 2;    ///< of a record that a model can be said to follow: beyond it a step to first order says less
constexpr double nearly_explained = 10;  ///< beyond it no two laws explain a mismatch alike

// Shares of what the best promises, or of what is left.
constexpr double quarter_of_it = 0.25;   ///< what promises less of it is not worth a fit, and a form no look at its other shapes (of which tests/studies/LAWS.md tells)
constexpr double half_of_it = 0.5;       ///< what promises or takes less does not come out ahead among thousands of samples
constexpr double as_much = 0.8;          ///< of it, told by one linear step: signals, which are an order faster, come first
constexpr double hardly_less = 0.9;      ///< what leaves so much is not what is missing
constexpr double enough_to_name = 0.97;  ///< of the excess that effects must remove to be named where something remains

// How many.
constexpr std::size_t most_effects = 3;   ///< of one set
constexpr std::size_t most_refits = 5;    ///< beside one set: effects that are fitted, or forms
constexpr std::size_t most_in_full = 2;   ///< signals that are fitted from first guesses, or for more than a few rounds
constexpr std::size_t few_candidates = 7;  ///< candidates that are all worth a fit
constexpr double far_dearer = 100;        ///< what is followed in small steps, than a further parameter

}  // namespace unrig
