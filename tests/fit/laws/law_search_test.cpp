// The law of a force that is on no list, found from free decays by an integrator that shares no code with the fit.

#include "fit/laws/law_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <string>

#include "core/law/law_effect.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/selection.h"
#include "fit/laws/found_law.h"
#include "fit/laws/screen.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double noise = 0.002;  // N; the rig's gauge reads its displacement, 1 N per metre, so that decays of 1 begin at 500 times it
constexpr double omega = 2 * pi * one_mode::hertz, stiffness = omega * omega;

/// x'' + 2 zeta omega x' + omega^2 x = force(x, v) from `start`, by the classical Runge-Kutta method in eight steps a sample.
VectorXd decay(const std::function<double(double, double)>& force, double start, Index samples) {
  constexpr int finer = 8;
  const double h = one_mode::dt / finer;
  using State = Eigen::Vector2d;
  const auto slope = [&](const State& s) {
    return State(s[1], force(s[0], s[1]) - 2 * one_mode::damping_ratio * omega * s[1] - stiffness * s[0]);
  };
  State s(start, 0);
  VectorXd x(samples);
  for (Index k = 0; k < samples; ++k) {
    x[k] = s[0];
    for (int i = 0; i < finer; ++i) {
      const State a = slope(s), b = slope(s + h / 2 * a), c = slope(s + h / 2 * b), d = slope(s + h * c);
      s += h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return x;
}

/// Two decays, from 1 and from 0.4, one of them to the other side.
FitProblem two_decays(const std::function<double(double, double)>& force) {
  constexpr Index samples = 900;
  FitProblem problem;
  problem.rig = one_mode::rig();
  problem.runs.push_back(one_mode::decay("large.csv", decay(force, 1, samples) + noise * one_mode::white_noise(samples, 3)));
  problem.runs.push_back(one_mode::decay("small.csv", decay(force, -0.4, samples) + noise * one_mode::white_noise(samples, 4)));
  return problem;
}

struct Hidden {
  const char* law;  // of the dictionary
  std::function<double(double, double)> force;
  std::vector<std::pair<const char*, double>> parameters;  // in SI: symbols divided by their scales belong to the formula
};

double sign(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

const std::vector<Hidden> hidden{
    {"spring with an even power", [](double x, double) { return -0.1 * stiffness * x * x; }, {{"p", 2}}},
    {"spring with a power", [](double x, double) { return -0.08 * stiffness * std::pow(std::abs(x), 2.5) * sign(x); }, {{"p", 2.5}}},
    {"spring on one side",
     [](double x, double) { return -0.2 * stiffness * std::max(0.0, x - 0.3); },
     {{"k", 0.2 * stiffness}, {"s", 0.3}}},
    {"damping with a power", [](double, double v) { return -1.5e-3 * std::pow(std::abs(v), 2.7) * sign(v); }, {{"p", 2.7}}},
    {"mass with a power of the amplitude",
     [](double x, double v) {  // (1 + m) x'' = the rig's own forces, which are those of a mass of one
       const double m = 0.3 * std::pow(std::abs(x), 1.5);
       return m / (1 + m) * (2 * one_mode::damping_ratio * omega * v + stiffness * x);
     },
     {{"p", 1.5}}},
    {"damping of van der Pol", [](double x, double v) { return 2 * 0.02 * omega * (1 - std::pow(x / 0.45, 2)) * v; }, {}},
};

/// Of the noise of these decays, which is white.
bool never(const Trial&) { return false; }

class LawSearches : public testing::TestWithParam<std::size_t> {};

TEST_P(LawSearches, FindTheFormAndItsParameters) {
  const Hidden& truth = hidden[GetParam()];
  FitProblem problem = two_decays(truth.force);
  const Trial base = fit_baseline(problem);
  ASSERT_GT(base.reduced_chi2(), 10) << "a linear rig does not explain it";
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  LawSearch search(problem, base, leaves_something, never, LawSearch::Among::forms);
  const std::vector<Trial> found = search.search();
  ASSERT_FALSE(found.empty());
  EXPECT_FALSE(leaves_something(found.front())) << found.front().effects.back();
  // Named, or among the rivals that these decays cannot refute.
  const std::string id = std::string("law:") + truth.law;
  const auto is_truth = [&](const Trial& t) { return t.effects == std::vector<std::string>{id}; };
  const auto trial = std::find_if(found.begin(), found.end(), is_truth);
  ASSERT_NE(trial, found.end()) << "named instead: " << found.front().effects.back();
  EXPECT_LT(bic_difference(*trial, found.front()), decisive);
  EXPECT_FALSE(leaves_something(*trial));
  for (const auto& [name, value] : truth.parameters)
    for (const Unknown& u : trial->arrival.joint.unknowns())
      if (trial->arrival.joint.parameter(u).name == id + "." + name) {
        EXPECT_NEAR(u.value, value, 0.03 * std::abs(value)) << name;
      }
  // Of van der Pol's law the linear part is damping of the rig.
  if (id == "law:damping of van der Pol") {
    const auto value = [&](const std::string& name) {
      for (const Unknown& u : trial->arrival.joint.unknowns())
        if (trial->arrival.joint.parameter(u).name == id + "." + name) return u.value;
      return std::nan("");
    };
    const double square = 2 * 0.02 * omega / (0.45 * 0.45);  // of the displacement, times the velocity
    const double scale = law_of(effect(problem.rig, id)).scales[static_cast<std::size_t>(Symbol::v)];
    EXPECT_NEAR(value("c") / scale / std::pow(value("s"), 2), square, 0.03 * square);
  }
  // Beyond chance no other rival than what such decays cannot tell apart: fewer than half of all that were fitted.
  EXPECT_LE(2 * rivals(found, leaves_something).size(), found.size());
}

INSTANTIATE_TEST_SUITE_P(Of, LawSearches, testing::Range<std::size_t>(0, hidden.size()), [](const auto& which) {
  std::string name = hidden[which.param].law;
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
});

TEST(LawSearch, FindsNothingInANonlinearDecayThatIsNone) {
  FitProblem problem = two_decays([](double, double) { return 0.0; });
  DiagnoseProblem diagnosis;
  diagnosis.rig = problem.rig;
  diagnosis.runs = problem.runs;
  const Diagnosis d = diagnose(diagnosis);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_FALSE(d.unexplained);
}

/// A rig gets other laws while they are tried; the one beside which a second is looked for stays at work.
TEST(LawSearch, FindsTheLawAtWorkInTheFitAndNotInTheRig) {
  FitProblem problem = two_decays(hidden.front().force);
  const Trial base = fit_baseline(problem);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  const Trial with = LawSearch(problem, base, leaves_something, never, LawSearch::Among::forms).search().front();
  problem.rig.laws.clear();
  for (const Trial& t : LawSearch(problem, with, leaves_something, never, LawSearch::Among::forms).search()) EXPECT_EQ(t.effects.front(), with.effects.front());
}

TEST(Screen, PutsTheTruthFirstOrSecond) {
  for (const Hidden& truth : hidden) {
    FitProblem problem = two_decays(truth.force);
    const Trial base = fit_baseline(problem);
    const BesideUnknownForces beside = beside_unknown_forces(base.arrival.joint);
    const Reach reach = reach_of(beside);
    EXPECT_NEAR(reach.x, 1, 0.2) << truth.law;
    EXPECT_NEAR(reach.v, omega, 0.2 * omega) << truth.law;
    std::vector<Form> forms = dictionary(problem.rig, reach);
    for (Form& form : forms) form.starts = shapes_of(form, Grid::fine);
    const std::vector<Screened> screened = screen(forms, beside);
    std::size_t better = 0;
    double own = 0;
    for (std::size_t i = 0; i < forms.size(); ++i)
      if (forms[i].law.name == truth.law) own = screened[i].gain;
    EXPECT_GT(own, 100) << truth.law;
    for (std::size_t i = 0; i < forms.size(); ++i)
      if (!forms[i].law.name.starts_with("curve") && screened[i].gain > own) ++better;
    EXPECT_LE(better, 1) << truth.law;
  }
}

TEST(Dictionary, ReadsBackAsItIsWritten) {
  Reach reach;
  reach.x = 0.01, reach.v = 0.3, reach.a = 9, reach.twist = 0.02, reach.twist_rate = 2, reach.alpha = 0.2, reach.seconds = 10, reach.force = 20,
  reach.moment = 0.5;
  const std::vector<Form> forms = dictionary(Rig(), reach);
  EXPECT_GT(forms.size(), 20);
  for (const Form& form : forms) {
    const Law again = parse_law(law_text(form.law), "again.toml");
    EXPECT_TRUE(again.says_the_same_as(form.law)) << form.law.name;
    for (std::size_t k = 0; k < again.parameters.size(); ++k) {
      EXPECT_EQ(again.parameters[k].start, form.law.parameters[k].start) << form.law.name;
      EXPECT_EQ(again.parameters[k].lower, form.law.parameters[k].lower) << form.law.name;
      EXPECT_EQ(again.parameters[k].upper, form.law.parameters[k].upper) << form.law.name;
    }
    for (const VectorXd& start : form.starts) ASSERT_EQ(start.size(), static_cast<Index>(again.parameters.size()));
  }
}

}  // namespace
}  // namespace unrig
