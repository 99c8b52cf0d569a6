#include "fit/trial/laboratory.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "core/effects/effect.h"
#include "core/numerics/spectrum.h"
#include "core/rig/default_errors.h"
#include "fit/trial/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using Random = std::mt19937_64;

constexpr double dt = 0.002;
constexpr Index samples = 1 << 16;

VectorXd noise_of(const Laboratory& laboratory, unsigned seed = 1) {
  Random random(seed);
  return draw_noise(laboratory, samples, dt, random);
}

/// Product of samples `lag` apart, in the mean.
double product(const VectorXd& noise, Index lag) { return noise.head(noise.size() - lag).dot(noise.tail(noise.size() - lag)) / static_cast<double>(noise.size() - lag); }

/// Mean power of a band.
double power(const VectorXd& noise, double low, double high) {
  const Eigen::VectorXcd lines = fourier(noise);
  double sum = 0;
  int count = 0;
  for (Index k = 1; k < lines.size(); ++k)
    if (const double f = static_cast<double>(k) / (static_cast<double>(noise.size()) * dt); f >= low && f < high) sum += std::norm(lines[k]), ++count;
  return sum / count;
}

TEST(LaboratoryNoise, HasTheVarianceOfOne) {
  for (const NoiseKind kind : {NoiseKind::white, NoiseKind::first_order, NoiseKind::pink, NoiseKind::heavy_tailed, NoiseKind::quantised}) {
    double variance = 0;
    for (unsigned seed = 1; seed <= 20; ++seed) variance += product(noise_of({kind, 3, 0.8, 2, "", 0}, seed), 0) / 20;
    EXPECT_NEAR(variance, 1, 0.1) << to_string(kind) << ": means of 20 records; pink noise scatters most, its slowest parts are longer than a record";
  }
}

TEST(LaboratoryNoise, OfFirstOrderForgetsExponentially) {
  const Laboratory laboratory{NoiseKind::first_order, 5, 0.7, 0, "", 0};
  const VectorXd noise = noise_of(laboratory);
  for (const Index lag : {1, 5, 20}) EXPECT_NEAR(product(noise, lag), 0.7 * std::exp(-2 * std::numbers::pi * 5 * dt * static_cast<double>(lag)), 0.03) << "scatter of 131 s at 5 Hz: 1.5 %";
}

TEST(LaboratoryNoise, PinkHasThreeDecibelsPerOctave) {
  const VectorXd noise = noise_of({NoiseKind::pink, 0, 1, 0, "", 0});
  for (const double f : {1.0, 4.0, 16.0}) EXPECT_NEAR(power(noise, f, 2 * f) / power(noise, 4 * f, 8 * f), 4, 1) << f << " Hz: two octaves apart; first-order parts three to an octave";
}

TEST(LaboratoryNoise, HeavyTailsReachFar) {
  const auto beyond = [](const VectorXd& noise) { return (noise.array().abs() > 5).count(); };
  EXPECT_EQ(beyond(noise_of({})), 0) << "of a normal distribution 0.04 in so many";
  EXPECT_GT(beyond(noise_of({NoiseKind::heavy_tailed, 0, 1, 0, "", 0})), 50) << "of t3 scaled to variance one: 2 P(t > 5 sqrt 3) = 0.3 %, 200 in so many";
}

TEST(Laboratory, DrawsEveryKindAndEveryGroup) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const std::vector<unrig::Run> runs{read_run(test::null_campaign("dry_pluck.csv")), read_run(test::null_campaign("step_a.csv"))};
  std::map<std::string, int> kinds, groups;
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Laboratory drawn = draw_laboratory(rig, runs, random);
    ++kinds[to_string(drawn.noise)];
    ++groups[drawn.misread];
  }
  EXPECT_EQ(kinds.size(), 5u);
  for (const auto& [kind, count] : kinds) EXPECT_NEAR(count, 200, 5 * std::sqrt(160)) << kind;
  EXPECT_NEAR(groups[""], 500, 5 * std::sqrt(250));
  EXPECT_NEAR(groups[as_stated], 250, 5 * std::sqrt(187.5));
  for (const char* group : {"normal.mass", "normal.station", "section.chord", "speed", "density", "clock", "calibration"}) EXPECT_GT(groups[group], 4) << group;
}

