#include "correct/report/fit_traces.h"

#include <algorithm>
#include <complex>
#include <numbers>

#include <fmt/format.h>

#include "core/files/command.h"
#include "core/model/wagner.h"
#include "fit/givens/fitted_numbers.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {

bool can_be_drawn(ReportPage& page, const FittedRig& fit, const Rig& rig, const std::string& result) {
  const std::vector<std::string> parts = fit.rig_differs_in(rig);
  if (parts.empty()) return true;
  const bool can = std::find(parts.begin(), parts.end(), "structure") == parts.end();
  const std::string text = fmt::format("The rig \"{}\" has {}; {}. Fit it again, or say with --data where the old one is.", rig.file, other_rig(rig, fit), can ? "the plots show what the fit makes of it" : "its plots are left out");
  warn(result + ": " + text);
  page.add_text("Warning: " + text);
  return can;
}

void warn_of_another(ReportPage& page, const FittedRig& fit, const Rig& rig, const Run& run, const std::string& result) {
  if (!fit.had_other_readings(run, rig)) return;
  const std::string text = fmt::format("The recording \"{}\" has other readings or conditions than the one that was fitted; its plots show what the fit makes of these. Fit it again, or say with --data where the old one is.", run.file);
  warn(result + ": " + text);
  page.add_text("Warning: " + text);
}

FittedModel fitted_model(const Rig& stated_rig, const FittedRig& fit, const Run& stated_run) {
  const FittedNumbers numbers(fit, stated_rig, stated_run);
  const Rig rig = numbers.rig();
  const Run run = numbers.run();
  const Basis basis = fit.normal_modes > 0 ? make_basis(rig, fit.normal_modes, fit.torsion_modes) : make_basis(rig, 0.5 / run.dt, run.density);
  AeroelasticModel model(with_laws(rig, fit), basis, wagner(fit.circulation));
  if (!fit.effects.empty()) model = model.with_effects(fit.effects);
  const Eigen::VectorXd theta = theta_for(model, fit, run.file, conditions_of(run).onset_angle);
  return {rig, run, model, theta};
}

std::vector<double> modes_of(const FittedModel& fitted) {
  constexpr double half_critical = 0.5;
  const AeroelasticModel bare(fitted.model.rig(), fitted.model.basis(), fitted.model.circulation());
  const Conditions all = conditions_of(fitted.run);
  Conditions conditions;
  conditions.density = all.density;
  conditions.speed = all.speed;
  std::vector<double> found;
  for (const std::complex<double> pole : oscillatory_poles(bare.system(conditions, fitted.theta.head(static_cast<Eigen::Index>(bare.parameters().size())), {}))) {
    const double hertz = pole.imag() / (2 * std::numbers::pi);
    if (-pole.real() < half_critical * std::abs(pole) && hertz < 0.5 / fitted.run.dt) found.push_back(hertz);
  }
  return found;
}

std::vector<FitTrace> fit_traces(const Rig& stated_rig, const FittedRig& fit, const Run& stated_run) {
  const auto [rig, run, model, theta] = fitted_model(stated_rig, fit, stated_run);
  RunResidual residual(model, run, windows_to_fit(run));
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
