#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <utility>

#include "core/files/error.h"
#include "core/model/simulate.h"
#include "fit/fit.h"
#include "fit/likelihood/run_residual.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string sample(const std::string& file) { return std::string(UNRIG_SOURCE_DIR) + "/sample_data/campaigns/null/" + file; }

/// A shaft that wanders at random through the whole record: a fit of it took more than minutes, and had no way to end well.
TEST(EndlessMotion, ThatTheKnotsDoNotFollowIsRefusedAtOnce) {
  for (const Index samples : {40000, 100000}) {
    unrig::Run run = read_run(sample("step_a.csv"));
    std::mt19937_64 engine(3);
    std::normal_distribution<double> normal(0, 1);
    VectorXd angle(samples), gauge(samples);
    double at = 0.05, rate = 0;
    for (Index k = 0; k < samples; ++k) {
      rate += 2e-4 * normal(engine) - 0.05 * rate;
      at += rate - 1e-3 * (at - 0.05);
      angle[k] = at + 2e-4 * normal(engine);
      gauge[k] = 10 * at + 0.03 * normal(engine);
    }
    for (Channel& channel : run.channels) channel.value = channel.name == "alpha" ? angle : gauge;
    FitProblem problem;
    problem.rig = read_rig(sample("rig.toml"));
    problem.runs = {run};
    try {
      fit(problem);
      ADD_FAILURE() << "no error";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), ::testing::HasSubstr("without a rest")) << samples;
      EXPECT_THAT(error.what(), ::testing::HasSubstr("unrig correct"));
    }
  }
}

/// Runs of the sample campaign's rig with the noise of its channels, simulated at a quarter of the sampling interval and with a circulation that is closer to Wagner's.
class Simulated {
 public:
  Simulated(std::map<std::string, double> truth, const std::vector<std::string>& effects) : truth_(std::move(truth)) {
    problem_.rig = read_rig(sample("rig.toml"));
    problem_.effects = effects;
  }

  const FitProblem& problem() const { return problem_; }
  double truth(const std::string& name) const { return name == "steady_normal_force" ? steady : truth_.at(name); }
  void add(unrig::Run recorded) { problem_.runs.push_back(std::move(recorded)); }

  /// A decay of so many samples, with conditions and sampling interval of the sample campaign's.
  void add_decay(const std::string& file, Index samples) {
    unrig::Run run = read_run(sample(file));
    const double dt = run.dt;
    run.dt = dt / finer;
    run.channels = {{"gauge", "N", "N", 1, VectorXd::Zero(finer * samples), 0}};
    add_simulated(std::move(run), dt, samples, 20);
  }

  /// A shaft that never rests: twelve frequencies.
  void add_restless(Index samples, double fastest) {
    unrig::Run run = read_run(sample("step_a.csv"));
    run.file = "restless.csv";
    const double dt = run.dt;
    run.dt = dt / finer;
    VectorXd angle(finer * samples);
    for (Index k = 0; k < angle.size(); ++k) {
      const double t = run.dt * static_cast<double>(k), x = std::clamp((t - 0.1) / 0.3, 0.0, 1.0), begins = x * x * x * (10 - 15 * x + 6 * x * x);
      angle[k] = 2;
      for (int i = 1; i <= 12; ++i) angle[k] += begins / i * std::sin(2 * std::numbers::pi * fastest / 12 * i * (1 + 1e-3 * std::sqrt(i)) * t + 2.4 * i * i);
    }
    run.channels = {{"alpha", "rad", "rad", 1, angle * degree, 0}};
    add_simulated(std::move(run), dt, samples, std::nullopt);
  }

 private:
  static constexpr Index finer = 4;
  static constexpr double degree = std::numbers::pi / 180, gauge_noise = 0.027, angle_noise = 0.01 * degree, steady = 0.2;

