// Where it is noise that is left, the halves of a decay agree within their errors. (Where it is not: tests/commands/results_test.cpp.)

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "fit/fit.h"
#include "fit/uncertainty/uncertainty.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using namespace one_mode;
using std::numbers::pi;

/// Noise of a corner at 5 Hz, of the same variance as white_noise.
VectorXd first_order_noise(Index samples, unsigned seed) {
  const double a = std::exp(-2 * pi * 5 * dt);
  VectorXd noise = white_noise(samples, seed);
  for (Index k = 1; k < samples; ++k) noise[k] = a * noise[k - 1] + std::sqrt(1 - a * a) * noise[k];
  return noise;
}

TEST(EarlierHalf, HasTheVarianceOfItsUnknownInNoise) {
  const AeroelasticModel rig_model = model();
  constexpr Index samples = 1500;
  const VectorXd clean = 10 * free_response(samples, hertz).col(0);
  for (const bool white : {true, false}) {
    double squares = 0, count = 0;
    for (unsigned seed = 0; seed < 150; ++seed) {
      const unrig::Run run = decay("decay.csv", clean + 0.1 * (white ? white_noise(samples, seed) : first_order_noise(samples, seed)));
      std::vector<RunResidual> runs;
      runs.emplace_back(rig_model, run, std::vector<MotionBasis::Window>{});
      JointProblem joint(rig_model, std::move(runs));
      for (Unknown& u : joint.unknowns()) {
        const std::string& name = joint.parameter(u).name;
        u.held = name != "modal[1].stiffness" && name != "modal[1].damping";
      }
      joint.solve({});
      const ParameterUncertainty uncertainty = estimate_uncertainty(joint);
      ASSERT_EQ(uncertainty.free.size(), 2u);
      for (Index a = 0; a < 2; ++a) squares += std::pow(uncertainty.earlier_half[a], 2) / uncertainty.covariance()(a, a), ++count;
    }
    // 300 squares of chi-square's one degree of freedom: 1 +- 0.08; a coloured variance is itself known to some tenths.
    EXPECT_NEAR(squares / count, 1, white ? 0.3 : 0.5) << (white ? "white" : "first order");
  }
}

/// Mistaken for physics by one fit in a thousand.
TEST(EarlierHalf, NoiseOfAColourLeavesAnAnswer) {
  constexpr Index samples = 1500;
  const VectorXd clean = 10 * free_response(samples, hertz).col(0);
  for (unsigned seed = 0; seed < 20; ++seed) {
    FitProblem problem;
    problem.rig = rig();
    problem.runs = {decay("decay.csv", clean + 0.5 * first_order_noise(samples, seed))};
    const FitResult result = fit(problem);
    EXPECT_GT(result.reduced_chi2(), 1.5) << "otherwise nothing is judged";
    EXPECT_EQ(result.no_answer, "") << seed;
  }
}

}  // namespace
}  // namespace unrig
