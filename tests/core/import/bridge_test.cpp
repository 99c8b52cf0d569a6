// Voltage to strain, against the bridges themselves: four resistors in a Wheatstone bridge, solved as a circuit.

#include "core/import/bridge.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace unrig {
namespace {

/// Output over excitation of a bridge whose arms have changed by these fractions, in NI's order: 1 and 2 on the left from plus to minus, 4 and 3 on the
/// right.
double ratio(double d1, double d2, double d3, double d4) { return (1 + d3) / (2 + d3 + d4) - (1 + d2) / (2 + d1 + d2); }

TEST(Bridge, FindsTheStrainThatWasPutIntoTheCircuit) {
  const double strain = 1.5e-3, nu = 0.3, factor = 2.1, excitation = 2.5, zero = 0.4e-3;
  const double s = factor * strain;  // relative change of resistance
  const struct {
    BridgeKind kind;
    double ratio;
  } circuits[] = {
      {BridgeKind::quarter_1, ratio(0, 0, 0, s)},       {BridgeKind::quarter_2, ratio(0, 0, 0, s)},       {BridgeKind::half_1, ratio(0, 0, -nu * s, s)},
      {BridgeKind::half_2, ratio(0, 0, -s, s)},         {BridgeKind::full_1, ratio(-s, s, -s, s)},        {BridgeKind::full_2, ratio(-nu * s, nu * s, -s, s)},
      {BridgeKind::full_3, ratio(-nu * s, s, -nu * s, s)},
  };
  for (const auto& circuit : circuits) {
    Bridge bridge{circuit.kind, factor, nu, excitation, zero};
    EXPECT_NEAR(bridge.strain(circuit.ratio * excitation + zero) / strain, 1, 1e-12) << static_cast<int>(circuit.kind);
  }
}

TEST(Bridge, CorrectsForLeadAndShuntWhereTheyMatter) {
  Bridge bridge{BridgeKind::quarter_1, 2.1, 0.3, 2.5, 0, 350};
  const double plain = bridge.strain(0.005);
  bridge.lead_resistance = 3.5;
  EXPECT_DOUBLE_EQ(bridge.strain(0.005), plain * 1.01);
  bridge.shunt_gain = 1.1;
  EXPECT_DOUBLE_EQ(bridge.strain(0.005), plain * 1.01 * 1.1);
  bridge.kind = BridgeKind::full_1;
  EXPECT_DOUBLE_EQ(bridge.strain(0.005), -0.005 / 2.5 / 2.1 * 1.1);  // its leads feed the whole bridge
}

TEST(Bridge, SaysWhatIsWrong) {
  EXPECT_EQ(what_is_wrong({BridgeKind::full_1, 2, 0, 5}), "");
  EXPECT_NE(what_is_wrong({BridgeKind::full_1, 2, 0, 0}), "");
  EXPECT_NE(what_is_wrong({BridgeKind::full_1, 0, 0, 5}), "");
  EXPECT_NE(what_is_wrong({BridgeKind::full_1, 2, 0.7, 5}), "");
  EXPECT_NE(what_is_wrong({BridgeKind::quarter_1, 2, 0, 5, 0, 0, 1}), "");
  EXPECT_EQ(bridge_from_name("half-2"), BridgeKind::half_2);
  EXPECT_THROW(bridge_from_name("half"), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
