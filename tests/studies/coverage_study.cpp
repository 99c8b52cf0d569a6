// Do the error bars hold? Simulates campaigns with known answers, fits them, and counts how often the truth lies within one standard error (68 %) and
// within 1.96 (95 %). Exit status 1 where either share is further from its nominal value than allowed.

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cmath>
#include <map>
#include <mutex>

#include "tests/studies/campaign_maker.h"
#include "tests/studies/crew.h"

namespace unrig::studies {
namespace {

struct Count {
  int intervals = 0, one = 0, two = 0;  // in all; with the truth within one and within 1.96 standard errors
  int held = 0;                         // not identified
  void add(double error, double std_error) {
    ++intervals;
    if (std::abs(error) < std_error) ++one;
    if (std::abs(error) < 1.959964 * std_error) ++two;
  }
  void add(const Count& other) {
    intervals += other.intervals, one += other.one, two += other.two, held += other.held;
  }
  double share(int within) const { return 100.0 * within / std::max(1, intervals); }
};

struct Tally {
  std::map<std::string, Count> by_recipe, by_parameter, by_noise;
  int failed = 0;

  void add(const CampaignRecipe& recipe, const SimulatedCampaign& campaign, const FitResult& result, unsigned seed, bool verbose) {
    if (!result.converged) ++failed;
    const auto count = [&](const std::string& name, const auto& what) {
      what(by_recipe[recipe.name()]);
      what(by_parameter[name]);
      what(by_noise[recipe.noise == studies::NoiseColour::white ? "white" : "coloured"]);
    };
    for (const DeterminedCombination& c : result.determined) {
      const double truth = combination_at([&](const FittedParameter& p) { return campaign.of(p); }, c, result);
      count("combinations", [&](Count& n) { n.add(c.value - truth, c.std_error); });
    }
    for (const FittedParameter& p : result.parameters) {
      if (p.name.ends_with("mount_participation")) continue;  // no run moves the mount
      const double error = p.value - campaign.of(p);
      if (p.identified) count(p.name, [&](Count& c) { c.add(error, p.std_error); });
      else count(p.name, [&](Count& c) { ++c.held; });
      if (verbose) fmt::print("{};{};{} {};{};{:.9g};{:.4g};{:.4g}\n", recipe.name(), seed, p.name, p.run, p.identified, campaign.of(p), error, p.std_error);
    }
  }
};

void print(const std::string& title, const std::map<std::string, Count>& counts) {
  fmt::print("\n| {} | intervals | within 68 % | within 95 % | not identified |\n| --- | --- | --- | --- | --- |\n", title);
  Count all;
  const auto row = [](const std::string& name, const Count& c) {
    fmt::print("| {} | {} | {:.1f} % | {:.1f} % | {} |\n", name, c.intervals, c.share(c.one), c.share(c.two), c.held);
  };
  for (const auto& [name, count] : counts) {
    row(name, count);
    all.add(count);
  }
  row("all", all);
}

/// Within the promise, or as near to it as this many intervals can tell (`deviations` of the binomial distribution; the intervals of one
/// campaign share their noise, which counts as half as many).
bool holds(const std::string& name, const Count& c, double deviations) {
  const auto within = [&](double share, double nominal, double low, double high) {
    const double spread = deviations * 100 * std::sqrt(nominal * (1 - nominal) / (0.5 * std::max(1, c.intervals)));
    const bool good = share > std::min(low, 100 * nominal - spread) && share < std::max(high, 100 * nominal + spread);
    if (!good) fmt::print("{}: {:.1f} % of the {:.0f} % intervals hold the truth\n", name, share, 100 * nominal);
    return good;
  };
  const bool one = within(c.share(c.one), 0.6827, 63, 73), two = within(c.share(c.two), 0.95, 93, 97);
  return one && two;
}

int study(int argc, char** argv) {
  CLI::App app{"Counts how often the truth lies within the error bars of a fit.", "coverage_study"};
  int campaigns = 1200, threads = 1;
  unsigned seed = 1;
  bool verbose = false;
  std::string only;
  app.add_option("--campaigns", campaigns, "how many to simulate, over all recipes in turn")->capture_default_str();
  app.add_option("--seed", seed, "of the first campaign; the others follow")->capture_default_str();
  app.add_option("--threads", threads, "how many fits at a time")->capture_default_str();
  app.add_option("--only", only, "recipes with this in their name");
  app.add_flag("--verbose", verbose, "print every parameter: recipe; seed; name; identified; truth; error; standard error");
  CLI11_PARSE(app, argc, argv);

  std::vector<CampaignRecipe> recipes = all_recipes();
  std::erase_if(recipes, [&](const CampaignRecipe& r) { return r.name().find(only) == std::string::npos; });
  Tally tally;
  std::mutex counting;
  each(campaigns, threads, [&](int i) {
    const CampaignRecipe& recipe = recipes[static_cast<std::size_t>(i) % recipes.size()];
    const SimulatedCampaign campaign = simulate_campaign(recipe, seed + static_cast<unsigned>(i));
    const FitResult result = fit(campaign.problem);
    const std::lock_guard guard(counting);
    tally.add(recipe, campaign, result, seed + static_cast<unsigned>(i), verbose);
  });
  print("noise", tally.by_noise);
  print("rig and runs", tally.by_recipe);
  print("parameter", tally.by_parameter);
  fmt::print("\n{} campaigns, {} of them not converged; seed {}\n", campaigns, tally.failed, seed);
  constexpr double deviations = 3;
  bool good = tally.failed * 100 <= campaigns;
  for (const auto& [name, count] : tally.by_noise) good &= holds(name, count, deviations);
  return good ? exit_done : exit_no_answer;
}

}  // namespace
}  // namespace unrig::studies

int main(int argc, char** argv) { return unrig::studies::study(argc, argv); }
