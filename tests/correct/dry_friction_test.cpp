// A rig that sticks and lets go: its load by the run's own motion along exact tangents.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string campaign(const std::string& file) { return test::source_path("sample_data/campaigns/friction/" + file); }

/// What `unrig fit --effect coulomb-friction` finds in the campaign's five runs.
FittedRig friction_fit() {
  return test::written_fit("coulomb-friction", {{"normal.stiffness_scale", 0.77970305, 1.5e-5},
                                                {"torsion.stiffness_scale", 0.79945713, 3.2e-4},
                                                {"normal.damping_ratio", 0.01724643, 1.1e-5},
                                                {"torsion.damping_ratio", 0.02298711, 3.1e-4},
                                                {"apparent_mass_coefficient", 1.01516981, 2.4e-5},
                                                {"coulomb-friction.force", 0.73223976, 1.5e-4},
                                                {"coulomb-friction.velocity", 1.2848656e-4, 9.6e-7}});
}

class DryFriction : public ::testing::TestWithParam<const char*> {};

TEST_P(DryFriction, IsTakenOutOfTheLoad) {
  const std::string name = GetParam();
  const CorrectResult result = correct({read_rig(campaign("rig.toml")), friction_fit(), read_run(campaign(name + ".csv")), 0});
  const VectorXd truth = test::column_of(campaign("truth_" + name + ".csv"), "circulatory");
  const double size = std::abs(truth[truth.size() - 1] - truth[0]);
  // From 0.5 to 8 semichords after the shaft begins to turn, at 1 s. 0.5 % is what the project promises; 0.19 to 0.33 % were measured, 2.5 % and more where the
  // motion ends in another minimum.
  double squares = 0, in_deviations = 0, count = 0;
  for (Index k = 0; k < truth.size(); ++k) {
    const double semichords = (result.start + static_cast<double>(k) * result.dt - 1) * result.semichords_per_second, off = result.circulatory.value[k] - truth[k];
    if (semichords < 0.5 || semichords > 8) continue;
    squares += off * off, in_deviations += std::pow(off / result.circulatory.std[k], 2), ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.005 * size);
  // Errors of neighbouring samples are one error, which scatters by half of itself or more: 0.6 to 1.9.
  EXPECT_LT(std::sqrt(in_deviations / count), 2.5);
  // Gauge and angle are explained: 1.02 to 1.07, of six thousand readings. Another minimum of the motion leaves 1.14 and more.
  EXPECT_GT(result.reduced_chi2, 0.9);
  EXPECT_LT(result.reduced_chi2, 1.1);
}

INSTANTIATE_TEST_SUITE_P(In, DryFriction, ::testing::Values("step_a", "step_b", "step_c", "heldout"), [](const auto& run) { return std::string(run.param); });

}  // namespace
}  // namespace unrig
