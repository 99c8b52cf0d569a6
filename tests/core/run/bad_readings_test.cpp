#include "core/run/bad_readings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/run/run.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double noise = 0.02;

template <class Distribution>
VectorXd draws(Index samples, Distribution distribution, unsigned seed) {
  std::mt19937_64 engine(seed);
  return VectorXd::NullaryExpr(samples, [&] { return distribution(engine); });
}

VectorXd white(Index samples, double sigma, unsigned seed = 1) { return draws(samples, std::normal_distribution<double>(0, sigma), seed); }

/// A rest at 6, a jump to 9 and a decaying vibration of `period` samples around it, in noise.
VectorXd step_record(double period, Index samples = 3000) {
  const Index begins = samples / 4;
  return white(samples, noise) + VectorXd::NullaryExpr(samples, [&](Index k) {
           const auto t = static_cast<double>(k - begins);
           return k < begins ? 6.0 : 9 - 3 * std::cos(2 * pi * t / period) * std::exp(-t / 150);
         });
}

std::vector<Index> bad(const VectorXd& x) { return isolated_readings(x, ReadingOf::answer).isolated; }

VectorXd rounded(const VectorXd& x, double step) { return x.unaryExpr([step](double v) { return step * std::round(v / step); }); }

VectorXd cut_above(const VectorXd& x, double top) { return x.cwiseMin(top); }

// ---------------------------------------------------------------------------------------------------------------- isolated readings

TEST(IsolatedReadings, ADropoutIsFoundWhereverItFalls) {
  const VectorXd sound = step_record(40);
  int found = 0, tried = 0;
  for (Index k = 0; k < sound.size(); k += 13, ++tried) {
    VectorXd x = sound;
    x[k] = 0;
    const std::vector<Index> isolated = bad(x);
    EXPECT_LE(isolated.size(), 1u);
    found += isolated == std::vector<Index>{k} ? 1 : 0;
  }
  EXPECT_GE(found, tried - 1) << "but in the very jump, where the readings before and behind are apart as far";
}

