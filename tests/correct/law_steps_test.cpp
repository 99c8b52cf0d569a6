// A fit says in how many steps a nonlinear law was followed; the correction follows it in as many.

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::string campaign(const std::string& file) { return test::source_path("sample_data/campaigns/drag/" + file); }

/// What `unrig fit --effect quadratic-drag` finds in the campaign's five runs.
FittedRig drag_fit() {
  return test::written_fit("quadratic-drag", {{"normal.stiffness_scale", 0.729847055, 2.5e-6},
                                              {"torsion.stiffness_scale", 0.940770658, 2.1e-3},
                                              {"normal.damping_ratio", 0.00720837768, 1.1e-6},
                                              {"torsion.damping_ratio", 0.0187228863, 1.3e-3},
                                              {"apparent_mass_coefficient", 0.983688621, 1.3e-5},
                                              {"quadratic-drag.coefficient", 8.35112857, 2.0e-3}});
}

TEST(LawSteps, OfAFitRefineTheLoadAsTheirSquareAndWithinItsBand) {
  unrig::Run run = read_run(campaign("step_c.csv"));
  for (Channel& c : run.channels) c.value.conservativeResize(900);
  std::vector<CorrectResult> in_steps;
  for (const Index steps : {1, 2, 4}) {
    FittedRig fit = drag_fit();
    fit.law_steps = steps;
    in_steps.push_back(correct({read_rig(campaign("rig.toml")), fit, run, 0}));
  }
  const VectorXd& finest = in_steps[2].circulatory.value;
  const double whole = (in_steps[0].circulatory.value - finest).norm(), half = (in_steps[1].circulatory.value - finest).norm();
  // Errors of h^2 differ from that of h/4 as 15 to 3; 4.6 was measured.
  EXPECT_GT(whole / half, 3);
  EXPECT_LT(whole / half, 8);
  EXPECT_LT((in_steps[0].circulatory.value - finest).cwiseAbs().cwiseQuotient(in_steps[2].circulatory.std).maxCoeff(), 0.5) << "the drag's fit was content with whole samples";
}

}  // namespace
}  // namespace unrig
