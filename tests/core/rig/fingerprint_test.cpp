#include "core/rig/fingerprint.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/sample_data.h"

namespace unrig {
namespace {

TEST(Fingerprint, IsThatOfTheAlgorithm) {
  // By another implementation (Python's integers, the constants of the draft), over the same bytes: four doubles, the name and its end, two doubles.
  unrig::Run run;
  run.density = 998.2;
  run.speed = 0.6;
  run.dt = 0.002;
  run.channels.push_back({"gauge", "N", "N", 1, Eigen::Vector2d(1.5, -2)});
  EXPECT_EQ(fingerprint(run), "8842b77f0bd58441");
}

TEST(Fingerprint, TellsRecordingsApartAndNotTheirFiles) {
  const unrig::Run run = read_run(test::null_campaign("step_b.csv"));
  unrig::Run renamed = run, changed = run, faster = run, gap = run, other_gap = run;
  renamed.file = "elsewhere.csv";
  EXPECT_EQ(fingerprint(renamed), fingerprint(run));
  changed.channels.back().value[1234] *= 1 + 1e-15;
  EXPECT_NE(fingerprint(changed), fingerprint(run));
  faster.speed *= 1.01;
  EXPECT_NE(fingerprint(faster), fingerprint(run));
  gap.channels.back().value[7] = std::nan("");
  other_gap.channels.back().value[7] = -std::nan("1");
  EXPECT_NE(fingerprint(gap), fingerprint(run));
  EXPECT_EQ(fingerprint(gap), fingerprint(other_gap));
}

TEST(Fingerprint, OfATextIsThatOfTheAlgorithm) {
  // The draft's test vectors (section 6, FNV-1a of 64 bits).
  EXPECT_EQ(fingerprint(std::string_view("")), "cbf29ce484222325");
  EXPECT_EQ(fingerprint(std::string_view("a")), "af63dc4c8601ec8c");
  EXPECT_EQ(fingerprint(std::string_view("foobar")), "85944171f73967e8");
}

TEST(Fingerprint, ColumnsThatNothingReadsDoNotCount) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const unrig::Run run = read_run(test::null_campaign("step_b.csv"));
  unrig::Run warmer = run;
  warmer.channels.push_back({"temperature", "K", "K", 1, Eigen::VectorXd::Constant(run.samples(), 291)});
  EXPECT_NE(fingerprint(warmer), fingerprint(run));
  EXPECT_EQ(fingerprint(warmer, rig), fingerprint(run, rig));
  EXPECT_EQ(fingerprint(run, rig), fingerprint(run)) << "as an earlier version wrote it";
  Rig with_sensor = rig;
  with_sensor.sensors.push_back({.column = "temperature", .unit = {}});
  EXPECT_NE(fingerprint(warmer, with_sensor), fingerprint(run, with_sensor));
}

TEST(Fingerprint, OfARigKnowsEveryNumberOfItsModel) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const auto differs = [&](auto change) {
    Rig other = rig;
    change(other);
    return parts_that_differ(fingerprint(rig), fingerprint(other));
  };
  using Parts = std::vector<std::string>;
  EXPECT_EQ(differs([](Rig&) {}), Parts{});
  EXPECT_EQ(differs([](Rig& r) { r.chord *= 1.01; }), Parts{"section"});
  EXPECT_EQ(differs([](Rig& r) { r.pitch_axis += 1e-6; }), Parts{"section"});
  EXPECT_EQ(differs([](Rig& r) { r.station[3] += 1e-6; }), Parts{"normal"});
  EXPECT_EQ(differs([](Rig& r) { r.mass_centre[3] += 1e-6; }), Parts{"normal"});
  EXPECT_EQ(differs([](Rig& r) { r.normal.inertia[3] *= 1.0001; }), Parts{"normal"});
  EXPECT_EQ(differs([](Rig& r) { r.normal.flexibility(2, 3) *= 1.0001; }), Parts{"normal"});
  EXPECT_EQ(differs([](Rig& r) { r.torsion.inertia[1] *= 1.0001; }), Parts{"torsion"});
  EXPECT_EQ(differs([](Rig& r) { r.torsion.flexibility(0, 0) *= 1.0001; }), Parts{"torsion"});
  EXPECT_EQ(differs([](Rig& r) { r.strip_length *= 1.0001; }), Parts{"submerged"});
  EXPECT_EQ(differs([](Rig& r) { r.gauge_filters.push_back(first_order_low_pass(30)); }), Parts{"gauge"});
  EXPECT_EQ(differs([](Rig& r) { r.sensors.push_back({.column = "heave", .unit = {}}); }), Parts{"sensors"});
  EXPECT_EQ(differs([](Rig& r) { r.normal.modes += 1; }), Parts{"modes"});
  for (const auto& change : std::vector<void (*)(Rig&)>{[](Rig& r) { r.rigid_from -= 1; }, [](Rig& r) { r.submerged.pop_back(); }, [](Rig& r) { r.gauge_element += 1; }, [](Rig& r) { r.calibration_element -= 1; }})
    EXPECT_EQ(differs(change), Parts{"structure"});
  const Parts one_less = differs([](Rig& r) { r.normal.inertia.conservativeResize(r.normal.inertia.size() - 1); });
  EXPECT_EQ(one_less, (Parts{"structure", "normal"}));

  // What is no number of the model.
  EXPECT_EQ(differs([](Rig& r) {
              r.file = "elsewhere.toml";
              r.name = "another name";
              r.warnings = {"a warning"};
              r.calibration_uncertainty = 0.01;
              r.normal.flexibility_std = r.normal.flexibility;
            }),
            Parts{});
  // The last digits of what was given in other units.
  EXPECT_EQ(differs([](Rig& r) { r.chord = 0.3048 * (r.chord / 0.3048) * (1 + 2e-16); }), Parts{});
}

TEST(Fingerprint, OfModesKnowsEachOfTheirNumbers) {
  Rig rig;
  rig.modal.push_back({2, 5, 0.01, 1000, "N", {}});
  using Parts = std::vector<std::string>;
  for (double ModalMode::* number : {&ModalMode::mass, &ModalMode::frequency, &ModalMode::damping_ratio, &ModalMode::gauge_gain}) {
    Rig other = rig;
    other.modal[0].*number *= 1.001;
    EXPECT_EQ(parts_that_differ(fingerprint(rig), fingerprint(other)), Parts{"modal"});
  }
  Rig two = rig;
  two.modal.push_back(rig.modal[0]);
  EXPECT_EQ(parts_that_differ(fingerprint(rig), fingerprint(two)), (Parts{"structure", "modal"}));
  EXPECT_EQ(parts_that_differ(fingerprint(rig), "of another version"), Parts{"numbers"});
}

}  // namespace
}  // namespace unrig
