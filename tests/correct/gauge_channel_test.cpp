// A known amplifier in the gauge's channel is undone.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>

#include "core/files/text_file.h"
#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const std::string campaigns = std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/";

/// The rig of a campaign with these lines under [gauge].
Rig rig_with(const std::string& campaign, const std::string& gauge, const std::string& response = "") {
  const test::TemporaryDirectory directory;
  if (!response.empty()) directory.file("amplifier.csv", response);
  std::string text = read_text(campaigns + campaign + "/rig.toml");
  return read_rig(directory.file("rig.toml", text.insert(text.find("[gauge]") + 7, "\n" + gauge + "\n")));
}

/// R.m.s. error of the circulatory load from 0.5 to 8 semichords after the shaft begins to turn, at 1 s, over the size of the step.
double error_of(const CorrectResult& result, const VectorXd& truth) {
  double sum = 0;
  Index count = 0;
  for (Index k = 0; k < truth.size(); ++k) {
    const double semichords = (result.start + static_cast<double>(k) * result.dt - 1) * result.semichords_per_second;
    if (semichords >= 0.5 && semichords <= 8) sum += std::pow(result.circulatory.value[k] - truth[k], 2), ++count;
  }
  return std::sqrt(sum / static_cast<double>(count)) / std::abs(truth[truth.size() - 1] - truth[0]);
}

FittedRig fitted(const Rig& rig, const std::string& campaign, FitResult& result) {
  FitProblem problem;
  problem.rig = rig;
  for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(campaigns + campaign + "/" + run + ".csv"));
  result = fit(problem);
  const test::TemporaryDirectory directory;
  return read_fit(directory.file("fit.json", to_json(result)));
}

class KnownAmplifier : public ::testing::TestWithParam<bool> {};

TEST_P(KnownAmplifier, IsUndone) {
  // The campaign's amplifier is Butterworth's of second order (KEY.json has the cutoff), once by name, once as a measured response.
  const nlohmann::json key = nlohmann::json::parse(read_text(campaigns + "KEY.json"))["lowpass"];
  const double cutoff = key["parameters"]["cutoff_hz"];
  std::string table = "frequency [Hz],gain [1],phase [deg]\n";
  for (double f = 0; f <= 150; f += 2.5) {
    const std::complex<double> x(0, f / cutoff), h = 1.0 / (1.0 + std::numbers::sqrt2 * x + x * x);
    table += std::to_string(f) + "," + std::to_string(std::abs(h)) + "," + std::to_string(std::arg(h) * 180 / std::numbers::pi) + "\n";
  }
  const Rig rig = GetParam() ? rig_with("lowpass", "response = \"amplifier.csv\"", table)
                             : rig_with("lowpass", "lowpass = { order = 2, cutoff = \"" + std::to_string(cutoff) + " Hz\" }");
  FitResult result;
  const FittedRig fit = fitted(rig, "lowpass", result);
  const std::map<std::string, double> truth = {{"normal.stiffness_scale", key["truth"]["kn"]}, {"torsion.stiffness_scale", key["truth"]["kt"]},
                                               {"normal.damping_ratio", key["truth"]["zeta_n"]}, {"apparent_mass_coefficient", key["truth"]["Ca"]}};
  for (const FittedParameter& p : result.parameters)
    if (truth.contains(p.name)) {
      EXPECT_LT(std::abs(p.value - truth.at(p.name)), 3 * p.std_error) << p.name;
    }
  for (const FittedRun& run : result.runs) EXPECT_LT(run.reduced_chi2(), 1.2) << run.file;

  for (const std::string run : {"step_b", "heldout"}) {
    const CorrectResult corrected = correct({rig, fit, read_run(campaigns + "lowpass/" + run + ".csv"), 0});
    const VectorXd true_load = test::column_of(campaigns + "lowpass/truth_" + run + ".csv", "circulatory");
    EXPECT_LT(error_of(corrected, true_load), 0.005) << run;
  }
}

INSTANTIATE_TEST_SUITE_P(Given, KnownAmplifier, ::testing::Values(false, true));

TEST(KnownDelay, IsUndone) {
  // The column of step_a five samples late.
  CorrectProblem problem = test::null_problem("step_a");
  constexpr Index late = 5;
  for (Channel& c : problem.run.channels)
    if (c.name == "gauge") c.value.tail(c.value.size() - late) = VectorXd(c.value.head(c.value.size() - late));
  const VectorXd truth = test::column_of(test::null_campaign("truth_step_a.csv"), "circulatory");
  EXPECT_GT(error_of(correct(problem), truth), 0.01) << "unknown, it does harm";
  problem.rig = rig_with("null", "delay = \"" + std::to_string(late * problem.run.dt) + " s\"\ncalibration_uncertainty = 0.01");
  const CorrectResult corrected = correct(problem);
  EXPECT_LT(error_of(corrected, truth), 0.005);
  // What the rig file says of the calibration is in the budget.
  const Index last = truth.size() - 1;
  EXPECT_NEAR(corrected.circulatory.by_source(last, static_cast<Index>(Source::calibration)), 0.01 * std::abs(corrected.circulatory.value[last]), 5e-4 * std::abs(truth[last]));
}

}  // namespace
}  // namespace unrig
