#include "fit/propose/explanations.h"

#include <algorithm>
#include <filesystem>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "core/effects/effect.h"
#include "core/files/text_file.h"
#include "fit/fit_files.h"
#include "fit/fit_json.h"

namespace unrig {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr const char* law_entry = "law";

std::string place_of(const std::string& path, const std::string& diagnosis) {
  const fs::path folder = fs::path(diagnosis).parent_path();
  std::error_code none;
  for (const fs::path& there : {fs::path(path), folder / path, folder / fs::path(path).filename()})
    if (fs::is_regular_file(there, none)) return there.string();
  throw InputError({diagnosis, 0}, fmt::format("{} is not where the diagnosis says", path), "wanted the file there, or beside the diagnosis", "Call it from the folder in which diagnose was called.");
}

std::string name_of(const Explanation& e) {
  std::vector<std::string> parts = e.effects;
  for (const Law& law : e.laws) parts.push_back(fmt::format("{} ({})", law.force_text, to_string(law.acts_on)));
  return parts.empty() ? "nothing missing" : fmt::format("{}", fmt::join(parts, " + "));
}

bool is_listed(const std::string& id) {
  return std::any_of(effects().begin(), effects().end(), [&](const Effect& e) { return e.id == id; });
}

/// Collects the explanations of a diagnosis.
class Reader {
 public:
  Reader(const json& diagnosis, std::string path) : diagnosis_(diagnosis), path_(std::move(path)) {}

  void read(Rivals& rivals) {
    Explanation winner;
    struct Replaced {
      std::size_t law;
      Law by;
    };
    std::vector<Replaced> replaced;
    for (const json& missing : diagnosis_.at("missing")) {
      const std::string id = missing.at("effect");
      if (id == law_entry) {
        const json& law = missing.at("law");
        winner.laws.push_back(law_of_text(law, "the law of `missing`"));
        for (const json& rival : law.value("rivals", json::array())) {
          if (rival.contains("text")) replaced.push_back({winner.laws.size() - 1, law_of_text(rival, "a rival")});
          else rivals.left_out.push_back(rival.value("force", std::string("a rival")) + ": the diagnosis does not hold it as a law file (text)");
        }
      } else if (is_listed(id)) {
        winner.effects.push_back(id);
      } else {
        rivals.left_out.push_back(id + ": no law that could be simulated; the runs are simulated without it");
      }
    }
    add(winner, rivals);
    for (const json& set : diagnosis_.value("equivalent", json::array())) {
      Explanation other;
      std::string why;
      for (const std::string id : set) {
        if (is_listed(id)) other.effects.push_back(id);
        else why = id + ": cannot be simulated";
      }
      if (why.empty()) add(other, rivals);
      else rivals.left_out.push_back(why);
    }
    for (const Replaced& r : replaced) {
      Explanation other = winner;
      other.laws[r.law] = r.by;
      add(other, rivals);
    }
  }

 private:
  Law law_of_text(const json& holder, const std::string& what) const {
    const std::string text = holder.at("text");
    try {
      return parse_law(text, path_ + ": " + what);
    } catch (const InputError& e) {
      throw InputError({path_, 0}, fmt::format("{} cannot be read: {}", what, e.what()), "wanted the text of a law file", "");
    }
  }

  static void add(Explanation e, Rivals& rivals) {
    e.name = name_of(e);
    rivals.explanations.push_back(std::move(e));
  }

  const json& diagnosis_;
  std::string path_;
};

void read_inputs(const FittedRig& fit, const std::string& path, Rivals& rivals) {
  const std::string rig = place_of(fit.rig_file, path);
  rivals.rig = read_rig(rig);
  refuse_other_rig(rivals.rig, fit);
  rivals.inputs.push_back(rig);
  for (const std::string& file : fit.runs) {
    const std::string there = place_of(file, path);
    Run run = read_run(there);
    if (fit.had_other_readings(run, rivals.rig)) throw InputError({there, 0}, "the readings are others than those of the diagnosis", "wanted the recording that was diagnosed", "Diagnose anew.");
    rivals.runs.push_back(std::move(run));
    rivals.inputs.push_back(there);
  }
  rivals.circulation = fit.circulation;
}

}  // namespace

Rivals read_rivals(const std::string& path) {
  const std::string wanted = "wanted the diagnosis.json of `unrig diagnose`";
  json diagnosis;
  Rivals rivals;
  try {
    diagnosis = json::parse(read_text(path));
    if (!diagnosis.is_object() || diagnosis.value("unrig", "") != "diagnosis") throw InputError({path, 0}, "no diagnosis", wanted, "");
    Reader(diagnosis, path).read(rivals);
    read_inputs(read_fit(diagnosis.at("fit"), path), path, rivals);
  } catch (const json::exception& e) {
    throw InputError({path, 0}, fmt::format("not as expected ({})", e.what()), wanted, "");
  }
  if (rivals.explanations.size() < 2) {
    std::string why;
    for (const std::string& one : rivals.left_out) why += " Left out: " + one + ".";
    throw InputError({path, 0}, "the diagnosis leaves no two explanations", "wanted one with sets in `equivalent`, or a law with rivals", "There is nothing to decide." + why);
  }
  return rivals;
}

}  // namespace unrig
