#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <variant>
#include <vector>

namespace unrig {

/// Properties of a TDMS object: numbers (timestamps and booleans too, as seconds and 0 or 1) and texts.
using TdmsProperties = std::map<std::string, std::variant<double, std::string>>;

const double* number_in(const TdmsProperties& properties, const std::string& name);
const std::string* text_in(const TdmsProperties& properties, const std::string& name);

/// A channel's values after the scales of its file.
struct TdmsScaled {
  std::vector<double> value;
  std::string raw;  ///< not empty: `value` are counts, and why
};

/// Follows the chain of scales (`NI_Number_Of_Scales`, `NI_Scale[i]_...`) that the properties describe: Linear, Polynomial, Table, Add, Subtract,
/// Strain (core/import/bridge.h) and AdvancedAPI, each with its `Input_Source`, from the last one back to the readings.
///
/// `raw`: readings by scaler id; DAQmx channels have one per raw scaler, all others have theirs under the id no_scaler. `integers`: the readings are
/// integers. Readings whose chain is missing or holds an unknown kind of scale are handed back as they are, with `raw` saying why. Integers without a
/// scale count as unscaled, and so does everything that `NI_Scaling_Status` calls so.
TdmsScaled scaled(const TdmsProperties& properties, std::map<std::uint32_t, std::vector<double>> raw, bool integers);

inline constexpr std::uint32_t no_scaler = 0xFFFFFFFF;

}  // namespace unrig
