// Does `unrig fit --effect` arrive at nonlinear effects, from weak to strong? Simulates campaigns of the sample rig with one effect hidden at a random size
// (fit/trial/trial_campaign.h), fits them with that effect named, and counts how often the fit finds it, says that it has not, or is wrong without saying so.
// Exit status 1 where a fit is wrong in silence.

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <random>

#include "core/effects/effect.h"
#include "fit/trial/trial_campaign.h"
#include "fit/fit.h"
#include "tests/studies/crew.h"
#include "tests/studies/outcome.h"
#include "tests/support/sample_data.h"

namespace unrig::studies {
namespace {

/// Every parameter of the effect that is called identified within five standard errors of the truth, every run explained.
Outcome judge(const TrialCampaign& campaign, const FitResult& result, double& worst) {
  constexpr double far = 5;
  bool good = result.converged, any = false;
  worst = 0;
  const auto& parameters = effect(campaign.hidden.front()).parameters;
  for (std::size_t k = 0; k < parameters.size(); ++k)
    for (const FittedParameter& p : result.parameters)
      if (p.name == campaign.hidden.front() + "." + parameters[k].name && p.identified) {
        any = true;
        worst = std::max(worst, std::abs(p.value - campaign.parameters[k]) / p.std_error);
        good &= std::abs(p.value - campaign.parameters[k]) < far * p.std_error;
      }
  if (!any || !raises_no_doubt(result)) return Outcome::said_so;
  return good ? Outcome::arrived : Outcome::silent;
}

int study(int argc, char** argv) {
  CLI::App app{"Counts how often a fit with a nonlinear effect named arrives.", "effects_study"};
  int campaigns = 8, threads = 1;
  unsigned seed = 1;
  double noise = 0.03, least = 0;
  std::vector<std::string> ids{"coulomb-friction", "quadratic-drag", "cubic-stiffness"};
  bool verbose = false;
  app.add_option("--effects", ids, "which")->capture_default_str()->delimiter(',');
  app.add_option("--campaigns", campaigns, "of each effect")->capture_default_str();
  app.add_option("--seed", seed, "of all campaigns")->capture_default_str();
  app.add_option("--noise", noise, "of the gauge [N]")->capture_default_str();
  app.add_option("--least", least, "size over the noise of campaigns that are worth a fit")->capture_default_str();
  app.add_option("--threads", threads, "how many fits at a time")->capture_default_str();
  app.add_flag("--verbose", verbose, "print every fit");
  CLI11_PARSE(app, argc, argv);

  std::map<std::string, std::map<int, OutcomeCount>> counts;  // by effect and size: 1 for up to the noise, 2 for up to 10 times the noise, ...
  std::mutex counting;
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const int jobs = campaigns * static_cast<int>(ids.size());
  each(jobs, threads, [&](int i) {
    const std::string& id = ids[static_cast<std::size_t>(i) % ids.size()];
    const auto trial = static_cast<unsigned>(i) / static_cast<unsigned>(ids.size());
    std::seed_seq sequence{seed, trial};
    std::mt19937_64 random(sequence);
    const TrialCampaign campaign = draw_campaign(rig, {id}, draw_runs(noise, random), ideal_laboratory(), random);
    if (campaign.size < least) return;
    FitProblem problem;
    problem.rig = campaign.rig;
    problem.runs = campaign.runs;
    problem.effects = {id};
    const FitResult result = fit(problem);
    double worst = 0;
    const Outcome outcome = judge(campaign, result, worst);
    const std::lock_guard guard(counting);
    counts[id][std::clamp(static_cast<int>(std::ceil(std::log10(campaign.size))), -1, 3) + 1].add(outcome);
    if (!verbose) return;
    fmt::print("  {}, trial {}, {:.3g} times the noise: {}, off by {:.1f} standard errors, reduced chi-square", id, trial, campaign.size, said(outcome), worst);
    for (const FittedRun& run : result.runs) fmt::print(" {:.3g}", run.reduced_chi2());
    fmt::print(", {:.1f} s{}\n", result.seconds, result.converged ? "" : ", not converged: " + result.message);
    if (!result.no_answer.empty()) fmt::print("    {}\n", result.no_answer);
    std::fflush(stdout);
  });

  static const char* const sizes[] = {"up to 0.1", "0.1 to 1", "1 to 10", "10 to 100", "over 100"};
  fmt::print("\n| effect | size over the noise | tried | arrived | wrong in silence |\n| --- | --- | --- | --- | --- |\n");
  int silent = 0;
  for (const auto& [id, by_size] : counts)
    for (const auto& [size, c] : by_size) {
      fmt::print("| {} | {} | {} | {} | {} |\n", id, sizes[size], c.tried, c.arrived, c.silent);
      silent += c.silent;
    }
  return silent == 0 ? exit_done : exit_no_answer;
}

}  // namespace
}  // namespace unrig::studies

int main(int argc, char** argv) { return unrig::studies::study(argc, argv); }
