// Rig files with cross-sections: lengths, stiffness, mass and inertia from dimensions and density, what is assumed, and what is refused.

#include "core/rig/drawn_sections.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/rig/beam_flexibility.h"
#include "core/rig/givens.h"
#include "core/rig/rig.h"
#include "core/rig/structure.h"
#include "tests/support/replaced.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using test::TemporaryDirectory;
using test::replaced;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// A tube of 0.8 m that carries a wing.
const std::string sting = R"toml(unrig_rig = 1
[section]
chord = "150 mm"
pitch_axis = 0.25
[normal]
density = "2700 kg/m^3"
youngs_modulus = "70 GPa"
[[normal.section]]
elements = 8
length = "800 mm"
shape = "tube"
outer_diameter = "40 mm"
wall = "2 mm"
[[normal.section]]
elements = 3
length = "300 mm"
shape = "other"
second_moment = "2e-7 m^4"
polar_moment = "4e-7 m^4"
mass_per_length = "2.5 kg/m"
inertia_per_length = "4.7 g.m"
[torsion]
[submerged]
elements = [9, 10, 11]
[gauge]
element = 1
calibration_element = 10
)toml";

Rig read(const std::string& text) {
  const TemporaryDirectory directory;
  return read_rig(directory.file("rig.toml", text));
}

std::string refusal(const std::string& text) {
  try {
    read(text);
  } catch (const InputError& error) {
    return error.what();
  }
  return "no error";
}

TEST(RigOfSections, MassInertiaAndFlexibilityFollowFromTheDimensions) {
  const Rig rig = read(sting);
  ASSERT_EQ(rig.station.size(), 11);
  for (Index k = 0; k < 11; ++k) EXPECT_NEAR(rig.station[k], 0.05 + 0.1 * static_cast<double>(k), 1e-14) << k;
  const CrossSection tube = tube_section(0.04, 0.002);
  EXPECT_NEAR(rig.normal.inertia[0], 2700 * std::numbers::pi / 4 * (0.04 * 0.04 - 0.036 * 0.036) * 0.1, 1e-15);
  EXPECT_NEAR(rig.normal.inertia[10], 0.25, 1e-15);
  ASSERT_EQ(rig.torsion.inertia.size(), 9);
  EXPECT_NEAR(rig.torsion.inertia[0], 2700 * tube.polar_second_moment * 0.1, 1e-17);
  EXPECT_NEAR(rig.torsion.inertia[8], 4.7e-3 * 0.3, 1e-15);
  EXPECT_NEAR(rig.strip_length, 0.1, 1e-15);

  SteppedBeam beam;
  beam.station = rig.station;
  beam.length = VectorXd::Constant(11, 0.1);
  beam.stiffness = VectorXd::Constant(11, 70e9 * tube.second_moment);
  beam.stiffness.tail(3).setConstant(70e9 * 2e-7);
  const Eigen::MatrixXd bending = bending_flexibility(beam);
  EXPECT_LE((rig.normal.flexibility - bending).norm(), 1e-13 * bending.norm());
  EXPECT_NEAR(rig.torsion.flexibility(3, 7), 0.35 / (70e9 / 2.6 * tube.torsion_constant), 1e-13);
}

TEST(RigOfSections, AUniformTubeHasTheFrequenciesOfACantilever) {
  std::string text = sting.substr(0, sting.find("[[normal.section]]\nelements = 3")) + sting.substr(sting.find("[torsion]"));
  text = replaced(replaced(replaced(text, "elements = 8", "elements = 64"), "[9, 10, 11]", "[64]"), "calibration_element = 10", "calibration_element = 64");
  const Rig rig = read(text);
  const CrossSection tube = tube_section(0.04, 0.002);
  const double length = 0.8, first = 1.8751040687119611 * 1.8751040687119611, second = 4.694091132974175 * 4.694091132974175;  // Blevins, 1979, Table 8-1
  const double unit = std::sqrt(70e9 * tube.second_moment / (2700 * tube.area)) / (length * length);
  const Modes modes = chain_modes(rig.normal);
  EXPECT_NEAR(modes.omega[0] / (first * unit), 1, 1e-3);
  EXPECT_NEAR(modes.omega[1] / (second * unit), 1, 1e-2);
}

TEST(RigOfSections, WhatIsNotGivenIsSaid) {
  const Rig rig = read(sting);
  ASSERT_EQ(rig.warnings.size(), 1u);
  for (const char* what : {"normal.modes = \"all\"", "normal.mass_centre = 0", "torsion.modes = 1", "torsion.rigid_from = 9 (the first submerged element)", "torsion.shear_modulus = normal.youngs_modulus / 2.6"})
    EXPECT_THAT(rig.warnings.front(), HasSubstr(what));
  std::string told = replaced(sting, "[torsion]\n", "[torsion]\nmodes = 1\nrigid_from = 9\nshear_modulus = \"26 GPa\"\n");
  told = replaced(told, "[normal]\n", "[normal]\nmodes = \"all\"\nmass_centre = \"0 mm\"\n");
  EXPECT_THAT(read(told).warnings, IsEmpty());
  const Rig modal = read("unrig_rig = 1\n[[modal]]\nmass = \"1 kg\"\nfrequency = \"8 Hz\"\ngauge_gain = \"1000 N/m\"\n");
  EXPECT_EQ(modal.modal.front().damping_ratio, 0.01);
  EXPECT_THAT(modal.warnings, ElementsAre(HasSubstr("not given, and taken as: modal[1].damping_ratio = 0.01")));
}

