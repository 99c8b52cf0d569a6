#include "correct/correct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/files/csv_table.h"
#include "core/files/error.h"
#include "core/rig/fingerprint.h"
#include "core/files/text_file.h"
#include "core/model/wagner.h"
#include "correct/corrected_files.h"
#include "tests/correct/null_campaign.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

using test::null_fit;
using test::null_problem;
using test::null_rig;

struct Truth {
  VectorXd time, gauge, circulatory, normal_force;
};

Truth truth_of(const std::string& run) {
  const std::string file = test::null_campaign("truth_" + run + ".csv"), text = read_text(file);
  const CsvTable table = read_csv(text, 1, file);
  const auto column = [&](const std::string& name) {
    return std::find_if(table.columns.begin(), table.columns.end(), [&](const CsvColumn& c) { return c.name == name; })->value;
  };
  return {column("time"), column("gauge_clean"), column("circulatory"), column("normal_force")};
}

constexpr double true_onset = 1;  ///< s: the simulator's shafts begin to turn here, in every run

double rms(const VectorXd& x) { return x.norm() / std::sqrt(static_cast<double>(x.size())); }

TEST(Correct, FindsTheLoadOfARigidRig) {
  for (const std::string name : {"step_a", "step_b", "step_c", "heldout"}) {
    const CorrectResult result = correct(null_problem(name));
    const Truth truth = truth_of(name);
    ASSERT_EQ(result.circulatory.value.size(), truth.circulatory.size());
    const double size = std::abs(truth.circulatory[truth.circulatory.size() - 1] - truth.circulatory[0]);

    // From 0.5 to 8 semichords after the step. The bound, 0.5 %, is what the project promises; 0.26 % is the worst that was measured.
    std::vector<Index> window;
    for (Index k = 0; k < truth.time.size(); ++k) {
      const double semichords = (truth.time[k] - true_onset) * result.semichords_per_second;
      if (semichords >= 0.5 && semichords <= 8) window.push_back(k);
    }
    ASSERT_GT(window.size(), 400u);
    const VectorXd error = (result.circulatory.value - truth.circulatory)(window), raw = (truth.gauge - truth.circulatory)(window);
    EXPECT_LT(rms(error), 0.005 * size) << name;
    EXPECT_GT(rms(raw), 0.4 * size) << name << ": the reading itself is far off";

    // Its own error bars: neither too small nor so wide that they say nothing. Errors of neighbouring samples are one error, so that their
    // r.m.s. scatters by half of itself.
    const VectorXd in_deviations = error.cwiseQuotient(result.circulatory.std(window));
    EXPECT_LT(rms(in_deviations), 2) << name;
    EXPECT_LT(in_deviations.cwiseAbs().maxCoeff(), 5) << name;
    EXPECT_LT(rms(result.circulatory.std(window)), 0.01 * size) << name;
    EXPECT_GT(result.circulatory.std.minCoeff(), 0) << name;

    EXPECT_GT(result.reduced_chi2, 0.9) << name;
    EXPECT_LT(result.reduced_chi2, 1.15) << name;
    EXPECT_NEAR(result.onset, true_onset, 0.006) << name << ": three samples";
  }
}

TEST(Correct, UndoesAFirstOrderAmplifierThatTheRigFileNames) {
  // The recording through an RC filter of 8 Hz, y' = w (u - y) with u straight between its samples, and the noise of a converter behind it.
  constexpr double cutoff = 8, noise = 0.03;
  CorrectProblem problem = null_problem("step_b");
  VectorXd& reading = std::find_if(problem.run.channels.begin(), problem.run.channels.end(), [](const Channel& c) { return c.name == "gauge"; })->value;
  const VectorXd raw = reading;
  const double w = 2 * std::acos(-1.0) * cutoff, decay = std::exp(-w * problem.run.dt), mean = (1 - decay) / (w * problem.run.dt);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, noise);
  double y = raw.head(100).mean();
  for (Index k = 0; k < raw.size(); ++k) {
    if (k > 0) y = decay * y + (mean - decay) * raw[k - 1] + (1 - mean) * raw[k];
    reading[k] = y + normal(random);
  }
  const test::TemporaryDirectory directory;
  std::string rig = read_text(test::null_campaign("rig.toml"));
  rig.insert(rig.find("[gauge]") + 7, "\nlowpass = { order = 1, cutoff = \"8 Hz\" }\n");
  const CorrectResult ignored = correct(problem);
  problem.rig = read_rig(directory.file("rig.toml", rig));
  const CorrectResult undone = correct(problem);
  const Truth truth = truth_of("step_b");
  const double size = std::abs(truth.circulatory[truth.circulatory.size() - 1] - truth.circulatory[0]);
  const auto error_of = [&](const CorrectResult& result) {
    double squares = 0, count = 0;
    for (Index k = 0; k < truth.time.size(); ++k)
      if (const double s = (truth.time[k] - true_onset) * result.semichords_per_second; s >= 0.5 && s <= 8) squares += std::pow(result.circulatory.value[k] - truth.circulatory[k], 2), ++count;
    return std::sqrt(squares / count) / size;
  };
  // What the project promises without an amplifier; where it is not named, the rig's ringing comes late and weak.
  EXPECT_LT(error_of(undone), 0.005);
  EXPECT_GT(error_of(ignored), 0.02);
}

