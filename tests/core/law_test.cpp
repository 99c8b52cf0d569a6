// Laws in a file: the formulas and their derivatives, what is refused, and what a law does to a rig, beside the compiled effects that say the same.
#include "core/law/law_effect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "core/propagate/feedback_force.h"
#include "core/propagate/nonlinear_response.h"
#include "tests/support/sample_data.h"
#include "tests/support/slope_check.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::AllOf;
using ::testing::HasSubstr;

const std::vector<std::string> names{"c", "p", "d"};
constexpr Index unknowns = static_cast<Index>(symbol_count) + 3;

struct Evaluated {
  double value;
  VectorXd slope;  // in the symbols, then the parameters
};

Evaluated evaluate(const Expression& e, const VectorXd& at) {
  Evaluated result{0, VectorXd(unknowns)};
  result.value = e(at.data(), at.data() + symbol_count, result.slope.data(), result.slope.data() + symbol_count);
  return result;
}

TEST(Expression, ComputesWhatIsWritten) {
  VectorXd at = VectorXd::Zero(unknowns);
  at[0] = 1.5, at[1] = -0.7, at[symbol_count] = 2, at[symbol_count + 1] = 1.7;
  const double x = 1.5, v = -0.7, c = 2, p = 1.7;
  const std::pair<const char*, double> cases[] = {
      {"1 + 2 * 3", 7}, {"-x^2", -x * x}, {"2^-1", 0.5}, {"2^3^2", 512}, {"8 / 4 / 2", 1}, {"1 - 2 - 3", -4}, {"(1 - 2) * 3", -3}, {"--x", x}, {"+x - -v", x + v}, {"1.5e1 * x", 15 * x}, {".5", 0.5},
      {"-c * abs(v)^p * sign(v)", -c * std::pow(0.7, p) * -1}, {"x^16", std::pow(x, 16)}, {"x^-3", 1 / (x * x * x)}, {"abs(x)^0.5", std::sqrt(x)}, {"min(x, v) + max(x, v)", x + v},
      {"exp(v) + log(abs(v)) + sqrt(abs(v)) + sin(v) + cos(v) + tanh(v)", std::exp(v) + std::log(0.7) + std::sqrt(0.7) + std::sin(v) + std::cos(v) + std::tanh(v)},
      {"x\n  * v", x * v}};
  for (const auto& [text, value] : cases) EXPECT_NEAR(evaluate(Expression(text, names), at).value, value, 1e-14 * std::abs(value)) << text;
}

TEST(Expression, DerivativesAreSlopesAtRandomPoints) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> size(0.3, 1.7);
  std::bernoulli_distribution negative;
  for (const char* text : {"x + v * c - p", "x / v", "-x * x * x", "abs(x)^p", "abs(x)^-1.5", "x^5 / c", "abs(v) * v", "sign(v) * x", "exp(x * c)", "log(abs(x * v))", "sqrt(abs(x + 3 * v))", "sin(x * p)", "cos(v / c)",
                           "tanh(v / c)", "min(x * v, c)", "max(x, v * p)", "-c * abs(v)^p * sign(v)", "v / c * (1 - abs(z)^p * (d + (1 - d) * sign(v * z)))", "theta * theta_rate - twist / twist_rate + alpha^2 * U - t * a"}) {
    const Expression e(text, names);
    for (int k = 0; k < 20; ++k) {
      VectorXd at(unknowns);
      for (double& one : at) one = size(random) * (negative(random) ? -1 : 1);
      for (double& parameter : at.tail(3)) parameter = std::abs(parameter);
      const Evaluated there = evaluate(e, at);
      const auto f = [&](const VectorXd& y) -> VectorXd { return VectorXd::Constant(1, evaluate(e, y).value); };
      EXPECT_TRUE(test::is_slope(f, there.slope.transpose(), at, VectorXd::Constant(unknowns, 1e-2))) << text << " at " << at.transpose();
    }
  }
}

