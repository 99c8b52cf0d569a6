#include "fit/fit_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "core/effects/effect.h"
#include "core/rig/fingerprint.h"
#include "core/rig/given_files.h"
#include "core/law/law_effect.h"
#include "core/files/text_file.h"
#include "core/files/units.h"
#include "fit/fit_json.h"

namespace unrig {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

/// In how many names, from the file's own on backwards, two paths agree.
std::ptrdiff_t folders_in_common(const fs::path& a, const fs::path& b) {
  std::error_code none;
  const fs::path whole = fs::weakly_canonical(b, none), &other = whole.empty() ? b : whole;
  const std::vector<fs::path> left(a.begin(), a.end()), right(other.begin(), other.end());
  return std::mismatch(left.rbegin(), left.rend(), right.rbegin(), right.rend()).first - left.rbegin();
}

constexpr std::pair<Wagner, const char*> circulation_names[] = {
    {Wagner::within_1e4, "1e-4"}, {Wagner::within_1e6, "1e-6"}, {Wagner::jones, "jones"}, {Wagner::seed, "seed"}};

const char* name_of(Wagner which) {
  for (const auto& [value, name] : circulation_names)
    if (value == which) return name;
  return "";
}

/// That of `known` which is the recording `file`: the same path or the same file; where the fit's own file is no longer where it was, the one that agrees with it in most names.
std::string same_recording(const std::vector<std::string>& known, const fs::path& fit_file, const std::string& file) {
  if (std::find(known.begin(), known.end(), file) != known.end()) return file;
  std::string best;
  std::ptrdiff_t most_in_common = 0;
  for (const std::string& own : known) {
    std::error_code none;
    bool moved = true;
    for (const fs::path& there : {fs::path(own), fit_file.parent_path() / own}) {
      if (!fs::exists(there, none)) continue;
      if (same_file(there.string(), file)) return own;
      moved = false;
    }
    const std::ptrdiff_t in_common = folders_in_common(own, file);
    if (moved && in_common > most_in_common) best = own, most_in_common = in_common;
  }
  return best;
}

/// JSON knows no NaN.
json number(double x) { return std::isfinite(x) ? json(x) : json(nullptr); }

/// Variances over that of the white level that the channel counts with, corners in Hz.
void add_noise_colour(const FitResult& r, json& out) {
  out["noise_colour"] = json::array();
  for (const ChannelColour& one : r.noise_colour) {
    json parts = json::array();
    for (Eigen::Index i = 0; i < one.colour.corner.size(); ++i) parts.push_back({{"corner", one.colour.corner[i]}, {"unit", "Hz"}, {"variance", one.colour.power[i]}});
    out["noise_colour"].push_back({{"channel", one.channel}, {"white", one.colour.white}, {"parts", parts}});
    if (one.colour.falling.size() > 0) out["noise_colour"].back()["falling"] = std::vector<double>(one.colour.falling.begin(), one.colour.falling.end());
  }
}

std::vector<ChannelColour> read_noise_colour(const json& in) {
  std::vector<ChannelColour> all;
  for (const json& item : in.value("noise_colour", json::array())) {
    ChannelColour one;
    one.channel = item.at("channel").get<std::string>();
    one.colour.white = item.at("white").get<double>();
    std::vector<double> corner, power;
    for (const json& part : item.at("parts")) {
      corner.push_back(part.at("corner").get<double>());
      power.push_back(part.at("variance").get<double>());
      if (!(corner.back() > 0) || !(power.back() > 0)) throw std::invalid_argument("a part of \"noise_colour\" without a positive corner and variance");
    }
    if (!(one.colour.white > 0)) throw std::invalid_argument("a \"noise_colour\" without white noise");
    const auto falling = item.value("falling", std::vector<double>());
    constexpr std::size_t three = 3;
    if (!(falling.empty() || falling.size() == three) || std::any_of(falling.begin(), falling.end(), [](double v) { return !(v >= 0); }))
      throw std::invalid_argument("a \"noise_colour\" whose \"falling\" are not three variances of at least 0");
    one.colour.falling = Eigen::Map<const Eigen::VectorXd>(falling.data(), static_cast<Eigen::Index>(falling.size()));
    one.colour.corner = Eigen::Map<const Eigen::VectorXd>(corner.data(), static_cast<Eigen::Index>(corner.size()));
    one.colour.power = Eigen::Map<const Eigen::VectorXd>(power.data(), static_cast<Eigen::Index>(power.size()));
    all.push_back(std::move(one));
  }
  return all;
}

/// What the fit left of a run.
void read_left(const json& run, FittedRig& fit) {
  for (const json& channel : run.value("channels", json::array())) {
    if (!channel.contains("left")) continue;
    const json& left = channel["left"];
    const auto density = left.at("density").get<std::vector<double>>();
    LeftByFit one{run.value("file", ""), channel.at("name").get<std::string>(), run.value("in_stream", false), {left.at("from").get<double>(), {}}};
    one.power.density = Eigen::Map<const Eigen::VectorXd>(density.data(), static_cast<Eigen::Index>(density.size()));
    if (!(one.power.from > 0) || !(one.power.density.array() >= 0).all()) throw std::invalid_argument("a \"left\" without a positive frequency and densities of at least 0");
    fit.left.push_back(std::move(one));
  }
}

/// The numbers that stated their uncertainty, and their covariance with the parameters.
void add_givens(const FitResult& r, json& out) {
  out["givens"] = json::array();
  for (const FittedGiven& g : r.givens) {
    json item = {{"name", g.name}, {"stated", g.stated}, {"stated_std", g.stated_std}, {"value", number(g.value)}, {"std_error", number(g.std_error)}, {"unit", g.unit}};
    if (!g.run.empty()) item["run"] = g.run;
    out["givens"].push_back(item);
  }
  out["joint_covariance"] = json::array();
  for (Eigen::Index i = 0; i < r.joint_covariance.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index j = 0; j < r.joint_covariance.cols(); ++j) row.push_back(number(r.joint_covariance(i, j)));
    out["joint_covariance"].push_back(row);
  }
}

