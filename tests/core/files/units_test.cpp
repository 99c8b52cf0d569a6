#include "core/files/units.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <thread>
#include <vector>

namespace unrig {
namespace {

using std::numbers::pi;
using ::testing::AllOf;
using ::testing::HasSubstr;

const InputError::Place place{"rig.toml", 7};

double factor(const std::string& unit, const std::string& si) { return unit_scale(unit, si, place, "x").factor; }

template <typename Call>
std::string message_of(Call call) {
  try {
    call();
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

// International foot and pound of 1959, exact by definition.
constexpr double inch = 0.0254;
constexpr double pound = 0.45359237;
constexpr double pound_force = pound * 9.80665;

TEST(Units, UnitsOfTheSeedAreExact) {
  EXPECT_DOUBLE_EQ(factor("in", "m"), inch);
  EXPECT_DOUBLE_EQ(factor("lb", "kg"), pound);
  EXPECT_DOUBLE_EQ(factor("lbm", "kg"), pound);
  EXPECT_DOUBLE_EQ(factor("lb.in^2", "kg.m^2"), pound * inch * inch);
  EXPECT_DOUBLE_EQ(factor("in/lbf", "m/N"), inch / pound_force);
  EXPECT_DOUBLE_EQ(factor("rad/(lbf.in)", "rad/(N.m)"), 1 / (pound_force * inch));
  EXPECT_DOUBLE_EQ(factor("psi", "Pa"), pound_force / (inch * inch));
}

TEST(Units, DegreeHasItsAliasInProductsAndPrefixes) {
  EXPECT_DOUBLE_EQ(factor("deg", "rad"), pi / 180);
  EXPECT_DOUBLE_EQ(factor("deg/s", "rad/s"), pi / 180);
  EXPECT_DOUBLE_EQ(factor("mdeg", "rad"), pi / 180e3);
}

TEST(Units, VoltGains) {
  EXPECT_DOUBLE_EQ(factor("lbf/V", "N/V"), pound_force);
  EXPECT_DOUBLE_EQ(factor("N/mV", "N/V"), 1000);
}

TEST(Units, OffsetsOfTemperatureScales) {
  const UnitScale celsius = unit_scale("degC", "K", place, "x");
  EXPECT_DOUBLE_EQ(celsius(0), 273.15);
  EXPECT_DOUBLE_EQ(celsius(100), 373.15);
  const UnitScale fahrenheit = unit_scale("degF", "K", place, "x");
  EXPECT_NEAR(fahrenheit(212), 373.15, 1e-9);  // the slope is a difference of numbers near 1e6, 1e-10 of round-off each
}

TEST(Units, RadianCountsAsDimensionless) {
  EXPECT_EQ(factor("1", "rad"), 1);
  EXPECT_EQ(factor("rad", "1"), 1);
  EXPECT_EQ(factor("N.m/rad", "N.m"), 1);
}

TEST(Units, CountsAndPercentsAreNoAngle) {
  EXPECT_EQ(factor("counts", "1"), 1);
  EXPECT_THROW(factor("counts", "rad"), InputError);
  EXPECT_THROW(factor("percent", "rad"), InputError);
}

TEST(Units, AngularFrequencyIsDividedByTwoPi) {
  EXPECT_DOUBLE_EQ(factor("rad/s", "Hz"), 1 / (2 * pi));
  EXPECT_NEAR(factor("rpm", "Hz"), 1 / 60.0, 1e-13);  // UDUNITS carries 2 pi with 15 digits
  EXPECT_DOUBLE_EQ(factor("kHz", "Hz"), 1000);
}

TEST(Units, AnotherDimensionIsAnErrorThatNamesBoth) {
  EXPECT_THAT(message_of([] { unit_scale("m", "rad", place, "the column \"alpha\""); }),
              AllOf(HasSubstr("rig.toml:7: "), HasSubstr("the column \"alpha\" has the unit \"m\""), HasSubstr("wanted an angle"),
                    HasSubstr("rad")));
  EXPECT_THROW(factor("kg", "N"), InputError);
  EXPECT_THROW(factor("lb", "N"), InputError);
}

TEST(Units, ReciprocalsAreNoConversion) {
  EXPECT_THROW(factor("s", "Hz"), InputError);
  EXPECT_THROW(factor("N/m", "m/N"), InputError);
}

TEST(Units, UnknownAndOddUnitsAreErrors) {
  EXPECT_THAT(message_of([] { factor("furlongs_per_fortnite", "m/s"); }),
              AllOf(HasSubstr("unknown unit \"furlongs_per_fortnite\""), HasSubstr("a speed")));
  EXPECT_THAT(message_of([] { factor(" ", "m"); }), HasSubstr("has no unit"));
  EXPECT_THROW(factor("seconds since 2000-01-01", "s"), InputError);
  EXPECT_THROW(factor("lg(re 1 mW)", "W"), InputError);
}

TEST(Units, FailuresAreSilentOnStandardError) {
  ::testing::internal::CaptureStderr();
  EXPECT_THROW(factor("((", "m"), InputError);
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST(Quantity, NumberAndUnit) {
  EXPECT_DOUBLE_EQ(quantity("4.4 N/V", "N/V", place, "x"), 4.4);
  EXPECT_DOUBLE_EQ(quantity(" 6in ", "m", place, "x"), 6 * inch);
  EXPECT_DOUBLE_EQ(quantity("+1.5e-3 lbf", "N", place, "x"), 1.5e-3 * pound_force);
  EXPECT_DOUBLE_EQ(quantity("-2 deg", "rad", place, "x"), -2 * pi / 180);
  EXPECT_DOUBLE_EQ(quantity("5 1/s", "Hz", place, "x"), 5);
  EXPECT_DOUBLE_EQ(quantity("0.3 1", "1", place, "x"), 0.3);
}

TEST(Quantity, WhatIsNotOneNumberAndOneUnitIsAnError) {
  for (const char* text : {"", "m", "6", "4.4.5 m", "4 2 m", "1,5 m", "1 -m", "+-1 m", "nan m", "inf m", "1e999 m", "0x10 m", "6 kg"}) {
    EXPECT_THROW(quantity(text, "m", place, "x"), InputError) << '"' << text << '"';
  }
}

TEST(Quantity, AMissingUnitIsNamed) {
  EXPECT_THAT(message_of([] { quantity("0.6", "m/s", place, "speed"); }),
              AllOf(HasSubstr("rig.toml:7: speed = \"0.6\" has no unit"), HasSubstr("for instance")));
}

TEST(SiUnit, CustomarySpelling) {
  const std::vector<std::pair<const char*, const char*>> spelt = {
      {"lbf", "N"},        {"deg", "rad"},     {"lbf.in", "N.m"},     {"mV", "V"},   {"counts", "1"},        {"mm", "m"},
      {"deg/s", "rad/s"},  {"g", "kg"},        {"lb.in^2", "kg.m^2"}, {"Hz", "Hz"},  {"(N.m/m).(m)", "N.m"}, {"(rad/m).(m)", "rad"},
      {"in/s^2", "m/s^2"}, {"(V/m).(m)", "V"}, {"degC", "K"},         {"psi", "Pa"}, {"1/V.N", "N/V"}};
  for (const auto& [unit, si] : spelt) EXPECT_EQ(si_unit(unit, place, "x"), si) << unit;
}

TEST(SiUnit, UncustomaryOnesAreSpeltInBaseUnitsThatConvertBack) {
  const std::string si = si_unit("lbf.s^3/in^2", place, "x");
  EXPECT_DOUBLE_EQ(factor("lbf.s^3/in^2", si), pound_force / (inch * inch));
  EXPECT_EQ(factor(si, si), 1);
}

TEST(Units, ThreadsMayConvertAtTheSameTime) {
  std::vector<std::thread> threads;
  std::vector<int> wrong(4, 0);
  for (int& count : wrong) {
    threads.emplace_back([&count] {
      for (int k = 0; k < 500; ++k) {
        count += si_unit("lbf.in", place, "x") != "N.m";
        count += std::abs(quantity("6 in", "m", place, "x") - 6 * inch) > 1e-15;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4, 0));
}

}  // namespace
}  // namespace unrig