TEST(Expression, CornersHaveTheMeanSlope) {
  const auto at_zero = [](const char* text, double p = 1) {
    VectorXd at = VectorXd::Zero(unknowns);
    at.tail(3) << 1, p, 1;
    return evaluate(Expression(text, names), at);
  };
  EXPECT_EQ(at_zero("sign(x)").value, 0);
  EXPECT_TRUE(at_zero("sign(x)").slope.isZero(0));
  EXPECT_TRUE(at_zero("abs(x)").slope.isZero(0));
  EXPECT_EQ(at_zero("max(x, 0)").slope[0], 0.5);
  EXPECT_EQ(at_zero("min(x, 0)").slope[0], 0.5);
  for (const double p : {0.5, 1.0, 2.5}) {
    EXPECT_TRUE(at_zero("abs(x)^p", p).slope.isZero(0)) << p;
    EXPECT_EQ(at_zero("abs(x)^p", p).value, 0);
  }
  EXPECT_TRUE(at_zero("sqrt(abs(x))").slope.isZero(0));
}

TEST(Expression, IsSplitWhereItIsLinear) {
  VectorXd at = VectorXd::LinSpaced(unknowns, 0.3, 1.9);
  for (const char* text : {"-c * z", "x - z / c + 3 * (z - v)", "-(c * z) * p + x^2", "z"}) {
    Expression e(text, names);
    std::array<double, symbol_count> scales;
    scales.fill(2);
    e.divide_by(scales);
    const auto split = e.linear_in(Symbol::z);
    ASSERT_TRUE(split) << text;
    EXPECT_FALSE(split->rest.uses(Symbol::z) || split->factor.uses(Symbol::z));
    EXPECT_NEAR(evaluate(split->rest, at).value + evaluate(split->factor, at).value * at[symbol_count - 1], evaluate(e, at).value, 1e-13) << text;
  }
  for (const char* text : {"z * z", "abs(z)", "1 / z", "c * z^2"}) EXPECT_FALSE(Expression(text, names).linear_in(Symbol::z)) << text;
}

std::string refusal(const std::string& text) {
  try {
    parse_law(text, "law.toml");
  } catch (const InputError& e) {
    return e.what();
  }
  return "accepted";
}

std::string file_of(const std::string& force, const std::string& parameters, const std::string& more = "", const std::string& acts_on = "normal") {
  return "unrig_law = 1\nname = \"mine\"\nacts_on = \"" + acts_on + "\"\nforce = \"" + force + "\"\n" + more + "[parameters]\n" + parameters;
}
const std::string c_and_p = "c = { start = \"0.1 N\", lower = \"0 N\" }\np = { start = 1.5, lower = 0.2, upper = 6 }\n";

