#include "fit/search/first_guess.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(FirstGuess, HearsADecayAtTheStartOfALongRecord) {
  // Over after 12 s, one per cent of the record; its first amplitude is three times the noise.
  constexpr Index samples = 300000;
  constexpr double dt = 0.004, hertz = 7.7, decay = 0.3;
  Rig rig;
  rig.name = "one mode";
  rig.modal = {{1.5, 10, 0.01, 1000, "N"}};
  const AeroelasticModel model(rig, Basis{}, wagner(Wagner::jones));
  unrig::Run run;
  run.kind = RunKind::pluck;
  run.density = 1.2;
  run.dt = dt;
  std::mt19937_64 engine(1);
  std::normal_distribution<double> normal(0, 1);
  VectorXd gauge(samples);
  for (Index k = 0; k < samples; ++k) {
    const double t = dt * static_cast<double>(k);
    gauge[k] = 3 * std::exp(-decay * t) * std::cos(2 * std::numbers::pi * hertz * t) + normal(engine);
  }
  run.channels.push_back({"gauge", "N", "N", 1, gauge, 0});
  JointProblem joint(model, {RunResidual(model, run, {})});
  guess_from_spectra(joint);
  const Index stiffness = model.index("modal[1].stiffness");
  // A line is as wide as the decay rate: 0.05 Hz.
  EXPECT_NEAR(std::sqrt(joint.theta(0)[stiffness] / model.start_values()[stiffness]), hertz / 10, 0.01);
}

}  // namespace
}  // namespace unrig
