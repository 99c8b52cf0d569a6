// Where a held rig is let go. Decays are written down in closed form: two damped modes that nothing of the program has made.
#include "core/run/release.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/run/run.h"
#include "tests/core/run/written_run.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd white(Index samples, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(samples, [&] { return normal(engine); });
}

/// 1/f: first-order lags an octave apart, of unit variance together.
VectorXd pink(Index samples, unsigned seed) {
  constexpr unsigned octaves = 14;
  VectorXd sum = VectorXd::Zero(samples);
  for (unsigned octave = 0; octave < octaves; ++octave) {
    const double keeps = std::exp(-std::pow(2.0, -static_cast<double>(octave)));
    VectorXd x = white(samples, seed * octaves + octave);
    for (Index k = 1; k < samples; ++k) x[k] = keeps * x[k - 1] + std::sqrt(1 - keeps * keeps) * x[k];
    sum += x;
  }
  return sum / std::sqrt(static_cast<double>(octaves));
}

using Noise = std::function<VectorXd(Index, unsigned)>;
const std::pair<const char*, Noise> noises[] = {{"white", white},
                                                {"pink", pink},
                                                {"white and pink", [](Index n, unsigned seed) -> VectorXd { return std::sqrt(0.5) * (white(n, seed) + pink(n, seed + 1000)); }}};

VectorXd rounded(const VectorXd& x, double step) { return (x / step).array().round() * step; }

/// Released from rest at time 0: the reading at t [samples], 1 before.
double released(double t, double period, double damping) {
  if (t <= 0) return 1;
  const double omega = 2 * pi / period, damped = omega * std::sqrt(std::abs(1 - damping * damping)), decay = std::exp(-damping * omega * t);
  return damping < 1 ? decay * (std::cos(damped * t) + damping * omega / damped * std::sin(damped * t)) : decay * (std::cosh(damped * t) + damping * omega / damped * std::sinh(damped * t));
}

/// Two modes, the second of 6.3 times the frequency (a cantilever's).
struct Decay {
  const char* name;
  double period, damping;  // samples of the lowest mode; 1
  double second = 0.05;    // its share of the amplitude
  double at(double t, double amplitude) const { return amplitude * ((1 - second) * released(t, period, damping) + second * released(t, period / 6.3, std::min(0.5, damping))); }
};
constexpr Decay decays[] = {{"dry", 60, 0.005}, {"wet", 200, 0.03}, {"wet and heavily damped", 150, 0.4}, {"overdamped", 120, 1.3}};

/// A record that begins `before` samples before its release (a negative number: behind it), in noise of 1.
VectorXd record(const Decay& decay, double before, double amplitude, const VectorXd& noise) {
  return VectorXd::NullaryExpr(noise.size(), [&](Index k) { return decay.at(static_cast<double>(k) - before, amplitude) + noise[k]; });
}

// ---------------------------------------------------------------------------------------------------------------- decays without a hold

TEST(Release, LeavesADecayWhole) {
  int records = 0;
  for (const Decay& decay : decays)
    for (const auto& [name, noise] : noises)
      for (unsigned seed = 1; seed <= 30; ++seed) {
        std::mt19937_64 engine(seed);
        const double amplitude = std::pow(10, std::uniform_real_distribution<double>(1, 3.5)(engine)), swings = std::uniform_real_distribution<double>(0, 2)(engine);
        const VectorXd noisy = noise(2500, seed);
        for (const double behind : {0.0, 0.5 * decay.period, decay.period, swings * decay.period}) {  // at the release, at turning points, anywhere
          const VectorXd x = record(decay, -behind, amplitude, noisy);
          ++records;
          EXPECT_FALSE(release_of(x)) << fmt::format("{}, {} noise, amplitude {:.4g}, {:.4g} samples after the release, seed {}", decay.name, name, amplitude, behind, seed);
          EXPECT_FALSE(release_of(rounded(x, 3))) << fmt::format("{}, {} noise in steps of three, amplitude {:.4g}, {:.4g} samples after the release, seed {}", decay.name, name, amplitude, behind, seed);
        }
      }
  EXPECT_EQ(records, 1440);
}

// The second mode's acceleration is forty-fold: at a share of -0.025 it takes away the first mode's, and the reading stands still at first.
TEST(Release, LeavesADecayWholeThatBeginsNearlyStill) {
  for (const double second : {-0.01, -0.025, -0.05, -0.1, -0.2, -0.3, 0.2})
    for (unsigned seed = 1; seed <= 40; ++seed) {
      std::mt19937_64 engine(seed);
      const double amplitude = std::pow(10, std::uniform_real_distribution<double>(1, 3.5)(engine));
      const Decay decay{"two modes", 340, 0.01, second};
      for (const double behind : {0.0, 170.0}) EXPECT_FALSE(release_of(record(decay, -behind, amplitude, white(3000, seed)))) << fmt::format("{}, amplitude {:.4g}, {} samples, seed {}", second, amplitude, behind, seed);
    }
}