void read_givens(const json& in, FittedRig& fit) {
  for (const json& item : in.at("givens")) {
    FittedGiven g;
    g.name = item.at("name").get<std::string>();
    g.unit = item.value("unit", "");
    g.run = item.value("run", "");
    g.stated = item.at("stated").get<double>();
    g.stated_std = item.at("stated_std").get<double>();
    g.value = item.at("value").get<double>();
    g.std_error = item.at("std_error").get<double>();
    fit.givens.push_back(std::move(g));
  }
  const json& rows = in.at("joint_covariance");
  const auto n = static_cast<Eigen::Index>(fit.parameters.size() + fit.givens.size());
  fit.joint_covariance.resize(n, n);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j) fit.joint_covariance(i, j) = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
}

/// A law of a fit. What the fit learnt stands in place of what the law's file says of it: its parameters are of these runs.
Law read_fitted_law(const json& item, const std::string& path) {
  const InputError::Place place{path + ", law " + item.value("name", ""), 0};
  Law law = parse_law(item.at("text").get<std::string>(), place.file);
  if (!item.contains("learnt_on")) return law;
  law.learnt_on.clear();
  for (const auto& [name, range] : item["learnt_on"].items()) {
    const auto symbol = std::find(symbol_names.begin(), symbol_names.end(), name);
    if (symbol == symbol_names.end()) throw std::invalid_argument(fmt::format("a law learnt on \"{}\", which is no symbol", name));
    const auto s = static_cast<std::size_t>(symbol - symbol_names.begin());
    const UnitScale scale = unit_scale(range.at(2).get<std::string>(), symbol_units[s], place, "learnt_on." + name);
    const Range in_si{scale(range.at(0).get<double>()), scale(range.at(1).get<double>())};
    if (!(in_si.lower <= in_si.upper)) throw std::invalid_argument(fmt::format("a law learnt on {} from {:g} to {:g}", name, in_si.lower, in_si.upper));
    law.learnt_on.emplace(static_cast<Symbol>(s), in_si);
  }
  return law;
}

