#include "fit/trial/law_files.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace unrig {
namespace {

using nlohmann::ordered_json;

ordered_json json_of(const std::optional<double>& number) { return number ? ordered_json(*number) : ordered_json(nullptr); }

std::optional<double> number_of(const ordered_json& json) { return json.is_null() ? std::nullopt : std::optional(json.get<double>()); }

ordered_json json_of(const ToldLaw& law) {
  ordered_json parameters = ordered_json::array();
  for (const ToldLaw::Value& v : law.parameters) parameters.push_back({{"name", v.name}, {"value", v.value}, {"unit", v.unit}});
  ordered_json json = {{"effect", law.effect}, {"class", law.kind}, {"force", law.force}};
  if (!law.memory.empty()) json["memory"] = law.memory;
  json["parameters"] = std::move(parameters);
  json["scales"] = law.scales;
  return json;
}

ToldLaw law_of(const ordered_json& json) {
  ToldLaw law;
  json.at("effect").get_to(law.effect);
  json.at("class").get_to(law.kind);
  json.at("force").get_to(law.force);
  law.memory = json.value("memory", std::string());
  for (const ordered_json& v : json.at("parameters")) law.parameters.push_back({v.at("name").get<std::string>(), v.at("unit").get<std::string>(), v.at("value").get<double>()});
  json.at("scales").get_to(law.scales);
  return law;
}

}  // namespace

ordered_json json_of(const LawOutcome& o) {
  ordered_json named = ordered_json::array();
  for (const ToldLaw& law : o.named) named.push_back(json_of(law));
  return {{"hidden", json_of(o.hidden)},
          {"outside", o.outside},
          {"noise", o.noise},
          {"named", std::move(named)},
          {"class_right", o.class_right},
          {"equation_right", o.equation_right},
          {"among_rivals", o.among_rivals},
          {"in_company", o.in_company},
          {"rivals", o.rivals},
          {"wrong_alone", o.wrong_alone()},
          {"curve", o.curve()},
          {"unexplained", o.unexplained},
          {"exact_reduced_chi2", json_of(o.exact_left)},
          {"exact_ahead", json_of(o.ahead)},
          {"found_behind_exact", json_of(o.behind)},
          {"heldout_over_exact", json_of(o.heldout)}};
}

LawOutcome law_outcome_of(const ordered_json& json) {
  LawOutcome o;
  o.hidden = law_of(json.at("hidden"));
  json.at("outside").get_to(o.outside);
  json.at("noise").get_to(o.noise);
  for (const ordered_json& one : json.at("named")) o.named.push_back(law_of(one));
  json.at("class_right").get_to(o.class_right);
  json.at("equation_right").get_to(o.equation_right);
  json.at("among_rivals").get_to(o.among_rivals);
  json.at("in_company").get_to(o.in_company);
  json.at("rivals").get_to(o.rivals);
  json.at("unexplained").get_to(o.unexplained);
  o.exact_left = number_of(json.at("exact_reduced_chi2"));
  o.ahead = number_of(json.at("exact_ahead"));
  o.behind = number_of(json.at("found_behind_exact"));
  o.heldout = number_of(json.at("heldout_over_exact"));
  return o;
}

ordered_json json_of(const LawCounts& n) {
  return {{"campaigns", n.campaigns},
          {"right", n.right},
          {"among_rivals", n.among_rivals},
          {"class_right", n.class_right},
          {"wrong_alone", n.wrong_alone},
          {"in_company", n.in_company},
          {"unexplained", n.unexplained},
          {"nothing", n.nothing},
          {"decided", n.decided},
          {"decided_right", n.decided_right},
          {"median_rivals", n.median_rivals},
          {"most_rivals", n.most_rivals},
          {"heldout", n.heldout},
          {"heldout_within", n.heldout_within},
          {"curve", n.curve},
          {"outside", n.outside},
          {"outside_right", n.outside_right}};
}

std::string report(const LawCounts& n) {
  std::string text = fmt::format("[[Laws]] {} campaigns: {} equations right, {} among the rivals, {} wrong alone ({} with the hidden law in company), {} unexplained, {} seen nothing; {} classes right\n", n.campaigns, n.right, n.among_rivals, n.wrong_alone, n.in_company, n.unexplained, n.nothing, n.class_right);
  text += fmt::format("    an exact model is ahead by 10 in twice the log likelihood in {}: of these {} right or among the rivals\n", n.decided, n.decided_right);
  text += fmt::format("    rivals where something is named: {:g} in the median, {} at most\n", n.median_rivals, n.most_rivals);
  text += fmt::format("    runs held out: at most 1.2 times what the exact model leaves in {} of {}\n", n.heldout_within, n.heldout);
  if (n.outside > 0) text += fmt::format("    of {} outside the dictionary {} a curve or unexplained, and so held out; {} named a curve\n", n.outside, n.outside_right, n.curve);
  return text;
}

}  // namespace unrig