TEST(Correct, FindsHowCirculationBuildsUp) {
  for (const std::string name : {"step_a", "step_b", "heldout"}) {
    const CorrectResult result = correct(null_problem(name));
    EXPECT_NEAR(result.slope, 5.8636, 3 * result.slope_std) << name;  // KEY.json
    for (Index i = 0; i < result.indicial.value.size(); ++i) {
      const double s = result.indicial.semichords[i];
      if (s < 0.5 || s > 20) continue;
      // The response is normalised by the slope, whose own error (0.6 %) is in its standard deviation.
      EXPECT_NEAR(result.indicial.value[i], wagner_exact(s), 4 * result.indicial.uncertainty.std[i]) << name << " at " << s << " semichords";
      EXPECT_LT(result.indicial.uncertainty.std[i], 0.02) << name << " at " << s << " semichords";
    }
    EXPECT_LT(result.indicial.trusted_from, 0.5);
  }
}

TEST(Correct, LoadIsCirculatoryPlusInertiaAndStartsSteady) {
  const CorrectResult result = correct(null_problem("step_a"));
  // Before the motion and long after it there is nothing but circulation.
  for (const Index k : {Index{0}, Index{300}, Index{2999}}) EXPECT_NEAR(result.normal_force.value[k], result.circulatory.value[k], 1e-3) << k;
  EXPECT_GT((result.normal_force.value - result.circulatory.value).cwiseAbs().maxCoeff(), 50) << "the ramp itself is apparent mass";
}

