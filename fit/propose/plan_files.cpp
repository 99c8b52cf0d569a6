#include "fit/propose/plan_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/run/run_text.h"
#include "fit/propose/expected_odds.h"

namespace unrig {
namespace {

std::vector<std::size_t> written(const Plan& plan, const PlanPaths& paths) {
  return {plan.ranking.begin(), plan.ranking.begin() + static_cast<std::ptrdiff_t>(std::min(paths.runs, plan.ranking.size()))};
}

/// A word for the shell.
std::string quoted(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-+=:,@%") == std::string::npos;
  if (plain) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string list(const std::vector<std::string>& texts) {
  std::vector<std::string> all;
  for (const std::string& text : texts) all.push_back(toml_string(text));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

std::string load_of(const CandidateRun& c) { return fmt::format("{:.10g} N", *c.release_load); }

std::string simulate_call(const CandidateRun& c, const std::string& motion, const PlanPaths& paths) {
  const std::string load = c.release_load ? " --release-load " + quoted(load_of(c)) : "";
  const std::string out = (std::filesystem::path(motion).parent_path() / (std::filesystem::path(motion).stem().string() + "_simulated.csv")).string();
  return fmt::format("unrig simulate --rig {} --run {}{} -o {}", quoted(paths.rig), quoted(motion), load, quoted(out));
}

/// A number in TOML, or nothing.
std::string number(const char* key, double value) { return std::isfinite(value) ? fmt::format("{} = {:.4g}\n", key, value) : std::string(); }

const char* how(const ExpectedOutcome& o) {
  if (!o.drawn.first.empty() && !o.drawn.second.empty()) return "simulated with noise and drawn parameters, and refitted";
  return o.was_refitted() ? "simulated and refitted" : "to first order";
}

std::string drawn(const std::vector<double>& x) {
  std::vector<std::string> all;
  for (const double value : x) all.push_back(fmt::format("{:.4g}", value));
  return fmt::format("[{}]", fmt::join(all, ", "));
}

std::string outcome_text(const ExpectedOutcome& o) {
  const auto [first, second] = o.expected();
  std::string text = number("expected_log_odds", o.least()) + number("if_first", first) + number("if_second", second);
  text += fmt::format("by = {}\n", toml_string(how(o)));
  if (o.was_refitted()) {
    text += number("first_order", std::min(o.linear.first, o.linear.second)) + fmt::format("refits = {}\nrefits_arrived = {}\n", o.searches, o.arrived);
    if (!std::isfinite(o.least())) text += "remark = \"a refit did not arrive: what this run would decide is not known\"\n";
  }
  if (!o.drawn.first.empty() || !o.drawn.second.empty()) text += fmt::format("drawn_if_first = {}\ndrawn_if_second = {}\n", drawn(o.drawn.first), drawn(o.drawn.second));
  if (!o.failed.empty()) text += "remark = " + toml_string(o.failed) + "\n";
  return text;
}

std::string plan_text(const Plan& plan, const PlanPaths& paths, const Provenance& made) {
  const std::vector<std::size_t> runs = written(plan, paths);
  std::string text = "# What to record next. Log odds are natural logarithms; 5 are odds of 150 to 1. What each key means: the manual's propose.md.\nunrig_plan = 1\n";
  text += fmt::format("program = {}\ncommand = {}\ndiagnosis = {}\nrig = {}\nlimits = {}\n", toml_string(made.program), toml_string(made.command), toml_string(paths.diagnosis), toml_string(paths.rig), toml_string(paths.limits));
  if (!plan.remarks.empty()) text += "remarks = " + list(plan.remarks) + "\n";
  for (std::size_t k = 0; k < plan.explanations.size(); ++k) {
    const Explanation& e = plan.explanations[k];
    text += fmt::format("\n[[explanation]]\nname = {}\neffects = {}\n", toml_string(e.name), list(e.effects));
    for (const Law& law : e.laws) text += fmt::format("# law {}: {}{}\n", toml_string(law.name), law.force_text, law.memory_text.empty() ? "" : ", z' = " + law.memory_text);
    if (k > 0) text += number("behind_by_now", plan.log_odds_now[k]);
    if (!plan.no_answer[k].empty()) text += "no_answer = " + toml_string(plan.no_answer[k]) + "\n";
  }
  for (const Comparison& c : plan.comparisons) {
    text += fmt::format("\n[[comparison]]\nbetween = {}\nverdict = {}\n", list({plan.explanations[c.first].name, plan.explanations[c.second].name}), toml_string(verdict_of(plan, c, paths)));
    text += fmt::format("decides = {}\n", c.decides());
    text += fmt::format("best_repeat = {}\n", toml_string(plan.candidates[c.repeat.candidate].what)) + number("log_odds_of_repeat", c.repeat.least());
    for (const ExpectedOutcome& o : c.outcomes) {
      const auto place = std::find(runs.begin(), runs.end(), o.candidate);
      text += fmt::format("[[comparison.run]]\nwhat = {}\n", toml_string(plan.candidates[o.candidate].what));
      if (place != runs.end()) text += fmt::format("file = {}\n", toml_string(base_name(paths.motion(static_cast<std::size_t>(place - runs.begin())))));
      text += outcome_text(o);
    }
  }
  for (std::size_t k = 0; k < runs.size(); ++k) {
    const CandidateRun& c = plan.candidates[runs[k]];
    text += fmt::format("\n[[run]]\nfile = {}\nwhat = {}\nkind = {}\n", toml_string(base_name(paths.motion(k))), toml_string(c.what), toml_string(to_string(c.run.kind)));
    if (!c.run.medium.empty()) text += fmt::format("medium = {}\n", toml_string(c.run.medium));
    text += fmt::format("density = \"{:.6g} kg/m^3\"\nspeed = \"{:.6g} m/s\"\n", c.run.density, c.run.speed);
    if (c.release_load) text += fmt::format("release_load = {}\n", toml_string(load_of(c)));
    text += fmt::format("simulate = {}\n", toml_string(simulate_call(c, paths.motion(k), paths)));
  }
  return text;
}

std::string motion_text(const CandidateRun& c, const std::string& name) {
  Run run = c.run;
  run.name = name;
  std::vector<std::string> remarks{"a motion that unrig propose proposes: " + c.what};
  if (c.release_load) remarks.push_back("released from " + load_of(c) + ": unrig simulate takes that by --release-load");
  return run_text(run, remarks);
}

}  // namespace

std::string PlanPaths::motion(std::size_t k) const {
  const std::filesystem::path path(plan);
  return (path.parent_path() / fmt::format("{}_{}.csv", path.stem().string(), k + 1)).string();
}

std::string verdict_of(const Plan& plan, const Comparison& c, const PlanPaths& paths) {
  if (c.outcomes.empty()) return "no run within your limits can be simulated";
  const ExpectedOutcome& best = c.outcomes.front();
  const std::string& what = plan.candidates[best.candidate].what;
  const bool some_open = std::any_of(c.outcomes.begin(), c.outcomes.end(), [](const ExpectedOutcome& o) { return !std::isfinite(o.least()); });
  if (c.decides()) {
    const std::vector<std::size_t> runs = written(plan, paths);
    const auto place = std::find(runs.begin(), runs.end(), best.candidate);
    const std::string file = place == runs.end() ? std::string() : fmt::format(" ({})", base_name(paths.motion(static_cast<std::size_t>(place - runs.begin()))));
    return fmt::format("{}{} decides: log odds of {:.3g} are expected", what, file, best.least());
  }
  if (!best.was_refitted() || !std::isfinite(best.least())) {
    if (best.was_refitted()) return "not known: no candidate's refits arrived";
    return fmt::format("not known: nothing was simulated and refitted; to first order {} promises log odds of {:.3g}", what, best.least());
  }
  const auto [first, second] = best.expected();
  const std::string one_sided = std::max(first, second) < enough_to_decide ? "" : fmt::format("; it would, by {:.3g}, if {} is true", std::max(first, second), plan.explanations[first > second ? c.first : c.second].name);
  return fmt::format("no run within your limits decides: the best, {}, promises log odds of {:.3g}, and {} are wanted{}{}", what, best.least(), enough_to_decide, one_sided, some_open ? "; of some candidates it is not known" : "");
}

std::vector<TextFile> plan_files(const Plan& plan, const PlanPaths& paths, const Provenance& made) {
  const auto whole = [](std::string text) -> TextSource { return [text = std::move(text)](const TextSink& sink) { sink(text); }; };
  std::vector<TextFile> files{{paths.plan, whole(plan_text(plan, paths, made))}};
  const std::vector<std::size_t> runs = written(plan, paths);
  for (std::size_t k = 0; k < runs.size(); ++k) files.push_back({paths.motion(k), whole(motion_text(plan.candidates[runs[k]], fmt::format("{} {}", std::filesystem::path(paths.plan).stem().string(), k + 1)))});
  return files;
}

std::string report(const Plan& plan, const PlanPaths& paths) {
  const std::vector<std::size_t> runs = written(plan, paths);
  std::string text;
  for (const Comparison& c : plan.comparisons) {
    text += fmt::format("[[{}  or  {}]] log odds now {:.3g}\n    {}.\n", plan.explanations[c.first].name, plan.explanations[c.second].name, plan.log_odds_now[c.second], verdict_of(plan, c, paths));
    text += "    expected log odds, if the first is true and if the second is; refits that arrived\n";
    constexpr std::size_t most = 10;
    for (std::size_t k = 0; k < std::min(most, c.outcomes.size()); ++k) {
      const ExpectedOutcome& o = c.outcomes[k];
      const auto place = std::find(runs.begin(), runs.end(), o.candidate);
      const std::string file = place == runs.end() ? "" : base_name(paths.motion(static_cast<std::size_t>(place - runs.begin())));
      const auto [first, second] = o.expected();
      const auto told = [](double x) { return std::isfinite(x) ? fmt::format("{:9.3g}", x) : std::string("not known"); };
      const std::string refits = o.was_refitted() ? fmt::format("{} of {}", o.arrived, o.searches) : "to first order";
      text += fmt::format("    {:<14} {} {}  {:<14} {}{}\n", file, told(first), told(second), refits, plan.candidates[o.candidate].what, o.failed.empty() ? "" : " (" + o.failed + ")");
    }
    if (c.outcomes.size() > most) text += fmt::format("    and {} more in the plan\n", c.outcomes.size() - most);
    text += fmt::format("    to compare: {}, {:.3g}\n", plan.candidates[c.repeat.candidate].what, c.repeat.least());
  }
  for (std::size_t k = 0; k < plan.explanations.size(); ++k)
    if (!plan.no_answer[k].empty()) text += fmt::format("    {}: the fit to the runs at hand is not to be trusted: {}\n", plan.explanations[k].name, plan.no_answer[k]);
  for (const std::string& remark : plan.remarks) text += "    left out: " + remark + "\n";
  return text;
}

}  // namespace unrig
