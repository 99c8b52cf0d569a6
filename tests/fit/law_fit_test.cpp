// Laws that users wrote down, fitted: to records of an integrator that shares no code with the fit, beside the compiled effect, and to a campaign that hides one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "core/law/law_effect.h"
#include "fit/fit.h"
#include "fit/fit_files.h"
#include "tests/support/shared_data.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;
using std::numbers::pi;

constexpr double mass = 2, hertz = 5, dt = 2e-3;
const double stiffness = mass * std::pow(2 * pi * hertz, 2), damping = 2 * 0.005 * mass * 2 * pi * hertz;

using State = Eigen::Vector3d;  // q, q', memory
struct Truth {
  std::function<double(const State&)> force, rate = [](const State&) { return 0.0; };
};

using Input = std::function<double(double)>;  // force over time

/// Displacement [m] of m q'' + c q' + k q = F(q, q', z) + u(t) by the classical Runge-Kutta method, ten steps a sample.
VectorXd recorded(const Truth& truth, double first, const Input& input, Index samples, double noise, unsigned seed) {
  constexpr int finer = 10;
  const double h = dt / finer;
  const auto slope = [&](const State& s, double u) { return State(s[1], (u + truth.force(s) - damping * s[1] - stiffness * s[0]) / mass, truth.rate(s)); };
  State s(first, 0, 0);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> white(0, noise);
  VectorXd reading(samples);
  for (Index k = 0; k < samples; ++k) {
    reading[k] = s[0] + white(random);
    for (int i = 0; i < finer; ++i) {
      const auto u = [&](double part) { return input(dt * static_cast<double>(k) + h * (i + part)); };
      const State a = slope(s, u(0)), b = slope(s + h / 2 * a, u(0.5)), c = slope(s + h / 2 * b, u(0.5)), d = slope(s + h * c, u(1));
      s += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return reading;
}

FitProblem problem_of(const Truth& truth, double first, const Input& input, Index samples, double noise) {
  FitProblem problem;
  problem.rig.file = "rig.toml";
  problem.rig.modal = {{mass, 1.03 * hertz, 0.01, 1, "m"}};
  Run run;
  run.file = "run.csv";
  run.kind = first != 0 ? RunKind::pluck : RunKind::forced;
  run.dt = dt;
  run.channels = {{"gauge", "m", "m", 1, recorded(truth, first, input, samples, noise, 5), 0}};
  if (first == 0) run.channels.push_back({"force", "N", "N", 1, VectorXd::LinSpaced(samples, 0, dt * static_cast<double>(samples - 1)).unaryExpr(input), 0});
  problem.runs = {run};
  return problem;
}

void add(FitProblem& problem, const std::string& text) {
  add_law(problem.rig, parse_law(text, "law.toml"));
  problem.effects.push_back(problem.rig.laws.back()->id);
}

const FittedParameter& parameter(const FitResult& result, const std::string& name) {
  for (const FittedParameter& p : result.parameters)
    if (p.name == name) return p;
  ADD_FAILURE() << "no parameter " << name;
  return result.parameters.front();
}

double no_force(double) { return 0; }

Input tones(double size) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> phase(0, 2 * pi);
  std::array<double, 60> at{};  // of lines from 0.2 to 12 Hz
  for (double& a : at) a = phase(random);
  return [=](double time) {
    double force = 0;
    for (std::size_t line = 0; line < at.size(); ++line) force += size * std::sin(2 * pi * 0.2 * static_cast<double>(line + 1) * time + at[line]);
    return force;
  };
}

const std::string grows = R"toml(unrig_law = 1
name = "damping that grows"
acts_on = "normal"
force = "-c * abs(v)^p * sign(v)"
[parameters]
c = { start = "0.1 N", lower = "0 N" }
p = { start = 1.5, lower = 0.2, upper = 6 }
[scales]
v = "0.1 m/s"
)toml";