TEST(Correct, LeavesWhatBelongsToTheLoadInIt) {
  // A fit that found a loss of lift: the loss is load, so that the answer is the same as without.
  CorrectProblem problem = null_problem("step_c");
  const CorrectResult plain = correct(problem);
  problem.fit.effects = {"separation-lag", "wagner-lag"};
  for (const auto& [name, value] : {std::pair{"separation-lag.loss", 0.3}, std::pair{"separation-lag.time", 10.0}, std::pair{"wagner-lag.replaced_share", 1.0},
                                   std::pair{"wagner-lag.amplitude_1", 0.1}, std::pair{"wagner-lag.rate_1", 0.1}, std::pair{"wagner-lag.amplitude_2", 0.2}, std::pair{"wagner-lag.rate_2", 0.6}}) {
    problem.fit.parameters.emplace_back();
    problem.fit.parameters.back().name = name;
    problem.fit.parameters.back().value = value;
  }
  const CorrectResult with = correct(problem);
  EXPECT_LT((with.circulatory.value - plain.circulatory.value).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((with.circulatory.std - plain.circulatory.std).cwiseAbs().maxCoeff(), 1e-9);
}

// ---------------------------------------------------------------------------------------------------------------- no answer

std::string refusal(const CorrectProblem& problem) {
  try {
    correct(problem);
  } catch (const InputError& error) {
    return std::string("input: ") + error.what();
  } catch (const NoAnswer& error) {
    return std::string("no answer: ") + error.what();
  }
  return "no error";
}

TEST(Correct, SaysWhatItCannotCorrect) {
  unrig::Run step = read_run(test::null_campaign("step_a.csv"));
  EXPECT_THAT(refusal(null_problem("wet_pluck")), ::testing::AllOf(HasSubstr("input: "), HasSubstr("wet_pluck.csv")));

  Rig modal;
  modal.file = "modes.toml";
  modal.modal = {{1, 3, 0.01, 1, "N"}};
  EXPECT_THAT(refusal({modal, null_fit(), step, 0}), ::testing::AllOf(HasSubstr("input: modes.toml"), HasSubstr("only as modes")));

  for (Channel& channel : step.channels)
    if (channel.name == "alpha") channel.value.tail(channel.value.size() - 500) = channel.value.segment(0, 500).replicate(5, 1);
  EXPECT_THAT(refusal({null_rig(), null_fit(), step, 0}), ::testing::AllOf(HasSubstr("no answer: "), HasSubstr("does not move")));

  step.channels.erase(std::find_if(step.channels.begin(), step.channels.end(), [](const Channel& c) { return c.name == "alpha"; }));
  EXPECT_THAT(refusal({null_rig(), null_fit(), step, 0}), ::testing::AllOf(HasSubstr("input: "), HasSubstr("alpha")));
}

/// The first of each channel's samples.
unrig::Run cut(unrig::Run run, Index samples) {
  for (Channel& c : run.channels) c.value.conservativeResize(samples);
  return run;
}

TEST(Correct, SaysThatAShortRecordKnowsNoLimit) {
  const unrig::Run step = read_run(test::null_campaign("step_a.csv"));
  for (const Index samples : {525, 600}) EXPECT_THAT(correct({null_rig(), null_fit(), cut(step, samples), 0}).warnings, testing::Contains(HasSubstr("semichords after the shaft sets out"))) << samples;
  EXPECT_THAT(correct({null_rig(), null_fit(), cut(step, 900), 0}).warnings, testing::Not(testing::Contains(HasSubstr("semichords after the shaft sets out"))));
}

TEST(Correct, SaysWhenTheRigOfTheFitDoesNotExplainTheReadings) {
  unrig::Run step = read_run(test::null_campaign("step_a.csv"));
  EXPECT_TRUE(correct({null_rig(), null_fit(), step, 0}).warnings.empty());
  for (Channel& c : step.channels)
    if (c.name == "gauge")
      for (Index k = 0; k < c.value.size(); ++k) c.value[k] += 0.3 * std::sin(2 * 3.14159265 * 11 * 0.002 * static_cast<double>(k));  // ten times the noise, at no frequency of the rig
  EXPECT_THAT(correct({null_rig(), null_fit(), step, 0}).warnings, testing::Contains(HasSubstr("unrig diagnose")));
}

/// What is left counts as noise: the band of the load grows with its root.
TEST(Correct, NoiseOfTheGaugeGrowsWithWhatIsLeft) {
  CorrectProblem problem = test::null_problem("step_a");
  const CorrectResult clean = correct(problem);
  for (Channel& c : problem.run.channels)
    if (c.name == "gauge")
      for (Index k = 0; k < c.value.size(); ++k) c.value[k] += 0.15 * std::sin(2 * 3.14159265 * 11 * 0.002 * static_cast<double>(k));  // at no frequency of the rig: what it does cancels
  const CorrectResult wrong = correct(problem);
  EXPECT_GT(wrong.reduced_chi2, 3);
  EXPECT_EQ(wrong.no_answer, "");
  const double grown = std::sqrt(wrong.reduced_chi2 / std::max(1.0, clean.reduced_chi2));
  for (const Index k : {Index{0}, Index{1000}, Index{2500}}) {
    const auto gauge = static_cast<Index>(Source::gauge);
    EXPECT_GT(wrong.circulatory.by_source(k, gauge) / clean.circulatory.by_source(k, gauge), 0.8 * grown) << k;
  }
}

/// The model has an answer to everything; these are none.
TEST(Correct, SaysWhereThereIsNoAnswer) {
  const auto gauge_of = [](CorrectProblem& problem) -> VectorXd& { return std::find_if(problem.run.channels.begin(), problem.run.channels.end(), [](const Channel& c) { return c.name == "gauge"; })->value; };
  CorrectProblem noise = test::null_problem("step_a");
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, 0.03);
  for (double& value : gauge_of(noise)) value = normal(random);
  EXPECT_THAT(correct(noise).no_answer, HasSubstr("of the gauge's variance"));

  CorrectProblem hardly_read = test::null_problem("step_a");
  VectorXd& gauge = gauge_of(hardly_read);
  for (Index k = 0; k < gauge.size(); ++k)
    if (k % 100 != 0) gauge[k] = std::nan("");
  EXPECT_THAT(correct(hardly_read).no_answer, HasSubstr("may move the load")) << "no noise level without neighbours";

  CorrectProblem absurd = test::null_problem("step_a");
  for (FittedParameter& p : absurd.fit.parameters)
    if (p.name == "normal.stiffness_scale") p.value = -1;
  EXPECT_THAT(refusal(absurd), HasSubstr("normal.stiffness_scale is -1"));
}

TEST(Correct, SaysWhenARecordingIsNotTheOneOfTheFit) {
  unrig::Run step = read_run(test::null_campaign("step_a.csv"));
  FittedRig fit = null_fit();
  fit.runs = {step.file};
  fit.fingerprints = {fingerprint(step)};
  EXPECT_THAT(correct({null_rig(), fit, step, 0}).warnings, testing::Not(testing::Contains(HasSubstr("other readings"))));
  step.channels.back().value[100] += 0.001;
  EXPECT_THAT(correct({null_rig(), fit, step, 0}).warnings, testing::Contains(HasSubstr("other readings")));
}

TEST(Correct, RefusesASectionThatDoesNotLoadTheGauge) {
  Rig inboard = null_rig();
  inboard.submerged = {1, 2};
  EXPECT_THAT(refusal({inboard, null_fit(), read_run(test::null_campaign("step_a.csv")), 0}), HasSubstr("no submerged element outboard of the gauge"));
}

TEST(Correct, RefusesTheFitOfAnotherRig) {
  FittedRig other;
  other.file = "other.json";
  other.parameters.emplace_back();
  other.parameters.back().name = "modal[1].stiffness";
  EXPECT_THAT(refusal({null_rig(), other, read_run(test::null_campaign("step_a.csv")), 0}),
              ::testing::AllOf(HasSubstr("other.json"), HasSubstr("normal.stiffness_scale")));
}

}  // namespace
}  // namespace unrig
