#include "fit/search/first_order.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "core/effects/effect.h"
#include "fit/fit.h"
#include "fit/search/effect_search.h"
#include "fit/search/screening.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const FitProblem& campaign() {
  static const FitProblem problem = [] {
    FitProblem p;
    p.rig = read_rig(test::null_campaign("rig.toml"));
    for (const char* run : {"dry_pluck.csv", "wet_pluck.csv", "step_a.csv", "step_b.csv"}) p.runs.push_back(read_run(test::null_campaign(run)));
    return p;
  }();
  return problem;
}

const Trial& baseline() {
  static const Trial fit = fit_baseline(campaign());
  return fit;
}

const std::shared_ptr<const AeroelasticModel>& model_with(const std::string& id) {
  static std::vector<std::shared_ptr<const AeroelasticModel>> models;  // outlive the joint problems that look at them
  models.push_back(std::make_shared<const AeroelasticModel>(model_of(campaign().rig, campaign().runs, campaign().circulation, {id})));
  return models.back();
}

/// Effects that are laws on a beam, all of the list.
std::vector<std::string> laws() {
  std::vector<std::string> ids;
  std::vector<Conditions> conditions;
  for (const RunResidual& run : baseline().arrival.joint.runs()) conditions.push_back(run.conditions());
  for (const Effect& e : effects()) {
    if (!why_idle(e, campaign().rig, conditions).empty()) continue;
    const auto model = model_with(e.id);
    const bool is_law = std::any_of(campaign().runs.begin(), campaign().runs.end(), [&](const Run& run) {
      const RunResidual residual(*model, run, motion_windows(run));
      return e.acts(campaign().rig, residual.conditions()) && !model->system(residual.conditions(), model->start_values(), residual.channels()).feedback.empty();
    });
    if (is_law) ids.push_back(e.id);
  }
  return ids;
}

/// Held against the whole linearisation of the model with the law in it: c found anew, its tangents and all derivatives those of the nonlinear model.
TEST(FirstOrder, PromisesWhatTheWholeLinearisationDoes) {
  const FirstOrder first_order(baseline().arrival.joint);
  ASSERT_TRUE(first_order.known());
  const Screening screening(campaign(), baseline().arrival);
  int held_against = 0;
  for (const std::string& id : laws()) {
    JointProblem joint = screening.extend(model_with(id), {id}).arrival.joint;
    if (takes_small_steps(joint)) continue;  // corners have no slope that both would see alike
    const double promised = 1 - first_order.promise(joint, id).left / first_order.left();
    Unknown& size = *unknowns_of(joint, id).front();
    if (!effect(id).frequency) size.value = std::clamp(1e-3 * size.value, joint.parameter(size).lower, joint.parameter(size).upper);
    const double whole = 1 - left_by_a_step(joint) / first_order.left();
    EXPECT_NEAR(promised, whole, 0.05 * whole) << id << ": 0.049 for speed-surge, whose amplitude is told in two steps here and there";
    ++held_against;
  }
  EXPECT_GE(held_against, 6);
}

/// What a fit leaves that has not come to its least chi-square is no mismatch that laws take away, nor signals: shares are of what a step without them leaves.
TEST(FirstOrder, WhatTheFitItselfWouldTakeIsNotPromised) {
  Arrival early = baseline().arrival;
  for (Unknown& u : early.joint.unknowns())
    if (u.run < 0 && early.joint.parameter(u).name == "normal.stiffness_scale") u.value *= 1.001;
  const double least = baseline().arrival.joint.chi2();
  ASSERT_GT(early.joint.chi2(), 2 * least);
  const Screening screening(campaign(), early), settled(campaign(), baseline().arrival);
  for (const std::string id : {"coulomb-friction", "cubic-stiffness", "gauge-drift"}) {
    const Screening::Extended promised = screening.extend(model_with(id), {id});
    EXPECT_LT(promised.left, 1.1 * least) << id << ": a step in all unknowns goes most of the way";
    EXPECT_NEAR(promised.share, settled.extend(model_with(id), {id}).share, 0.02) << id << ": of the least nothing is there to take; two per cent for the curvature of the step";
  }
}

