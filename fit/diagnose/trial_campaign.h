#pragma once
#include <random>
#include <string>
#include <vector>

#include "core/rig.h"
#include "core/run.h"

namespace unrig {

/// A campaign that was never recorded, with effects hidden in it.
struct TrialCampaign {
  Rig rig;                         ///< what a diagnosis is given: the rig file's values, not the truth
  std::vector<Run> runs;
  std::vector<std::string> hidden;
  std::vector<double> parameters;  ///< of the hidden effects, one after the other
  double size = 0;                 ///< what they change in the gauge: the largest r.m.s. of a run, over the noise
  std::vector<double> sizes;       ///< the same of each beside the bare rig, in the order of `hidden`
};

/// Draws one: a pluck in air, one in water, and three steps at two speeds from 2, 4 and 25 degrees. Stiffness, damping, apparent mass and lift slopes are drawn around
/// the rig file's, the effects' sizes at random over the ranges of trial_campaign.cpp. The truth has every normal mode, circulation within 1e-6 and a quarter of
/// the recorded step of 2 ms. `noise` [N] is the gauge's; the angle's is 0.01 degrees. `rig` has all its modes, unless `higher-mode` is hidden: then it has one.
///
/// Throws InputError where the rig has no section, gauge or calibration element.
TrialCampaign draw_campaign(const Rig& rig, const std::vector<std::string>& hidden, double noise, std::mt19937_64& random);

/// Throws as draw_campaign would.
void check_for_trials(const Rig& rig);

/// Every n-th sample.
Run every_nth(const Run& fine, Eigen::Index n);

/// From 0 to 1 in 0 <= x <= 1 with three derivatives at rest at either end.
double smooth_ramp(double x);

}  // namespace unrig