/// The laws at work, each with its whole file, and how far these runs took it.
json laws_at_work(const FitResult& r, const std::vector<std::shared_ptr<const Effect>>& laws) {
  json list = json::array();
  for (const std::string& id : r.effects) {
    if (!is_law_id(id)) continue;
    const auto found = std::find_if(laws.begin(), laws.end(), [&](const auto& law) { return law->id == id; });
    if (found == laws.end()) throw std::invalid_argument(fmt::format("the fit has {} at work, which is not among the laws given", id));
    const Law& law = law_of(**found);
    json item = {{"effect", id}, {"name", law.name}, {"class", law.kind()}, {"acts_on", to_string(law.acts_on)}, {"force", law.force_text}};
    if (law.memory) item["memory"] = law.memory_text;
    if (const auto learnt_on = r.learnt_on.find(id); learnt_on != r.learnt_on.end()) item["learnt_on"] = learnt_json<json>(learnt_on->second);
    item["file"] = law.file;
    item["text"] = law.text;
    list.push_back(item);
  }
  return list;
}

}  // namespace

std::string to_json(const FitResult& r, const std::vector<std::shared_ptr<const Effect>>& laws) {
  json out;
  out["unrig"] = "fit";
  out["rig"] = r.rig_file;
  if (!r.rig_fingerprint.empty()) out["rig_fingerprint"] = r.rig_fingerprint;
  if (!r.program.empty()) out["program"] = r.program;
  if (!r.command.empty()) out["command"] = r.command;
  out["converged"] = r.converged;
  out["message"] = r.message;
  if (!r.no_answer.empty()) out["no_answer"] = r.no_answer;
  out["reduced_chi2"] = number(r.reduced_chi2());
  out["chi2"] = number(r.chi2);
  out["observations"] = r.observations;
  out["variables"] = r.variables;
  out["aic"] = number(r.aic());
  out["bic"] = number(r.bic());
  out["circulation"] = name_of(r.circulation);
  out["modes"] = {{"normal", r.normal_modes}, {"torsion", r.torsion_modes}};
  out["standard_errors"] = r.coloured ? "from the residuals' own spectra (coloured)" : "white residuals, times sqrt(reduced chi-square) where that exceeds one";
  if (!r.effects.empty()) out["effects"] = r.effects;
  if (const json at_work = laws_at_work(r, laws); !at_work.empty()) out["laws"] = at_work;
  if (r.law_steps > 1) out["law_steps"] = r.law_steps;
  out["parameters"] = json::array();
  for (const FittedParameter& p : r.parameters) {
    json item = {{"name", p.name},   {"value", number(p.value)}, {"std_error", p.std_error > 0 ? number(p.std_error) : json(nullptr)},
                 {"unit", p.unit},   {"identified", p.identified}, {"start", number(p.start)}};
    if (std::isfinite(p.std_error) && p.std_error_white > 0) {
      item["std_error_white"] = number(p.std_error_white);
      item["std_error_coloured"] = number(p.std_error_coloured);
    }
    if (!p.run.empty()) item["run"] = p.run;
    if (!p.advice.empty()) item["advice"] = p.advice;
    out["parameters"].push_back(item);
  }
  if (!r.determined.empty()) out["determined"] = json::array();
  for (const DeterminedCombination& c : r.determined)
    out["determined"].push_back({{"combination", c.combination}, {"value", number(c.value)}, {"std_error", number(c.std_error)}, {"settled_by", c.settled_by}});
  if (!r.profiles.empty()) out["profile"] = json::array();
  for (const ProfiledParameter& p : r.profiles) {
    json item = {{"name", p.name}, {"unit", p.unit}, {"intervals", json::array()}};
    if (!p.run.empty()) item["run"] = p.run;
    for (const ProfileInterval& i : p.intervals)
      item["intervals"].push_back({{"confidence", i.confidence}, {"lower", number(i.lower.value)}, {"upper", number(i.upper.value)}, {"text", i.text}});
    out["profile"].push_back(item);
  }
  out["correlation"] = json::array();
  for (Eigen::Index i = 0; i < r.correlation.rows(); ++i) {
    json row = json::array();
    for (Eigen::Index j = 0; j < r.correlation.cols(); ++j) row.push_back(number(r.correlation(i, j)));
    out["correlation"].push_back(row);
  }
  if (!r.givens.empty()) add_givens(r, out);
  if (!r.noise_colour.empty()) add_noise_colour(r, out);
  out["runs"] = json::array();
  for (const FittedRun& run : r.runs) {
    json channels = json::array();
    for (const FittedChannel& c : run.channels) {
      channels.push_back({{"name", c.name}, {"unit", c.unit}, {"samples", c.samples}, {"missing", c.missing}, {"spikes", c.spikes + static_cast<Eigen::Index>(c.bad)}, {"clipped", c.clipped},
                          {"rms_residual", number(c.rms_residual)}, {"noise", number(c.noise)}});
      if (c.left.density.size() > 0) channels.back()["left"] = {{"from", c.left.from}, {"unit", "Hz"}, {"density", std::vector<double>(c.left.density.begin(), c.left.density.end())}};
    }
    const FittedChannel& first = run.channels.front();
    out["runs"].push_back({{"file", run.file}, {"fingerprint", run.fingerprint}, {"onset_angle", number(run.onset_angle)}, {"in_stream", run.in_stream}, {"samples", run.samples}, {"rms_residual", number(first.rms_residual)}, {"noise", number(first.noise)},
                           {"unit", first.unit}, {"reduced_chi2", number(run.reduced_chi2())}, {"whiteness", number(run.whiteness)}, {"explained", run.explained()},
                           {"followed", number(run.followed)}, {"set_aside", run.aside}, {"channels", channels}});
    if (run.hold) out["runs"].back()["release"] = run.hold->release, out["runs"].back()["held"] = run.hold->samples;
  }
  out["warnings"] = r.warnings;
  return out.dump(2) + "\n";
}

