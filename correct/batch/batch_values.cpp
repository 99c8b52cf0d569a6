#include "correct/batch/batch_values.h"

#include <algorithm>
#include <cmath>

#include "core/files/csv_table.h"

namespace unrig {
namespace {

using nlohmann::ordered_json;
using Strings = std::vector<std::string>;
using Values = std::vector<BatchValue>;

ordered_json at(const ordered_json& object, const std::string& key) { return object.contains(key) ? object.at(key) : ordered_json(); }

/// `name` and `name.std_error`, of an object that has a value and its error.
void take_estimate(Values& values, const std::string& name, const std::string& unit, const ordered_json& estimate) {
  if (!estimate.is_object()) return;
  values.push_back({name, unit, at(estimate, "value")});
  values.push_back({name + ".std_error", unit, at(estimate, "std_error")});
}

/// Of run `file`; nothing where the campaign has no such run.
Values* of_run(BatchCase& one, const Strings& files, const std::string& file) {
  const auto found = std::find(files.begin(), files.end(), file);
  return found == files.end() ? nullptr : &one.by_run[static_cast<std::size_t>(found - files.begin())];
}

void take_check(BatchCase& one, const ordered_json& check, const Strings& files) {
  one.values.push_back({"suspicions", "1", check.at("suspicions").size()});
  for (const ordered_json& run : check.at("runs")) {
    Values* const values = of_run(one, files, run.at("file"));
    if (!values) continue;
    values->push_back({"samples", "1", run.at("samples")});
    for (const char* key : {"rate", "duration", "ringing"})
      if (const ordered_json number = at(run, key); number.is_object()) values->push_back({key, number.at("unit"), number.at("value")});
    if (const ordered_json motion = at(run, "motion"); motion.is_object())
      for (const char* key : {"onset", "step"})
        if (motion.contains(key)) values->push_back({key, motion.at(key).at("unit"), motion.at(key).at("value")});
  }
}

void take_fit(BatchCase& one, const ordered_json& fit, const Strings& files) {
  for (const char* key : {"reduced_chi2", "bic"}) one.values.push_back({key, "1", fit.at(key)});
  for (const ordered_json& run : fit.at("runs"))
    if (Values* const values = of_run(one, files, run.at("file"))) {
      values->push_back({"run_reduced_chi2", "1", at(run, "reduced_chi2")});
      for (const char* key : {"rms_residual", "noise"}) values->push_back({key, run.at("unit"), at(run, key)});
    }
  for (const ordered_json& parameter : fit.at("parameters")) {
    Values* const values = parameter.contains("run") && !parameter.at("run").get<std::string>().empty() ? of_run(one, files, parameter.at("run")) : &one.values;
    if (!values) continue;
    ordered_json estimate = parameter;
    if (!parameter.at("identified").get<bool>()) estimate["value"] = estimate["std_error"] = nullptr;  // held at its start: the runs say nothing of it
    take_estimate(*values, parameter.at("name"), parameter.at("unit"), estimate);
  }
  for (const ordered_json& known : at(fit, "determined")) take_estimate(one.values, known.at("combination"), "", known);  // what is known where a parameter is not, in SI
}

void take_apparent_mass(BatchCase& one, const ordered_json& apparent) {
  take_estimate(one.values, "coefficient", "1", at(apparent, "apparent_mass_coefficient"));
  take_estimate(one.values, "mass", apparent.at("apparent_mass").at("unit"), apparent.at("apparent_mass"));
  for (const char* medium : {"dry", "wet"}) one.values.push_back({std::string(medium) + "_frequency", apparent.at(medium).at("unit"), at(apparent.at(medium), "frequency")});
}

void take_diagnosis(BatchCase& one, const ordered_json& diagnosis, const Strings& files) {
  std::string missing;
  ordered_json probability;
  for (const ordered_json& effect : diagnosis.at("missing")) {
    missing += (missing.empty() ? "" : " + ") + effect.at("effect").get<std::string>();
    probability = at(effect, "probability");
  }
  one.values.push_back({"verdict", "", diagnosis.at("verdict")});
  one.values.push_back({"missing", "", missing});
  one.values.push_back({"probability", "1", probability});
  one.values.push_back({"unexplained", "", diagnosis.at("unexplained").get<bool>() ? "true" : "false"});
  for (const ordered_json& run : diagnosis.at("improvement").at("runs"))
    if (Values* const values = of_run(one, files, run.at("file")); values && values->empty())  // a run that is fitted and left out in turn: as fitted
      for (const char* key : {"rms_before", "rms_after"}) values->push_back({key, run.at("unit"), at(run, key)});
}

/// Of a corrected record: its loads before the motion and at the end, and the largest.
void take_corrected(BatchCase& one, const std::string& text) {
  const CsvTable table = read_csv(text, 1, "corrected.csv");
  const auto column = [&](const std::string& name) {
    const auto found = std::find_if(table.columns.begin(), table.columns.end(), [&](const CsvColumn& c) { return c.name == name; });
    return found == table.columns.end() ? nullptr : &*found;
  };
  const auto take = [&](const std::string& name, const std::string& of, const CsvColumn* from, double value) {
    if (from) one.values.push_back({name + of, from->unit.empty() ? "1" : from->unit, std::isfinite(value) ? ordered_json(value) : ordered_json()});
  };
  const auto last = [](const CsvColumn* c) { return c ? c->value[c->value.size() - 1] : 0; };
  const auto first = [](const CsvColumn* c) { return c ? c->value[0] : 0; };
  const CsvColumn *circulatory = column("circulatory"), *circulatory_std = column("circulatory_std"), *load = column("normal_force"), *load_std = column("normal_force_std"), *chi2 = column("reduced_chi2");
  take("reduced_chi2", "", chi2, first(chi2));
  take("circulatory", "_before", circulatory, first(circulatory));
  take("circulatory", "_end", circulatory, last(circulatory));
  take("circulatory", "_end.std_error", circulatory_std, last(circulatory_std));
  if (!load) return;
  Eigen::Index peak = 0;
  load->value.cwiseAbs().maxCoeff<Eigen::PropagateNumbers>(&peak);
  take("normal_force", "_peak", load, load->value[peak]);
  take("normal_force", "_peak.std_error", load_std, load_std ? load_std->value[peak] : 0);
}

}  // namespace

void take_values(BatchCase& one, const std::string& text, const Strings& files) {
  if (one.command == "correct") return take_corrected(one, text);
  const ordered_json result = ordered_json::parse(text);
  one.by_run.resize(files.size());
  if (one.command == "check") take_check(one, result, files);
  if (one.command == "fit") take_fit(one, result, files);
  if (one.command == "apparent-mass") take_apparent_mass(one, result);
  if (one.command == "diagnose") take_diagnosis(one, result, files);
}

}  // namespace unrig