TEST(LawFile, SaysWhatIsWrongAndWhere) {
  const std::string c = "c = { start = \"0.1 N\" }\n";
  const std::pair<std::string, std::string> cases[] = {
      {file_of("-c * velo", c), "law.toml:4: force: \"velo\" is no symbol and does not stand in [parameters]"},
      {file_of("-c * velo", c), "\n    -c * velo\n         ^"},
      {file_of("-c * twst", c), "Did you mean twist?"},
      {file_of("-c * tahn(v)", c), "Did you mean tanh?"},
      {file_of("-c * (v", c), "it ends too early; wanted \")\""},
      {file_of("-c ** v", c), "A power is written x^2."},
      {file_of("2x * c", c), "\"x\" stands right behind the number 2"},
      {file_of("-c * min(v)", c), "wanted \",\" and a second argument"},
      {file_of("-c * sign v", c), "wanted \"(\" behind sign"},
      {file_of("-c * v^1.5", c), "abs(v)^p * sign(v)"},
      {file_of("-c * sqrt(x)", c), "sqrt(abs(x))"},
      {file_of("-c * v; 3", c), "there is \";\"; wanted an operator or the end"},
      {file_of("", c), "force: it is empty"},
      {file_of("-c * v / abs(v)", c), "sign(v) in place of v / abs(v)"},
      {file_of("-c * x", c + "d = { start = 1 }\n"), "the parameter d is not used"},
      {file_of("-c * x", c + "v = { start = 1 }\n"), "the symbol v stands in [parameters]"},
      {file_of("-c * x", c + "abs = { start = 1 }\n"), "the function abs stands in [parameters]"},
      {file_of("-c * x", "c = { start = 0.1, lower = 1 }\n"), "c starts at 0.1 1; wanted a start from 1"},
      {file_of("-c * x", "c = { start = \"1 N\", lower = \"0 m\" }\n"), "parameters.c.lower has the unit \"m\""},
      {file_of("-c * x", "c = { start = \"1 N\", step = 3 }\n"), "the key \"parameters.c.step\" is unknown"},
      {file_of("-c * x", "c = { lower = \"1 N\" }\n"), "parameters.c.start"},
      {file_of("-c * z", c), "wanted memory ="},
      {file_of("-c * x", c, "memory = \"v\"\n"), "a memory that the force does not use"},
      {file_of("-c * z", c, "memory = \"v + a\"\n"), "the acceleration a in `memory`"},
      {file_of("-c", c), "a force that is always the same"},
      {file_of("-c * x", c, "", "nowhere"), "wanted one of normal, torsion, lift, gauge, mount"},
      {file_of("-c * x", c) + "[scales]\nv = \"1 m/s\"\n", "v in [scales], which the law does not use"},
      {file_of("-c * x", c) + "[scales]\nx = \"0 m\"\n", "wanted a value above zero"},
      {file_of("-c * x", c) + "[scales]\nx = \"1 m/s\"\n", "scales.x"},
      {file_of("-c * x", c) + "[learnt_on]\nv = [\"0 m/s\", \"1 m/s\"]\n", "law.toml:8: v in [learnt_on], which the law does not use"},
      {file_of("-c * x", c) + "[learnt_on]\nw = [\"0 m\", \"1 m\"]\n", "law.toml:8: \"w\" in [learnt_on] is no symbol; wanted one of x v a"},
      {file_of("-c * x", c) + "[learnt_on]\nx = [\"0 m/s\", \"1 m\"]\n", "law.toml:8: learnt_on.x has the unit \"m/s\""},
      {file_of("-c * x", c) + "[learnt_on]\nx = [\"5 mm\", \"-4 mm\"]\n", "law.toml:8: x was learnt from 0.005 to -0.004 m; wanted the lowest value first"},
      {file_of("-c * x", c) + "[learnt_on]\nx = [\"5 mm\"]\n", "law.toml:8: learnt_on.x has 1 value; wanted two"},
      {file_of("-c * x", c) + "[learnt_on]\nx = [-4, 5]\n", "wanted text in double quotes"},
      {file_of("-c * x", c) + "[learnt_on]\nx = \"5 mm\"\n", "learnt_on.x"},
      {file_of("-c * x * z", c, "memory = \"v - z\"\n") + "[learnt_on]\nz = [\"0\", \"1\"]\n", "a range of the memory"},
      {file_of(std::string(200, '('), c), "nested more than"},
      {"name = \"mine\"\n", "Begin the file with unrig_law = 1."},
      {"unrig_law = [\n", "wanted TOML"},
  };
  for (const auto& [text, message] : cases) EXPECT_THAT(refusal(text), HasSubstr(message)) << text;
  std::string sum = "x";
  for (int k = 0; k < 300; ++k) sum += " + x^" + std::to_string(k);
  EXPECT_THAT(refusal(file_of(sum, "")), HasSubstr("more than 200 parts"));
}