TEST(Laboratory, StatesWhatAllNumbersAreOffBy) {
  const Rig truth = read_rig(test::null_campaign("rig.toml"));
  const std::vector<unrig::Run> true_runs{read_run(test::null_campaign("step_a.csv")), read_run(test::null_campaign("step_b.csv"))};
  double squares = 0, count = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    Random random(seed);
    std::pair<Rig, std::vector<unrig::Run>> files{truth, true_runs};
    misread({NoiseKind::white, 0, 1, 0, as_stated, 0}, files.first, files.second, random);
    const auto& [rig, runs] = files;
    ASSERT_TRUE(rig.givens && runs[0].givens && runs[1].givens);
    for (const Given& g : rig.givens->numbers) {
      if (g.number == GivenNumber::mass) squares += std::pow((g.value - truth.normal.inertia[g.row]) / g.std, 2), ++count;
      if (g.number == GivenNumber::chord) squares += std::pow((g.value - truth.chord) / g.std, 2), ++count;
    }
    EXPECT_NEAR(runs[0].speed / true_runs[0].speed, runs[1].speed / true_runs[1].speed, 1e-12) << "alike in all runs";
  }
  EXPECT_NEAR(squares / count, 1, 0.15) << "errors as large as stated; masses share a part of theirs";
}

TEST(Laboratory, MisreadsOneKindOfNumberAlikeInAllRuns) {
  const Rig truth = read_rig(test::null_campaign("rig.toml"));
  const std::vector<unrig::Run> true_runs{read_run(test::null_campaign("step_a.csv")), read_run(test::null_campaign("wet_pluck.csv")), read_run(test::null_campaign("step_b.csv"))};
  const auto read = [&](const char* group, unsigned seed) {
    Random random(seed);
    std::pair<Rig, std::vector<unrig::Run>> files{truth, true_runs};
    misread({NoiseKind::white, 0, 1, 0, group, 0}, files.first, files.second, random);
    return files;
  };
  const auto [exact, same] = read("", 1);
  EXPECT_EQ(exact.normal.inertia, truth.normal.inertia);
  double squares = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto [rig, runs] = read("normal.mass", seed);
    squares += (rig.normal.inertia - truth.normal.inertia).cwiseQuotient(truth.normal.inertia).squaredNorm() / static_cast<double>(truth.normal.inertia.size()) / 200;
    EXPECT_EQ(rig.station, truth.station);
    EXPECT_EQ(rig.chord, truth.chord);
    EXPECT_EQ(runs[0].speed, true_runs[0].speed);
    EXPECT_EQ(rig.givens, truth.givens) << "nothing is stated of it";
  }
  EXPECT_NEAR(std::sqrt(squares), 0.01 * std::numbers::sqrt2, 0.001) << "one per cent of each and one in common; 200 draws";
  const auto [rig, runs] = read("speed", 5);
  EXPECT_EQ(rig.normal.inertia, truth.normal.inertia);
  EXPECT_NE(runs[0].speed, true_runs[0].speed);
  EXPECT_NEAR(runs[0].speed / true_runs[0].speed, runs[2].speed / true_runs[2].speed, 1e-12);
  EXPECT_EQ(runs[1].speed, 0) << "a pluck";
}

TEST(TrialCampaign, OfALaboratoryIsReadByItsConverterAndSheddingWalks) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto draw = [&](const Laboratory& laboratory, unsigned seed) {
    Random random(seed);
    std::vector<PlannedRun> runs = draw_runs(0.03, random);
    runs.erase(runs.begin(), runs.end() - 1);
    return draw_campaign(rig, {"vortex-shedding"}, runs, laboratory, random);
  };
  const auto gauge = [](const TrialCampaign& campaign) { return campaign.runs.front().channel("gauge").value; };
  const VectorXd coarse = gauge(draw({NoiseKind::quantised, 0, 1, 4, "", 0}, 7)), steps = coarse / (4 * 0.03);
  EXPECT_LT((steps.array() - steps.array().round()).abs().maxCoeff(), 1e-9);
  double first = 0, last = 0;
  for (unsigned seed = 1, strong = 0; strong < 4; ++seed) {
    const TrialCampaign steady = draw({}, seed);
    if (steady.size < 5) continue;  // drawn from 0.2 to 20 times the noise
    ++strong;
    const VectorXd apart = gauge(draw({NoiseKind::white, 0, 1, 0, "", 1}, seed)) - gauge(steady);
    first += apart.head(50).squaredNorm() / 50;
    last += apart.tail(apart.size() / 2).squaredNorm() / static_cast<double>(apart.size() / 2);
  }
  EXPECT_GT(last, 4 * first) << "by 0.3 rad in the first tenth of a second, by more than 1.7 in the second half; the noise differs too";
}

}  // namespace
}  // namespace unrig
