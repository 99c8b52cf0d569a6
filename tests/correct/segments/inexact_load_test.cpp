#include "correct/segments/inexact_load.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/correct/null_campaign.h"
#include "tests/support/shared_data.h"
#include "tests/support/stated.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A campaign fitted and one of its steps corrected, with what rig file and runs state.
struct Corrected {
  CorrectResult result;
  VectorXd truth;  ///< circulatory load [N]
};

Corrected correct_campaign(const std::string& folder, const std::string& step, const std::string& place, const std::string& of_rig, const std::string& of_runs) {
  const test::TemporaryDirectory directory;
  const std::string file = directory.path("rig.toml"), text = read_text(folder + "/rig.toml");
  directory.file("rig.toml", of_rig.empty() ? text : test::with_line(text, place, of_rig));
  FitProblem problem;
  problem.rig = read_rig(file);
  for (const std::string run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) {
    const std::string path = folder + "/" + run + ".csv";
    problem.runs.push_back(of_runs.empty() ? read_run(path) : test::run_that_states(path, of_runs));
  }
  const FittedRig fitted = read_fit(directory.file("fit.json", to_json(fit(problem))));
  const std::string path = folder + "/" + step + ".csv";
  CorrectProblem at{problem.rig, fitted, of_runs.empty() ? read_run(path) : test::run_that_states(path, of_runs), 0};
  return {correct(at), test::column_of(folder + "/truth_" + step + ".csv", "circulatory")};
}

struct Held {
  double share = 0;  ///< of the samples from 0.5 to 8 semichords, within 1.96 standard deviations
  double error = 0;  ///< r.m.s., over the step of the load
};

Held held(const Corrected& c) {
  const CorrectedLoad& load = c.result.circulatory;
  double count = 0, inside = 0, square = 0;
  for (Index k = 0; k < load.value.size(); ++k) {
    const double s = (c.result.start + static_cast<double>(k) * c.result.dt - c.result.onset) * c.result.semichords_per_second, off = load.value[k] - c.truth[k];
    if (s < 0.5 || s > 8) continue;
    ++count;
    inside += std::abs(off) <= 1.96 * load.std[k] ? 1 : 0;
    square += off * off;
  }
  return {inside / count, std::sqrt(square / count) / std::abs(c.truth[c.truth.size() - 1] - c.truth[0])};
}

const std::string null_folder = test::source_path("sample_data/campaigns/null");

TEST(InexactLoad, NumbersKnownToAMillionthLeaveTheBandAsItIs) {
  const CorrectResult exact = correct_campaign(null_folder, "step_a", "", "", "").result;
  const CorrectResult tight = correct_campaign(null_folder, "step_a", "mass.unit", "mass.std_percent = 1e-6", "").result;
  const Index last = exact.circulatory.value.size() - 1;
  for (const Index k : {last / 2, last}) {
    EXPECT_NEAR(tight.circulatory.value[k], exact.circulatory.value[k], 0.1 * exact.circulatory.std[k]);
    EXPECT_NEAR(tight.circulatory.std[k] / exact.circulatory.std[k], 1, 0.05);
  }
}

/// An error of the speed of one run that took no part in the fit does not change how large the measured load is, but what coefficient it makes (over U^2), and so the slope.
TEST(InexactLoad, ASpeedThatIsUncertainIsInTheCoefficientAndTheSlope) {
  const std::string path = test::null_campaign("heldout.csv");
  const CorrectResult exact = correct({test::null_rig(), test::null_fit(), read_run(path), 0});
  const CorrectResult result = correct({test::null_rig(), test::null_fit(), test::run_that_states(path, "speed_std_percent = 1.0\n# speed_error = \"own\""), 0});
  const Index last = result.normal_force.value.size() - 1;
  const double coefficient = result.normal_force.value[last] / result.force_per_coefficient;
  EXPECT_NEAR(result.coefficient_std[last] / coefficient, 0.02, 0.003);
  EXPECT_NEAR(result.slope_std / result.slope, std::hypot(exact.slope_std / exact.slope, 0.019), 0.004);
  EXPECT_LT(result.normal_force.std[last] / result.normal_force.value[last], 0.005);
  EXPECT_EQ(result.normal_force.value[last], exact.normal_force.value[last]);
}

TEST(InexactLoad, AFitOfStatedNumbersWantsTheFileThatStatesThem) {
  const test::TemporaryDirectory directory;
  FittedRig fit = test::null_fit();
  fit.givens = {{"normal.mass[1]", "kg", "", 1, 0.01, 1.01, 0.005}};
  fit.joint_covariance = Eigen::MatrixXd::Identity(static_cast<Index>(fit.parameters.size()) + 1, static_cast<Index>(fit.parameters.size()) + 1);
  EXPECT_THROW(correct({test::null_rig(), fit, read_run(test::null_campaign("step_a.csv")), 0}), InputError);
}

/// Masses off by one per cent each, by another program: 4 % of the load without what is stated.
TEST(InexactLoad, BandsHoldWhereMassesAreOffByWhatIsStated) {
  UNRIG_NEEDS_SHARED("campaigns/open2/e1/rig.toml");
  const std::string folder = test::shared_path("campaigns/open2/e1");
  const Held without = held(correct_campaign(folder, "step_b", "", "", "")), with = held(correct_campaign(folder, "step_b", "mass.unit", "mass.std_percent = 1.0", ""));
  EXPECT_GT(without.error, 0.02);
  EXPECT_LT(with.error, 0.01);
  EXPECT_GT(with.share, 0.9);
}

}  // namespace
}  // namespace unrig