TEST(LawFile, KeepsUnitsBoundsAndScales) {
  const Law law = parse_law(file_of("-c * abs(v)^p * sign(v) - k * x", c_and_p + "k = { start = \"2 lbf/in\", upper = \"3 lbf/in\" }\n") + "[scales]\nv = \"10 cm/s\"\n", "law.toml");
  EXPECT_EQ(law.id(), "law:mine");
  ASSERT_EQ(law.parameters.size(), 3u);
  EXPECT_EQ(law.parameters[0].name, "c") << "in the order of the formula";
  EXPECT_EQ(law.parameters[0].unit, "N");
  EXPECT_EQ(law.parameters[1].upper, 6);
  EXPECT_EQ(law.parameters[2].unit, "N/m");
  EXPECT_NEAR(law.parameters[2].start, 2 * 4.4482216152605 / 0.0254, 1e-9);
  std::array<double, symbol_count> symbols{}, slope{};
  symbols[1] = 0.2;
  const double p[] = {0.1, 1.5, 0};
  double partial[3];
  EXPECT_NEAR(law.force(symbols.data(), p, slope.data(), partial), -0.1 * std::pow(2, 1.5), 1e-15);
  EXPECT_NEAR(slope[1], -0.1 * 1.5 * std::pow(2, 0.5) / 0.1, 1e-13);
  const std::pair<const char*, const char*> kinds[] = {{"-c * x^3", "stiffness"}, {"-c * v", "damping"}, {"-c * tanh(v)", "friction"}, {"-c * a", "inertia"}, {"c * t", "signal"}, {"c * alpha", "lift"}};
  for (const auto& [force, kind] : kinds) EXPECT_EQ(parse_law(file_of(force, "c = { start = 1 }\n"), "").kind(), kind) << force;
}

TEST(LawFile, KeepsWhereItWasLearnt) {
  const Law law = parse_law(file_of("-c * abs(v) * v * x + theta * c", "c = { start = \"1 N\" }\n") + "[scales]\nv = \"10 cm/s\"\n[learnt_on]\nx = [\"-4 mm\", \"5 mm\"]\ntheta = [\"10 deg\", \"10 deg\"]\n", "law.toml");
  ASSERT_EQ(law.learnt_on.size(), 2u) << "of v nothing is known";
  EXPECT_NEAR(law.learnt_on.at(Symbol::x).lower, -0.004, 1e-17);
  EXPECT_NEAR(law.learnt_on.at(Symbol::x).upper, 0.005, 1e-17);
  EXPECT_NEAR(law.learnt_on.at(Symbol::theta).upper, 0.17453292519943295, 1e-15);
  const Law again = parse_law(law_text(law), "again.toml");
  EXPECT_TRUE(again.says_the_same_as(law));
  ASSERT_EQ(again.learnt_on.size(), 2u);
  for (const auto& [symbol, range] : law.learnt_on) {
    EXPECT_EQ(again.learnt_on.at(symbol).lower, range.lower) << "to the last digit";
    EXPECT_EQ(again.learnt_on.at(symbol).upper, range.upper);
  }
  const Law nothing = parse_law(file_of("-c * x", "c = { start = \"1 N\" }\n"), "law.toml");
  EXPECT_TRUE(nothing.learnt_on.empty());
  EXPECT_EQ(law_text(nothing).find("learnt_on"), std::string::npos);
}

const std::string hysteresis = R"toml(unrig_law = 1
name = "hysteresis"
acts_on = "normal"
force = "-f * z"
memory = "v / xy * (1 - (b + (1 - abs(b)) * sign(v * z)) * abs(z)^n)"
[parameters]
f = { start = "1 N", lower = "0 N" }
xy = { start = "1 mm", lower = "1e-6 m" }
b = { start = 0.5, lower = 0, upper = 1 }
n = { start = 1, lower = 0.5, upper = 4 }
)toml";

AeroelasticModel beam(const std::vector<std::string>& laws, std::vector<std::string> effects = {}) {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  for (const std::string& law : laws) {
    add_law(rig, parse_law(law, "law.toml"));
    effects.push_back(rig.laws.back()->id);
  }
  const Basis basis = make_basis(rig, Index{2}, Index{1});
  return AeroelasticModel(rig, basis, wagner(Wagner::jones)).with_effects(effects);
}

Conditions stream() {
  Conditions c;
  c.density = 998;
  c.speed = 0.6;
  c.prescribed_pitch = true;
  c.onset_angle = 0.1;
  return c;
}

/// Outputs over some steps from a start that moves, and their derivatives in theta.
NonlinearResponse response(const AeroelasticModel& model, const Conditions& c, const VectorXd& theta, double size = 1e-3) {
  const LinearSystem system = model.system(c, theta, {"gauge"});
  VectorXd start = VectorXd::Zero(system.states());
  start.head(2 * system.coordinates).setConstant(size);
  if (system.motion >= 0) start[system.motion + 1] = 10 * size;
  return follow(system, step_to_follow(system, 0.002), theta, {start, {}, MatrixXd(101, 0), MatrixXd(system.states(), 0), {}}, 100, Partials::all);
}