TEST(RigOfSections, MassesMayBeAddedAndState) {
  std::string text = replaced(sting, "density = \"2700 kg/m^3\"\n", "density = \"2700 kg/m^3\"\ndensity_std_percent = 1\nadded_mass.unit = \"g\"\nadded_mass.values = [0,0,0,0,0,0,0,0,0,5,0]\nadded_mass.std = \"1 g\"\n");
  text = replaced(text, "[torsion]\n", "[torsion]\nadded_inertia.unit = \"g.m^2\"\nadded_inertia.values = [0,0,0,0,0,0,0,0,0.1]\n");
  const Rig rig = read(text);
  EXPECT_NEAR(rig.normal.inertia[9], 0.255, 1e-15);
  EXPECT_NEAR(rig.torsion.inertia[8], 4.7e-3 * 0.3 + 1e-4, 1e-15);
  ASSERT_TRUE(rig.givens);
  // One deviation moves all that the density gives, in proportion, and nothing else.
  const Givens& givens = *rig.givens;
  const auto density = std::find(givens.group.begin(), givens.group.end(), "normal.density (common)") - givens.group.begin();
  ASSERT_LT(static_cast<std::size_t>(density), givens.group.size());
  const Rig heavier = with_errors(rig, givens.spread.col(static_cast<Index>(density)));
  EXPECT_NEAR(heavier.normal.inertia[0] / rig.normal.inertia[0], 1.01, 1e-12);
  EXPECT_NEAR(heavier.torsion.inertia[0] / rig.torsion.inertia[0], 1.01, 1e-12);
  EXPECT_EQ(heavier.normal.inertia[9], rig.normal.inertia[9]);
  EXPECT_EQ(heavier.torsion.inertia[8], rig.torsion.inertia[8]);
}

TEST(RigOfSections, WhatCannotBeDrawn) {
  EXPECT_THAT(refusal(replaced(sting, "\"tube\"", "\"pipe\"")), AllOf(HasSubstr("rig.toml:11: "), HasSubstr("normal.section[1].shape is \"pipe\"; wanted \"circular\", \"tube\"")));
  EXPECT_THAT(refusal(replaced(sting, "wall = \"2 mm\"", "wall = \"20 mm\"")), AllOf(HasSubstr("rig.toml:13: "), HasSubstr("leaves nothing hollow")));
  EXPECT_THAT(refusal(replaced(sting, "wall = ", "thickness = ")), HasSubstr("\"normal.section[1].thickness\" is unknown for the shape \"tube\"; wanted one of: shape, elements, length, outer_diameter, wall"));
  EXPECT_THAT(refusal(replaced(sting, "elements = 8", "elements = 0")), HasSubstr("wanted one element at least"));
  EXPECT_THAT(refusal(replaced(sting, "density = \"2700 kg/m^3\"\n", "")), HasSubstr("normal.mass of element 1 is 0 kg"));
  EXPECT_THAT(refusal(replaced(sting, "density = ", "mass = \"1 kg\"\ndensity = ")), HasSubstr("normal.density stands beside normal.mass"));
  EXPECT_THAT(refusal(replaced(sting, "length = \"300 mm\"\n", "")), HasSubstr("normal.section[2].length is missing"));
  EXPECT_THAT(refusal(replaced(sting, "[normal]\n", "[normal]\nlength = \"100 mm\"\n")), HasSubstr("normal.length stands beside lengths of the sections"));
  EXPECT_THAT(refusal(replaced(sting, "[normal]\n", "[normal]\nstation.unit = \"m\"\nstation.values = [0.1, 0.2]\n")), HasSubstr("normal.section is for 11 elements; wanted sections for 2"));
  EXPECT_THAT(refusal(replaced(sting, "[normal]\n", "[normal]\nsecond_moment = \"1e-8 m^4\"\n")), HasSubstr("normal.second_moment stands beside normal.section"));
  EXPECT_THAT(refusal(replaced(sting, "[normal]\n", "[normal]\nmass_centre = \"60 mm\"\n")), HasSubstr("wanted at least"));
  EXPECT_THAT(refusal(replaced(sting, "[normal]\n", "[normal]\nmass_centre_std = \"1 mm\"\n")), HasSubstr("normal.mass_centre is not given"));
  EXPECT_THAT(refusal(replaced(replaced(sting, "elements = [9, 10, 11]", "elements = [8, 9]"), "\"300 mm\"", "\"450 mm\"")), HasSubstr("wanted one length of all strips"));
}

}  // namespace
}  // namespace unrig
