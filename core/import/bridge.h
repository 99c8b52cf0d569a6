#pragma once
#include <string>

namespace unrig {

/// How strain gauges stand in a Wheatstone bridge. The names are NI's and so is the count of active arms.
enum class BridgeKind { quarter_1, quarter_2, half_1, half_2, full_1, full_2, full_3 };

/// A strain-gauge bridge and how its voltage becomes strain. With V = (reading - initial) / excitation,
///
///     quarter I, II   -4 V / (GF (1 + 2 V))                         one active gauge; II with a dummy for temperature
///     half I          -4 V / (GF ((1 + nu) - 2 V (nu - 1)))         axial and transverse gauge
///     half II         -2 V / GF                                     two gauges in bending
///     full I          -V / GF                                       four in bending
///     full II         -2 V / (GF (nu + 1))                          bending, two of them transverse
///     full III        -2 V / (GF ((nu + 1) - V (nu - 1)))           axial, two of them transverse
///
/// times (1 + lead resistance / gauge resistance) for quarter and half bridges, whose leads carry the gauge's current, times the gain that a shunt
/// calibration found. Source: NI-DAQmx help, "Strain Gage Bridge Configurations"; the lead's part assumes three wires.
struct Bridge {
  BridgeKind kind = BridgeKind::full_1;
  double gauge_factor = 2;
  double poisson = 0;
  double excitation = 0;        ///< V
  double initial_voltage = 0;   ///< V, unstrained
  double gauge_resistance = 0;  ///< ohm; 0: the lead is not corrected for
  double lead_resistance = 0;   ///< ohm, of one wire
  double shunt_gain = 1;

  /// Strain for a reading in volts.
  double strain(double volts) const;
};

/// "quarter-1" ... "full-3". Throws std::invalid_argument naming the choices.
BridgeKind bridge_from_name(const std::string& name);

/// Why the bridge cannot scale anything (no excitation, no gauge factor ...); empty where it can.
std::string what_is_wrong(const Bridge& bridge);

}  // namespace unrig
