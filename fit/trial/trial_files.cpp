#include "fit/trial/trial_files.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/files/provenance.h"
#include "core/files/text_file.h"
#include "fit/trial/law_files.h"
#include "fit/trial/parts.h"

namespace unrig {
namespace {

using nlohmann::ordered_json;

constexpr const char* wanted = "wanted what `unrig trial -o` wrote";

ordered_json json_of(const TrialOutcome& o, bool seconds) {
  ordered_json one = {{"trial", o.trial},           {"hidden", o.hidden},         {"parameters", o.parameters},   {"size", o.size},    {"sizes", o.sizes}, {"found", o.found},
                      {"equivalent", o.equivalent}, {"mismatch", o.mismatch},     {"unexplained", o.unexplained}, {"right", o.right()}};
  one["noise"] = o.noise;
  one["misread"] = o.misread.empty() ? ordered_json(nullptr) : ordered_json(o.misread);
  one["probability"] = o.probability ? ordered_json(*o.probability) : ordered_json(nullptr);
  one["explanations"] = o.explanations;
  one["named"] = ordered_json::array();
  for (const NamedParameter& p : o.named) one["named"].push_back({{"name", p.name}, {"truth", p.truth}, {"value", p.value}, {"std_error", p.std_error}});
  if (o.law) one["law"] = json_of(*o.law);
  one["work"] = o.work;
  if (o.stopped) one["stopped"] = true;
  if (seconds) one["seconds"] = o.seconds;
  if (!o.failure.empty()) one["failure"] = o.failure;
  return one;
}

TrialOutcome outcome_of(const ordered_json& json) {
  TrialOutcome o;
  json.at("trial").get_to(o.trial);
  json.at("hidden").get_to(o.hidden);
  json.at("parameters").get_to(o.parameters);
  json.at("size").get_to(o.size);
  json.at("sizes").get_to(o.sizes);
  json.at("found").get_to(o.found);
  json.at("equivalent").get_to(o.equivalent);
  json.at("mismatch").get_to(o.mismatch);
  json.at("unexplained").get_to(o.unexplained);
  json.at("noise").get_to(o.noise);
  if (const ordered_json& misread = json.at("misread"); !misread.is_null()) misread.get_to(o.misread);
  if (const ordered_json& probability = json.at("probability"); !probability.is_null()) o.probability = probability.get<double>();
  o.explanations = json.value("explanations", o.explanations);
  for (const ordered_json& p : json.value("named", ordered_json::array())) o.named.push_back({p.at("name").get<std::string>(), p.at("truth").get<double>(), p.at("value").get<double>(), p.at("std_error").get<double>()});
  if (json.contains("law")) o.law = law_outcome_of(json.at("law"));
  o.work = json.value("work", 0.0);
  o.stopped = json.value("stopped", false);
  o.seconds = json.value("seconds", 0.0);
  o.failure = json.value("failure", std::string());
  return o;
}

ordered_json json_of(const Reliability& r) {
  ordered_json bins = ordered_json::array();
  for (const Reliability::Bin& b : r.bins) bins.push_back({{"from", b.from}, {"to", b.to}, {"campaigns", b.campaigns}, {"stated", b.stated}, {"right", b.right}});
  return {{"campaigns", r.campaigns}, {"calibration_error", r.calibration_error}, {"brier", r.brier}, {"bins", bins}, {"explanations", {{"campaigns", r.explained}, {"hold", r.held}, {"members", r.members}}},
          {"intervals", {{"parameters", r.parameters}, {"within_68", r.within_68}, {"within_95", r.within_95}}}};
}

}  // namespace

std::string to_json(const TrialResult& r, const Provenance& made, bool seconds) {
  ordered_json trials = ordered_json::array(), scores = ordered_json::array();
  for (const TrialOutcome& o : r.outcomes) trials.push_back(json_of(o, seconds));
  for (const auto& [id, s] : r.scores)
    scores.push_back({{"effect", id}, {"hidden", s.hidden}, {"found", s.found}, {"equivalent", s.equivalent},
                      {"smallest_found", s.found > 0 ? ordered_json(s.smallest_found) : ordered_json(nullptr)},
                      {"found_nine_in_ten_from", s.nine_in_ten > 0 ? ordered_json(s.nine_in_ten) : ordered_json(nullptr)}});
  ordered_json json = {{"unrig", "trial"}, {"program", made.program}, {"command", made.command}, {"rig", r.rig_file}, {"rig_fingerprint", r.rig_fingerprint}, {"study", r.study}, {"seed", r.seed}, {"planned", r.trials}, {"noise", {{"gauge", r.noise}, {"unit", "N"}}}, {"recordings", r.recordings}, {"recording_fingerprints", r.recording_fingerprints}, {"nulls", r.nulls}, {"false_alarms", r.false_alarms},
                       {"wrong_names", r.wrong_names}, {"misses", r.misses}, {"confusion", r.confusion}, {"reliability", json_of(r.reliability)}, {"effects", scores}, {"hidden_in_turn", r.effects}, {"trials", trials}};
  if (r.laws) json["laws"] = json_of(*r.laws);
  if (r.shards > 1) json["shard"] = fmt::format("{}/{}", r.shard, r.shards);
  return json.dump(2) + "\n";
}

std::string report(const TrialResult& r) {
  const std::string like = r.recordings.empty() ? "" : fmt::format(", runs like {}", fmt::join(r.recordings, ", "));
  std::string text = fmt::format("{} trials, seed {}, noise {:.4g} N{}: {} false alarms in {} campaigns with nothing hidden\n", r.outcomes.size(), r.seed, r.noise, like, r.false_alarms, r.nulls);
  text += fmt::format("    of {} with something hidden {} named an effect that was not there, {} named nothing\n", static_cast<int>(r.outcomes.size()) - r.nulls - r.failures, r.wrong_names, r.misses);
  text += "[[Hidden -> found]]\n";
  for (const auto& [hidden, row] : r.confusion)
    for (const auto& [found, count] : row) text += fmt::format("    {:<36} {:<36} {:4}\n", hidden, found, count);
  text += "[[Size: largest r.m.s. of a run over the noise]]\n    effect               found  hidden  as good   least found   nine in ten from\n";
  const auto number = [](double x) { return x > 0 ? fmt::format("{:.3g}", x) : std::string("-"); };
  for (const auto& [id, s] : r.scores) text += fmt::format("    {:<20} {:5} {:7} {:8} {:>13} {:>18}\n", id, s.found, s.hidden, s.equivalent, number(s.smallest_found), number(s.nine_in_ten));
  if (r.reliability.campaigns > 0) {
    text += fmt::format("[[Stated probability -> share of right names]] calibration error {:.3f}, Brier score {:.3f}\n", r.reliability.calibration_error, r.reliability.brier);
    for (const Reliability::Bin& b : r.reliability.bins) text += fmt::format("    {:.2f} to {:.2f}: stated {:.3f}, right {} of {}\n", b.from, b.to, b.stated, b.right, b.campaigns);
  }
  if (r.reliability.explained > 0)
    text += fmt::format("[[Explanations]] hold what was hidden in {} of {} campaigns, with {:.2f} members on the mean\n", r.reliability.held, r.reliability.explained, r.reliability.members);
  if (const Reliability& s = r.reliability; s.parameters > 0)
    text += fmt::format("[[Intervals]] of parameters of hidden effects that were named: 68 % hold the truth in {} of {}, 95 % in {}\n", s.within_68, s.parameters, s.within_95);
  if (r.laws) text += report(*r.laws);
  for (const TrialOutcome& o : r.outcomes)
    if (!o.failure.empty()) text += fmt::format("    failed with {} hidden: {}\n", name_of(o.hidden), o.failure);
  return text;
}

TrialResult read_trial(const std::string& path) {
  const ordered_json json = ordered_json::parse(read_text(path), nullptr, false);
  if (json.is_discarded() || !json.is_object() || json.value("unrig", std::string()) != "trial") throw InputError({path, 0}, "no result of a trial", wanted, "");
  try {
    TrialResult r;
    json.at("study").get_to(r.study);
    json.at("seed").get_to(r.seed);
    json.at("planned").get_to(r.trials);
    json.at("noise").at("gauge").get_to(r.noise);
    json.at("recordings").get_to(r.recordings);
    json.at("recording_fingerprints").get_to(r.recording_fingerprints);
    json.at("rig").get_to(r.rig_file);
    json.at("rig_fingerprint").get_to(r.rig_fingerprint);
    json.at("hidden_in_turn").get_to(r.effects);
    for (const ordered_json& one : json.at("trials")) r.outcomes.push_back(outcome_of(one));
    tally(r);
    return r;
  } catch (const nlohmann::json::exception& e) {
    throw InputError({path, 0}, e.what(), wanted, "Run the trial again with this version.");
  }
}

TrialResult collected(const std::vector<TrialResult>& shards, const std::vector<std::string>& paths) {
  TrialResult all = shards.front();
  std::vector<Part<TrialOutcome>> parts;
  for (std::size_t s = 0; s < shards.size(); ++s) {
    Part<TrialOutcome> part{paths[s], fmt::format("{} {}", shards[s].study, shards[s].trials), static_cast<std::size_t>(shards[s].trials), {}};
    for (const TrialOutcome& o : shards[s].outcomes) part.cases.emplace_back(o.trial, o);
    parts.push_back(std::move(part));
  }
  const PartsOf trials{"trial", "trials", "the same version, rig, recordings, effects, options, seed and number of trials"};
  all.outcomes = all_cases(parts, trials, [](const TrialOutcome& a, const TrialOutcome& b) { return json_of(a, false) == json_of(b, false); });
  all.confusion.clear();
  all.scores.clear();
  all.reliability = {};
  all.laws.reset();
  all.nulls = all.false_alarms = all.wrong_names = all.misses = all.failures = 0;
  all.shard = all.shards = 1;
  tally(all);
  return all;
}

std::string study_of(const TrialProblem& problem, const std::vector<std::string>& effects) {
  std::vector<std::string> parts{provenance_of(0, nullptr).program, fingerprint(problem.rig), fmt::format("{} {} {}", problem.pairs, problem.outside, problem.seed), problem.noise ? fmt::format("{}", *problem.noise) : ""};
  for (const Run& run : problem.recordings) parts.push_back(base_name(run.file) + fingerprint(run, problem.rig));
  parts.insert(parts.end(), effects.begin(), effects.end());
  if (problem.nulls) parts.emplace_back("nulls");
  if (problem.ideal) parts.emplace_back("ideal");
  if (problem.laws) parts.emplace_back("laws");
  return fingerprint(std::string_view(fmt::format("{}", fmt::join(parts, "\n"))));
}

TrialCases::TrialCases(const std::string& folder, const std::string& study) : cases_(folder.empty() ? "" : (std::filesystem::path(folder) / study).string()) {}

std::optional<TrialOutcome> TrialCases::find(std::size_t trial) const {
  const std::optional<std::string> kept = cases_.find(fmt::format("{}.json", trial));
  if (!kept) return std::nullopt;
  try {
    const TrialOutcome outcome = outcome_of(ordered_json::parse(*kept));
    return outcome.trial == trial ? std::optional(outcome) : std::nullopt;
  } catch (const nlohmann::json::exception&) {
    return std::nullopt;  // damaged: computed again
  }
}

void TrialCases::keep(const TrialOutcome& outcome) const { cases_.keep(fmt::format("{}.json", outcome.trial), json_of(outcome, true).dump() + "\n"); }

}  // namespace unrig
