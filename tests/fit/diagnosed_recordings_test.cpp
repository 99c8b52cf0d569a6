// Recordings by others (sample_data/README.md): what a diagnosis says of them. The bounds are the right-hand column of the reference numbers, measured independently of this project.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "fit/diagnose/diagnose.h"
#include "tests/support/band.h"
#include "tests/support/long_tests.h"
#include "tests/support/shared_data.h"

namespace unrig {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::IsSupersetOf;

/// Of these candidates; of all of the list, which takes minutes under the sanitizers, where long tests are wanted.
DiagnoseProblem recording(const std::string& rig, const std::string& run, const std::vector<std::string>& candidates = {}) {
  DiagnoseProblem problem;
  problem.laws = candidates.empty();  // otherwise effects of the list are asked for
  if (!test::long_tests_wanted()) problem.effects = candidates;
  problem.rig = read_rig(test::shared_path("real/" + rig + "/rig.toml"));
  problem.runs.push_back(read_run(test::shared_path("real/" + rig + "/" + run)));
  return problem;
}

/// Samples of a run up to `seconds` after its start, and those behind.
std::pair<unrig::Run, unrig::Run> parted(const unrig::Run& whole, double seconds) {
  const auto samples = static_cast<Eigen::Index>(std::lround(seconds / whole.dt));
  return {test::part(whole, 0, samples), test::part(whole, samples, whole.samples())};
}

std::vector<std::string> names(const std::vector<MissingEffect>& effects) {
  std::vector<std::string> ids;
  for (const MissingEffect& m : effects) ids.push_back(m.effect);
  return ids;
}

/// Roll decay of a ship model: its damping is known to grow with the rate and its righting couple not to be linear (Himeno 1981). The linear model leaves 0.174 deg, one with
/// both terms 0.0186 deg (measured independently of this project).
TEST(DiagnosedRecordings, ShipRollHasQuadraticDampingAndNonlinearStiffness) {
  UNRIG_NEEDS_SHARED("real/ship_roll/run_21337.csv");
  DiagnoseProblem problem = recording("ship_roll", "run_21337.csv", {"cubic-stiffness", "coulomb-friction", "quadratic-drag", "gauge-drift"});
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(names(d.missing), IsSupersetOf({"quadratic-drag", "cubic-stiffness"}));
  constexpr double degree = 3.14159265358979323846 / 180;
  EXPECT_LT(d.runs.front().rms_after, 0.0186 * degree);
}

/// Electronic resonator. A linear model leaves 6.8 to 7.5 mV, the right one 0.90 mV; so does what was not fitted.
TEST(DiagnosedRecordings, OscillatorHasCubicStiffness) {
  UNRIG_NEEDS_SHARED("real/oscillator/multisine.csv");
  DiagnoseProblem problem = recording("oscillator", "multisine.csv");
  const auto [fitted, unseen] = parted(problem.runs.front(), 12000 * problem.runs.front().dt);
  problem.runs = {fitted};
  problem.heldout = {unseen};
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(names(d.missing), ElementsAre("cubic-stiffness"));
  EXPECT_FALSE(d.unexplained);
  ASSERT_EQ(d.runs.size(), 2u);
  for (const ImprovedRun& run : d.runs) {
    EXPECT_GT(run.rms_before, 6e-3) << run.file;
    EXPECT_LT(run.rms_after, 0.35e-3) << run.file << ": 0.90 mV under a force that runs straight between its samples; published: 0.23 to 0.3 mV, of models with more terms";
  }
}

/// Hysteresis that its authors simulated. Their noise went through a filter: it falls towards half the sampling rate. The test signal was recorded in full swing.
TEST(DiagnosedRecordings, TheBenchmarkOfHysteresisIsNamed) {
  UNRIG_NEEDS_SHARED("real/bouc_wen/train_multisine.csv");
  DiagnoseProblem problem = recording("bouc_wen", "train_multisine.csv", {"bouc-wen"});
  problem.runs.front() = test::part(problem.runs.front(), 0, 8192);  // half of it
  problem.heldout.push_back(read_run(test::shared_path("real/bouc_wen/test_multisine.csv")));
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(names(d.missing), ElementsAre("bouc-wen"));
  EXPECT_FALSE(d.unexplained);
  ASSERT_EQ(d.runs.size(), 2u);
  EXPECT_GT(d.runs[0].rms_before, 1.8e-4);
  EXPECT_LT(d.runs[0].rms_after, 8e-6) << "the noise that was added to it, before a filter";
  EXPECT_GT(d.runs[1].rms_before, 1e-4);
  EXPECT_LT(d.runs[1].rms_after, 1.9e-5) << "published: 4.52e-5 and 1.87e-5 m";
}

/// Swings of a pendulum until dry friction in its bearing stops it: 3.83 mrad without, 0.94 to 1.01 mrad with the right terms.
TEST(DiagnosedRecordings, PendulumHasDryFriction) {
  UNRIG_NEEDS_SHARED("real/pendulum/swing.csv");
  DiagnoseProblem problem = recording("pendulum", "swing.csv", {"cubic-stiffness", "coulomb-friction", "quadratic-drag", "gauge-drift"});
  constexpr double sticks = 6.3;  // s
  problem.runs = {parted(problem.runs.front(), sticks).first};
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(names(d.missing), Contains("coulomb-friction"));
  EXPECT_TRUE(d.unexplained) << "the encoder's noise is a tenth of what is left";
  EXPECT_GT(d.runs.front().rms_before, 3.8e-3);
  EXPECT_LT(d.runs.front().rms_after, 0.94e-3);
}

/// Wing section on springs, heave and pitch: 14.9 mrad without, 2.8 to 3.7 mrad with the right terms. What is
/// left still is a hundred times the converter's noise, and so the set that comes closest is reported without being named.
TEST(DiagnosedRecordings, WingSectionHasNonlinearPitchSprings) {
  UNRIG_NEEDS_SHARED("real/flutter_rig/free_decay_1.csv");
  DiagnoseProblem problem = recording("flutter_rig", "free_decay_1.csv");
  const auto [fitted, unseen] = parted(problem.runs.front(), 5);
  problem.runs = {fitted};
  problem.heldout = {unseen};
  problem.laws = false;  // effects of the list are asked for
  const Diagnosis d = diagnose(problem);
  EXPECT_THAT(d.missing, testing::IsEmpty());
  EXPECT_TRUE(d.unexplained);
  EXPECT_THAT(names(d.closest), IsSupersetOf({"twist-stiffness", "coulomb-friction"}));
  EXPECT_GT(d.removed_by_closest, 0.9);
  ASSERT_EQ(d.runs.size(), 3u);
  EXPECT_EQ(d.runs[1].channel, "pitch");
  EXPECT_GT(d.runs[1].rms_before, 10e-3);
  EXPECT_LT(d.runs[1].rms_after, 2.8e-3);
  EXPECT_TRUE(d.runs[2].heldout);
  EXPECT_LT(d.runs[2].rms_after, d.runs[2].rms_before);
}

}  // namespace
}  // namespace unrig
