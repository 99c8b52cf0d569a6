// The load on a rig that is known only as modes.

#include "correct/modal/modal_load.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "core/model/simulate.h"
#include "fit/fit.h"
#include "tests/correct/null_campaign.h"
#include "tests/support/band.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using ::testing::HasSubstr;

Rig oscillator() {
  Rig rig;
  rig.name = rig.file = "oscillator.toml";
  rig.modal = {{1, 8, 0.02, 500, "N"}};
  return rig;
}

FittedRig known(const Rig& rig) {
  FittedRig fit;
  fit.file = "fit.json";
  const AeroelasticModel model(rig, {}, {});
  for (const Parameter& p : model.parameters()) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = p.name;
    fit.parameters.back().value = p.start;
  }
  fit.correlation = Eigen::MatrixXd::Identity(static_cast<Index>(fit.parameters.size()), static_cast<Index>(fit.parameters.size()));
  return fit;
}

/// A moved run under a load, with noise in the gauge: what is recorded, and the load in the unit of the reading.
struct Loaded {
  unrig::Run run;
  VectorXd load;
};

Loaded recorded(double (*load)(double t), double noise, std::uint64_t seed, Index samples = 3000) {
  const Rig rig = oscillator();
  unrig::Run run;
  run.file = "moved.csv";
  run.kind = RunKind::moved;
  run.dt = 0.005;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  VectorXd mount(samples), force(samples);
  double acceleration = 0;
  for (Index k = 0; k < samples; ++k) {
    acceleration = 0.9 * acceleration + normal(random);
    mount[k] = acceleration;
    force[k] = load(run.time(k));
  }
  const double stiffness = std::pow(2 * pi * 8, 2);
  run.channels = {{"mount_acceleration", "m/s^2", "m/s^2", 1, mount, 0}, {"force", "N", "N", 1, force * stiffness / 500, 0}};
  const AeroelasticModel model(rig, {}, {});
  VectorXd gauge = simulate({model, model.start_values(), run, PitchBetweenSamples::spline, {}, {}}).run.channel("gauge").value;
  for (double& x : gauge) x += noise * normal(random);
  run.channels.pop_back();
  run.channels.push_back({"gauge", "N", "N", 1, gauge, 0});
  return {run, force};
}

double pulses(double t) { return 40 * std::exp(-std::pow((t - 4.0013) / 0.15, 2)) - 25 * std::exp(-std::pow((t - 9) / 0.4, 2)) + 3 * std::sin(2 * pi * 0.7 * t); }

TEST(ModalLoad, ComesBackInsideItsBandAndAtItsTime) {
  Index inside = 0, all = 0, whole = 0;
  constexpr int runs = 8;
  double late = 0;  // s, mean
  for (int i = 0; i < runs; ++i) {
    const Loaded made = recorded(pulses, 0.5, static_cast<std::uint64_t>(i) + 1);
    const ModalLoad result = modal_load({oscillator(), known(oscillator()), made.run, 0});
    const VectorXd off = result.load - made.load;
    EXPECT_LT(std::sqrt(off.squaredNorm() / 3000.0), 0.5) << "half of what the noise of one reading is would be no deconvolution; of the 40 N this is 1.2 %";
    EXPECT_NEAR(result.noise, 0.5, 0.05);
    inside += (off.array().abs() < 1.96 * result.std.array()).count();
    all += off.size();
    whole += (off.array().abs() < result.simultaneous * result.std.array()).all() ? 1 : 0;
    // By how much it must be shifted to lie on the true one.
    const VectorXd slope = (made.load.tail(2999) - made.load.head(2999)) / made.run.dt;
    late -= slope.dot(off.head(2999)) / slope.squaredNorm() / runs;
    EXPECT_GT((made.run.channel("gauge").value - made.load).norm(), 10 * off.norm()) << "the reading itself is far off";
  }
  EXPECT_LT(std::abs(late), 0.1 * 0.005) << "a tenth of a sample";
  const double share = static_cast<double>(inside) / static_cast<double>(all);
  EXPECT_GT(share, 0.90);
  EXPECT_LT(share, 0.985);
  EXPECT_GE(whole, runs / 2);
}

TEST(ModalLoad, MissingReadingsWidenTheBand) {
  Loaded made = recorded(pulses, 0.5, 3);
  made.run.channels.back().value.segment(1800, 60).setConstant(std::nan(""));
  const ModalLoad result = modal_load({oscillator(), known(oscillator()), made.run, 0.01});
  EXPECT_TRUE(result.load.allFinite());
  EXPECT_GT(result.std[1830], 1.5 * result.std[1500]);
  EXPECT_LT(std::abs(result.load[1830] - made.load[1830]), 4 * result.std[1830]);
  EXPECT_DOUBLE_EQ(result.by_source(800, static_cast<Index>(Source::calibration)), 0.01 * std::abs(result.load[800]));
  EXPECT_THAT(to_csv(result), HasSubstr("normal_force [N],normal_force_std [N]"));
}

TEST(ModalLoad, TheFitOfAnotherRigIsRefused) {
  FittedRig other = known(oscillator());
  other.parameters.front().name = "modal[2].mass";
  EXPECT_THROW(modal_load({oscillator(), other, recorded(pulses, 0.5, 1, 200).run, 0}), InputError);
}

TEST(ModalLoad, ForcePlateCarriesNothing) {
  // Fitted to the first half; nothing stands on the plate. Below 6 Hz at most 1.8 N m of the reading may be left; 1.68 was measured, and 0.03 as load.
  UNRIG_NEEDS_SHARED("real/force_plate/RandomFastSpeed1.csv");
  const unrig::Run whole = read_run(test::shared_path("real/force_plate/RandomFastSpeed1.csv"));
  const Index half = whole.samples() / 2;
  FitProblem problem;
  problem.rig = read_rig(test::shared_path("real/force_plate/rig.toml"));
  problem.runs = {test::part(whole, 0, half)};
  const test::TemporaryDirectory directory;
  const FittedRig fit = read_fit(directory.file("fit.json", to_json(unrig::fit(problem))));
  const ModalLoad result = modal_load({problem.rig, fit, test::part(whole, half, whole.samples()), 0});
  EXPECT_EQ(result.unit, "N.m");
  const auto left = [&](VectorXd x) {
    x = x.unaryExpr([](double value) { return std::isfinite(value) ? value : 0; });
    x.array() -= x.mean();
    return test::rms(test::below(6, x, whole.dt));
  };
  EXPECT_GT(left(result.gauge), 10) << "N m: what is to be removed";
  EXPECT_LT(left(result.gauge - result.from_inputs), 1.8);
  EXPECT_LT(left(result.load), 1.8);
  EXPECT_LT(result.load.cwiseAbs().maxCoeff(), result.simultaneous * result.std.maxCoeff() + 1) << "a zero of the gauge of less than 1 N m";
}

}  // namespace
}  // namespace unrig
