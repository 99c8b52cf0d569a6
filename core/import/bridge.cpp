#include "core/import/bridge.h"

#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace unrig {
namespace {

constexpr std::array kind_names = {std::pair{"quarter-1", BridgeKind::quarter_1}, std::pair{"quarter-2", BridgeKind::quarter_2}, std::pair{"half-1", BridgeKind::half_1},
                              std::pair{"half-2", BridgeKind::half_2},       std::pair{"full-1", BridgeKind::full_1},       std::pair{"full-2", BridgeKind::full_2},
                              std::pair{"full-3", BridgeKind::full_3}};

bool is_full(BridgeKind kind) { return kind == BridgeKind::full_1 || kind == BridgeKind::full_2 || kind == BridgeKind::full_3; }

}  // namespace

double Bridge::strain(double volts) const {
  const double v = (volts - initial_voltage) / excitation, nu = poisson;
  const double lead = is_full(kind) || gauge_resistance == 0 ? 1 : 1 + lead_resistance / gauge_resistance;
  const double scale = shunt_gain * lead / gauge_factor;
  switch (kind) {
    case BridgeKind::quarter_1:
    case BridgeKind::quarter_2: return -4 * v / (1 + 2 * v) * scale;
    case BridgeKind::half_1: return -4 * v / ((1 + nu) - 2 * v * (nu - 1)) * scale;
    case BridgeKind::half_2: return -2 * v * scale;
    case BridgeKind::full_1: return -v * scale;
    case BridgeKind::full_2: return -2 * v / (nu + 1) * scale;
    case BridgeKind::full_3: return -2 * v / ((nu + 1) - v * (nu - 1)) * scale;
  }
  throw std::invalid_argument("no such bridge");
}

BridgeKind bridge_from_name(const std::string& name) {
  std::string choices;
  for (const auto& [known, kind] : kind_names) {
    if (name == known) return kind;
    choices += std::string(choices.empty() ? "" : ", ") + known;
  }
  throw std::invalid_argument("no bridge is called \"" + name + "\", but: " + choices);
}

std::string what_is_wrong(const Bridge& bridge) {
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (!positive(bridge.excitation)) return "the bridge's excitation is not positive";
  if (!positive(bridge.gauge_factor)) return "the gauge factor is not positive";
  if (!std::isfinite(bridge.poisson) || bridge.poisson < 0 || bridge.poisson > 0.5) return "Poisson's ratio is not between 0 and 0.5";
  if (!std::isfinite(bridge.initial_voltage)) return "the bridge's initial voltage is no number";
  if (bridge.lead_resistance < 0 || !std::isfinite(bridge.lead_resistance)) return "the lead's resistance is negative";
  if (bridge.lead_resistance > 0 && !positive(bridge.gauge_resistance)) return "the lead has a resistance but the gauge has none";
  if (!positive(bridge.shunt_gain)) return "the gain of the shunt calibration is not positive";
  return "";
}

}  // namespace unrig