void expect_same(const AeroelasticModel& a, const AeroelasticModel& b, const VectorXd& parameters, double size = 1e-3, double near = 1e-10) {
  VectorXd theta = a.start_values();
  theta.tail(parameters.size()) = parameters;
  const NonlinearResponse left = response(a, stream(), theta, size), right = response(b, stream(), theta, size);
  EXPECT_GT((left.output - response(beam({}), stream(), theta.head(theta.size() - parameters.size()), size).output).norm(), 1e-3 * left.output.norm()) << "otherwise the law does nothing";
  EXPECT_LT((left.output - right.output).norm(), near * right.output.norm());
  EXPECT_LT((left.tangent[0] - right.tangent[0]).norm(), near * right.tangent[0].norm());
}

TEST(LawEffect, IsWhatTheCompiledEffectIs) {
  expect_same(beam({hysteresis}), beam({}, {"bouc-wen"}), Eigen::Vector4d(8, 2e-3, 0.4, 1.3));
  const std::string cubic = file_of("-k * ((x + d)^3 - d^3)", "k = { start = \"1 N/m^3\" }\nd = { start = \"0 m\" }\n");
  expect_same(beam({cubic}), beam({}, {"cubic-stiffness"}), Eigen::Vector2d(1e9, 2e-4));
  // Without the subtraction too: what it is at rest belongs to the steady load.
  expect_same(beam({file_of("-k * (x + d)^3", "k = { start = \"1 N/m^3\" }\nd = { start = \"0 m\" }\n")}), beam({}, {"cubic-stiffness"}), Eigen::Vector2d(1e9, 2e-4));
  expect_same(beam({file_of("-c * tanh(v / vs)", "c = { start = \"1 N\" }\nvs = { start = \"1 mm/s\" }\n")}), beam({}, {"coulomb-friction"}), Eigen::Vector2d(2, 3e-3));
  // What fills is a sum of exponentials there and an integral from step to step here: they differ by (dt / tau)^2 / 12, 1.3e-4 of the force.
  expect_same(beam({file_of("-m * a * (1 - exp(-t / tau))", "m = { start = \"0.1 kg\" }\ntau = { start = \"0.1 s\" }\n")}), beam({}, {"filling-mass"}), Eigen::Vector2d(0.8, 0.05), 1e-3, 1e-3);
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const std::string per_strip = std::to_string(0.5 * 998 * rig.chord * rig.strip_length);  // six digits behind the point
  expect_same(beam({file_of("-c * abs(v) * v * " + per_strip, "c = { start = 1 }\n", "", "lift")}), beam({}, {"quadratic-drag"}), VectorXd::Constant(1, 30), 0.01, 1e-6);
}

/// The law beside the effect, both evaluated alone: forces and derivatives at random arguments.
TEST(LawEffect, MemoryHasTheRateOfTheCompiledOne) {
  const AeroelasticModel law = beam({hysteresis}), effect = beam({}, {"bouc-wen"});
  VectorXd theta = law.start_values();
  for (const double shape : {0.4, -0.6}) {
    theta.tail(4) << 8, 2e-3, shape, 1.3;
    const LinearSystem a = law.system(stream(), theta, {"gauge"}), b = effect.system(stream(), theta, {"gauge"});
    EXPECT_EQ((a.A.value - b.A.value).norm(), 0);
    EXPECT_EQ((a.C.value - b.C.value).norm(), 0);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> any(-1, 1);
    for (int k = 0; k < 200; ++k) {
      const double z[] = {k % 7 == 0 ? 0 : 0.1 * any(random), k % 5 == 0 ? 0 : any(random)};
      const FeedbackForce left = force_of(a.feedback.at(0), z, theta), right = force_of(b.feedback.at(0), z, theta);
      const auto near = [&](double x, double y) { EXPECT_NEAR(x, y, 1e-10 * std::max(1.0, std::abs(y))) << z[0] << " " << z[1]; };
      near(left.value, right.value);
      for (std::size_t i = 0; i < 2; ++i) near(left.slope[i], right.slope[i]);
      for (std::size_t i = 0; i < 4; ++i) near(left.partial[i], right.partial[i]);
    }
  }
}

