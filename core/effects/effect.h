#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/aeroelastic_model.h"

namespace unrig {

/// What an effect may look at while it changes a system.
struct EffectContext {
  const AeroelasticModel& model;
  const Conditions& conditions;
  const Eigen::VectorXd& theta;
  Eigen::Index first_parameter;  ///< index into theta of the effect's first parameter
  Eigen::Index gauge;            ///< row of the gauge among the outputs, -1 where it is not among them
  Eigen::Index strip_force;      ///< input column that pushes with one newton, spread evenly over the strips, in the direction of the normal force

  double parameter(Eigen::Index k) const { return theta[first_parameter + k]; }
};

/// One candidate for missing physics (formats.md, section 5): what it is, where it can act, and how it changes the linear system of a run.
///
/// To add one: a file in core/effects/ that defines it, and one line in core/effects/table.cpp. Fit and simulation pick it up from there.
struct Effect {
  std::string id;
  std::string summary;   ///< one line
  std::string equation;  ///< as a person would write it
  std::string source;
  std::vector<Parameter> parameters;  ///< names without the id
  /// Values from which a search should start, besides the parameters' own: one vector per start. The linear unknowns (amplitudes) follow by themselves.
  std::vector<Eigen::VectorXd> starts;
  /// Whether it can act at all under these conditions.
  bool (*acts)(const Conditions& conditions);
  void (*apply)(LinearSystem& system, const EffectContext& context);
};

/// All effects, in the order of formats.md.
const std::vector<Effect>& effects();
/// By id; throws std::invalid_argument naming the choices.
const Effect& effect(const std::string& id);

/// Appends an autonomous system z' = F z to the states of `system`: z drives the inputs in `columns` with the rows of `H` (u = H z), and its initial value
/// is unknown in every run. F is k x k, H is columns x k, both with partials over the model's parameters. Returns the index of the first new state.
Eigen::Index append_signal(LinearSystem& system, const DualMatrix& F, const std::vector<Eigen::Index>& columns, const DualMatrix& H);

/// The same for a signal that is simply added to output `row`.
Eigen::Index append_reading(LinearSystem& system, const DualMatrix& F, Eigen::Index row, const DualMatrix& H);

}  // namespace unrig