namespace {

InputError no_fit(const std::string& path, const std::string& found) {
  return {{path, 0}, found, "wanted a fit.json written by `unrig fit`", "Give the file that `unrig fit -o` wrote."};
}

}  // namespace

FittedRig read_fit(const std::string& path) {
  const json in = json::parse(read_text(path), nullptr, false);
  if (in.is_discarded()) throw no_fit(path, "not valid JSON");
  return read_fit(in, path);
}

FittedRig read_fit(const json& in, const std::string& path) {
  const auto refuse = [&](const std::string& found) { return no_fit(path, found); };
  if (!in.is_object() || in.value("unrig", "") != "fit") throw refuse("no key \"unrig\" with the value \"fit\"");
  try {
    FittedRig fit;
    fit.file = path;
    fit.rig_file = in.value("rig", "");
    fit.rig_fingerprint = in.value("rig_fingerprint", "");
    const std::string circulation = in.value("circulation", "1e-4");
    fit.circulation = wagner_from_name(circulation);
    if (in.contains("modes")) {
      fit.normal_modes = in["modes"].value("normal", 0);
      fit.torsion_modes = in["modes"].value("torsion", 0);
    }
    fit.effects = in.value("effects", std::vector<std::string>{});
    Rig laws;
    for (const json& item : in.value("laws", json::array())) add_law(laws, read_fitted_law(item, path));
    fit.laws = laws.laws;
    for (const std::string& id : fit.effects) {
      if (is_law_id(id) && std::none_of(fit.laws.begin(), fit.laws.end(), [&](const auto& law) { return law->id == id; })) throw refuse(fmt::format("the law \"{}\" at work, but not among the \"laws\"", id));
      effect(laws, id);  // refuses what this version does not know
    }
    fit.law_steps = in.value("law_steps", Eigen::Index{1});
    if (fit.law_steps < 1) throw refuse(fmt::format("\"law_steps\" of {}", fit.law_steps));
    for (const json& item : in.at("parameters")) {
      FittedParameter p;
      p.name = item.at("name").get<std::string>();
      p.unit = item.value("unit", "");
      p.run = item.value("run", "");
      p.value = item.at("value").get<double>();
      p.std_error = item.at("std_error").is_number() ? item.at("std_error").get<double>() : std::nan("");
      if (p.std_error <= 0) throw refuse(fmt::format("the standard error of {} is {:g}, where one is above zero or null", p.name, p.std_error));
      p.identified = item.value("identified", true);
      for (const std::string& id : fit.effects) {
        const Effect& e = effect(laws, id);
        for (const std::vector<Parameter>* of_rig : {&e.parameters, &e.modal_parameters})
          for (std::size_t k = 0; k < of_rig->size(); ++k)
            if (p.name == id + "." + (*of_rig)[k].name) p.effect = id, p.place = static_cast<int>(k);
        if (p.effect.empty() && p.name.starts_with(id + "."))
          throw refuse(fmt::format("a parameter {}, which the effect {} of this version does not have", p.name, id));
      }
      fit.parameters.push_back(p);
    }
    const auto n = static_cast<Eigen::Index>(fit.parameters.size());
    fit.correlation = Eigen::MatrixXd::Identity(n, n);
    if (in.contains("correlation")) {
      const json& rows = in["correlation"];
      if (rows.size() != fit.parameters.size()) throw refuse(fmt::format("{} parameters but a correlation matrix of {} rows", n, rows.size()));
      for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < n; ++j) {
          double& c = fit.correlation(i, j);
          c = rows.at(static_cast<std::size_t>(i)).at(static_cast<std::size_t>(j)).get<double>();
          if (!(std::abs(c) <= 1) || (i == j && c != 1)) throw refuse(fmt::format("a correlation of {:g} in row {}, column {}", c, i + 1, j + 1));
        }
    }
    if (in.contains("givens")) read_givens(in, fit);
    fit.noise_colour = read_noise_colour(in);
    for (const json& run : in.value("runs", json::array())) {
      fit.runs.push_back(run.value("file", ""));
      fit.fingerprints.push_back(run.value("fingerprint", ""));
      read_left(run, fit);
      fit.onset_angles.push_back(run.contains("onset_angle") && run["onset_angle"].is_number() ? run["onset_angle"].get<double>() : std::nan(""));
    }
    return fit;
  } catch (const json::exception& e) {
    throw refuse(e.what());
  } catch (const std::invalid_argument& e) {
    throw refuse(e.what());
  }
}

