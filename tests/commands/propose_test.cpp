// `unrig propose`: the run that decides between laws that the runs at hand cannot tell apart. Recordings are by an integrator that shares no code with the program.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/files/text_file.h"
#include "core/files/toml_table.h"
#include "tests/commands/run_unrig.h"
#include "tests/support/long_tests.h"

namespace unrig {
namespace {

using nlohmann::json;
using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double mass = 2, hertz = 5, ratio = 0.005, gain = 1000, dt = 0.005, noise = 0.03;
constexpr int samples = 600;
const double stiffness = mass * std::pow(2 * std::numbers::pi * hertz, 2), damping = 2 * ratio * mass * 2 * std::numbers::pi * hertz;

const std::string rig_text = "unrig_rig = 1\nname = \"oscillator\"\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"5 Hz\"\ndamping_ratio = 0.005\ngauge_gain = \"1000 N/m\"\n";

/// A law of damping: the force, and its file with these first values.
struct DampingLaw {
  std::function<double(double v)> force;
  std::function<std::string(double size)> text;
};

const DampingLaw power{[](double v) { return -std::pow(std::abs(v), 1.5) * (v > 0 ? 1 : -1); }, [](double size) {
                         return "unrig_law = 1\nname = \"power\"\nacts_on = \"normal\"\nforce = \"-c * abs(v)^1.5 * sign(v)\"\n[parameters]\nc = { start = \"" + std::to_string(size) + " N.s^1.5/m^1.5\" }\n";
                       }};
const DampingLaw bounded{[](double v) { return -0.2 * std::tanh(v / 0.2); }, [](double size) {
                           return "unrig_law = 1\nname = \"bounded\"\nacts_on = \"normal\"\nforce = \"-f * tanh(v / w)\"\n[parameters]\nf = { start = \"" + std::to_string(size) +
                                  " N\" }\nw = { start = \"0.2 m/s\", lower = \"0.02 m/s\", upper = \"2 m/s\" }\n";
                         }};

/// Readings of a decay from `load`, by the classical Runge-Kutta method in four steps a sample, in a run file.
std::string decay(const TemporaryDirectory& directory, const std::string& name, const DampingLaw& law, double load, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> white(0, noise);
  std::ostringstream text;
  text << "# unrig_run = 1\n# kind = \"pluck\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  text.precision(9);
  constexpr int finer = 4;
  const double h = dt / finer;
  double x = load / stiffness, v = 0;
  const auto acceleration = [&](double a, double b) { return (law.force(b) - damping * b - stiffness * a) / mass; };
  for (int k = 0; k < samples; ++k) {
    text << dt * k << "," << gain * x + white(random) << "\n";
    for (int i = 0; i < finer; ++i) {
      const double v1 = v, a1 = acceleration(x, v1), v2 = v + h / 2 * a1, a2 = acceleration(x + h / 2 * v1, v2);
      const double v3 = v + h / 2 * a2, a3 = acceleration(x + h / 2 * v2, v3), v4 = v + h * a3, a4 = acceleration(x + h * v3, v4);
      x += h / 6 * (v1 + 2 * v2 + 2 * v3 + v4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
  }
  return directory.file(name, text.str());
}

/// BIC with each run's own variance.
double cost(const json& fit) {
  double sum = 0, count = 0;
  for (const json& run : fit["runs"]) {
    sum += 2 * run["samples"].get<double>() * std::log(run["rms_residual"].get<double>());
    count += run["samples"].get<double>();
  }
  return sum + fit["variables"].get<double>() * std::log(count);
}

double size_of_law(const json& fit) {
  for (const json& p : fit["parameters"])
    if (p["name"].get<std::string>().starts_with("law:")) return p["value"];
  return 0;
}

/// A rig and three decays from small loads.
class Laboratory {
 public:
  Laboratory(const TemporaryDirectory& directory, const DampingLaw& truth) : directory_(directory), truth_(truth), rig_(directory.file("rig.toml", rig_text)) {
    runs_ = {decay(directory, "pluck_1.csv", truth, 6, 11), decay(directory, "pluck_2.csv", truth, 4, 12), decay(directory, "pluck_3.csv", truth, 5, 13)};
  }

  /// The best fit from these sizes of the law, to the runs at hand and more.
  json fit(const DampingLaw& law, const std::vector<double>& sizes, const std::vector<std::string>& more = {}) const {
    json best;
    for (const double size : sizes) {
      const std::string file = directory_.file("law.toml", law.text(size)), out = directory_.path("fit.json");
      std::vector<std::string> words{"fit", "--anyway", "--rig", rig_, "--law", file};
      words.insert(words.end(), runs_.begin(), runs_.end());
      words.insert(words.end(), more.begin(), more.end());
      words.insert(words.end(), {"-o", out});
      const Finished fitted = run_unrig(directory_, words);
      EXPECT_NE(fitted.status, 2) << fitted.err;
      json one = json::parse(read_text(out));
      if (best.is_null() || cost(one) < cost(best)) best = std::move(one);
    }
    return best;
  }

  /// A diagnosis with the laws as rivals, as `diagnose` writes it.
  std::string diagnosis() {
    const json one = fit(power, {0.5, -0.5}), other = fit(bounded, {0.5, -0.5});
    size_of_power_ = size_of_law(one);
    size_of_bounded_ = size_of_law(other);
    const double lead = 0.5 * (cost(other) - cost(one));
    EXPECT_LT(std::abs(lead), 5) << "the runs at hand decide already";
    const json rival = {{"force", "-f * tanh(v / w)"}, {"distance_sigma", 1}, {"log_odds", lead}, {"text", bounded.text(size_of_bounded_)}};
    const json law = {{"acts_on", "normal"}, {"class", "damping"}, {"force", "-c * abs(v)^1.5 * sign(v)"}, {"text", power.text(size_of_power_)}, {"rivals", {rival}}};
    return directory_.file("diagnosis.json", json{{"unrig", "diagnosis"}, {"missing", {{{"effect", "law"}, {"law", law}}}}, {"equivalent", json::array()}, {"fit", one}}.dump(1));
  }

  /// How far the true law leads once a decay from this load is there too.
  double lead_with(double load, unsigned seed) const {
    const std::string next = decay(directory_, "next.csv", truth_, load, seed);
    const double of_power = cost(fit(power, {size_of_power_}, {next})), of_bounded = cost(fit(bounded, {size_of_bounded_}, {next}));
    return 0.5 * (&truth_ == &power ? of_bounded - of_power : of_power - of_bounded);
  }

  const std::string& rig() const { return rig_; }
  const std::vector<std::string>& runs() const { return runs_; }

 private:
  const TemporaryDirectory& directory_;
  const DampingLaw& truth_;
  std::string rig_;
  std::vector<std::string> runs_;
  double size_of_power_ = 0, size_of_bounded_ = 0;
};

Finished propose(const TemporaryDirectory& directory, const std::string& diagnosis, const std::string& limits, const std::string& plan, std::vector<std::string> more = {}) {
  std::vector<std::string> words{"propose", diagnosis, "--limits", directory.file("limits.toml", limits), "-o", plan};
  words.insert(words.end(), more.begin(), more.end());
  return run_unrig(directory, words);
}

TomlTable read_plan(const std::string& path) { return TomlTable::parse(read_text(path), path, ""); }

/// From recordings of the law to the run that decides for it. `if_it`: where the plan says what that run is worth if the law is true.
void decides(const TemporaryDirectory& directory, const Laboratory& laboratory, const std::string& diagnosis, const char* if_it) {
  const std::string path = directory.path("plan.toml");
  const Finished finished = propose(directory, diagnosis, "unrig_limits = 1\npluck_load = \"60 N\"\n", path, {"--draws", "2", "--refits", "1"});
  EXPECT_NE(finished.status, 2) << finished.err;
  const TomlTable plan = read_plan(path), comparison = plan.tables("comparison").front(), first = plan.tables("run").front(), best = comparison.tables("run").front();
  const double load = first.quantity("release_load", "N");
  EXPECT_GT(load, 2 * 6) << "small loads are what cannot tell";
  EXPECT_EQ(best.text("file"), "plan_1.csv");
  const double expected = best.number(if_it);
  EXPECT_GT(expected, 13.6) << "enough to yield 5 in 95 of 100";
  EXPECT_GT(expected, 10 * std::max(1.0, comparison.number("log_odds_of_repeat")));
  EXPECT_EQ(best.integer("refits"), 4 + 4 * 2);
  EXPECT_EQ(best.integer("refits_arrived"), best.integer("refits"));

  const std::string motion = directory.path(first.text("file")), out = directory.path("simulated.csv");
  const Finished simulated = run_unrig(directory, {"simulate", "--rig", laboratory.rig(), "--run", motion, "--release-load", first.text("release_load"), "-o", out});
  EXPECT_EQ(simulated.status, 0) << simulated.err;
  EXPECT_THAT(read_text(out), HasSubstr("gauge [N]"));

  const int count = test::long_tests_wanted() ? 10 : 1;
  for (int k = 0; k < count; ++k) EXPECT_GT(laboratory.lead_with(load, 100 + static_cast<unsigned>(k)), 5) << "decay " << k;
}

TEST(Propose, NamesAPluckThatDecidesForABoundedLaw) {
  const TemporaryDirectory directory;
  Laboratory laboratory(directory, bounded);
  decides(directory, laboratory, laboratory.diagnosis(), "if_second");
}

TEST(Propose, NamesAPluckThatDecidesForAPowerAndSaysWhereNoneDoes) {
  const TemporaryDirectory directory;
  Laboratory laboratory(directory, power);
  const std::string diagnosis = laboratory.diagnosis();
  decides(directory, laboratory, diagnosis, "if_first");

  const std::string small = "unrig_limits = 1\npluck_load = \"3 N\"\n", path = directory.path("none.toml");
  const Finished finished = propose(directory, diagnosis, small, path, {"--refits", "1", "--draws", "0", "--runs", "2"});
  EXPECT_EQ(finished.status, 1) << finished.err;
  EXPECT_THAT(finished.out, HasSubstr("no run within your limits decides: the best, free decay at 1.2 kg/m^3, released from"));
  const TomlTable plan = read_plan(path);
  EXPECT_FALSE(plan.tables("comparison").front().boolean_or("decides", true));
  EXPECT_EQ(plan.tables("run").size(), 2u);
  EXPECT_TRUE(std::filesystem::exists(directory.path("none_2.csv")));
  EXPECT_FALSE(std::filesystem::exists(directory.path("none_3.csv")));
}

/// A diagnosis with sets of the list that it could not tell apart, from a fit without effects.
std::string equivalent(const TemporaryDirectory& directory, const std::string& rig, const std::vector<std::string>& runs) {
  std::vector<std::string> words{"fit", "--anyway", "--rig", rig};
  words.insert(words.end(), runs.begin(), runs.end());
  words.insert(words.end(), {"-o", directory.path("fit.json")});
  EXPECT_NE(run_unrig(directory, words).status, 2);
  const json missing = {{"effect", "quadratic-drag"}}, fit = json::parse(read_text(directory.path("fit.json")));
  return directory.file("diagnosis.json", json{{"unrig", "diagnosis"}, {"missing", {missing}}, {"equivalent", {{"cubic-damping"}}}, {"fit", fit}}.dump(1));
}

TEST(Propose, TakesSetsOfEffectsThatADiagnosisCannotTellApart) {
  const TemporaryDirectory directory;
  const Laboratory laboratory(directory, power);
  const std::string path = directory.path("plan.toml");
  const std::string diagnosis = equivalent(directory, laboratory.rig(), laboratory.runs()), limits = "unrig_limits = 1\npluck_load = \"60 N\"\nforce = \"5 N\"\n";
  const Finished finished = propose(directory, diagnosis, limits, path, {"--refits", "1", "--draws", "0"});
  EXPECT_NE(finished.status, 2) << finished.err;
  EXPECT_THAT(finished.out, AllOf(HasSubstr("quadratic-drag  or  cubic-damping"), HasSubstr("sweep of the force from 2.5 to 10 Hz, amplitude 5 N")));
  const std::string before = read_text(path);
  propose(directory, diagnosis, limits, path, {"--refits", "1", "--draws", "0", "--threads", "1"});
  EXPECT_EQ(read_text(path), before) << "the same plan in any number of threads";
}

TEST(Propose, RefusesWhatItCannotUseAndWritesNothing) {
  const TemporaryDirectory directory;
  const Laboratory laboratory(directory, power);
  const std::string diagnosis = equivalent(directory, laboratory.rig(), laboratory.runs()), path = directory.path("plan.toml"), good = "unrig_limits = 1\npluck_load = \"60 N\"\n";
  const auto refused = [&](const std::string& file, const std::string& limits, const std::string& why) {
    const Finished finished = propose(directory, file, limits, path);
    EXPECT_EQ(finished.status, 2);
    EXPECT_THAT(finished.err, HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(path));
  };
  refused(diagnosis, good + "pluck = \"1 N\"\n", "limits.toml:3: ");
  refused(diagnosis, "unrig_limits = 1\nspeed = \"1 m/s\"\n", "no run is possible; wanted one at least of pluck_load");
  refused(diagnosis, "unrig_limits = 1\nangle = [\"2 deg\", \"10 deg\"]\n", "rate");
  refused(diagnosis, "unrig_limits = 1\nangle = [\"12 deg\", \"10 deg\"]\nrate = \"10 deg/s\"\n", "wanted the lower one first");
  refused(diagnosis, "unrig_limits = 1\nangle = [\"2 deg\", \"10 deg\"]\nrate = \"10 deg/s\"\n", "no run within these limits is possible with this rig");
  refused(diagnosis, "unrig_limits = 1\npluck_load = \"-1 N\"\n", "wanted a value above zero");
  refused(directory.path("fit.json"), good, "no diagnosis");
  json changed = json::parse(read_text(diagnosis));
  changed["equivalent"] = json::array();
  refused(directory.file("decided.json", changed.dump()), good, "There is nothing to decide");
  changed["missing"] = {{{"effect", "law"}, {"law", {{"text", "unrig_law = 1\nname = \"x\"\n"}}}}};
  refused(directory.file("no_law.json", changed.dump()), good, "the law of `missing` cannot be read");

  const Finished over = run_unrig(directory, {"propose", diagnosis, "--limits", directory.file("limits.toml", good), "-o", diagnosis});
  EXPECT_EQ(over.status, 2);
  std::filesystem::copy_file(laboratory.runs()[0], directory.path("other_1.csv"));
  changed = json::parse(read_text(diagnosis));
  changed["fit"]["runs"][0]["file"] = directory.path("other_1.csv");
  const Finished motion = propose(directory, directory.file("moved.json", changed.dump()), good, directory.path("other.toml"));
  EXPECT_EQ(motion.status, 2) << "a motion file would overwrite a recording";
  EXPECT_THAT(motion.err, HasSubstr("other_1.csv"));

  decay(directory, "pluck_1.csv", power, 7, 3);
  refused(diagnosis, good, "the readings are others than those of the diagnosis");
  std::filesystem::remove(laboratory.runs()[0]);
  refused(diagnosis, good, "pluck_1.csv is not where the diagnosis says");
}

}  // namespace
}  // namespace unrig