TEST(LawFit, FindsPowerAndSizeOfADamping) {
  constexpr double c = 0.6, p = 2.6, noise = 2e-5;
  const Truth truth{[](const State& s) { return -c * std::pow(std::abs(s[1]) / 0.1, p) * (s[1] > 0 ? 1 : -1); }};
  FitProblem problem = problem_of(truth, 0.01, no_force, 2000, noise);
  EXPECT_GT(fit(problem).runs[0].channels[0].rms_residual, 3 * noise) << "a linear rig does not explain it";
  add(problem, grows);
  const FitResult result = fit(problem);
  EXPECT_TRUE(result.converged) << result.message;
  EXPECT_LT(result.runs[0].channels[0].rms_residual, 1.1 * noise);
  const FittedParameter &size = parameter(result, "law:damping that grows.c"), &power = parameter(result, "law:damping that grows.p");
  EXPECT_NEAR(power.value, p, 4 * power.std_error);
  EXPECT_LT(power.std_error, 0.2);
  EXPECT_NEAR(size.value, c, 4 * size.std_error);
  EXPECT_EQ(size.unit, "N");
  EXPECT_EQ(power.start, 1.5);
}

/// What a fit learns is how far its runs go, whatever the law's file says: velocity and displacement of the record as it was integrated, without noise.
TEST(LawFit, LearnsHowFarItsRunsGo) {
  constexpr double first = 0.01, noise = 2e-5;
  const Truth truth{[](const State& s) { return -8 * std::abs(s[1]) * s[1] - 2e5 * s[0] * s[0] * s[0]; }};
  FitProblem problem = problem_of(truth, first, no_force, 1500, noise);
  const VectorXd x = recorded(truth, first, no_force, 1500, 0, 1);
  const VectorXd v = (x.tail(1498) - x.head(1498)) / (2 * dt);
  add(problem, "unrig_law = 1\nname = \"both\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v - k * x^3\"\n[parameters]\nc = { start = \"5 N.s^2/m^2\" }\nk = { start = \"1e5 N/m^3\" }\n[learnt_on]\nx = [\"-9 m\", \"9 m\"]\n");
  const FitResult result = fit(problem);
  ASSERT_TRUE(result.converged) << result.message;
  const LearntOn& learnt_on = result.learnt_on.at("law:both");
  ASSERT_EQ(learnt_on.size(), 2u);
  constexpr double near = 0.01;
  EXPECT_NEAR(learnt_on.at(Symbol::x).lower / x.minCoeff(), 1, near);
  EXPECT_NEAR(learnt_on.at(Symbol::x).upper / first, 1, near);
  EXPECT_NEAR(learnt_on.at(Symbol::v).lower / v.minCoeff(), 1, near);
  EXPECT_NEAR(learnt_on.at(Symbol::v).upper / v.maxCoeff(), 1, near);
}

TEST(LawFit, OfHysteresisIsThatOfTheCompiledEffect) {
  constexpr double noise = 2e-5;
  const Truth truth{[](const State& s) { return -12 * s[2]; }, [](const State& s) {
                      const double side = s[1] * s[2] > 0 ? 1 : s[1] * s[2] < 0 ? -1 : 0;
                      return s[1] / 2e-3 * (1 - std::abs(s[2]) * (0.4 + 0.6 * side));
                    }};
  FitProblem by_name = problem_of(truth, 0, tones(3), 4000, noise), by_file = by_name;
  by_name.effects = {"bouc-wen"};
  add(by_file, R"toml(unrig_law = 1
name = "hysteresis"
acts_on = "normal"
force = "-f * z"
memory = "v / xy * (1 - abs(z)^n * (b + (1 - b) * sign(v * z)))"
[parameters]
f = { start = "5 N", lower = "0 N" }
xy = { start = "1 mm", lower = "1e-6 m" }
b = { start = 0.5, lower = 0, upper = 1 }
n = { start = 1, lower = 0.5, upper = 4 }
)toml");
  const FitResult a = fit(by_name), b = fit(by_file);
  EXPECT_TRUE(b.converged) << b.message;
  EXPECT_LT(b.runs[0].channels[0].rms_residual, 1.1 * noise);
  EXPECT_NEAR(b.chi2, a.chi2, 0.01) << "both searches end within hundredths of a standard error";
  for (const auto& [name, law] : {std::pair{"bouc-wen.force", "f"}, {"bouc-wen.yield_displacement", "xy"}, {"bouc-wen.shape", "b"}, {"bouc-wen.sharpness", "n"}}) {
    const FittedParameter &left = parameter(a, name), &right = parameter(b, std::string("law:hysteresis.") + law);
    EXPECT_NEAR(left.value, right.value, 0.05 * left.std_error) << name;
    EXPECT_NEAR(left.std_error, right.std_error, 0.02 * left.std_error) << name;
  }
}

