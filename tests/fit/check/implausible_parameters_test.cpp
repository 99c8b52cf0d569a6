#include "fit/check/implausible_parameters.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace unrig {
namespace {

FittedParameter parameter(const std::string& name, double value, Role role) {
  FittedParameter p;
  p.name = name;
  p.unit = "1";
  p.value = value;
  p.role = role;
  return p;
}

TEST(ImplausibleParameters, AreThoseThatNoRigHas) {
  FitResult result;
  result.parameters = {parameter("normal.stiffness_scale", 12, Role::stiffness), parameter("normal.damping_ratio", 0.7, Role::damping), parameter("torsion.damping_ratio", 0.02, Role::damping)};
  const std::vector<Suspicion> found = implausible_parameters(result);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_THAT(found[0].text, testing::HasSubstr("normal.stiffness_scale is fitted as 12, and plausible is 0.1 to 10"));
  EXPECT_THAT(found[1].text, testing::HasSubstr("normal.damping_ratio is fitted as 0.7"));
}

/// An amplifier is damped by 0.7; a rig known as modes has its stiffness in N/m; what the runs do not determine is no finding.
TEST(ImplausibleParameters, AreNoneOfAnEffectNorOfAModeNorUndetermined) {
  FittedParameter amplifier = parameter("gauge-lowpass.damping_ratio", 0.7038, Role::damping), mode = parameter("mode1.stiffness", 1e5, Role::stiffness), held = parameter("apparent_mass_coefficient", 9, Role::mass);
  amplifier.effect = "gauge-lowpass";
  mode.mode = 0;
  held.identified = false;
  FitResult result;
  result.parameters = {amplifier, mode, held};
  EXPECT_TRUE(implausible_parameters(result).empty());
}

}  // namespace
}  // namespace unrig
