#include "core/rig/stated_errors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/rig/beam_flexibility.h"
#include "core/files/text_file.h"
#include "tests/support/sample_data.h"
#include "tests/support/stated.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using ::testing::HasSubstr;

std::string null_rig() { return read_text(test::null_campaign("rig.toml")); }

const Given& number(const Givens& givens, const std::string& name) {
  for (const Given& g : givens.numbers)
    if (g.name == name) return g;
  ADD_FAILURE() << "no " << name;
  return givens.numbers.front();
}

std::string refusal_of_rig(const std::string& text) {
  try {
    test::rig_of_text(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

std::string run_text(const std::string& head, const std::string& column = "gauge [N]") {
  return "# unrig_run = 1\n# kind = \"step\"\n# density = \"998.2 kg/m^3\"\n# speed = \"0.5 m/s\"\n" + head + "time [s],alpha [deg]," + column + "\n0.0,1,10\n0.1,2,20\n0.2,3,30\n";
}

std::string refusal_of_run(const std::string& text) {
  try {
    parse_run(text, "step.csv");
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(StatedErrors, AFileThatStatesNoneHasNone) {
  EXPECT_EQ(test::rig_of_text(null_rig()).givens, nullptr);
  EXPECT_EQ(parse_run(run_text(""), "step.csv").givens, nullptr);
}

TEST(StatedErrors, OfArraysAndScalarsInTheirUnits) {
  std::string text = null_rig();
  text = test::with_line(text, "mass.unit", "mass.std_percent = 2.0\nmass.common_std_percent = 1.5");
  text = test::with_line(text, "station.unit", "station.std = \"1.5 mm\"");
  text = test::with_line(text, "mass_centre.unit", "mass_centre.std_values = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.1, 0.2, 0.3]");
  text = test::with_line(text, "pitch_axis", "chord_std = \"0.5 mm\"\npitch_axis_std = 0.004");
  text = test::with_line(text, "strip_length", "strip_length_std_percent = 1");
  const Rig rig = test::rig_of_text(text);
  ASSERT_NE(rig.givens, nullptr);
  const Givens& g = *rig.givens;
  const double mass = rig.normal.inertia[12];
  EXPECT_NEAR(number(g, "normal.mass[13]").std, 0.025 * mass, 1e-12) << "2 % and 1.5 % together";
  EXPECT_EQ(number(g, "normal.mass[13]").value, mass);
  EXPECT_EQ(number(g, "normal.mass[13]").unit, "kg");
  EXPECT_NEAR(number(g, "normal.station[7]").std, 1.5e-3, 1e-15);
  EXPECT_NEAR(number(g, "normal.mass_centre[16]").std, 0.2 * 0.0254, 1e-15) << "in the array's unit, inches";
  EXPECT_NEAR(number(g, "section.chord").std, 5e-4, 1e-15);
  EXPECT_NEAR(number(g, "section.pitch_axis").std, 0.004, 1e-15);
  EXPECT_NEAR(number(g, "submerged.strip_length").std, 0.01 * 14 * 0.0254, 1e-12);
  EXPECT_EQ(g.numbers.size(), 17u + 17u + 3u + 3u) << "a standard deviation of 0 states nothing";
  // Masses go together as far as they share an error: 1.5^2 / 2.5^2.
  const Eigen::MatrixXd covariance = g.spread * g.spread.transpose();
  const auto place = [&](const std::string& name) { return static_cast<Index>(&number(g, name) - g.numbers.data()); };
  const Index one = place("normal.mass[1]"), other = place("normal.mass[17]");
  EXPECT_NEAR(covariance(one, other) / std::sqrt(covariance(one, one) * covariance(other, other)), 0.36, 1e-12);
  for (Index i = 0; i < covariance.rows(); ++i) EXPECT_NEAR(std::sqrt(covariance(i, i)), g.numbers[static_cast<std::size_t>(i)].std, 1e-15);
}

TEST(StatedErrors, AMeasuredFlexibilityIsOneNumberForBothSidesOfItsDiagonal) {
  const Rig rig = test::rig_of_text(test::with_line(null_rig(), "flexibility.unit", "flexibility.std_percent = 2.0"));
  ASSERT_NE(rig.givens, nullptr);
  EXPECT_EQ(rig.givens->numbers.size(), 17u * 18u / 2);
  EXPECT_EQ(rig.normal.flexibility_std.rows(), 17) << "and still says what may be asymmetric";
  EXPECT_NEAR(number(*rig.givens, "normal.flexibility[3][5]").std, 0.02 * rig.normal.flexibility(2, 4), 1e-18);
  VectorXd off = VectorXd::Zero(rig.givens->spread.rows());
  off[static_cast<Index>(&number(*rig.givens, "normal.flexibility[3][5]") - rig.givens->numbers.data())] = 1e-7;
  const Rig moved = with_errors(rig, off);
  EXPECT_EQ(moved.normal.flexibility(2, 4), rig.normal.flexibility(2, 4) + 1e-7);
  EXPECT_EQ(moved.normal.flexibility(4, 2), rig.normal.flexibility(4, 2) + 1e-7);
}

TEST(StatedErrors, ADrawingIsDrawnAnew) {
  std::string text = read_text(test::source_path("sample_data/seed/rig_from_drawings.toml"));
  text = test::with_line(text, "length.unit", "length.std = \"1 mm\"");
  const Rig rig = test::rig_of_text(text);
  ASSERT_NE(rig.givens, nullptr);
  VectorXd off = VectorXd::Zero(rig.givens->spread.rows());
  off[2] = 2e-3;
  SteppedBeam longer = *rig.givens->normal_beam;
  longer.length[2] += 2e-3;
  EXPECT_EQ(with_errors(rig, off).normal.flexibility, bending_flexibility(longer));
  EXPECT_EQ(with_errors(rig, VectorXd::Zero(off.size())).normal.flexibility, rig.normal.flexibility);
}

TEST(StatedErrors, NoRigHasAMassBelowZero) {
  const Rig rig = test::rig_of_text(test::with_masses_stated(null_rig()));
  EXPECT_THROW(with_errors(rig, -2 * rig.normal.inertia), std::invalid_argument);
}

TEST(StatedErrors, OfARunsHead) {
  const unrig::Run run = parse_run(run_text("# calibration = \"4.4 N/V\"\n# calibration_std = \"0.044 N/V\"\n# speed_std_percent = 0.5\n# speed_error = \"own\"\n# density_std = \"1 kg/m^3\"\n# clock_std_percent = 0.1\n", "gauge [V]"), "step.csv");
  ASSERT_NE(run.givens, nullptr);
  const Givens& g = *run.givens;
  EXPECT_NEAR(number(g, "speed").std, 0.0025, 1e-15);
  EXPECT_NEAR(number(g, "density").std, 1, 1e-15);
  EXPECT_NEAR(number(g, "calibration").std, 0.044, 1e-12);
  EXPECT_NEAR(number(g, "clock").std, 1e-3, 1e-15);
  EXPECT_FALSE(g.common[static_cast<std::size_t>(&number(g, "speed") - g.numbers.data())]);
  EXPECT_TRUE(g.common[static_cast<std::size_t>(&number(g, "density") - g.numbers.data())]);
  VectorXd off = VectorXd::Zero(4);
  off[&number(g, "calibration") - g.numbers.data()] = 0.44;
  off[&number(g, "clock") - g.numbers.data()] = 0.01;
  const unrig::Run moved = with_errors(run, off);
  EXPECT_NEAR(moved.channel("gauge").value[2], 1.1 * run.channel("gauge").value[2], 1e-12);
  EXPECT_NEAR(moved.dt, 1.01 * run.dt, 1e-15);
}

TEST(StatedErrors, APercentageOfAStillTankIsNothing) {
  std::string text = run_text("# speed_std_percent = 0.5\n");
  text.replace(text.find("0.5 m/s"), 7, "0 m/s");
  EXPECT_EQ(parse_run(text, "pluck.csv").givens, nullptr);
}

TEST(StatedErrors, WhatCannotBeIsRefusedByItsKey) {
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "mass.unit", "mass.std_percent = 1\nmass.std = \"1 g\"")), HasSubstr("side by side"));
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "mass.unit", "mass.std_percent = -1")), HasSubstr("normal.mass.std_percent is -1"));
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "mass.unit", "mass.std = \"1 mm\"")), HasSubstr("normal.mass.std"));
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "mass.unit", "mass.std_values = [1, 2]")), HasSubstr("wanted 17"));
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "pitch_axis", "chord_std = \"1 kg\"")), HasSubstr("section.chord_std"));
  EXPECT_THAT(refusal_of_rig(test::with_line(null_rig(), "pitch_axis", "chord_std = 3")), HasSubstr("has no unit"));
  EXPECT_THAT(refusal_of_run(run_text("# speed_error = \"mine\"\n")), HasSubstr("speed_error is \"mine\""));
  EXPECT_THAT(refusal_of_run(run_text("# calibration_std_percent = 1\n")), HasSubstr("calibration is not given"));
  EXPECT_THAT(refusal_of_run(run_text("# speed_std = \"3 kg\"\n")), HasSubstr("step.csv:5"));
}

}  // namespace
}  // namespace unrig