TEST(LawFit, OfTwoLawsIsCarriedWholeByItsFile) {
  constexpr double noise = 2e-5;
  const Truth truth{[](const State& s) { return -30 * std::abs(s[1]) * s[1] - 2e6 * s[0] * s[0] * s[0]; }};
  FitProblem problem = problem_of(truth, 0, tones(3), 4000, noise);
  add(problem, "unrig_law = 1\nname = \"drag\"\nacts_on = \"normal\"\nforce = \"-c * abs(v) * v\"\n[parameters]\nc = { start = \"10 N.s^2/m^2\", lower = \"0 N.s^2/m^2\" }\n");
  add(problem, "unrig_law = 1\nname = \"hard\"\nacts_on = \"normal\"\nforce = \"-k * x^3\"\n[parameters]\nk = { start = \"1e6 N/m^3\" }\n");
  const FitResult result = fit(problem);
  EXPECT_LT(result.runs[0].channels[0].rms_residual, 1.1 * noise);
  for (const auto& [name, value] : {std::pair{"law:drag.c", 30.0}, {"law:hard.k", 2e6}}) {
    const FittedParameter& p = parameter(result, name);
    EXPECT_NEAR(p.value, value, 4 * p.std_error) << name;
    EXPECT_LT(p.std_error, 0.2 * value) << name;
  }
  EXPECT_EQ(parameter(result, "law:drag.c").unit, "N.s^2/m^2");

  EXPECT_THROW(to_json(result), std::invalid_argument) << "the laws must not get lost";
  nlohmann::json json = nlohmann::json::parse(to_json(result, problem.rig.laws));
  EXPECT_EQ(json["laws"][0]["class"], "damping");
  EXPECT_EQ(json["laws"][1]["class"], "stiffness");
  const test::TemporaryDirectory directory;
  const FittedRig fitted = read_fit(directory.file("fit.json", json.dump()));
  ASSERT_EQ(fitted.laws.size(), 2u);
  EXPECT_TRUE(law_of(*fitted.laws[1]).says_the_same_as(law_of(*problem.rig.laws[1])));
  json["laws"].erase(1);
  try {
    read_fit(directory.file("fit.json", json.dump()));
    ADD_FAILURE() << "a law that the file does not carry";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("the law \"law:hard\" at work, but not among the \"laws\""));
  }
}

TEST(LawFit, NamesThePowerOfADampingInACampaign) {
  UNRIG_NEEDS_SHARED("campaigns/open2/o1/rig.toml");
  FitProblem problem;
  problem.rig = read_rig(test::shared_path("campaigns/open2/o1/rig.toml"));
  for (const char* run : {"dry_pluck.csv", "wet_pluck.csv"}) problem.runs.push_back(read_run(test::shared_path(std::string("campaigns/open2/o1/") + run)));
  add(problem, grows);
  const FitResult result = fit(problem);
  const FittedParameter& power = parameter(result, "law:damping that grows.p");
  EXPECT_NEAR(power.value, 3, 4 * power.std_error);  // KEY.json: cubic-damping
  EXPECT_LT(power.std_error, 0.3);
  EXPECT_LT(result.reduced_chi2(), 1.1);
}

}  // namespace
}  // namespace unrig
