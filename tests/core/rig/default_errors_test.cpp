#include "core/rig/default_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

double std_of(const Givens& givens, const std::string& name) {
  for (const Given& g : givens.numbers)
    if (g.name == name) return g.std;
  return NAN;
}

TEST(DefaultErrors, MassesAreOffEachByItselfAndTogether) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const Givens usual = usual_errors(rig);
  EXPECT_NEAR(std_of(usual, "normal.mass[13]"), std::hypot(0.01, 0.01) * rig.normal.inertia[12], 1e-12);
  EXPECT_NEAR(std_of(usual, "normal.station[2]"), 0.0025 * rig.station[rig.station.size() - 1], 1e-12);
  EXPECT_NEAR(std_of(usual, "section.chord"), 0.01 * rig.chord, 1e-12);
  EXPECT_TRUE(std::isnan(std_of(usual, "normal.mass_centre[1]")));  // 0: on the axis by definition
  for (std::size_t i = 0; i < usual.numbers.size(); ++i) EXPECT_NEAR(usual.spread.row(static_cast<Eigen::Index>(i)).norm(), usual.numbers[i].std, 1e-12);
  // One standard deviation of what all masses share moves every mass by one per cent.
  Rig stated = rig;
  stated.givens = std::make_shared<const Givens>(usual);
  const Eigen::Index common = rig.normal.inertia.size();
  const Rig moved = with_errors(stated, usual.spread.col(common));
  EXPECT_TRUE(moved.normal.inertia.isApprox(1.01 * rig.normal.inertia, 1e-12));
  EXPECT_EQ(moved.torsion.inertia, rig.torsion.inertia);
}

TEST(DefaultErrors, HeadsOfRunsAreOffTogether) {
  const unrig::Run step = read_run(test::null_campaign("step_a.csv")), pluck = read_run(test::null_campaign("dry_pluck.csv"));
  const Givens usual = usual_errors(step);
  EXPECT_NEAR(std_of(usual, "speed"), 0.01 * step.speed, 1e-12);
  EXPECT_NEAR(std_of(usual, "clock"), 0.001, 1e-12);
  for (const bool common : usual.common) EXPECT_TRUE(common);
  EXPECT_TRUE(std::isnan(std_of(usual_errors(pluck), "speed")));  // at rest
}

}  // namespace
}  // namespace unrig
