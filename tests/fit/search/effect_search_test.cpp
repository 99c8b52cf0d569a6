// How sets of effects are compared: the criterion of Schwarz, with as many samples as the residual's colour leaves independent.

#include "fit/search/effect_search.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "tests/fit/one_mode.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr Index samples = 4000;

/// A fit of the true rig to its decay under this noise.
struct Fitted {
  unrig::Run run;
  Trial trial;

  explicit Fitted(const VectorXd& noise) : Fitted(one_mode::decay("decay.csv", 5 * one_mode::free_response(samples, one_mode::hertz).col(0) + noise)) {}
  explicit Fitted(unrig::Run of) : run(std::move(of)), trial(fit_of(run)) {}

 private:
  static Trial fit_of(const unrig::Run& run) {
    const auto model = std::make_shared<const AeroelasticModel>(one_mode::model());
    std::vector<RunResidual> residuals;
    residuals.emplace_back(*model, run, std::vector<MotionBasis::Window>{});
    return {{}, {model, {{}}, JointProblem(*model, std::move(residuals))}};
  }
};

/// One run that is left with this residual power over the noise's, `independent` of its samples by the colour of what is left.
Trial left_with(const Trial& any, double variance, double independent, int variables) {
  Trial trial = any;
  trial.variance = {variance};
  trial.samples = {independent};
  trial.angle_variance = {1};
  trial.angle_samples = {0};
  trial.variables = variables;
  return trial;
}

TEST(Bic, EachVariableCostsTheLogarithmOfTheSamples) {
  const Fitted any(one_mode::white_noise(samples, 1));
  const Trial few = left_with(any.trial, 1, 1000, 5), more = left_with(any.trial, 1, 1000, 8);
  EXPECT_NEAR(bic_difference(more, few), 3 * std::log(1000), 1e-9);
  EXPECT_NEAR(bic_difference(few, more), -3 * std::log(1000), 1e-9);
  // Three variables must take more of the residual than that: n ln(variance) is -2 ln(likelihood) at the best variance.
  const double enough = std::exp(-3 * std::log(1000) / 1000);
  EXPECT_GT(bic_difference(left_with(any.trial, 1.001 * enough, 1000, 8), few), 0);
  EXPECT_LT(bic_difference(left_with(any.trial, 0.999 * enough, 1000, 8), few), 0);
}

TEST(Bic, SamplesCountByTheColourOfTheBetterFit) {
  const Fitted any(one_mode::white_noise(samples, 1));
  const Trial worse = left_with(any.trial, 2, 30, 5), better = left_with(any.trial, 1.5, 300, 5);
  EXPECT_NEAR(bic_difference(better, worse), 300 * std::log(1.5 / 2), 1e-9);
  EXPECT_NEAR(bic_difference(worse, better), 300 * std::log(2 / 1.5), 1e-9);
}

TEST(Bic, TheAngleCountsOnlyWhereTheGaugeHasItsFullWeight) {
  const Fitted any(one_mode::white_noise(samples, 1));
  Trial a = left_with(any.trial, 1, 1000, 5), b = left_with(any.trial, 1, 1000, 5);
  a.angle_variance = {1.0}, b.angle_variance = {1.2};
  a.angle_samples = b.angle_samples = {500};
  EXPECT_NEAR(bic_difference(a, b), 500 * std::log(1 / 1.2), 1e-9);
  a.variance = b.variance = {1.01 * explained};  // noise with heavy tails, say
  EXPECT_NEAR(bic_difference(a, b), 500 * std::log(1 / 1.2), 1e-9);
  a.arrival.joint.runs().front().temper(2);
  EXPECT_NEAR(bic_difference(a, b), 0, 1e-9);
}

/// A calibration that is ten per cent off makes readings and noise larger alike: the numbers of the file are as likely as they were.
TEST(Bic, ACalibrationMakesNoEvidence) {
  Fitted as_filed(one_mode::white_noise(samples, 1));
  unrig::Run larger = as_filed.run;
  for (Channel& c : larger.channels) c.value *= 1.1, c.factor *= 1.1;
  Fitted moved(larger);
  moved.trial.arrival.joint.runs().front().keep_noise_of(as_filed.trial.arrival.joint.runs().front());
  EXPECT_NEAR(moved.trial.arrival.joint.chi2() / as_filed.trial.arrival.joint.chi2(), 1, 1e-9);
  measure(as_filed.trial);
  measure(moved.trial);
  EXPECT_NEAR(deviance_difference(moved.trial, as_filed.trial), 0, 1e-6);
}

