// From how far away does a fit arrive? Simulates campaigns, hands the fit a rig file whose stiffness is wrong by a factor, and damping that is wrong by
// another, and counts how often it finds the truth, says that it has not, or, worst of all, is wrong without saying so.
// Exit status 1 where a fit is wrong in silence, or where less than 95 % arrive from a factor of 2 in stiffness and 10 in damping.

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>

#include "tests/studies/campaign_maker.h"
#include "tests/studies/crew.h"
#include "tests/studies/outcome.h"

namespace unrig::studies {
namespace {

/// The same recordings with a rig file that is wrong: `stiffness` and `damping` are the factors by which the rig file is above the truth.
void falsify(SimulatedCampaign& campaign, double stiffness, double damping) {
  Rig& rig = campaign.problem.rig;
  const auto off = [&](const std::string& name) { return campaign.truth.at(name); };
  if (rig.is_modal()) {
    for (std::size_t i = 0; i < rig.modal.size(); ++i) {
      const std::string prefix = fmt::format("modal[{}].", i + 1);
      const double k = off(prefix + "stiffness"), c = off(prefix + "damping"), m = rig.modal[i].mass;
      rig.modal[i].frequency = std::sqrt(stiffness * k / m) / (2 * std::numbers::pi);
      rig.modal[i].damping_ratio = damping * c / (2 * std::sqrt(stiffness * k * m));
    }
    return;
  }
  for (const auto& [name, chain] : {std::pair{"normal", &rig.normal}, {"torsion", &rig.torsion}}) {
    double& scale = campaign.truth.at(std::string(name) + ".stiffness_scale");
    chain->flexibility /= stiffness * scale;
    scale = 1 / stiffness;
    campaign.problem.start[std::string(name) + ".damping_ratio"] = std::min(0.5, damping * off(std::string(name) + ".damping_ratio"));
  }
}

Outcome judge(const SimulatedCampaign& campaign, const FitResult& result) {
  constexpr double far = 5;  // standard errors, of a dozen parameters: chance does not go there
  bool good = result.converged, any = false;
  for (const FittedParameter& p : result.parameters) {
    if (!p.identified) continue;
    any = true;
    good &= std::abs(p.value - campaign.of(p)) < far * p.std_error;
  }
  if (good && any) return Outcome::arrived;
  return raises_no_doubt(result) ? Outcome::silent : Outcome::said_so;
}

int study(int argc, char** argv) {
  CLI::App app{"Counts how often a fit arrives from a rig file that is wrong.", "basin_study"};
  int campaigns = 5, threads = 1;
  unsigned seed = 1;
  bool short_form = false, verbose = false;
  std::string only;
  app.add_option("--campaigns", campaigns, "of each rig, per pair of factors")->capture_default_str();
  app.add_option("--seed", seed, "of the first campaign; the others follow")->capture_default_str();
  app.add_option("--threads", threads, "how many fits at a time")->capture_default_str();
  app.add_option("--only", only, "rigs with this in their name");
  app.add_flag("--short", short_form, "only the corners: a factor 2 in stiffness, 10 in damping");
  app.add_flag("--verbose", verbose, "print every fit that does not arrive");
  CLI11_PARSE(app, argc, argv);

  std::vector<CampaignRecipe> recipes;
  for (const CampaignRecipe& r : all_recipes())  // everything that was recorded, white noise
    if (r.noise == studies::NoiseColour::white && (r.runs.size() == 4 || (r.runs.size() == 2 && r.runs[0] == "pluck")) && r.name().find(only) != std::string::npos) recipes.push_back(r);
  std::vector<double> stiffness{0.4, 0.5, 0.63, 0.8, 1, 1.25, 1.6, 2, 2.5}, damping{0.1, 0.3, 1, 3, 10};
  if (short_form) stiffness = {0.5, 2}, damping = {0.1, 10};

  std::map<std::pair<double, double>, OutcomeCount> counts;
  std::map<std::string, OutcomeCount> by_rig;
  std::mutex counting;
  const int cells = static_cast<int>(stiffness.size() * damping.size() * recipes.size());
  each(cells * campaigns, threads, [&](int i) {
    const auto cell = static_cast<std::size_t>(i % cells);
    const CampaignRecipe& recipe = recipes[cell % recipes.size()];
    const double k = stiffness[cell / recipes.size() % stiffness.size()], d = damping[cell / recipes.size() / stiffness.size()];
    SimulatedCampaign campaign = simulate_campaign(recipe, seed + static_cast<unsigned>(i / cells));
    falsify(campaign, k, d);
    const FitResult result = fit(campaign.problem);
    const Outcome outcome = judge(campaign, result);
    const std::lock_guard guard(counting);
    for (OutcomeCount* c : {&counts[{k, d}], &by_rig[recipe.name()]}) c->add(outcome);
    if (verbose && outcome != Outcome::arrived)
      fmt::print("  {}, seed {}, stiffness x {}, damping x {}: {}, reduced chi-square {:.3g}\n", recipe.name(), seed + static_cast<unsigned>(i / cells), k, d,
                 said(outcome), result.reduced_chi2());
  });

  fmt::print("\nArrived, of {} in each cell; the rig file's stiffness and damping over the true ones:\n\n| stiffness |", campaigns * static_cast<int>(recipes.size()));
  for (const double d : damping) fmt::print(" damping x {} |", d);
  fmt::print("\n| --- |");
  for (std::size_t k = 0; k < damping.size(); ++k) fmt::print(" --- |");
  int silent = 0, near = 0, arrived = 0;
  for (const double k : stiffness) {
    fmt::print("\n| x {} |", k);
    for (const double d : damping) {
      const OutcomeCount& c = counts[{k, d}];
      fmt::print(" {:.0f} % |", 100.0 * c.arrived / c.tried);
      silent += c.silent;
      if (k < 0.45 || k > 2.2) continue;
      near += c.tried;
      arrived += c.arrived;
    }
  }
  fmt::print("\n\n| rig | tried | arrived | wrong in silence |\n| --- | --- | --- | --- |\n");
  for (const auto& [name, c] : by_rig) fmt::print("| {} | {} | {} | {} |\n", name, c.tried, c.arrived, c.silent);
  fmt::print("\nWithin a factor 2 in stiffness and 10 in damping {} of {} arrive; {} fits in all are wrong without saying so. Seed {}.\n", arrived, near, silent, seed);
  constexpr double promised = 0.95;
  return silent == 0 && arrived >= promised * near ? exit_done : exit_no_answer;
}

}  // namespace
}  // namespace unrig::studies

int main(int argc, char** argv) { return unrig::studies::study(argc, argv); }
