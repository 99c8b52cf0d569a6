#pragma once
#include <functional>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "fit/fit.h"

namespace unrig::studies {

/// Kinds of rigs that the studies draw campaigns of.
enum class RigKind {
  tow_tank,  ///< the sample campaigns' beam of 17 elements, plucked in air and water, pitched in a stream
  cantilever,  ///< a stout uniform beam of 8 elements in a faster stream
  oscillator,  ///< one mode, plucked, and driven by a measured force
  two_modes,   ///< two modes that one gauge sees, likewise
  one_mode_cantilever  ///< the cantilever with one mode of each kind, in the model and in truth
};

/// Noise of both channels.
enum class NoiseColour {
  white,
  coloured  ///< a first-order autoregression, corner 2 to 25 Hz, plus white noise of half its power: what amplifiers and rooms leave
};

struct CampaignRecipe {
  RigKind rig = RigKind::tow_tank;
  NoiseColour noise = NoiseColour::white;
  std::vector<std::string> runs;  ///< dry_pluck, wet_pluck, step_a, step_b of a beam; pluck, forced_a, forced_b of modes
  std::string name() const;
};

/// Every kind of rig with several subsets of its runs.
std::vector<CampaignRecipe> all_recipes();

struct SimulatedCampaign {
  FitProblem problem;                   ///< the rig file's start values, not the truth
  std::map<std::string, double> truth;  ///< by parameter, per-run ones as "normal_force_slope step_a.csv"
  double of(const FittedParameter& p) const;
};

/// A combination that a fit calls determined, at the truth.
double combination_at(const std::function<double(const FittedParameter&)>& truth, const DeterminedCombination& combination, const FitResult& result);

/// A campaign with its truth drawn at random: stiffness and apparent mass within a fifth of the rig file's, damping within a factor of two,
/// a gauge of 40 to 60 dB. The motion of the shaft is a smooth function of time, and the rig answers to it at a quarter of the fitted step, so
/// that the fit's spline is an approximation as it is with a real shaft.
SimulatedCampaign simulate_campaign(const CampaignRecipe& recipe, unsigned seed);

Rig rig_of(RigKind kind);

}  // namespace unrig::studies