/// In the same samples; before its release the rig was held.
constexpr double delay = 0.004;
unrig::Run made_late(unrig::Run pluck) {
  const auto by = static_cast<Index>(std::lround(delay / pluck.dt));
  for (Channel& c : pluck.channels) {
    const VectorXd now = c.value;
    c.value << VectorXd::Constant(by, now[0]), now.head(now.size() - by);
  }
  return pluck;
}

/// What the states cost in which a delay of the gauge's channel starts, in twice the logarithm of the evidence.
double cost_of_starts(const unrig::Run& pluck) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.runs = {pluck};
  const Trial base = fit_baseline(problem);
  Trial late = prepare(problem, base, {"channel-delay"});
  for (Unknown& u : late.arrival.joint.unknowns())
    if (late.arrival.joint.parameter(u).name == "channel-delay.time") u.value = delay, u.held = true;  // beside free starts a pluck alone tells it to two samples
  settle(late);
  double unknowns = 0;
  for (const Unknown& u : late.arrival.joint.unknowns()) unknowns += u.held ? 0 : 1;
  for (const Unknown& u : base.arrival.joint.unknowns()) unknowns -= u.held ? 0 : 1;
  return (late.variables - base.variables - unknowns) * std::log(static_cast<double>(pluck.samples()));
}

/// What a delay was in has died out within milliseconds: a longer record tells no more of it, and six states, of which the first samples tell two, cost less than if all samples told each.
TEST(Bic, WhereAFilterStartsCostsWhatIsLikelyOfIt) {
  const unrig::Run pluck = made_late(read_run(test::null_campaign("dry_pluck.csv")));
  unrig::Run half = pluck;
  for (Channel& c : half.channels) c.value.conservativeResize(pluck.samples() / 2);
  const double late = cost_of_starts(pluck);
  // Less than what is decisive, 10: the release weighs twice in the differences that tell the noise of the half, 1.2 times that of the whole, which is 2 ln 1.2 less for each of six states.
  constexpr double negligible = 6, level = 12;  // 2 ln of the swing over the noise, some 400, by which one sample tells the level that the delay was at
  EXPECT_NEAR(cost_of_starts(half), late, negligible);
  EXPECT_GT(late, level);
  EXPECT_LT(late, 6 * std::log(static_cast<double>(pluck.samples())));
}

/// Of an autoregression of first order, n samples tell of its power what n (1 - r^2) / (1 + r^2) independent ones would (the mean of its spectrum, squared, over the mean of the square).
TEST(Bic, ColouredSamplesCountAsFewerWhiteOnes) {
  for (const double r : {0.0, 0.5, 0.8}) {
    VectorXd noise = one_mode::white_noise(samples, 2);
    for (Index k = 1; k < samples; ++k) noise[k] += r * noise[k - 1];
    Fitted fitted(0.05 * noise);
    fit_fully(fitted.trial, 0);  // at the truth: measured, not searched
    const double expected = samples * (1 - r * r) / (1 + r * r);
    // The mean of 2000 squares of exponential numbers, 2.2 of it each, scatters by 5 %; for r = 0.8 over a fifth of the lines, by 11 %.
    EXPECT_NEAR(fitted.trial.samples.front(), expected, (r < 0.6 ? 0.15 : 0.3) * expected) << r;
  }
}

/// A spring that gives way at once (the search for a law may begin there): that the record of such a rig is not finite tells nothing of what the runs respond to.
TEST(HoldUndetermined, HoldsNothingWhereTheModelRunsAway) {
  FitProblem problem;
  problem.rig = read_rig(test::null_campaign("rig.toml"));
  problem.runs = {read_run(test::null_campaign("dry_pluck.csv"))};
  Trial trial = prepare(problem, fit_baseline(problem), {"cubic-stiffness"});
  const auto held = [&] {
    int count = 0;
    for (const Unknown& u : trial.arrival.joint.unknowns()) count += u.held ? 1 : 0;
    return count;
  };
  const auto spring = std::find_if(trial.arrival.joint.unknowns().begin(), trial.arrival.joint.unknowns().end(), [&](const Unknown& u) { return trial.arrival.joint.parameter(u).name == "cubic-stiffness.coefficient"; });
  ASSERT_NE(spring, trial.arrival.joint.unknowns().end());
  ASSERT_TRUE(hold_undetermined(trial));
  ASSERT_EQ(held(), 0) << "otherwise this pluck tests nothing";
  for (const double coefficient : {-1e9, -1e10, -1e12, -1e15}) {
    spring->value = coefficient;
    EXPECT_FALSE(hold_undetermined(trial)) << coefficient;
    EXPECT_EQ(held(), 0) << coefficient;
  }
}