/// The first parameter of a tone is no size: a line of 2 Hz in the readings of the steps is promised by a surge of the speed at 2 Hz, and by none that is slower.
TEST(FirstOrder, AToneIsAskedForAtItsOwnFrequency) {
  FitProblem with_line = campaign();
  for (unrig::Run& run : with_line.runs) {
    if (run.kind != RunKind::step) continue;
    for (Channel& c : run.channels)
      if (c.name == "gauge")
        for (Index k = 0; k < c.value.size(); ++k) c.value[k] += 0.2 * std::sin(2 * std::numbers::pi * 2 * run.dt * static_cast<double>(k));
  }
  const Trial base = fit_baseline(with_line);
  const FirstOrder first_order(base.arrival.joint);
  const auto model = std::make_shared<const AeroelasticModel>(model_of(with_line.rig, with_line.runs, with_line.circulation, {"speed-surge"}));
  JointProblem joint = transferred(with_line, base.arrival, model).joint;
  const auto promised_at = [&](double frequency) {
    unknowns_of(joint, "speed-surge").front()->value = frequency;
    return 1 - first_order.promise(joint, "speed-surge").left / first_order.left();
  };
  // Not all of the line: a surge acts by the load, which changes in a step.
  EXPECT_GT(promised_at(2), 0.2);
  EXPECT_LT(promised_at(0.5), 0.1 * promised_at(2));
}

/// Slopes in a law's own parameters by differences, over all laws and all of their parameters. What is left falls as the prediction grows.
TEST(FirstOrder, SlopesAreThoseOfDifferences) {
  const Screening screening(campaign(), baseline().arrival);
  const JointProblem& base = baseline().arrival.joint;
  for (const std::string& id : laws()) {
    const JointProblem joint = screening.extend(model_with(id), {id}).arrival.joint;
    if (takes_small_steps(joint)) continue;  // differences see single crossings of a corner
    std::vector<Index> own;
    for (const Unknown& u : joint.unknowns())
      if (joint.parameter(u).name.starts_with(id + ".") && std::find(own.begin(), own.end(), u.parameter) == own.end()) own.push_back(u.parameter);
    for (std::size_t r = 0; r < base.runs().size(); ++r) {
      const RunResidual::FirstOrder run(base.runs()[r], base.theta(r));
      ASSERT_TRUE(run.known());
      if (!effect(id).acts(campaign().rig, base.runs()[r].conditions())) continue;
      VectorXd theta = joint.theta(r);
      theta[own.front()] *= 1e-3;  // trajectories beside strong laws are chaotic
      const auto all = run.beside(joint.runs()[r], theta, own);
      for (std::size_t j = 0; j < own.size(); ++j) {
        // The rows of two calls are rotated alike but for what lies beside c and theta: inner products with what theta does, which both have, tell of the rest.
        const Index known = run.slopes().cols(), rows = run.slopes().rows() - 1;
        const VectorXd slope = all.slopes.col(known + static_cast<Index>(j)).head(rows);
        if (slope.isZero(0)) continue;
        const double h = theta[own[j]] != 0 ? 1e-4 * std::abs(theta[own[j]]) : 1e-3 / slope.norm();
        VectorXd up = theta, down = theta;
        up[own[j]] += h, down[own[j]] -= h;
        const VectorXd difference = (run.beside(joint.runs()[r], down, own).left - run.beside(joint.runs()[r], up, own).left).head(rows) / (2 * h);
        EXPECT_LT((slope - difference).norm(), 1e-3 * slope.norm()) << id << " " << joint.model().parameters()[static_cast<std::size_t>(own[j])].name << " " << joint.runs()[r].run().file;
      }
    }
  }
}

/// Without any law beside it: chi-square and its slopes are those of the run itself.
TEST(FirstOrder, IsTheRunsOwnEvaluation) {
  const JointProblem& joint = baseline().arrival.joint;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual::Evaluation e = joint.runs()[r].evaluate(joint.theta(r), Partials::all);
    const RunResidual::FirstOrder run(joint.runs()[r], joint.theta(r));
    EXPECT_NEAR(run.left().squaredNorm(), e.chi2, 1e-9 * e.chi2);
    const MatrixXd expected = e.jacobian.transpose() * e.jacobian, found = run.slopes().transpose() * run.slopes();
    EXPECT_LT((expected - found).norm(), 1e-8 * expected.norm());
    EXPECT_LT((e.jacobian.transpose() * e.residual + run.slopes().transpose() * run.left()).norm(), 1e-8 * e.jacobian.norm() * e.residual.norm()) << "slopes of what is left, and of the prediction";
  }
}

