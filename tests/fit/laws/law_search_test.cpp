// The law of a force that is on no list, found from free decays by an integrator that shares no code with the fit.

#include "fit/laws/law_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "core/law/law_effect.h"
#include "core/numerics/time_limit.h"
#include "core/numerics/work.h"
#include "core/propagate/feedback_force.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/law_answer.h"
#include "fit/diagnose/selection.h"
#include "fit/laws/found_law.h"
#include "fit/laws/screen.h"
#include "tests/fit/laws/two_decays.h"
#include "tests/fit/one_mode.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

using two_decays::omega;
using two_decays::stiffness;

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
  FitProblem problem = two_decays::problem(truth.force);
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

/// The linear part of van der Pol's law cannot be told from damping of the rig, so that no record prefers a value of s; with a small one self-excitation asked for a rig's damping below zero, and what s was tried hung on the noise.
TEST(LawSearch, SelfExcitationIsFoundInAnyNoise) {
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  for (const unsigned seed : {7u, 9u, 15u, 17u}) {
    FitProblem problem = two_decays::problem(hidden.back().force, seed);
    const std::vector<Trial> found = LawSearch(problem, fit_baseline(problem), leaves_something, never, LawSearch::Among::forms).search();
    ASSERT_FALSE(found.empty());
    EXPECT_EQ(found.front().effects, std::vector<std::string>{"law:damping of van der Pol"}) << seed;
    EXPECT_FALSE(leaves_something(found.front())) << seed;
  }
}

TEST(LawSearch, FindsNothingInANonlinearDecayThatIsNone) {
  FitProblem problem = two_decays::problem([](double, double) { return 0.0; });
  DiagnoseProblem diagnosis;
  diagnosis.rig = problem.rig;
  diagnosis.runs = problem.runs;
  const Diagnosis d = diagnose(diagnosis);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_FALSE(d.unexplained);
}

/// Little above the noise the free decays are not fitted by themselves, and what a step to first order promises at the rig's own stiffness leaves more than no law does: it is followed all the same.
TEST(LawSearch, FollowsWhatAStepDoesNotComeNear) {
  constexpr double gap = 1.3, pull = 4e-4 * stiffness;
  FitProblem problem = two_decays::problem([](double x, double) { return pull * (std::pow(1 - x / gap, -2) - std::pow(1 + x / gap, -2)); });
  const Trial base = fit_baseline(problem);
  EXPECT_GT(base.reduced_chi2(), 1.5);
  EXPECT_LT(base.reduced_chi2(), 2);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  const std::vector<Trial> found = LawSearch(problem, base, leaves_something, never, LawSearch::Among::forms).search();
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().effects, std::vector<std::string>{"law:pull across two gaps"});
  for (const Unknown& u : found.front().arrival.joint.unknowns())
    if (found.front().arrival.joint.parameter(u).name == "law:pull across two gaps.g") {
      EXPECT_NEAR(u.value, gap, 0.1);
    }
}

/// Wherever a corner lies between a seventh of what the runs reach and nine tenths, one that is asked for first is near.
TEST(Dictionary, AsksForCornersThroughoutTheReach) {
  Reach reach;
  reach.x = 0.01, reach.v = 0.3, reach.a = 9, reach.seconds = 10, reach.force = 20;
  int corners = 0;
  for (const Form& form : dictionary(one_mode::rig(), reach))
    for (std::size_t k = 0; k < form.law.parameters.size(); ++k) {
      const Parameter& p = form.law.parameters[k];
      if (p.name != "s" || p.upper != reach.x) continue;
      ++corners;
      for (const Grid grid : {Grid::first, Grid::coarse, Grid::fine}) {
        std::vector<double> asked;
        for (const VectorXd& shape : shapes_of(form, grid)) asked.push_back(shape[static_cast<Index>(k)]);
        for (double corner = 0.15 * reach.x; corner < 0.9 * reach.x; corner += 0.05 * reach.x) {
          double nearest = INFINITY;
          for (const double a : asked) nearest = std::min(nearest, std::abs(a - corner));
          EXPECT_LE(nearest, (grid == Grid::fine ? 0.08 : 0.16) * reach.x) << form.law.name << ", " << corner;
        }
      }
    }
  EXPECT_EQ(corners, 3) << "on one side, on the other, on both";
}

/// A rig gets other laws while they are tried; the one beside which a second is looked for stays at work.
TEST(LawSearch, FindsTheLawAtWorkInTheFitAndNotInTheRig) {
  FitProblem problem = two_decays::problem(hidden.front().force);
  const Trial base = fit_baseline(problem);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  const Trial with = LawSearch(problem, base, leaves_something, never, LawSearch::Among::forms).search().front();
  problem.rig.laws.clear();
  for (const Trial& t : LawSearch(problem, with, leaves_something, never, LawSearch::Among::forms).search()) EXPECT_EQ(t.effects.front(), with.effects.front());
}