/// A hum as large as the noise, and no drift: whichever comes first, only the drift goes, and the hum is not fitted without.
TEST(TakenAway, IsWhatNothingIsLostWithout) {
  FitProblem problem;
  problem.rig = one_mode::rig();
  problem.runs.push_back(one_mode::decay("decay.csv", 5 * one_mode::free_response(samples, one_mode::hertz).col(0) + 0.05 * one_mode::white_noise(samples, 5) + 0.05 * one_mode::tone(samples, 50.03)));
  const Trial base = fit_baseline(problem);
  for (const std::vector<std::string>& both : {std::vector<std::string>{"mains-hum", "gauge-drift"}, {"gauge-drift", "mains-hum"}}) {
    Trial with = prepare(problem, base, both);
    fit_fully(with, 6);
    const std::vector<Trial> fewer = taken_away(problem, with);
    ASSERT_EQ(fewer.size(), 1u);
    EXPECT_EQ(fewer.front().effects, std::vector<std::string>{"mains-hum"});
    EXPECT_NEAR(fewer.front().reduced_chi2(), 1, 0.1) << "of 4000 samples the variance scatters by 2 %, and the noise level is an estimate";
  }
  // Without any hum in the readings it goes too, or rather the last of both stays: a set is never empty.
  problem.runs.front() = one_mode::decay("decay.csv", 5 * one_mode::free_response(samples, one_mode::hertz).col(0) + 0.05 * one_mode::white_noise(samples, 5));
  const Trial clean = fit_baseline(problem);
  Trial with = prepare(problem, clean, {"mains-hum", "gauge-drift"});
  fit_fully(with, 6);
  EXPECT_EQ(taken_away(problem, with).size(), 1u);
}

/// Released from 5, with a spring that grows by `hardening` of itself there and dry friction of `friction` of its force.
VectorXd nonlinear_decay(double hardening, double friction) {
  const double omega = 2 * std::numbers::pi * one_mode::hertz, release = 5, slip = 1e-3 * omega * release;
  const auto force = [&](double q, double v) { return omega * omega * (hardening * std::pow(q / release, 2) * q + friction * release * std::tanh(v / slip)); };
  return one_mode::decay_beside(force, release, samples, 16);
}

/// Laws too: of two that act neither goes, of one that does not act beside one that does the idle one, in whichever order.
TEST(TakenAway, IsNoLawThatTheDecaysMiss) {
  FitProblem problem;
  problem.rig = one_mode::rig();
  const auto left_of = [&](double friction, const std::vector<std::string>& both) {
    problem.runs = {one_mode::decay("decay.csv", nonlinear_decay(0.2, friction) + 0.02 * one_mode::white_noise(samples, 9))};
    Trial with = fit_baseline(problem);
    for (const std::size_t count : {1, 2}) {
      Trial next = prepare(problem, with, {both.begin(), both.begin() + static_cast<std::ptrdiff_t>(count)});
      EXPECT_TRUE(follow_nonlinear(problem, next, with, INFINITY));
      with = std::move(next);
    }
    EXPECT_LT(with.reduced_chi2(), explained);
    return taken_away(problem, with);
  };
  EXPECT_TRUE(left_of(0.01, {"cubic-stiffness", "coulomb-friction"}).empty());
  const std::vector<Trial> fewer = left_of(0, {"cubic-stiffness", "coulomb-friction"});
  ASSERT_EQ(fewer.size(), 1u);
  EXPECT_EQ(fewer.front().effects, std::vector<std::string>{"cubic-stiffness"});
}

}  // namespace
}  // namespace unrig
