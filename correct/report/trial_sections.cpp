#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "correct/report/result_files.h"

namespace unrig {
namespace {

using nlohmann::json;

struct Counts {
  int hidden = 0, right = 0, silent = 0, unexplained = 0, failed = 0;
};

/// Of the campaigns that hid something.
Counts counts_of(const json& trials) {
  Counts n;
  for (const json& trial : trials) {
    if (trial.contains("failure")) {
      ++n.failed;
      continue;
    }
    if (trial.at("hidden").empty()) continue;
    ++n.hidden;
    n.right += trial.at("right").get<bool>() ? 1 : 0;
    if (!trial.at("found").empty()) continue;
    n.silent += trial.at("unexplained").get<bool>() ? 0 : 1;
    n.unexplained += trial.at("unexplained").get<bool>() ? 1 : 0;
  }
  return n;
}

std::string campaigns(int count) { return fmt::format("{} campaign{}", count, count == 1 ? "" : "s"); }

void add_confusion(ReportPage& page, const json& confusion) {
  std::set<std::string> found;
  for (const json& row : confusion)
    for (const auto& [name, count] : row.items()) found.insert(name);
  std::vector<std::string> header{"hidden"};
  header.insert(header.end(), found.begin(), found.end());
  std::vector<std::vector<std::string>> rows;
  for (const auto& [hidden, row] : confusion.items()) {
    rows.push_back({hidden});
    for (const std::string& name : found) rows.back().push_back(row.contains(name) ? plain(number_of(row, name.c_str()), 9) : "");
  }
  page.add_table("What was hidden, and what was found", header, rows, "Campaigns with what the row hides, by what the diagnosis named. \"nothing\" in a row of an effect: not seen.");
}

void add_sizes(ReportPage& page, const json& effects) {
  std::vector<std::vector<std::string>> rows;
  for (const json& e : effects)
    rows.push_back({text_of(e, "effect"), plain(number_of(e, "found"), 9), plain(number_of(e, "hidden"), 9), plain(number_of(e, "equivalent"), 9), plain(number_of(e, "smallest_found"), 3),
                    plain(number_of(e, "found_nine_in_ten_from"), 3)});
  page.add_table("How large an effect must be", {"effect", "found", "hidden", "named as good", "least found", "nine in ten found from"}, rows,
                 "Sizes: the largest r.m.s. that the effect makes in a run, over the noise of the gauge. Named as good: the diagnosis said that these runs cannot tell it from what it named.");
}

/// 95 % of the share that `found` of `all` shows (E. B. Wilson, J. American Statistical Association 22 (1927) 209).
Bar share_of(const std::string& name, int found, int all, int colour) {
  constexpr double z = 1.959964;
  const double n = all, p = found / n, centre = (p + z * z / (2 * n)) / (1 + z * z / n), half = z / (1 + z * z / n) * std::sqrt(p * (1 - p) / n + z * z / (4 * n * n));
  return {name, p, std::max(0.0, centre - half), std::min(1.0, centre + half), fmt::format("{} of {}", found, all), colour};
}

void add_shares(ReportPage& page, const json& effects, int nulls, int alarms) {
  std::vector<Bar> bars;
  for (const json& e : effects)
    if (const int hidden = e.value("hidden", 0); hidden > 0) bars.push_back(share_of(text_of(e, "effect"), e.value("found", 0), hidden, 1));
  if (nulls > 0) bars.push_back(share_of("false alarm", alarms, nulls, 2));
  if (!bars.empty())
    page.add_bars("What was found of what was hidden", "campaigns [%]", bars, "Of the campaigns that hid an effect, those in which it was named; of those that hid nothing, those in which something was named. Lines: 95 % intervals (Wilson) of the share, for so many campaigns.");
}

/// Reliability diagram: of names stated with such probabilities, how many were right.
void add_reliability(ReportPage& page, const json& reliability) {
  std::vector<Bar> bars;
  for (const json& bin : reliability.value("bins", json::array()))
    bars.push_back(share_of(fmt::format("stated {} to {}, {} in the mean", plain(number_of(bin, "from"), 3), plain(number_of(bin, "to"), 3), plain(number_of(bin, "stated"), 3)), bin.value("right", 0), bin.value("campaigns", 1), 1));
  if (!bars.empty())
    page.add_bars("Do stated probabilities hold?", "right names [%]", bars,
                  fmt::format("Of the campaigns in which something was named with such a probability, those in which that is just what was hidden. Lines: 95 % intervals (Wilson). Calibration error {}, Brier score {}.",
                              plain(number_of(reliability, "calibration_error"), 3), plain(number_of(reliability, "brier"), 3)));
  if (const json explanations = reliability.value("explanations", json::object()); explanations.value("campaigns", 0) > 0)
    page.add_text(fmt::format("The explanations that were given hold what was hidden in {} of {} campaigns, with {} of them on the mean.", explanations.value("hold", 0), explanations.value("campaigns", 0), plain(number_of(explanations, "members"), 3)));
  if (const json intervals = reliability.value("intervals", json::object()); intervals.value("parameters", 0) > 0)
    page.add_text(fmt::format("Of {} parameters of hidden effects that were named the truth lies within one standard error of {} (68 % expected) and within 1.96 of {} (95 %).", intervals.value("parameters", 0), intervals.value("within_68", 0), intervals.value("within_95", 0)));
}

void add_failures(ReportPage& page, const json& trials) {
  for (const json& trial : trials)
    if (const std::string failure = text_of(trial, "failure"); !failure.empty()) page.add_text("Warning: a campaign failed: " + failure);
}

}  // namespace

void add_trial(ReportPage& page, const json& result, const std::string& path) {
  const json &trials = result.at("trials"), &noise = result.at("noise");
  const Counts n = counts_of(trials);
  const int nulls = result.at("nulls").get<int>(), alarms = result.at("false_alarms").get<int>(), wrong = result.at("wrong_names").get<int>();
  page.add_verdict(alarms == 0 && wrong == 0 && n.failed == 0 ? Tone::good : Tone::open,
                   fmt::format("Of {} that hid something {} {} named right, {} named an effect that was not there, {} called unexplained and {} not seen; {} in {} that hid nothing.", campaigns(n.hidden), n.right,
                               n.right == 1 ? "was" : "were", wrong, n.unexplained, n.silent, alarms == 0 ? "no false alarm" : fmt::format("{} false alarm{}", alarms, alarms == 1 ? "" : "s"), campaigns(nulls)),
                   file_name(path));
  page.add_section("Trial: " + file_name(path));
  std::string like;
  for (const json& recording : result.value("recordings", json::array())) like += (like.empty() ? "runs like " : ", ") + file_name(recording.get<std::string>());
  page.add_text(fmt::format("Simulated campaigns with {}, a noise of {} {} and the random numbers of seed {}.", like.empty() ? "two plucks and three steps" : like, plain(number_of(noise, "gauge"), 4),
                            text_of(noise, "unit"), result.at("seed").dump()));
  add_shares(page, result.at("effects"), nulls, alarms);
  add_confusion(page, result.at("confusion"));
  add_sizes(page, result.at("effects"));
  if (const json reliability = result.value("reliability", json::object()); reliability.is_object()) add_reliability(page, reliability);
  add_failures(page, trials);
  add_provenance(page, result);
}

}  // namespace unrig
