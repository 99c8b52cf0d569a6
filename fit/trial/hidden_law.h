#pragma once
#include <Eigen/Core>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/law/law.h"
#include "core/rig/rig.h"
#include "fit/laws/dictionary.h"
#include "fit/trial/trial_plan.h"

namespace unrig {

/// Where the runs of a plan take the rig with no law at work.
struct Reached {
  Reach reach;                            ///< largest absolute values
  std::vector<Eigen::MatrixXd> symbols;   ///< per run: samples x symbols, in SI; z is 0
  std::vector<Eigen::RowVectorXd> rest;   ///< per run: the symbols before it begins
  double dt = 0;                          ///< s, of all runs
  Eigen::Index strips = 0;
};
/// x, v and a of all modes together, where a law takes the first; alpha without what the rig moves by. The laws in which that matters are drawn by a size that is off by as much.
/// `truth`: parameters of the rig (draw_rig); none: as its file has it.
Reached reached_by(const Rig& rig, const std::vector<PlannedRun>& runs, const std::optional<Eigen::VectorXd>& truth = {});

/// What a trial hides in turn: the dictionary that a diagnosis searches, or laws that no line of it can say (`outside`); of both those whose symbols these runs move. Parameters stand at no values yet.
std::vector<Law> laws_to_hide(const Rig& rig, const Reached& reached, bool outside);

/// The law with its parameters drawn, as start values, evenly in the logarithm:
///
/// | parameter | from | to | of |
/// | --- | --- | --- | --- |
/// | size | 0.02 | 0.3 | largest force of the law over what holds the rig where the runs reach farthest (Reach::force, ::moment) |
/// | exponent | 0.5 | 4 | 1 |
/// | corner | 0.2 | 1 | what the runs reach |
/// | time | 0.02 | 0.2 | the longest run |
///
/// Exceptions stand in one table of hidden_law.cpp. A size may have either sign where the law may; where it would take more than 0.7 of the stiffness at a point that the runs reach it is drawn anew.
Law draw_law(const Law& form, const Reached& reached, std::mt19937_64& random);

/// The largest force, or moment, of the law where the runs take the rig; of a law on strips that of all of them together. A memory is followed by Euler's method.
double largest_force(const Law& law, const Reached& reached);

}  // namespace unrig
