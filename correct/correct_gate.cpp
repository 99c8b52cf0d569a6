#include "correct/correct_gate.h"

#include "core/check/gate.h"

namespace unrig {

void pass_the_gate(const CorrectProblem& problem, bool anyway) {
  if (!other_rig(problem.rig, problem.fit).empty()) return;
  Rig rig = problem.rig;
  for (const auto& [name, chain] : {std::pair{"normal.stiffness_scale", &rig.normal}, std::pair{"torsion.stiffness_scale", &rig.torsion}})
    if (const FittedParameter* scale = problem.fit.find(name, problem.run.file); scale && scale->value > 0) chain->flexibility /= scale->value;
  pass_the_gate(rig, {problem.run}, anyway);
}

}  // namespace unrig
