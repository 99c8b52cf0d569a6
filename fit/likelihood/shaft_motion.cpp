#include "fit/likelihood/shaft_motion.h"

#include <algorithm>

#include "fit/fit.h"
#include "fit/likelihood/motion_prior.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

using Eigen::Index;
using Eigen::VectorXd;

std::optional<ShaftMotion> shaft_motion(const Rig& rig, const Run& run) {
  const std::vector<MotionBasis::Window> windows = motion_windows(run);
  if (windows.empty() || windows.front().stride > 1) return std::nullopt;
  const VectorXd measured = run.channel("alpha").value;
  double scatter = 0;  // at rest
  for (const MotionBasis::Phase& phase : MotionBasis(run.samples(), windows).phases())
    if (!phase.moving && phase.samples.length() > 0)
      scatter = std::max(scatter, (measured.segment(phase.samples.first, phase.samples.length()).array() - measured[phase.samples.first]).abs().maxCoeff());
  if (!(scatter > 0)) return std::nullopt;

  Run angle_alone = run;
  if (!run.find("gauge")) angle_alone.channels.push_back({"gauge", "N", "N", 1, measured});
  const AeroelasticModel model = model_of(rig, {angle_alone}, Wagner::within_1e4, {});
  const VectorXd theta = model.start_values();
  RunResidual residual(model, angle_alone, windows);
  constexpr double unheard = 1e6;  // what the gauge read has no say
  residual.temper(unheard);
  residual.reject_spikes(theta);
  residual.set_motion_prior(motion_prior(residual, theta));
  const RunResidual::Prediction said = residual.predict(theta);
  return ShaftMotion{said.motion.angle.array() + said.angle_offset[0], residual.angle_sigma()};
}

}  // namespace unrig
