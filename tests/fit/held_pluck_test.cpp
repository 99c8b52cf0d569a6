// A pluck that begins with the hold before its release: what is fitted to it is what is fitted to the decay alone. The decay is written down in closed form.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "core/run/release.h"
#include "fit/fit.h"
#include "fit/fit_report.h"
#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using namespace one_mode;

constexpr double true_hertz = 7.1, true_damping = 0.02, load = 20, noise = 0.05;  // Hz, 1, N, N
constexpr Index samples = 1000;

/// Held at `load` until `released` samples after the first, then let go from rest.
VectorXd reading(double released, Index count, unsigned seed) {
  const double omega = 2 * std::numbers::pi * true_hertz, root = std::sqrt(1 - true_damping * true_damping);
  const VectorXd scatter = noise * white_noise(count, seed);
  return VectorXd::NullaryExpr(count, [&](Index k) {
    const double t = std::max(0.0, dt * (static_cast<double>(k) - released));
    return scatter[k] + load * std::exp(-true_damping * omega * t) * (std::cos(root * omega * t) + true_damping / root * std::sin(root * omega * t));
  });
}

FitResult fitted(const Run& run) {
  FitProblem problem;
  problem.rig = rig();
  problem.runs = {run};
  return fit(problem);
}

const FittedParameter& parameter(const FitResult& result, const std::string& part) {
  return *std::find_if(result.parameters.begin(), result.parameters.end(), [&](const FittedParameter& p) { return p.name.find(part) != std::string::npos; });
}

TEST(HeldPluck, IsFittedFromItsReleaseOn) {
  for (const double held : {20.3, 150.5, 700.9}) {
    const VectorXd x = reading(held, samples + static_cast<Index>(held), 7);
    unrig::Run whole = decay("held.csv", x), run = whole;
    begin_at_release(run);
    ASSERT_TRUE(run.hold) << held;
    EXPECT_NEAR(run.hold->release, dt * held, 2 * dt);
    const unrig::Run alone = decay("alone.csv", x.tail(samples - 1));
    const FitResult result = fitted(run), reference = fitted(alone);
    EXPECT_NEAR(result.reduced_chi2(), 1, 0.15) << held;
    const double omega = 2 * std::numbers::pi * true_hertz;
    for (const auto& [name, truth] : {std::pair{"stiffness", omega * omega}, std::pair{"damping", 2 * true_damping * omega}}) {  // of 1 kg
      const FittedParameter &p = parameter(result, name), &q = parameter(reference, name);
      EXPECT_NEAR(p.value, truth, 4 * p.std_error) << held << " " << p.name;
      EXPECT_NEAR(p.value, q.value, p.std_error) << held << " " << p.name;
      EXPECT_LT(p.std_error, 1.1 * q.std_error) << held << " " << p.name << ": a few samples after the release are lost";
    }
    EXPECT_NE(report(result, 0.1).find(said_of(*run.hold)), std::string::npos);
    const FitResult with_hold = fitted(whole);
    EXPECT_GT(with_hold.reduced_chi2(), 3) << held << ": a hold is no decay";
  }
}

}  // namespace
}  // namespace unrig