TEST(Release, IsNoneWhereNothingMovesOrNothingIs) {
  for (unsigned seed = 1; seed <= 100; ++seed) {
    EXPECT_FALSE(release_of(white(2500, seed))) << seed;
    EXPECT_FALSE(release_of(pink(2500, seed))) << seed;
  }
  EXPECT_FALSE(release_of(VectorXd()));
  EXPECT_FALSE(release_of(VectorXd::Constant(1, 3)));
  EXPECT_FALSE(release_of(VectorXd::Constant(500, 3)));
  EXPECT_FALSE(release_of(VectorXd::Constant(500, nan)));
  EXPECT_FALSE(release_of(VectorXd::LinSpaced(500, 0, 7))) << "a counter";
}

// ---------------------------------------------------------------------------------------------------------------- decays with one

struct Found {
  int records = 0, found = 0, early = 0;
  double farthest = 0, latest = 0;  // samples: of the instant from the truth, of the first sample that counts behind it
  void add(const std::optional<Release>& release, double truth) {
    ++records;
    if (!release) return;
    ++found;
    early += static_cast<double>(release->first) < truth;
    farthest = std::max(farthest, std::abs(release->instant - truth));
    latest = std::max(latest, static_cast<double>(release->first) - truth);
  }
};

TEST(Release, IsFoundBetweenSamples) {
  for (const Decay& decay : decays)
    for (const auto& [name, noise] : noises)
      for (const double quantum : {0.0, 3.0}) {
        Found found;
        for (unsigned seed = 1; seed <= 6; ++seed)
          for (const double held : {25.3, 120.5, 900.8}) {
            const VectorXd x = record(decay, held, 500, noise(2500 + static_cast<Index>(held), seed));
            found.add(release_of(quantum > 0 ? rounded(x, quantum) : x), held);
          }
        const std::string what = fmt::format("{}, {} noise, steps of {}", decay.name, name, quantum);
        EXPECT_EQ(found.found, found.records) << what;
        EXPECT_EQ(found.early, 0) << what << ": a sample of the hold is not of the decay";
        EXPECT_LT(found.farthest, 1.5 + 0.02 * decay.period) << what;
        EXPECT_LT(found.latest, 8) << what;
      }
}

TEST(Release, IsNotBelievedTooEarlyWhereNoiseWanders) {
  Found found;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    VectorXd lagged = white(3000, seed);
    constexpr double keeps = 0.95;
    for (Index k = 1; k < lagged.size(); ++k) lagged[k] = keeps * lagged[k - 1] + std::sqrt(1 - keeps * keeps) * lagged[k];
    found.add(release_of(record(decays[1], 600.5, 60, lagged)), 600.5);
  }
  EXPECT_GT(found.found, 50);
  EXPECT_LE(found.early, 3) << "one of them; seventeen where the noise is taken for white";
}

TEST(Release, IsFoundAfterADozenSamples) {
  Found found;
  for (unsigned seed = 1; seed <= 100; ++seed) found.add(release_of(record(decays[0], 14.5, 1000, white(2500, seed))), 14.5);
  EXPECT_GT(found.found, 95);
  EXPECT_EQ(found.early, 0);
  for (unsigned seed = 1; seed <= 100; ++seed) EXPECT_FALSE(release_of(record(decays[0], 8.5, 1000, white(2500, seed)))) << "too few to know a constant from";
}

TEST(Release, IsFoundInWhatRecordingsHave) {
  constexpr double held = 400.4;
  constexpr Index samples = 3000;
  const VectorXd clean = record(decays[1], held, 300, VectorXd::Zero(samples)), noise = white(samples, 3);
  const VectorXd count = VectorXd::LinSpaced(samples, 0, samples - 1);
  VectorXd gaps = clean + noise;
  for (Index k = 0; k < samples; k += 7) gaps[k] = nan;
  gaps.segment(390, 8).setConstant(nan);
  const std::pair<const char*, VectorXd> records[] = {{"noise of simulated digits", rounded(clean, 1e-5)},
                                                      {"a hum", clean + noise + 3 * (0.31 * count.array()).sin().matrix()},
                                                      {"a channel that drifts by eight times its noise", clean + noise + 0.02 * count},
                                                      {"missing readings", gaps},
                                                      {"upside down, in small units", -1e-6 * (clean + noise)},
                                                      {"at the end of a long hold", (VectorXd(40000 + samples) << VectorXd::Constant(40000, 300) + white(40000, 4), clean + noise).finished()}};
  for (const auto& [what, x] : records) {
    const double truth = held + static_cast<double>(x.size() - samples);
    const std::optional<Release> release = release_of(x);
    ASSERT_TRUE(release) << what;
    EXPECT_NEAR(release->instant, truth, 5) << what;
    EXPECT_GT(static_cast<double>(release->first), truth) << what;
    EXPECT_LT(static_cast<double>(release->first), truth + 20) << what;
  }
}