/// d output / d theta of the law's parameters is the slope of the response, wherever and whatever the law looks at.
TEST(LawEffect, DerivativesOfTheResponseAreSlopesInEveryPlace) {
  const std::string c = "c = { start = 1 }\n";
  for (const std::string& text : {file_of("-c * tanh(300 * x) * (1 + 20 * v) + theta * twist", c), file_of("-c * twist^3 - c * twist_rate * theta_rate", c, "", "torsion"), file_of("c * alpha^3 * U^2", c, "", "lift"),
                                  file_of("c * x * z", c, "memory = \"30 * alpha - 2 * z\"\n", "lift"), file_of("c * v^2 + c * t", c, "", "gauge"), file_of("c * sin(20 * t) + x * c^2", c, "", "mount"), file_of("-c * a", c),
                                  file_of("-c * a - 1e9 * x^3", c), file_of("-c * z^3", c, "memory = \"1000 * v - z\"\n"), file_of("-0.1 * c * a", c, "", "lift"), file_of("c * a * 1e-3", c, "", "gauge"),
                                  file_of("-c * a * (1 + 1e5 * x^2)", c), file_of("-c * abs(a) * a * 0.1 + c * x * z", c, "memory = \"30 * alpha - 2 * z\"\n"), file_of("-c * a * twist * 100", c, "", "lift")}) {
    const AeroelasticModel model = beam({text});
    VectorXd theta = model.start_values();
    theta.tail(1)[0] = 0.4;
    const NonlinearResponse there = response(model, stream(), theta, 3e-3);
    ASSERT_TRUE(there.output.allFinite()) << text;
    const auto f = [&](const VectorXd& y) -> VectorXd {
      VectorXd at = theta;
      at.tail(1) = y;
      return response(model, stream(), at, 3e-3).output.col(0);
    };
    EXPECT_GT(there.tangent[0].rightCols(1).norm(), 0) << text;
    EXPECT_TRUE(test::is_slope(f, there.tangent[0].rightCols(1), theta.tail(1), VectorXd::Constant(1, 0.1), 1e-11)) << text;
  }
}

constexpr double mass = 2, stiffness = 800, dt = 0.002;