/// c goes over to a model with two states more, behind those that both have, and comes back as it was.
TEST(FirstOrder, LinearUnknownsGoOverToAModelWithFurtherStates) {
  const JointProblem& joint = baseline().arrival.joint;
  const JointProblem with = transferred(campaign(), baseline().arrival, model_with("tank-wave")).joint;
  for (std::size_t r = 1; r < joint.runs().size(); ++r) {  // there are no waves in air
    const RunResidual &run = joint.runs()[r], &other = with.runs()[r];
    ASSERT_EQ(other.linear_unknowns(), run.linear_unknowns() + 2);
    const VectorXd c = run.predict(joint.theta(r)).linear, there = RunResidual::FirstOrder::as_other_has_it(run, c, other);
    const Index offsets = run.linear_unknowns() - run.first_offset();
    EXPECT_EQ(there.tail(offsets), c.tail(offsets));
    EXPECT_EQ((there.array() == 0).count(), (c.array() == 0).count() + 2);
    EXPECT_EQ(RunResidual::FirstOrder::as_other_has_it(other, there, run), c);
  }
}

/// Beside a strong law a search for c in two steps, a glance, needs the c of the fit without the effect: from that of the rig without the law it ends elsewhere.
TEST(Screening, ANonlinearRunBeginsWhereTheFitWithoutTheEffectStands) {
  FitProblem problem;
  problem.rig = read_rig(test::source_path("sample_data/campaigns/drag/rig.toml"));
  for (const char* run : {"dry_pluck.csv", "wet_pluck.csv", "step_b.csv"}) problem.runs.push_back(read_run(test::source_path("sample_data/campaigns/drag/") + run));
  const Trial without = fit_baseline(problem);
  Trial drag = prepare(problem, without, {"quadratic-drag"});
  ASSERT_TRUE(follow_nonlinear(problem, drag, without, without.reduced_chi2()));
  ASSERT_LT(drag.reduced_chi2(), explained);
  const auto both = std::make_shared<const AeroelasticModel>(model_of(problem.rig, problem.runs, problem.circulation, {"quadratic-drag", "gauge-drift"}));
  JointProblem with = Screening(problem, drag.arrival).extend(both, {"gauge-drift"}).arrival.joint;
  for (RunResidual& run : with.runs()) run.glance(true);
  EXPECT_LT(with.chi2(), 1.01 * drag.arrival.joint.chi2());
}

TEST(FirstOrder, StepAlongColumnsThatAreAlike) {
  const MatrixXd columns = (MatrixXd(3, 2) << 1, 2, 0, 0, 0, 0).finished();  // one direction, twice
  const LinearStep step = linear_step(columns, Eigen::Vector3d(3, 4, 0));
  EXPECT_NEAR(step.left, 16, 1e-14);
  EXPECT_NEAR(step.x[0] + 2 * step.x[1], 3, 1e-14);
  EXPECT_EQ(linear_step(MatrixXd::Zero(3, 1), Eigen::Vector3d(3, 4, 0)).left, 25);
}

TEST(ResidualLines, AToneIsFoundAtItsFrequencyWithEveryFurtherStart) {
  FitProblem problem = campaign();
  constexpr double frequency = 1.37, amplitude = 0.05;
  for (unrig::Run& run : problem.runs)
    for (Channel& c : run.channels)
      if (c.name == "gauge")
        for (Index k = 0; k < c.value.size(); ++k) c.value[k] += amplitude * std::sin(2 * std::numbers::pi * frequency * run.dt * static_cast<double>(k));
  const Trial fit = fit_baseline(problem);
  const std::vector<VectorXd> starts = tone_starts(ResidualLines(fit.arrival.joint), fit.arrival.joint, effect("tank-wave"));
  ASSERT_EQ(starts.size(), 6u) << "three lines, two decay times";
  EXPECT_NEAR(starts[0][0], frequency, 0.1) << "a fifth of the resolution of runs of two seconds";
  EXPECT_EQ(starts[0][0], starts[1][0]);
  EXPECT_NE(starts[0][1], starts[1][1]);
}

}  // namespace
}  // namespace unrig
