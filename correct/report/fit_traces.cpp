#include "correct/report/fit_traces.h"

#include <fmt/format.h>

#include "core/command.h"
#include "core/wagner.h"
#include "fit/run_residual.h"

namespace unrig {

void warn_of_another(ReportPage& page, const FittedRig& fit, const Run& run, const std::string& result) {
  if (!fit.had_other_readings(run)) return;
  const std::string text = fmt::format("The recording \"{}\" has other readings or conditions than the one that was fitted; its plots show what the fit makes of these. Fit it again, or say with --data where the old one is.", run.file);
  warn(result + ": " + text);
  page.add_text("Warning: " + text);
}

std::vector<FitTrace> fit_traces(const Rig& rig, const FittedRig& fit, const Run& run) {
  const Basis basis = rig.is_modal()          ? Basis{}
                      : fit.normal_modes > 0  ? make_basis(rig, fit.normal_modes, fit.torsion_modes)
                                              : make_basis(rig, 0.5 / run.dt, run.density);
  AeroelasticModel model(with_laws(rig, fit), basis, wagner(fit.circulation));
  if (!fit.effects.empty()) model = model.with_effects(fit.effects);
  const Eigen::VectorXd theta = theta_for(model, fit, run.file, conditions_of(run).onset_angle);
  RunResidual residual(model, run, motion_windows(run));
  residual.settle_noise(theta);
  residual.reject_spikes(theta);
  const RunResidual::Prediction p = residual.predict(theta);

  std::vector<FitTrace> traces;
  for (std::size_t c = 0; c < p.channels.size(); ++c) {
    const Channel& channel = run.channel(p.channels[c]);
    traces.push_back({channel.name, channel.unit, channel.value, p.output.col(static_cast<Eigen::Index>(c)), residual.sigma(c)});
  }
  if (p.motion.angle.size() > 0) {
    const Channel& alpha = run.channel("alpha");
    traces.push_back({alpha.name, alpha.unit, alpha.value, p.motion.angle.array() + p.angle_offset[0], residual.angle_sigma()});
  }
  return traces;
}

}  // namespace unrig
