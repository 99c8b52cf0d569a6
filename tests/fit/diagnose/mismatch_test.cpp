#include "fit/diagnose/mismatch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <numbers>
#include <string>
#include <vector>

#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Decays of the rig with this beside them, at the rig's true values.
struct AtTheTruth {
  AeroelasticModel model = one_mode::model();
  std::deque<unrig::Run> runs;
  std::vector<RunResidual> residuals;

  void add(const VectorXd& beside) {
    runs.push_back(one_mode::decay("decay_" + std::to_string(runs.size() + 1) + ".csv", 3 * one_mode::free_response(beside.size(), one_mode::hertz).col(0) + beside));
    residuals.emplace_back(model, runs.back(), std::vector<MotionBasis::Window>{});
  }
  Mismatch mismatch() const { return locate_mismatch(JointProblem(model, residuals)); }
};

/// What a model that leaves out a tone of this amplitude, or a band of tones with its power, is left with, in units of the noise.
VectorXd with_tone(Index samples, double amplitude, unsigned seed) { return 0.01 * (one_mode::white_noise(samples, seed) + amplitude * one_mode::tone(samples, 20)); }

VectorXd with_band(Index samples, double amplitude, unsigned seed) {
  constexpr int tones = 401;
  VectorXd band = VectorXd::Zero(samples);
  for (int i = 0; i < tones; ++i)  // from 15 to 25 Hz, with Schroeder's phases, else they make a pulse
    for (Index k = 0; k < samples; ++k) band[k] += std::sin(2 * std::numbers::pi * (15 + 0.025 * i) * one_mode::dt * static_cast<double>(k) + std::numbers::pi * i * i / tones);
  return 0.01 * (one_mode::white_noise(samples, seed) + amplitude / std::sqrt(tones) * band);
}

Mismatch of(const VectorXd& beside) {
  AtTheTruth t;
  t.add(beside);
  return t.mismatch();
}
Mismatch of_band(Index samples, double amplitude) { return of(with_band(samples, amplitude, 7)); }

/// The amplitude with which the band in a single run is as unlikely as this.
double amplitude_of(double p_value, Index samples) {
  double low = 0, high = 2;
  for (int halving = 0; halving < 25; ++halving) {
    const double middle = (low + high) / 2;
    (of_band(samples, middle).p_value > p_value ? low : high) = middle;
  }
  return high;
}

constexpr Index some = 500;

TEST(Mismatch, IsFoundWhereNoiseLeavesAsMuchOnceInAThousandTimes) {
  const Mismatch chance = of_band(some, amplitude_of(3e-3, some)), found = of_band(some, amplitude_of(3e-4, some));
  ASSERT_NEAR(chance.p_value, 3e-3, 1e-4);
  ASSERT_NEAR(found.p_value, 3e-4, 1e-5);
  ASSERT_GT(chance.channels.front().energy, 1.06) << "otherwise it is the motion's share that excuses it";
  EXPECT_FALSE(chance.found);
  EXPECT_TRUE(found.found);
}

TEST(Mismatch, OneChannelOfManyMustBeAsManyTimesLessLikely) {
  AtTheTruth alone, among_others;
  const VectorXd beside = with_band(some, amplitude_of(2e-4, some), 7);
  alone.add(beside);
  ASSERT_TRUE(alone.mismatch().found);
  among_others.add(beside);
  for (unsigned i = 1; i < 20; ++i) among_others.add(with_tone(some, 0, 100 + i));
  const Mismatch m = among_others.mismatch();
  double least = 1;
  for (const ChannelMismatch& channel : m.channels) least = std::min(least, channel.p_value);
  ASSERT_NEAR(least, 2e-4, 1e-5) << "noise alone is less likely in one of the others";
  EXPECT_NEAR(m.p_value, 20 * least, 1e-12);
  EXPECT_FALSE(m.found) << "one in 250 campaigns of twenty runs looks so";
}

/// Forty thousand samples show a fortieth of the noise's power without any doubt; a motion that is known to its noise leaves up to a twentieth.
TEST(Mismatch, IsNoneWithinATwentiethOfTheNoise) {
  constexpr Index many = 40000;
  const Mismatch little = of_band(many, std::sqrt(2 * 0.025)), more = of_band(many, std::sqrt(2 * 0.08));
  ASSERT_NEAR(little.channels.front().energy, 1.025, 0.015);  // a hundredth is how well so many samples tell the noise and what is left
  ASSERT_NEAR(more.channels.front().energy, 1.08, 0.015);
  EXPECT_LT(little.p_value, 1e-4);
  EXPECT_FALSE(little.found);
  EXPECT_TRUE(more.found);
}