/// Of a rig of one mode m q'' + k q = F, q(0) = 0.02 m, by the classical Runge-Kutta method; `force` of q, q', t and the memory, whose rate is `rate`.
template <class Force, class Rate>
VectorXd integrated(const Force& force, const Rate& rate, Index samples, double extra_mass = 0) {
  constexpr int finer = 20;
  const double h = dt / finer;
  using State = Eigen::Vector3d;
  const auto slope = [&](const State& s, double t) { return State(s[1], (force(s[0], s[1], t, s[2]) - stiffness * s[0]) / (mass + extra_mass), rate(s[0], s[1], s[2])); };
  State s(0.02, 0, 0);
  VectorXd q(samples);
  for (Index k = 0; k < samples; ++k) {
    q[k] = s[0];
    for (int i = 0; i < finer; ++i) {
      const double t = dt * static_cast<double>(k) + h * i;
      const State a = slope(s, t), b = slope(s + h / 2 * a, t + h / 2), c = slope(s + h / 2 * b, t + h / 2), d = slope(s + h * c, t + h);
      s += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return q;
}

VectorXd simulated(const std::vector<std::string>& laws, Index samples) {
  Rig rig;
  rig.modal = {{mass, std::sqrt(stiffness / mass) / (2 * 3.14159265358979323846), 0, 1, "m"}};
  std::vector<std::string> ids;
  for (const std::string& law : laws) {
    add_law(rig, parse_law(law, "law.toml"));
    ids.push_back(rig.laws.back()->id);
  }
  const AeroelasticModel model = AeroelasticModel(rig, {}, {}).with_effects(ids);
  const LinearSystem system = model.system({}, model.start_values(), {"gauge"});
  VectorXd start = VectorXd::Zero(system.states());
  start[0] = 0.02;
  return follow(system, step_to_follow(system, dt), model.start_values(), {start, {}, MatrixXd(samples + 1, 0), MatrixXd(system.states(), 0), {}}, samples, Partials::none).output.col(0);
}

/// The parabola of a step is off by (w dt)^4/720 of the force (core/propagate/nonlinear_response.h), 4e-9 at 20 rad/s, and 81 times as much of its third harmonic; laws of some tenths of the
/// spring, over ten periods.
constexpr double steps_own = 1e-6;

std::string named(std::string law, const std::string& name) { return law.replace(law.find("mine"), 4, name); }

TEST(LawEffect, MovesARigAsAnotherIntegratorDoes) {
  const auto none = [](double, double, double) { return 0.0; };
  constexpr Index samples = 1500;
  const auto compare = [&](const VectorXd& a, const VectorXd& b) { EXPECT_LT((a - b).norm(), steps_own * b.norm()); };
  const std::string drag = file_of("-c * abs(v)^p * sign(v)", "c = { start = \"2 N\" }\np = { start = 2 }\n"), hard = named(file_of("-k * x^3", "k = { start = \"2e5 N/m^3\" }\n"), "hard");
  compare(simulated({drag}, samples), integrated([](double, double v, double, double) { return -2 * std::abs(v) * v; }, none, samples));
  compare(simulated({drag, hard}, samples), integrated([](double x, double v, double, double) { return -2 * std::abs(v) * v - 2e5 * x * x * x; }, none, samples));
  compare(simulated({file_of("c * t * sin(7 * t) - 0.5 * v", "c = { start = 1 }\n")}, samples), integrated([](double, double v, double t, double) { return t * std::sin(7 * t) - 0.5 * v; }, none, samples));
  compare(simulated({file_of("-m * a - k * x^3", "m = { start = \"0.7 kg\" }\nk = { start = \"2e5 N/m^3\" }\n")}, samples), integrated([](double x, double, double, double) { return -2e5 * x * x * x; }, none, samples, 0.7));
  // Mass that grows with the amplitude and with time: (m + M) q'' = -k q.
  const auto heavier = [](double x, double more) { return stiffness * x - mass / (mass + more) * stiffness * x; };
  compare(simulated({file_of("-m * a * x^2", "m = { start = \"1500 kg/m^2\" }\n")}, samples), integrated([&](double x, double, double, double) { return heavier(x, 1500 * x * x); }, none, samples));
  compare(simulated({file_of("-m * a * (1 - exp(-t))", "m = { start = \"0.7 kg\" }\n")}, samples), integrated([&](double x, double, double t, double) { return heavier(x, 0.7 * (1 - std::exp(-t))); }, none, samples));
  compare(simulated({file_of("-k * x * (1 + z^2)", "k = { start = \"100 N/m\" }\n", "memory = \"20 * v - 3 * z\"\n")}, samples),
          integrated([](double x, double, double, double z) { return -100 * x * (1 + z * z); }, [](double, double v, double z) { return 20 * v - 3 * z; }, samples));
}

TEST(LawEffect, WhatTheRigOrTheRunDoesNotHaveIsRefused) {
  Rig rig;
  rig.file = "rig.toml";
  rig.modal = {{1, 5, 0.01, 1, "m"}};
  add_law(rig, parse_law(file_of("-c * twist", "c = { start = 1 }\n"), "law.toml"));
  EXPECT_THROW(AeroelasticModel(rig, {}, {}).with_effects({"law:mine"}), InputError);
  EXPECT_THROW(add_law(rig, parse_law(file_of("-c * x", "c = { start = 1 }\n"), "other.toml")), InputError) << "the same name";
  const AeroelasticModel model = beam({file_of("c * alpha^3", "c = { start = 1 }\n")});
  Conditions still;
  still.density = 998;
  EXPECT_TRUE(model.system(still, model.start_values(), {"gauge"}).feedback.empty()) << "no angle of attack without a stream";
}

}  // namespace
}  // namespace unrig
