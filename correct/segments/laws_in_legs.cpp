#include "correct/segments/laws_in_legs.h"

#include <fmt/format.h>

#include "core/law/law_effect.h"
#include "fit/likelihood/law_reach.h"

namespace unrig {

void refuse_beyond_learnt(const RunInLegs& legs, const Eigen::VectorXd& theta, bool go_on, std::vector<std::string>& warnings) {
  const RunResidual& whole = legs.residual(0);
  if (legs.size() > 1) return warn_of_laws_unheeded(whole.model(), whole.run(), warnings);
  refuse_beyond(beyond_learnt(seen_by_laws(whole, theta, Sights::learnt), whole.run()), whole.run().file, go_on, warnings);
}

void warn_of_laws_unheeded(const AeroelasticModel& model, const Run& run, std::vector<std::string>& warnings) {
  for (const std::string& id : model.effect_ids())
    if (is_law_id(id) && !law_of(effect(model.rig(), id)).learnt_on.empty())
      warnings.push_back(fmt::format("{}: the run is followed in parts or without a rest; whether it takes the law \"{}\" beyond where that was learnt was not looked at.", run.file, law_of(effect(model.rig(), id)).name));
}

}  // namespace unrig
