#include "core/effects/process_noise.h"

#include <algorithm>
#include <stdexcept>

#include "core/effects/effect.h"
#include "core/law/law_effect.h"
#include "core/rig/gauge_filter.h"

namespace unrig {

using Eigen::Index;
using Eigen::MatrixXd;

std::optional<DualMatrix> process_noise(const AeroelasticModel& model, const Conditions& conditions, const Eigen::VectorXd& theta, const std::vector<std::string>& channels, const LinearSystem& system) {
  const Rig& rig = model.rig();
  std::vector<const Effect*> at_work;
  bool wanders = false;
  for (const std::string& id : model.effect_ids()) {
    at_work.push_back(&effect(rig, id));
    wanders = wanders || (at_work.back()->noise && at_work.back()->acts(rig, conditions));
  }
  if (!wanders) return std::nullopt;
  // The states of effects stand behind those of the rig in their order, before those of the gauge's own filters.
  Index state = system.states(), parameter = theta.size();
  const auto gauge = std::find(channels.begin(), channels.end(), "gauge");
  if (gauge != channels.end())
    for (const GaugeFilter& filter : rig.gauge_filters) state -= filter.states();
  for (const Effect* e : at_work) {
    parameter -= static_cast<Index>(e->parameters_on(rig).size());
    if (e->acts(rig, conditions) && e->states) state -= e->states(model, conditions);
  }
  std::optional<DualMatrix> all;
  for (const Effect* e : at_work) {
    if (e->acts(rig, conditions)) {
      if (e->noise) {
        const DualMatrix own = e->noise({model, conditions, theta, parameter, gauge == channels.end() ? Index{-1} : gauge - channels.begin(), {}});
        const Index before = all ? all->cols() : 0;
        all = all ? all->grown(system.states(), before + own.cols()) : DualMatrix(MatrixXd::Zero(system.states(), own.cols()), theta.size());
        if (std::find(system.exogenous.begin(), system.exogenous.end(), state) == system.exogenous.end()) throw std::logic_error("the states of the effect " + e->id + " are not where they should be");
        all->set_block(state, before, own);
      }
      if (e->states) state += e->states(model, conditions);
    }
    parameter += static_cast<Index>(e->parameters_on(rig).size());
  }
  return all;
}

}  // namespace unrig