TEST(Screen, PutsTheTruthFirstOrSecond) {
  for (const Hidden& truth : hidden) {
    FitProblem problem = two_decays::problem(truth.force);
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

/// What the screen says of a law of the list is where its effect begins.
TEST(Screen, TellsWhereAnEffectOfTheListBegins) {
  const double spring = 0.08 * stiffness, damper = 2e-4, force = 0.6, speed = 0.1;
  struct Listed {
    const char* id;
    std::function<double(double, double)> force;
    std::vector<double> parameters;
  };
  const std::vector<Listed> list{
      {"cubic-stiffness", [&](double x, double) { return -spring * x * x * x; }, {spring}},
      {"cubic-damping", [&](double, double v) { return -damper * v * v * v; }, {damper}},
      {"coulomb-friction", [&](double, double v) { return -force * std::tanh(v / speed); }, {force}},
  };
  for (const Listed& truth : list) {
    const FitProblem problem = two_decays::problem(truth.force);
    const Trial base = fit_baseline(problem);
    const BesideUnknownForces beside = beside_unknown_forces(base.arrival.joint);
    std::vector<Form> forms = laws_of_the_list(problem.rig, reach_of(beside));
    for (Form& form : forms) form.starts = shapes_of(form, Grid::fine);
    const std::vector<Screened> screened = screen(forms, beside);
    std::size_t best = 0;
    for (std::size_t i = 0; i < forms.size(); ++i)
      if (screened[i].gain > screened[best].gain) best = i;
    EXPECT_EQ(forms[best].listed, truth.id);
    const VectorXd values = as_listed(forms[best], screened[best].start);
    ASSERT_EQ(values.size(), static_cast<Index>(effect(truth.id).parameters.size()));
    // Between the shapes that are tried, and beside shifts of stiffness and damping, a start is a third off at most.
    for (std::size_t k = 0; k < truth.parameters.size(); ++k) EXPECT_NEAR(values[static_cast<Index>(k)] / truth.parameters[k], 1, 0.33) << truth.id << k;
  }
}

/// As formulas, with the stiffness that the gap takes its couple from.
TEST(Dictionary, HasTheForcesOfTheListsEffects) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const unrig::Run run = read_run(test::null_campaign("dry_pluck.csv"));
  Reach reach;
  reach.x = 0.01, reach.v = 0.3, reach.a = 9, reach.twist = 0.02, reach.twist_rate = 2, reach.seconds = 10, reach.force = 20, reach.moment = 0.5;
  const std::vector<Form> forms = laws_of_the_list(rig, reach);
  ASSERT_EQ(forms.size(), 5u);
  for (const Form& form : forms) {
    Rig with_law = rig;
    add_law(with_law, form.law);
    const Basis basis = make_basis(rig, Index{2}, Index{1});
    const AeroelasticModel listed = AeroelasticModel(rig, basis, wagner(Wagner::jones)).with_effects({form.listed}), law = AeroelasticModel(with_law, basis, wagner(Wagner::jones)).with_effects({form.law.id()});
    VectorXd own = form.starts.front(), theta = listed.start_values(), as_law = law.start_values();
    if (form.listed == "freeplay") {
      const double shape = basis.twist(rig.submerged.back() - 1, basis.normal_modes), by_torsion = basis.omega[basis.normal_modes];
      own[form.listed_order[1]] = by_torsion * by_torsion / (shape * shape);
    }
    theta.tail(static_cast<Index>(effect(form.listed).parameters.size())) = as_listed(form, own);
    as_law.tail(own.size()) = own;
    const Conditions conditions = conditions_of(run);
    const LinearSystem a = listed.system(conditions, theta, {"gauge"}), b = law.system(conditions, as_law, {"gauge"});
    // The force of the last law and where it acts, at states of a hundredth of a metre and a radian.
    ASSERT_EQ(a.feedback.size(), 1u);
    ASSERT_EQ(b.feedback.size(), 1u);
    VectorXd state = VectorXd::LinSpaced(a.states(), 0.011, 0.003);
    const auto pushed = [&](const LinearSystem& s, const VectorXd& parameters) {
      const VectorXd seen = s.feedback.front().sees * state;
      return VectorXd(s.A.value * state + s.B.value.rightCols(1) * force_of(s.feedback.front(), seen.data(), parameters).value);
    };
    const VectorXd free = listed.system(conditions, theta, {"gauge"}).A.value * state, moved = pushed(a, theta), by_law = pushed(b, as_law);
    EXPECT_LT((moved - by_law).norm(), 1e-9 * (moved - free).norm() + 1e-12 * moved.norm()) << form.listed << ": rounding";
    EXPECT_GT((moved - free).norm(), 0) << form.listed;
  }
}

/// What has been followed by the time a limit is reached stands.
TEST(LawSearch, AStoppedSearchKeepsWhatItHas) {
  const double spring = 0.08 * stiffness;
  FitProblem problem = two_decays::problem([&](double x, double) { return -spring * x * x * x; });
  const Trial base = fit_baseline(problem);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  const auto search = [&](std::uint64_t most) {
    const WorkLimit limit(most);
    const std::uint64_t before = work_done();
    const std::vector<Trial> found = LawSearch(problem, base, leaves_something, never, LawSearch::Among::laws_and_forms).search();
    return std::pair(found, work_done() - before);
  };
  constexpr std::uint64_t any = 1'000'000'000'000;
  const auto [whole, work] = search(any);
  ASSERT_FALSE(whole.empty());
  EXPECT_EQ(whole.front().effects, std::vector<std::string>{"cubic-stiffness"});
  std::size_t some = 0;
  for (const double share : {0.5, 0.7, 0.8, 0.9, 0.95, 0.98}) {
    const std::vector<Trial> stopped = search(static_cast<std::uint64_t>(share * static_cast<double>(work))).first;
    for (const Trial& t : stopped) EXPECT_EQ(t.variance.size(), problem.runs.size()) << share;
    some += stopped.empty() ? 0 : 1;
  }
  EXPECT_GT(some, 0u) << "the decays are followed before the end";
}

/// Nobody has to fit again what leaves twice the excess of another of the decays.
TEST(LawSearch, TellsWhatTheDecaysRefute) {
  const double spring = 0.08 * stiffness;
  FitProblem problem = two_decays::problem([&](double x, double) { return -spring * x * x * x; });
  const Trial base = fit_baseline(problem);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  LawSearch search(problem, base, leaves_something, never, LawSearch::Among::forms);
  const std::vector<Trial> found = search.search();
  ASSERT_FALSE(found.empty());
  const double excess = std::max(left_of_decays(found.front()), explained) - 1;
  EXPECT_FALSE(search.refuted().empty());
  for (const Trial& t : search.refuted()) {
    EXPECT_TRUE(t.ruled_out || left_of_decays(t) - 1 > 2 * excess) << t.effects.back();
    EXPECT_TRUE(std::none_of(found.begin(), found.end(), [&](const Trial& f) { return f.effects == t.effects; })) << t.effects.back();
  }
  // A diagnosis has them among what was tried.
  DiagnoseProblem diagnosis;
  diagnosis.rig = problem.rig;
  diagnosis.runs = problem.runs;
  Selection selection(diagnosis, problem, base);
  search_laws(problem, base, base, LawSearch::Among::forms, never, selection, {});
  const std::vector<Candidate> ranking = selection.ranking();
  for (const Trial& t : search.refuted())
    EXPECT_TRUE(std::any_of(ranking.begin(), ranking.end(), [&](const Candidate& c) { return c.effects == t.effects && c.search == SearchOutcome::ruled_out; })) << t.effects.back();
}

/// What no formula fits is no question where a law of the list that others have found explains the runs.
TEST(LawSearch, AsksForNoCurveWhereALawIsKnownThatExplainsTheRuns) {
  const double spring = 0.08 * stiffness;
  FitProblem problem = two_decays::problem([&](double x, double) { return -spring * x * x * x; });
  const Trial base = fit_baseline(problem);
  const auto leaves_something = [](const Trial& t) { return what_remains(t).found; };
  const std::vector<Trial> listed = LawSearch(problem, base, leaves_something, never, LawSearch::Among::laws_and_forms).search();
  ASSERT_FALSE(listed.empty());
  ASSERT_EQ(listed.front().effects, std::vector<std::string>{"cubic-stiffness"});
  const auto tried = [&](const LawSearch::Known& known) {
    LawSearch search(problem, base, leaves_something, never, LawSearch::Among::forms, known);
    std::vector<std::string> ids;
    for (const Trial& t : search.search()) ids.push_back(t.effects.back());
    for (const Trial& t : search.refuted()) ids.push_back(t.effects.back());
    return ids;
  };
  const auto is_curve = [](const std::string& id) { return id.starts_with("law:curve"); };
  const std::vector<std::string> rivals = tried({{}, {listed.front()}, {}}), of_nothing = tried(LawSearch::Known());
  EXPECT_TRUE(std::any_of(of_nothing.begin(), of_nothing.end(), is_curve)) << "otherwise these decays test nothing";
  EXPECT_TRUE(std::none_of(rivals.begin(), rivals.end(), is_curve));
  EXPECT_EQ(std::count(rivals.begin(), rivals.end(), "cubic-stiffness"), 0) << "what was known is not found anew";
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
