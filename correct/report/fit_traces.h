#pragma once
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "correct/report/report_page.h"
#include "fit/fit_files.h"

namespace unrig {

/// Say so on the page and to the user where rig or recording are not those that were fitted, or have changed since: `result` is drawn beside them all the same. False where the rig
/// has another structure, in which the fit's parameters have no meaning.
bool can_be_drawn(ReportPage& page, const FittedRig& fit, const Rig& rig, const std::string& result);
void warn_of_another(ReportPage& page, const FittedRig& fit, const Rig& rig, const Run& run, const std::string& result);

/// What a fit makes of a run: rig, run and model with the fit's numbers.
struct FittedModel {
  Rig rig;
  Run run;
  AeroelasticModel model;  ///< with the fit's effects
  Eigen::VectorXd theta;
};
FittedModel fitted_model(const Rig& rig, const FittedRig& fit, const Run& run);

/// Frequencies [Hz] of the fitted rig's modes in the run's fluid and stream, ascending, up to half the sampling rate: without effects, and without what is damped by half of the critical damping or more.
std::vector<double> modes_of(const FittedModel& fitted);

/// A fitted channel of a run: what was recorded and what the model says, in SI.
struct FitTrace {
  std::string name, unit;
  Eigen::VectorXd measured;  ///< NaN where missing
  Eigen::VectorXd model;
  double noise = 0;
};

/// The fitted channels of `run`, then `alpha` where the motion is estimated: the model of `fit`, its parameters held, with motion, initial state and
/// offsets estimated from the run again. fit.json holds no traces: the record determines them, and they would make it as long as the recordings.
std::vector<FitTrace> fit_traces(const Rig& rig, const FittedRig& fit, const Run& run);

}  // namespace unrig
