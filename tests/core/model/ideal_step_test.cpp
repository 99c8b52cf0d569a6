#include "core/model/ideal_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "core/propagate/exact_step.h"
#include "core/run/motion.h"
#include "core/rig/rig.h"
#include "core/model/rigid_system.h"

// The seed's own step, its polynomials and Table 1: tests/verification/ideal_step_test.cpp.

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class IdealStepTest : public testing::Test {
 protected:
  IdealStepTest()
      : rig_(read_rig(std::string(UNRIG_SOURCE_DIR) + "/sample_data/seed/rig_from_drawings.toml")),
        model_(rig_, make_basis(rig_, Index{3}, Index{1}), wagner(Wagner::within_1e4)),
        system_(model_.system({1000, 0.6, true, false, false}, model_.start_values(), {"gauge", "tip_displacement", "tip_twist"})) {}

  Rig rig_;
  AeroelasticModel model_;
  LinearSystem system_;
};

TEST_F(IdealStepTest, IsTheMatrixExponentialFromTheJump) {
  const IdealStep step = ideal_step(system_, 0.02);
  VectorXd state = 0.02 * step_jump(system_);
  const double dt = 0.003;
  const MatrixXd transition = exact_step(system_, dt).transition.value;
  for (int k = 0; k < 400; ++k) {
    const VectorXd expected = system_.C.value * state, value = step.output_at(k * dt);
    // The sum over eigenvectors loses as many digits as they are apart; 1e-10 measured, rounded up.
    for (Index c = 0; c < 3; ++c) ASSERT_NEAR(value[c], expected[c], 1e-9 * step.output_at(0).cwiseAbs().maxCoeff()) << "sample " << k;
    ASSERT_LT((step.state_at(k * dt) - state.head(system_.free_states())).norm(), 1e-9 * step.start.norm());
    state = transition * state;
  }
}

TEST_F(IdealStepTest, IsTheLimitOfEverFasterRamps) {
  // A ramp that is symmetric about the step's instant has no first moment there, so that what follows differs by the order of its duration
  // squared.
  const double amplitude = 0.02, dt = 1e-5;
  const IdealStep step = ideal_step(system_, amplitude);
  double last = 0;
  for (const Index ramp : {160, 80, 40}) {  // samples; the step in the middle
    const Index samples = 6000, middle = 200;
    VectorXd angle(samples);
    for (Index k = 0; k < samples; ++k) {
      const double x = std::clamp((static_cast<double>(k - middle)) / static_cast<double>(ramp) + 0.5, 0.0, 1.0);
      angle[k] = amplitude * x * x * x * (10 + x * (6 * x - 15));
    }
    const MatrixXd output = motion_response(system_, interpolated_motion(angle, dt), dt);
    double error = 0;
    for (Index k = 1000; k < samples; k += 100) {
      const VectorXd difference = output.row(k).transpose() - step.output_at(dt * static_cast<double>(k - middle));
      error = std::max(error, std::abs(difference[1]));  // displacement: jumps, without a delta function
    }
    if (last > 0) {
      EXPECT_NEAR(last / error, 4, 0.1) << ramp << " samples";
    }
    last = error;
  }
}

TEST_F(IdealStepTest, ScalesAndEndsInTheSteadyState) {
  const IdealStep one = ideal_step(system_, 0.01), two = ideal_step(system_, -0.02);
  EXPECT_LT((two.output_at(0.1) + 2 * one.output_at(0.1)).norm(), 1e-12 * two.output_at(0.1).norm());
  EXPECT_LT((one.output_at(1e5) - one.output.steady).norm(), 1e-12 * one.output.steady.norm());
  EXPECT_NEAR(one.output.steady[2], 0.01, 1e-12) << "no twist: the steady load acts on the pitch axis";
}

TEST_F(IdealStepTest, NeedsPrescribedPitch) {
  const LinearSystem still = model_.system({1000, 0.6, false, false, false}, model_.start_values(), {"gauge"});
  EXPECT_THROW(ideal_step(still, 1), std::invalid_argument);
  EXPECT_THROW(step_jump(still), std::invalid_argument);
}

TEST_F(IdealStepTest, RefusesPolesWithoutPartialFractions) {
  // Critical damping: a double pole with one eigenvector has t exp(-t) in its response.
  LinearSystem system;
  MatrixXd a = MatrixXd::Zero(5, 5);
  a(0, 1) = 1, a(1, 0) = -4, a(1, 1) = -4, a(1, 2) = 1, a(2, 3) = a(3, 4) = 1;
  system.A = DualMatrix(a);
  system.C = DualMatrix(MatrixXd::Identity(1, 5));
  system.coordinates = 1;
  system.motion = 2;
  EXPECT_THROW(ideal_step(system, 1), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
