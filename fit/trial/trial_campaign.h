#pragma once
#include <Eigen/Core>
#include <map>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "core/model/simulate.h"
#include "core/rig/rig.h"
#include "core/run/run.h"
#include "fit/trial/laboratory.h"
#include "fit/trial/trial_plan.h"

namespace unrig {

/// A campaign that was never recorded, with effects hidden in it.
struct TrialCampaign {
  Rig rig;                         ///< what a diagnosis is given: the rig file's values, not the truth
  std::vector<Run> runs;           ///< likewise
  std::vector<std::string> hidden;
  std::vector<double> parameters;  ///< of the hidden effects, one after the other
  double size = 0;                 ///< what they change: the largest r.m.s. of a channel in a run, over its noise
  std::vector<double> sizes;       ///< the same of each beside the bare rig, in the order of `hidden`
  std::map<std::string, double> truth;  ///< parameters of the rig and of what is hidden, but for those of single runs
};

/// Simulates these runs with the effects at work, those of the table and laws of the rig. Stiffness, damping and apparent mass are drawn around the rig file's, the effects' sizes as each
/// of them says (Effect::draw), or where they start; the laboratory adds its noise, misread numbers and walking phases. Sensors of the rig are recorded too, with a noise as small beside their reading as the gauge's. The truth has every normal mode, circulation within 1e-6 and a quarter of the recorded step. `rig` has all its modes, unless `higher-mode` is hidden: then it has one.
///
/// `truth`: parameters of the rig that were drawn already.
///
/// Throws InputError where the rig has no section, gauge or calibration element.
TrialCampaign draw_campaign(const Rig& rig, const std::vector<std::string>& hidden, const std::vector<PlannedRun>& runs, const Laboratory& laboratory, std::mt19937_64& random, const std::optional<Eigen::VectorXd>& truth = {});

/// Every mode that half the simulated sampling rate lets through, in the densest fluid, circulation within 1e-6.
AeroelasticModel whole_model(const Rig& rig, const std::vector<PlannedRun>& runs);
/// Parameters of such a model, drawn around the rig file's.
Eigen::VectorXd draw_rig(const AeroelasticModel& model, std::mt19937_64& random);
/// What drives the same rig in one run, with and without what is hidden.
SimulateProblem problem_of(const AeroelasticModel& model, const Eigen::VectorXd& theta, const PlannedRun& planned);

/// Throws as draw_campaign would.
void check_for_trials(const Rig& rig);

}  // namespace unrig
