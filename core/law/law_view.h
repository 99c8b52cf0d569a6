#pragma once
#include <Eigen/Core>
#include <array>

#include "core/law/expression.h"
#include "core/model/aeroelastic_model.h"

namespace unrig {

/// What the symbols of a law are at one place, in SI: what they are at rest where the run begins, and the rows over the states that add to it; empty where they stay. The row of a is over the
/// states' rates. Time and memory are states that the law itself brings (law_effect.cpp): they have no row here.
struct LawView {
  using Symbols = std::array<double, symbol_count>;
  Symbols at_rest{};
  std::array<Eigen::RowVectorXd, symbol_count> row;
  Eigen::RowVectorXd moves;  ///< over the coordinates: by how much they move the place
};

/// `strip`: the place is that strip; -1: the element that the dead weights hung at, or the first mode of a rig of modes.
LawView law_view(const AeroelasticModel& model, const LinearSystem& system, const Conditions& conditions, Eigen::Index strip);

/// Twist of the outermost strip in the first torsional mode, over the coordinates [rad per unit]; zero where the model has no such mode.
Eigen::RowVectorXd section_twist(const AeroelasticModel& model, Eigen::Index coordinates);

}  // namespace unrig