// ---------------------------------------------------------------------------------------------------------------- runs

/// A run file of a pluck in steps of 2 ms from 0.1 s on.
std::string written(const std::vector<std::pair<std::string, VectorXd>>& columns, const std::string& kind = "pluck") {
  std::string text = fmt::format("# unrig_run = 1\n# kind = \"{}\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s]", kind);
  for (const auto& [name, value] : columns) text += "," + name;
  text += "\n";
  for (Index k = 0; k < columns.front().second.size(); ++k) {
    text += fmt::format("{:.3f}", 0.1 + 0.002 * static_cast<double>(k));
    for (const auto& [name, value] : columns) text += fmt::format(",{:.6f}", value[k]);
    text += "\n";
  }
  return text;
}

const VectorXd held_decay = record(decays[0], 250.5, 500, white(1500, 1));
const VectorXd plain_decay = record(decays[0], 0, 500, white(1500, 1));

TEST(Release, IsWhereAPluckBegins) {
  const VectorXd number = VectorXd::LinSpaced(1500, 0, 1499);
  const unrig::Run run = test::read(written({{"gauge [N]", held_decay}, {"number [1]", number}}));
  ASSERT_TRUE(run.hold);
  EXPECT_NEAR(run.hold->release, 0.1 + 0.002 * 250.5, 0.002);
  EXPECT_GE(run.hold->samples, 251);
  EXPECT_LE(run.hold->samples, 255);
  EXPECT_EQ(run.samples() + run.hold->samples, 1500);
  for (const Channel& channel : run.channels) EXPECT_EQ(channel.value.size(), run.samples()) << channel.name;
  EXPECT_EQ(run.channel("number").value[0], static_cast<double>(run.hold->samples)) << "the columns stay side by side";
  EXPECT_NEAR(run.time(0), 0.1 + 0.002 * static_cast<double>(run.hold->samples), 1e-9) << "times are the record's";
  EXPECT_NEAR(run.channel("gauge").value[10], held_decay[run.hold->samples + 10], 1e-6);
  EXPECT_EQ(said_of(*run.hold), fmt::format("released at {:.6g} s, {} samples of hold before left out", run.hold->release, run.hold->samples));
  EXPECT_TRUE(run.warnings.empty()) << "it is no fault";
}

TEST(Release, IsLookedForInPlucksOnly) {
  EXPECT_FALSE(test::read(written({{"gauge [N]", plain_decay}})).hold);
  EXPECT_FALSE(test::read(written({{"gauge [N]", held_decay}, {"force [N]", white(1500, 2)}}, "forced")).hold);
}

TEST(Release, IsTheGaugesOrThatOfAllSensors) {
  const VectorXd later = record(decays[1], 260.5, 500, white(1500, 2)), temperature = 20 * VectorXd::Ones(1500) + 0.1 * pink(1500, 3);
  EXPECT_TRUE(test::read(written({{"gauge [N]", held_decay}, {"heave [m]", plain_decay}})).hold) << "what the rig does not name has no say beside a gauge";
  const unrig::Run run = test::read(written({{"heave [m]", held_decay}, {"pitch [rad]", later}, {"alpha [deg]", white(1500, 4)}}));
  ASSERT_TRUE(run.hold);
  EXPECT_GT(run.hold->samples, 260) << "the later of two";
  EXPECT_FALSE(test::read(written({{"heave [m]", held_decay}, {"pitch [rad]", plain_decay}})).hold);
  EXPECT_FALSE(test::read(written({{"heave [m]", held_decay}, {"temperature [1]", temperature}})).hold);
}

TEST(Release, IsLookedForAmongSamplesThatCount) {
  VectorXd weight = VectorXd::Ones(1500), pushed = held_decay;
  weight.head(100).setZero();
  pushed.head(100) = 100 * white(100, 5);
  const unrig::Run run = test::read(written({{"gauge [N]", pushed}, {"weight", weight}}));
  ASSERT_TRUE(run.hold);
  EXPECT_NEAR(run.hold->release, 0.1 + 0.002 * 250.5, 0.002);
  weight.setOnes();
  EXPECT_FALSE(test::read(written({{"gauge [N]", pushed}, {"weight", weight}})).hold) << "hands at the section are no hold";
}

}  // namespace
}  // namespace unrig