Rig with_laws(Rig rig, const FittedRig& fit) {
  rig.laws = fit.laws;
  return rig;
}

bool FittedRig::had_other_readings(const Run& run, const Rig& rig) const {
  const auto place = static_cast<std::size_t>(std::find(runs.begin(), runs.end(), recorded_as(run.file)) - runs.begin());
  if (place >= fingerprints.size() || fingerprints[place].empty()) return false;
  return fingerprints[place] != unrig::fingerprint(run, rig) && fingerprints[place] != unrig::fingerprint(run);  // an earlier version counted every column
}

std::vector<std::string> FittedRig::rig_differs_in(const Rig& rig) const {
  if (rig_fingerprint.empty()) return {};
  std::vector<std::string> parts = parts_that_differ(rig_fingerprint, unrig::fingerprint(rig));
  std::erase_if(parts, [](const std::string& part) { return part == "sensors" || part == "modes"; });
  return parts;
}

std::string fingerprint(const FittedRig& fit) {
  const auto run_of = [&](const FittedParameter& p) {
    const auto place = static_cast<std::size_t>(std::find(fit.runs.begin(), fit.runs.end(), p.run) - fit.runs.begin());
    return place < fit.fingerprints.size() ? fit.fingerprints[place] : p.run;
  };
  std::vector<std::string> items{fmt::format("circulation {} modes {} {} steps {} rig {}", name_of(fit.circulation), fit.normal_modes, fit.torsion_modes, fit.law_steps, fit.rig_fingerprint)};
  for (const std::string& id : fit.effects) items.push_back("effect " + id);
  for (const auto& law : fit.laws) items.push_back("law " + law_of(*law).text);
  std::vector<std::string> names;
  for (const FittedParameter& p : fit.parameters) {
    names.push_back(p.name + " " + run_of(p));
    items.push_back(fmt::format("{} = {} +/- {} {}", names.back(), p.value, p.std_error, p.identified));
  }
  for (std::size_t i = 0; i < names.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      items.push_back(fmt::format("{} with {}: {}", std::min(names[i], names[j]), std::max(names[i], names[j]), fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j))));
  std::sort(items.begin(), items.end());
  std::string text;
  for (const std::string& item : items) text += item + "\n";
  return fingerprint(std::string_view(text));
}