  void add_simulated(unrig::Run run, double dt, Index samples, std::optional<double> release_load) {
    const AeroelasticModel model = AeroelasticModel(problem_.rig, make_basis(problem_.rig, 0.5 / dt, run.density), wagner(Wagner::within_1e6)).with_effects(problem_.effects);
    VectorXd theta = model.start_values();
    for (const auto& [name, value] : truth_) theta[model.index(name)] = value;
    const SimulateResult simulated = simulate({model, theta, run, PitchBetweenSamples::spline, release_load, release_load ? std::nullopt : std::optional<double>(steady)});
    std::normal_distribution<double> normal;
    const auto recorded = [&](const std::string& channel, double noise) -> VectorXd {
      VectorXd value = simulated.run.channel(channel).value(Eigen::VectorXi::LinSpaced(samples, 0, static_cast<int>(finer * (samples - 1))));
      for (double& one : value) one += noise * normal(random_);
      return value;
    };
    run.dt = dt;
    run.channels = {{"gauge", "N", "N", 1, recorded("gauge", gauge_noise), 0}};
    if (!release_load) run.channels.push_back({"alpha", "rad", "rad", 1, recorded("alpha", angle_noise), 0});
    problem_.runs.push_back(std::move(run));
  }

  FitProblem problem_;
  std::map<std::string, double> truth_;
  std::mt19937_64 random_{5};
};

const std::map<std::string, double> of_the_rig{{"normal.stiffness_scale", 0.7886982855975505}, {"torsion.stiffness_scale", 0.8013562073631658},  {"normal.damping_ratio", 0.008116058148283655},
                                               {"torsion.damping_ratio", 0.027202192423294178}, {"apparent_mass_coefficient", 1.1219030719225085}, {"normal_force_slope", 5.86}};

void expect_truth(const Simulated& campaign, const FitResult& result) {
  EXPECT_TRUE(result.converged);
  for (const FittedRun& run : result.runs) EXPECT_LT(run.reduced_chi2(), 1.15) << run.file;
  for (const FittedParameter& p : result.parameters) {
    EXPECT_TRUE(p.identified) << p.name;
    EXPECT_NEAR(p.value, campaign.truth(p.name), 4 * p.std_error) << p.name;
  }
}

/// Six seconds up to 30 Hz beside decays of the sample campaign: 900 knots or more, where there were 375.
TEST(EndlessMotion, OfNineHundredKnotsIsFitted) {
  Simulated campaign(of_the_rig, {});
  campaign.add(read_run(sample("dry_pluck.csv")));
  campaign.add(read_run(sample("wet_pluck.csv")));
  campaign.add_restless(3000, 30);
  const std::vector<MotionBasis::Window> windows = windows_to_fit(campaign.problem().runs[2]);
  ASSERT_EQ(windows.size(), 1u);
  EXPECT_GE(windows[0].knots.length() / windows[0].stride, 900);
  expect_truth(campaign, fit(campaign.problem()));
}

/// Up to 0.6 Hz by a degree and less: the angle changes by less than its noise from sample to sample, everywhere alike. It was taken for one that stands still and wanders.
TEST(EndlessMotion, ThatIsSlowIsFitted) {
  Simulated campaign(of_the_rig, {});
  campaign.add(read_run(sample("dry_pluck.csv")));
  campaign.add(read_run(sample("wet_pluck.csv")));
  campaign.add_restless(3000, 0.6);
  ASSERT_EQ(windows_to_fit(campaign.problem().runs[2]).size(), 1u);
  expect_truth(campaign, fit(campaign.problem()));
}

/// Dry friction in the rig turns each time that the section does, while the shaft moves from the beginning of the record to its end.
TEST(EndlessMotion, WithFrictionInTheRigIsFitted) {
  std::map<std::string, double> truth = of_the_rig;
  truth["coulomb-friction.force"] = 0.5;
  truth["coulomb-friction.velocity"] = 0.004;
  Simulated campaign(truth, {"coulomb-friction"});
  campaign.add_decay("dry_pluck.csv", 1500);
  campaign.add_decay("wet_pluck.csv", 1500);
  campaign.add_restless(1500, 25);
  EXPECT_GE(windows_to_fit(campaign.problem().runs[2]).front().knots.length(), 1400);
  expect_truth(campaign, fit(campaign.problem()));
}

}  // namespace
}  // namespace unrig
