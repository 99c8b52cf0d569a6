// Numbers of rig file and heads that state an uncertainty, as parameters of the models that a diagnosis searches with.

#include "fit/givens/number_parameters.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/effects/effect.h"
#include "core/rig/default_errors.h"
#include "fit/diagnose/diagnose.h"
#include "fit/diagnose/heldout.h"
#include "fit/givens/stated_numbers.h"
#include "fit/search/effect_search.h"
#include "fit/search/first_order.h"
#include "fit/search/screening.h"
#include "fit/trial/laboratory.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A campaign whose files state the usual errors of all of their numbers, off by such errors or, without a seed, exact.
FitProblem stated_campaign(const std::string& name, unsigned seed = 0) {
  FitProblem problem;
  problem.rig = read_rig(test::source_path("sample_data/campaigns/" + name + "/rig.toml"));
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(test::source_path("sample_data/campaigns/" + name + "/" + run + ".csv")));
  if (seed > 0) {
    std::mt19937_64 random(seed);
    misread({NoiseKind::white, 0, 1, 0, as_stated, 0}, problem.rig, problem.runs, random);
    return problem;
  }
  problem.rig.givens = std::make_shared<const Givens>(usual_errors(problem.rig));
  for (unrig::Run& run : problem.runs) run.givens = std::make_shared<const Givens>(usual_errors(run));
  return problem;
}

FitProblem without_statements(FitProblem stated) {
  stated.rig.givens = nullptr;
  for (unrig::Run& run : stated.runs) run.givens = nullptr;
  return stated;
}

FilesToFit files_of(const FitProblem& stated) {
  const FitProblem exact = without_statements(stated);
  return with_numbers_as_parameters(stated, {}, fit_baseline(exact).arrival);
}

double apart(const LinearSystem& a, const LinearSystem& b) {
  const auto relative = [](const DualMatrix& x, const DualMatrix& y) { return (x.value - y.value).norm() / std::max(y.value.norm(), 1e-300); };
  return relative(a.A, b.A) + relative(a.B, b.B) + relative(a.C, b.C) + relative(a.D, b.D);
}

/// To first order a deviation of the model is one of the numbers, over all deviations and runs, with the modes of the rig file and with all modes: one standard deviation of numbers known to about one per cent moves
/// the matrices by what it says but for a tenth of that. Without the clock and calibrations, which act on times and readings.
TEST(NumberParameters, MoveTheModelAsTheNumbersDo) {
  FitProblem stated = stated_campaign("null");
  for (unrig::Run& run : stated.runs) run.givens = nullptr;
  const FitProblem exact_files = without_statements(stated);
  const Trial fit = fit_baseline(exact_files);
  const FilesToFit files = with_numbers_as_parameters(stated, {}, fit.arrival);
  const StatedNumbers numbers(stated.rig, stated.runs);
  ASSERT_GT(files.directions.cols(), 2);
  const auto as_fitted = [&](const AeroelasticModel& model, std::size_t r) {
    VectorXd theta = model.start_values();
    const VectorXd known = fit.arrival.joint.theta(r);
    for (Index j = 0; j < known.size(); ++j) theta[model.index(fit.arrival.model->parameters()[static_cast<std::size_t>(j)].name)] = known[j];
    return theta;
  };
  for (const std::vector<std::string>& effects : {std::vector<std::string>{}, {"higher-mode"}}) {
    const AeroelasticModel model = model_of(files.problem.rig, files.problem.runs, files.problem.circulation, effects), filed = model_of(stated.rig, stated.runs, stated.circulation, effects);
    for (Index k = 0; k < files.directions.cols(); ++k) {
      const auto moved = [&](double size, std::size_t r) {
        VectorXd theta = as_fitted(model, r);
        theta[model.index("deviation[" + std::to_string(k + 1) + "]")] = size;
        const AeroelasticModel there = model_of(numbers.rig_at(size * files.directions.col(k)), stated.runs, stated.circulation, effects);
        const LinearSystem exact = there.system(conditions_of(stated.runs[r]), as_fitted(there, r), {"gauge"});
        return std::pair(apart(model.system(conditions_of(files.problem.runs[r]), theta, {"gauge"}), exact), apart(filed.system(conditions_of(stated.runs[r]), as_fitted(filed, r), {"gauge"}), exact));
      };
      for (std::size_t r = 0; r < stated.runs.size(); ++r) {
        EXPECT_LT(moved(0, r).first, 1e-12);
        const auto [miss, change] = moved(1, r);
        EXPECT_LT(miss, 0.1 * change) << k << " " << stated.runs[r].file << " " << change;
      }
    }
  }
}