TEST(IsolatedReadings, OnePerCentOfSpikesIsFound) {
  const VectorXd sound = step_record(40);
  std::mt19937_64 engine(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  VectorXd x = sound;
  std::vector<Index> put;
  for (Index k = 0; k < x.size(); ++k)
    if (uniform(engine) < 0.01) x[k] += (uniform(engine) < 0.5 ? -5 : 5) * (1 + uniform(engine)), put.push_back(k);
  const std::vector<Index> isolated = bad(x);
  EXPECT_TRUE(std::includes(put.begin(), put.end(), isolated.begin(), isolated.end())) << "and nothing else";
  EXPECT_GE(isolated.size() + 2, put.size()) << "but one that falls beside another";
}

TEST(IsolatedReadings, APairFarOutsideAndAShortRunOfOneValueAreFound) {
  VectorXd x = step_record(40);
  x[1500] = 60, x[1501] = -45;
  x.segment(2000, 5).setZero();
  EXPECT_THAT(bad(x), ElementsAre(1500, 1501, 2000, 2001, 2002, 2003, 2004));
}

TEST(IsolatedReadings, TheFirstAndTheLastReadingToo) {
  VectorXd x = step_record(40);
  x[0] = 0, x[x.size() - 1] = -10;
  EXPECT_THAT(bad(x), ElementsAre(0, x.size() - 1));
}

TEST(IsolatedReadings, BesideMissingOnes) {
  VectorXd x = step_record(40);
  x[1999] = nan, x[2000] = 0, x[2002] = nan;
  EXPECT_THAT(bad(x), ElementsAre(2000));
}

TEST(IsolatedReadings, NoneInGaussianNoiseAndOneInThreeThousandInHeavyTails) {
  EXPECT_THAT(bad(white(100000, 1)), IsEmpty());
  // P(|t3| > x) = 2.2 / x^3. Ten scales of the deviations are some 19 of t3's own: 0.3 in a thousand.
  const std::size_t of_t3 = bad(draws(100000, std::student_t_distribution<double>(3), 5)).size();
  EXPECT_GT(of_t3, 0u);
  EXPECT_LT(of_t3, 100u) << "a per mille";
}

TEST(IsolatedReadings, NoneInFastVibrationsWithASharpStart) {
  for (const double period : {2.1, 2.7, 3.0, 4.0, 5.3, 9.0})
    for (const double level : {0.0, 1e-4, 1e-2}) {
      VectorXd x = white(4000, level > 0 ? level : 1, 7) * (level > 0 ? 1 : 0);
      for (Index k = 0; k < x.size(); ++k) x[k] += k < 100 ? 1 : std::cos(2 * pi * static_cast<double>(k - 100) / period) * std::exp(-static_cast<double>(k - 100) / 100);
      EXPECT_THAT(bad(x), IsEmpty()) << period << " samples a period, noise " << level;
    }
}

TEST(IsolatedReadings, NoneInSmoothPulsesOfThreeSamplesAndJumps) {
  VectorXd pulses = white(3000, noise);
  for (Index k = 100; k < 2900; k += 100) pulses[k] += 2, pulses[k - 1] += 1, pulses[k + 1] += 1;
  EXPECT_THAT(bad(pulses), IsEmpty());
  VectorXd jumps = white(3000, noise);
  for (Index k = 0; k < 3000; ++k) jumps[k] += 3 * static_cast<double>((k / 100) % 2);
  EXPECT_THAT(bad(jumps), IsEmpty());
}

TEST(IsolatedReadings, NoneFromACoarseConverter) {
  for (const double steps : {1.0, 3.0, 12.0}) EXPECT_THAT(bad(rounded(step_record(40), steps * noise)), IsEmpty()) << steps << " sigma";
}

TEST(IsolatedReadings, ABlowIsNone) {
  VectorXd force = white(3000, 0.1);
  force[500] = 80;
  force[1200] = 60, force[1201] = 55;
  force[2000] = 30, force[2001] = 90, force[2002] = 20;
  const SuspectReadings in_force = isolated_readings(force, ReadingOf::input);
  EXPECT_THAT(in_force.isolated, IsEmpty());
  EXPECT_TRUE(std::find(in_force.blows.begin(), in_force.blows.end(), 500) != in_force.blows.end());

  VectorXd acceleration = white(3000, 0.1);  // of what the hammer hits: it follows within the sample
  acceleration[500] = 20;
  EXPECT_THAT(bad(acceleration), ElementsAre(500)) << "by itself it would be one";
  EXPECT_THAT(isolated_readings(acceleration, ReadingOf::answer, in_force.blows).isolated, IsEmpty());
}

TEST(IsolatedReadings, ADropoutOfAForceThatNeverRestsIsOne) {
  VectorXd force = white(3000, noise);
  for (Index k = 0; k < 3000; ++k) force[k] += 5 * std::sin(0.1 * static_cast<double>(k)) + 3 * std::sin(0.23 * static_cast<double>(k));
  force[1000] = 0;
  EXPECT_THAT(isolated_readings(force, ReadingOf::input).isolated, ElementsAre(1000));
}

// ---------------------------------------------------------------------------------------------------------------- clipped readings

TEST(ClippedReadings, AreAllThatStandAtTheEndOfTheRange) {
  const VectorXd sound = step_record(40);
  for (const double top : {10.0, 11.0}) {
    const VectorXd x = cut_above(sound, top);
    const auto over = static_cast<std::size_t>((sound.array() >= top).count());
    EXPECT_EQ(clipped_readings(x).size(), over) << top;
    EXPECT_EQ(clipped_readings(-x).size(), over) << "below";
  }
  const double step = 12 * noise, top = 40 * step;  // eight steps below the highest reading
  EXPECT_GT(clipped_readings(cut_above(rounded(sound, step), top)).size(), static_cast<std::size_t>((sound.array() > top).count()) - 1) << "in coarse steps";
}

TEST(ClippedReadings, NoneAtTheTurningPointsOfASlowSignalInCoarseSteps) {
  for (const double period : {40.0, 400.0, 4000.0})
    for (const double step : {1e-5, 0.02, 0.06, 0.24}) EXPECT_THAT(clipped_readings(rounded(step_record(period, 12000), step)), IsEmpty()) << period << " samples a period, steps of " << step;
  const VectorXd quiet = VectorXd::NullaryExpr(20000, [](Index k) { return std::sin(2 * pi * static_cast<double>(k) / 9000); });
  EXPECT_THAT(clipped_readings(rounded(quiet, 1e-5)), IsEmpty()) << "no noise, five digits";
}

TEST(ClippedReadings, AreThoseOfAnAmplifierThatStaysAtTheEndOfItsRange) {
  VectorXd x = step_record(40);
  const double top = x.maxCoeff() + 1;
  x.tail(1700).setConstant(top);
  EXPECT_EQ(clipped_readings(x).size(), 1700u);
  EXPECT_EQ(clipped_readings(-x).size(), 1700u);
  EXPECT_EQ(clipped_readings(rounded(x, 0.3 * noise)).size(), 1700u) << "in steps finer than the noise";
  const VectorXd ramp = VectorXd::NullaryExpr(3000, [](Index k) { return 0.01 * static_cast<double>(std::min<Index>(k, 1200)) + 1e-3 * std::sin(0.05 * static_cast<double>(std::min<Index>(k, 1200))); });
  EXPECT_THAT(clipped_readings(ramp), IsEmpty()) << "a motion that arrives, without noise";
  EXPECT_THAT(clipped_readings(rounded(ramp, 1e-5)), IsEmpty());
  VectorXd force = VectorXd::Zero(3000);
  force.segment(500, 60) = white(60, 5).cwiseAbs();
  EXPECT_THAT(clipped_readings(force), IsEmpty()) << "a blow on a channel that rests at its end";
}

TEST(ClippedReadings, NoneInARestAtTheLargestReading) {
  VectorXd x = VectorXd::NullaryExpr(3000, [](Index k) { return k < 1000 ? 20.0 : 20 * std::cos(0.1 * static_cast<double>(k - 1000)) * std::exp(-static_cast<double>(k - 1000) / 300); });
  EXPECT_THAT(clipped_readings(rounded(x, 0.2)), IsEmpty()) << "a pluck's load before it is let go";
  EXPECT_THAT(clipped_readings(rounded(x + white(3000, 0.1), 0.2)), IsEmpty());
}

// ---------------------------------------------------------------------------------------------------------------- of a run file

/// The run with its gauge from `gauge`, as text; no pluck, whose rest would be a hold (core/run/release.h).
std::string run_text(const VectorXd& gauge, const VectorXd& force = {}) {
  std::string text = "# unrig_run = 1\n# kind = \"" + std::string(force.size() > 0 ? "forced" : "step") + "\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]" +
                     (force.size() > 0 ? ",force [N]" : "") + "\n";
  for (Index k = 0; k < gauge.size(); ++k) {
    text += fmt::format("{:.3f},{:.6g}", 0.002 * static_cast<double>(k), gauge[k]);
    if (force.size() > 0) text += fmt::format(",{:.6g}", force[k]);
    text += "\n";
  }
  return text;
}

TEST(BadReadingsOfARun, AreMissingCountedAndWarnedOfWithTheirPlace) {
  VectorXd gauge = step_record(40);
  gauge[1000] = 0;
  const unrig::Run run = parse_run(run_text(gauge), "run.csv");
  const Channel& channel = run.channel("gauge");
  EXPECT_EQ(channel.bad, 1u);
  EXPECT_TRUE(std::isnan(channel.value[1000]));
  ASSERT_EQ(run.warnings.size(), 1u);
  EXPECT_THAT(run.warnings[0], HasSubstr("run.csv:1006: the column \"gauge\" holds 1 isolated reading"));
  EXPECT_THAT(run.warnings[0], HasSubstr("the first at 2 s"));
}

TEST(BadReadingsOfARun, WhatAnInstrumentSendsForNoReadingIsMissing) {
  for (const double sentinel : {9.9e37, -9.91e37, 1e308}) {
    VectorXd gauge = step_record(40);
    gauge.segment(100, 20).setConstant(sentinel);
    const unrig::Run run = parse_run(run_text(gauge), "run.csv");
    EXPECT_EQ(run.channel("gauge").missing, 20u);
    EXPECT_EQ(run.channel("gauge").value.array().isNaN().count(), 20);
    ASSERT_EQ(run.warnings.size(), 1u);
    EXPECT_THAT(run.warnings[0], HasSubstr("20 number(s) beyond 1e+36"));
  }
  EXPECT_THROW(parse_run(run_text(VectorXd::Constant(100, 9.9e37)), "run.csv"), InputError) << "nothing else";
}

TEST(BadReadingsOfARun, AClippedGaugeIsLeftOutAndAClippedForceOnlyWarnedOf) {
  const VectorXd gauge = cut_above(step_record(40), 11);
  const unrig::Run run = parse_run(run_text(gauge), "run.csv");
  EXPECT_GT(run.channel("gauge").clipped, 5u);
  EXPECT_EQ(static_cast<std::size_t>(run.channel("gauge").value.array().isNaN().count()), run.channel("gauge").clipped);
  ASSERT_EQ(run.warnings.size(), 1u);
  EXPECT_THAT(run.warnings[0], HasSubstr("at the end of its range, 11 N"));

  const unrig::Run forced = parse_run(run_text(step_record(40), gauge), "run.csv");
  EXPECT_EQ(forced.channel("force").clipped, 0u);
  EXPECT_TRUE(forced.channel("force").value.allFinite()) << "a force that is left out would count as another";
  ASSERT_EQ(forced.warnings.size(), 1u);
  EXPECT_THAT(forced.warnings[0], HasSubstr("What drove the rig there is not known"));
}

TEST(BadReadingsOfARun, NoneInTheNullCampaign) {
  for (const char* name : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c", "heldout"}) {
    const unrig::Run run = read_run(test::null_campaign(std::string(name) + ".csv"));
    EXPECT_THAT(run.warnings, IsEmpty());
    for (const Channel& channel : run.channels) EXPECT_EQ(channel.bad + channel.clipped, 0u) << name << " " << channel.name;
  }
}

TEST(RobustRange, DoesNotSeeSingleReadings) {
  VectorXd x = VectorXd::LinSpaced(1000, 0, 1);
  x[500] = 9.9e37, x[700] = nan;
  EXPECT_NEAR(robust_range(x), 1, 0.01);
  EXPECT_EQ(robust_range(VectorXd::Constant(100, 3)), 0);
}

}  // namespace
}  // namespace unrig
