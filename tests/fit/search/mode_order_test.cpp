#include "fit/search/mode_order.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/studies/campaign_maker.h"

namespace unrig {
namespace {

using namespace studies;

/// A joint problem of two modes at its truth, and the same with the modes' numbers exchanged.
class TwoModes : public ::testing::Test {
 protected:
  TwoModes()
      : campaign(simulate_campaign({RigKind::two_modes, studies::NoiseColour::white, {"pluck", "forced_a"}}, 5)),
        model(model_of(campaign.problem.rig, campaign.problem.runs, Wagner::within_1e4)),
        joint(model, residuals()) {
    for (Unknown& u : joint.unknowns()) u.value = campaign.truth.at(joint.parameter(u).name);
  }

  std::vector<RunResidual> residuals() const {
    std::vector<RunResidual> runs;
    for (const unrig::Run& run : campaign.problem.runs) runs.emplace_back(model, run, std::vector<MotionBasis::Window>{});
    return runs;
  }

  Unknown& unknown(JointProblem& of, const std::string& name) const {
    return *std::find_if(of.unknowns().begin(), of.unknowns().end(), [&](const Unknown& u) { return of.parameter(u).name == name; });
  }

  JointProblem exchanged() const {
    JointProblem other = joint;
    const auto& modes = model.rig().modal;
    for (const auto& [to, from] : {std::pair{0, 1}, {1, 0}})
      for (const char* what : {"mass", "stiffness", "damping"})
        unknown(other, "modal[" + std::to_string(to + 1) + "]." + what).value =
            modes[static_cast<std::size_t>(to)].gauge_gain / modes[static_cast<std::size_t>(from)].gauge_gain * campaign.truth.at("modal[" + std::to_string(from + 1) + "]." + what);
    return other;
  }

  SimulatedCampaign campaign;
  AeroelasticModel model;
  JointProblem joint;
};

TEST_F(TwoModes, NoReadingNoticesThatTheyChangePlaces) {
  const JointProblem other = exchanged();
  EXPECT_NEAR(other.chi2(), joint.chi2(), 1e-9 * joint.chi2()) << "the same model but for rounding";
}

TEST_F(TwoModes, TakeTheNumbersOfTheRigFileByFrequency) {
  JointProblem other = exchanged();
  EXPECT_TRUE(number_modes_by_frequency(other));
  for (const Unknown& u : joint.unknowns()) {
    const std::string& name = joint.parameter(u).name;
    if (name.ends_with("mount_participation")) continue;
    EXPECT_NEAR(unknown(other, name).value / u.value, 1, 1e-12) << name;
  }
  EXPECT_FALSE(number_modes_by_frequency(other)) << "they have them now";
}

TEST_F(TwoModes, KeepAMassThatIsHeld) {
  JointProblem other = exchanged();
  for (const char* name : {"modal[1].mass", "modal[2].mass"}) unknown(other, name).held = true;
  const double mass = unknown(other, "modal[1].mass").value, ratio = campaign.truth.at("modal[1].stiffness") / campaign.truth.at("modal[1].mass");
  EXPECT_TRUE(number_modes_by_frequency(other));
  EXPECT_EQ(unknown(other, "modal[1].mass").value, mass);
  EXPECT_NEAR(unknown(other, "modal[1].stiffness").value / mass / ratio, 1, 1e-12);
}

/// From a rig file that is off by 0.4 in stiffness and 0.1 in damping (tests/studies/basin_study.cpp) the search ends with the modes in either order.
TEST_F(TwoModes, AreFoundInTheRigFilesOrderFromAfar) {
  for (ModalMode& mode : campaign.problem.rig.modal) {
    mode.frequency *= std::sqrt(0.4);
    mode.damping_ratio *= 0.1;
  }
  for (const FittedParameter& p : fit(campaign.problem).parameters) {
    if (!p.identified) continue;
    EXPECT_LT(std::abs(p.value - campaign.of(p)), 5 * p.std_error) << p.name;  // of six parameters: chance does not go there
  }
}

}  // namespace
}  // namespace unrig