/// A line is no part of what a motion leaves: a fiftieth of the noise's power in one is found, and said where.
TEST(Mismatch, IsFoundInALineHoweverFaint) {
  constexpr Index many = 3000;
  const Mismatch line = of(with_tone(many, 0.2, 7)), none = of(with_tone(many, 0, 7));
  ASSERT_LT(line.channels.front().energy, 1.05) << "otherwise its power is seen";
  EXPECT_TRUE(line.found);
  EXPECT_NE(line.summary.find("a line at 20 Hz"), std::string::npos) << line.summary;
  ASSERT_EQ(line.frequency.size(), 1u);
  EXPECT_NEAR(line.frequency.front()[0], 20, 1 / (one_mode::dt * many));
  EXPECT_NEAR(line.frequency.front()[1], 20, 1 / (one_mode::dt * many));
  EXPECT_FALSE(none.found);
}

/// p value of a run whose noise is `reading`, held against the noise level of a quiet one.
double p_against_quiet(const VectorXd& reading) {
  const AeroelasticModel model = one_mode::model();
  const unrig::Run quiet = one_mode::decay("quiet.csv", with_tone(reading.size(), 0, 3)), loud = one_mode::decay("loud.csv", reading);
  std::vector<RunResidual> residuals{{model, loud, {}}};
  residuals.front().keep_noise_of(RunResidual(model, quiet, {}));
  return locate_mismatch(JointProblem(model, residuals)).p_value;
}

/// The same for what is left white, which has no colour to be seen by, in the first quarter of the record.
TEST(Mismatch, PowerIsHeldAgainstTheNoiseAndATwentieth) {
  constexpr Index many = 40000;
  const auto of_power = [&](double power) {
    VectorXd reading = with_tone(many, 0, 3);
    reading.head(many / 4) *= std::sqrt(1 + 4 * (power - 1));
    return p_against_quiet(reading);
  };
  EXPECT_GT(of_power(1.03), 0.01) << "four standard deviations above the noise itself";
  EXPECT_LT(of_power(1.10), 1e-3);
}

/// White noise that is larger than it is said to be, alike in all of the record, is noise; so is one with heavy tails (Student's t of three degrees of freedom).
TEST(Mismatch, IsNoneInWhiteNoiseOfAnyLevelAndTails) {
  constexpr Index many = 40000;
  EXPECT_GT(p_against_quiet(1.3 * with_tone(many, 0, 3)), 1e-3);
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937_64 random(seed);
    std::student_t_distribution<double> student(3);
    EXPECT_GT(p_against_quiet(0.01 * VectorXd::NullaryExpr(many, [&] { return student(random); })), 1e-3) << seed;
  }
}

TEST(Mismatch, NamesPowersAsOneSaysThem) {
  EXPECT_EQ(in_words_of_power(1.04), "in proportion to");
  EXPECT_EQ(in_words_of_power(1.98), "with the square of");
  EXPECT_EQ(in_words_of_power(2.9), "with the cube of");
  EXPECT_EQ(in_words_of_power(1.43), "with the power 1.4 of");
  EXPECT_EQ(in_words_of_power(0.5), "with the power 0.5 of");
}

/// Red noise forty times as large, as a law leaves that is missing, holds next to nothing at 50 Hz.
TEST(Mismatch, ALineAtAKnownFrequencyIsSeenWhereTheRestDrownsIt) {
  constexpr Index samples = 2000;
  constexpr int records = 200;
  const Effect& hum = effect("mains-hum");
  int seen = 0, false_alarms = 0;
  for (unsigned seed = 0; seed < records; ++seed) {
    VectorXd red = one_mode::white_noise(samples, 1000 + seed);
    for (Index k = 1; k < samples; ++k) red[k] += 0.98 * red[k - 1];
    const VectorXd noise = one_mode::white_noise(samples, seed) + 8 * red;
    const auto is_seen = [&](double amplitude) {
      AtTheTruth t;
      t.add(0.01 * (noise + amplitude * one_mode::tone(samples, 50.1)));
      return has_line(JointProblem(t.model, t.residuals), hum);
    };
    false_alarms += is_seen(0) ? 1 : 0;
    seen += is_seen(8) ? 1 : 0;
  }
  EXPECT_LE(false_alarms, 2) << "one in a thousand each: three of 200 happen once in a thousand times";
  EXPECT_EQ(seen, records);
}

}  // namespace
}  // namespace unrig