std::string other_rig(const Rig& rig, const FittedRig& fit) {
  std::vector<std::string> parts = fit.rig_differs_in(rig);
  if (parts.empty()) return "";
  for (std::string& part : parts) part = part == "structure" ? "its structure (elements, modes, where gauge and strips sit)" : "[" + part + "]";
  return fmt::format("other numbers in {} than the rig{} that {} was fitted to", fmt::join(parts, ", "), fit.rig_file.empty() ? "" : " " + fit.rig_file, fit.file);
}

std::string FittedRig::recorded_as(const std::string& run_file) const { return same_recording(runs, file, run_file); }

const FittedParameter* FittedRig::find(const std::string& name, const std::string& run_file) const {
  std::vector<std::string> own;
  for (const FittedParameter& p : parameters)
    if (p.name == name && !p.run.empty()) own.push_back(p.run);
  const std::string run = same_recording(own, file, run_file);
  const auto found = std::find_if(parameters.begin(), parameters.end(), [&](const FittedParameter& p) { return p.name == name && (p.run.empty() || (!run.empty() && p.run == run)); });
  return found == parameters.end() ? nullptr : &*found;
}

void refuse_other_rig(const Rig& rig, const FittedRig& fit) {
  std::vector<std::string> parts = fit.rig_differs_in(rig);
  std::erase(parts, "gauge");  // another amplifier: the structure that was fitted is the same
  if (!parts.empty())
    throw InputError({rig.file, 0}, other_rig(rig, fit), "wanted the rig of the fit: its parameters multiply the numbers of its rig file", "Fit this rig, or give the rig file as it was.");
}

void check_is_fit_of(const AeroelasticModel& model, const FittedRig& fit, const std::string& run_file) {
  refuse_other_rig(model.rig(), fit);
  for (const Parameter& p : model.parameters())
    if (!p.per_run && !fit.find(p.name, run_file))
      throw InputError({fit.file, 0}, "no parameter \"" + p.name + "\"", "wanted a fit of the rig " + model.rig().file, "Fit this rig to its free decays and steps first.");
}

double FittedRig::value(const std::string& name, const std::string& run_file, double missing) const {
  const FittedParameter* p = find(name, run_file);
  return p ? p->value : missing;
}

Eigen::VectorXd theta_for(const AeroelasticModel& model, const FittedRig& fit, const std::string& run_file, double onset_angle) {
  const auto away = [&](const FittedParameter& p) {  // of the run that a parameter belongs to
    const auto run = static_cast<std::size_t>(std::find(fit.runs.begin(), fit.runs.end(), p.run) - fit.runs.begin());
    const double apart = run < fit.onset_angles.size() ? std::abs(fit.onset_angles[run] - onset_angle) : std::nan("");
    return std::isfinite(apart) ? apart : 0;
  };
  Eigen::VectorXd theta = model.start_values();
  for (std::size_t j = 0; j < model.parameters().size(); ++j) {
    const Parameter& p = model.parameters()[j];
    double& value = theta[static_cast<Eigen::Index>(j)];
    if (const FittedParameter* fitted = fit.find(p.name, run_file)) {
      if (!(fitted->value >= p.lower && fitted->value <= p.upper))
        throw InputError({fit.file, 0}, fmt::format("{} is {:g}", p.name, fitted->value), fmt::format("wanted a value from {:g} to {:g}", p.lower, p.upper), "Give the file that `unrig fit -o` wrote, as it is.");
      value = fitted->value;
      continue;
    }
    double sum = 0, nearest = std::numeric_limits<double>::infinity();
    int count = 0;
    for (const FittedParameter& other : fit.parameters) {
      if (other.name != p.name || away(other) > nearest) continue;
      if (away(other) < nearest) sum = count = 0, nearest = away(other);
      sum += other.value, ++count;
    }
    if (count > 0) value = sum / count;
  }
  return theta;
}

}  // namespace unrig