/// chi-square has what is known of the numbers, its rows and slopes have it too, and a step to first order is the one that a step of everything is.
TEST(NumberParameters, CountByWhatIsKnownOfThem) {
  const FilesToFit files = files_of(stated_campaign("null", 3));
  Trial baseline = fit_baseline(files.problem);
  JointProblem& joint = baseline.arrival.joint;
  for (RunResidual& run : joint.runs()) run.temper(1);
  double runs = 0, known = 0;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) runs += joint.runs()[r].evaluate(joint.theta(r), Partials::none).chi2;
  Index deviations = 0;
  for (Unknown& u : joint.unknowns())
    if (std::isfinite(joint.parameter(u).known_to)) known += u.value * u.value, ++deviations;
  EXPECT_EQ(deviations, files.directions.cols());
  ASSERT_GT(known, 0.5);
  measure(baseline);
  Trial worse = baseline;
  for (Unknown& u : worse.arrival.joint.unknowns())
    if (std::isfinite(joint.parameter(u).known_to)) u.value *= 2;
  EXPECT_NEAR(deviance_difference(worse, baseline), 3 * known, 1e-9 * known) << "the variances are those of before";
  EXPECT_NEAR(joint.chi2(), runs + known, 1e-9 * joint.chi2());
  const JointProblem::Linearisation lin = joint.linearise();
  EXPECT_NEAR(lin.residual.squaredNorm(), joint.chi2(), 1e-9 * joint.chi2());
  EXPECT_NEAR(lin.chi2(), joint.chi2(), 1e-9 * joint.chi2());
  for (Unknown& u : joint.unknowns())
    if (std::isfinite(joint.parameter(u).known_to)) u.value += 0.5;
  const double by_all = left_by_a_step(joint), to_first_order = FirstOrder(joint).left();
  EXPECT_NEAR(to_first_order, by_all, 1e-6 * by_all);
  EXPECT_LT(by_all, joint.chi2() - 0.25);
}

/// Numbers that are off by what is stated leave nothing, far fewer parameters than numbers find them, and a run that took no part is predicted by what the others leave open.
TEST(NumberParameters, TakeWhatTheFilesAreOffBy) {
  const FitProblem stated = stated_campaign("null", 3);
  const FilesToFit files = files_of(stated);
  FitProblem exact = files.problem;
  exact.rig.deviations = 0;
  EXPECT_GT(fit_baseline(exact).reduced_chi2(), explained);
  const Trial baseline = fit_baseline(files.problem);
  EXPECT_LT(baseline.reduced_chi2(), explained);
  EXPECT_LT(files.directions.cols(), 20);
  EXPECT_LT(deviations_at(files, baseline.arrival.joint).squaredNorm(), 40) << "of 59 standard normal ones some twelve are told: 12 + 5 sqrt(24) = 36";
  for (std::size_t r = 0; r < stated.runs.size(); ++r) {
    const HeldoutResidual left = predict_left_out(baseline.arrival, r);
    EXPECT_LT(left.rms, 1.1 * left.noise) << stated.runs[r].file;
  }
}

/// What is hidden is named beside numbers that are off, and its error allows for theirs: the fit to the exact files is within it.
TEST(StatedNumbersInADiagnosis, DragIsNamed) {
  const FitProblem stated = stated_campaign("drag", 3);
  DiagnoseProblem problem;
  problem.rig = stated.rig;
  problem.runs = stated.runs;
  problem.effects = {"quadratic-drag", "tank-wave", "wagner-lag"};
  const Diagnosis d = diagnose(problem);
  ASSERT_EQ(d.missing.size(), 1u);
  EXPECT_EQ(d.missing.front().effect, "quadratic-drag");
  EXPECT_FALSE(d.unexplained);
  FitProblem exact = without_statements(stated_campaign("drag"));
  exact.effects = {"quadratic-drag"};
  const FitResult fit = unrig::fit(exact);
  const auto coefficient = std::find_if(fit.parameters.begin(), fit.parameters.end(), [](const FittedParameter& p) { return p.name == "quadratic-drag.coefficient"; });
  ASSERT_NE(coefficient, fit.parameters.end());
  const FittedParameter& found = d.missing.front().parameters.front();
  EXPECT_EQ(found.name, coefficient->name);
  EXPECT_TRUE(found.identified) << found.advice;
  EXPECT_LT(std::abs(found.value - coefficient->value), 3 * found.std_error) << found.value << " +- " << found.std_error << ", of exact files " << coefficient->value << " +- " << coefficient->std_error;
  EXPECT_GT(found.std_error, 2 * coefficient->std_error);
  EXPECT_LT(found.std_error, 0.1 * found.value);
  EXPECT_FALSE(d.after.givens.empty());
  for (const FittedParameter& p : d.after.parameters) EXPECT_FALSE(p.name.starts_with("deviation")) << "numbers are told as such";
}

/// Nothing is missing but what the files state of their numbers.
TEST(StatedNumbersInADiagnosis, NothingIsMissing) {
  const FitProblem stated = stated_campaign("null", 3);
  DiagnoseProblem problem;
  problem.rig = stated.rig;
  problem.runs = stated.runs;
  problem.heldout.push_back(read_run(test::source_path("sample_data/campaigns/null/heldout.csv")));
  const Diagnosis d = diagnose(problem);
  EXPECT_TRUE(d.missing.empty());
  EXPECT_FALSE(d.unexplained);
  EXPECT_FALSE(d.mismatch.found);
  EXPECT_EQ(d.before.givens.size(), d.after.givens.size());
  EXPECT_FALSE(d.after.givens.empty());
}

}  // namespace
}  // namespace unrig
