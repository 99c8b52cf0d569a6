#include "core/import/tdms_scaling.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "core/import/bridge.h"

namespace unrig {
namespace {

using Values = std::vector<double>;
using RawValues = std::map<std::uint32_t, Values>;

/// Why a chain cannot be followed.
class NoScale : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The properties of one scale.
class Scale {
 public:
  Scale(const TdmsProperties& properties, std::uint32_t index) : properties_(&properties), prefix_(fmt::format("NI_Scale[{}]_", index)) {}

  std::string kind() const {
    const std::string* kind = text_in(*properties_, prefix_ + "Scale_Type");
    if (!kind) throw NoScale(prefix_ + "Scale_Type is missing");
    return *kind;
  }
  double number(const std::string& name) const {
    const double* found = number_in(*properties_, prefix_ + name);
    if (!found) throw NoScale(prefix_ + name + " is missing");
    return *found;
  }
  double number_or(const std::string& name, double otherwise) const {
    const double* found = number_in(*properties_, prefix_ + name);
    return found ? *found : otherwise;
  }
  std::vector<double> numbers(const std::string& name, double otherwise_count) const {
    const double count = number_or(name + "_Size", otherwise_count);
    if (!(count >= 0 && count < 100000)) throw NoScale(prefix_ + name + " has a senseless size");
    std::vector<double> values;
    for (int i = 0; i < static_cast<int>(count); ++i) values.push_back(number(fmt::format("{}[{}]", name, i)));
    return values;
  }
  /// The scale that this one works on; readings where it does not say.
  std::uint32_t source(const std::string& name) const {
    const double found = number_or(name, no_scaler);
    if (!(found >= 0 && found <= no_scaler)) throw NoScale(prefix_ + name + " has a senseless value");
    return static_cast<std::uint32_t>(found);
  }

 private:
  const TdmsProperties* properties_;
  std::string prefix_;
};

double polynomial(const std::vector<double>& coefficients, double x) {
  double sum = 0;
  for (std::size_t i = coefficients.size(); i-- > 0;) sum = sum * x + coefficients[i];
  return sum;
}

/// Straight lines between the points; the end values beyond.
double interpolated(const std::vector<double>& from, const std::vector<double>& to, double x) {
  const auto above = std::upper_bound(from.begin(), from.end(), x);
  if (above == from.begin()) return to.front();
  if (above == from.end()) return to.back();
  const auto i = static_cast<std::size_t>(above - from.begin());
  return to[i - 1] + (to[i] - to[i - 1]) * (x - from[i - 1]) / (from[i] - from[i - 1]);
}

BridgeKind kind_of(double configuration) {
  switch (static_cast<int>(configuration)) {  // the numbers of NI-DAQmx
    case 10183: return BridgeKind::full_1;
    case 10184: return BridgeKind::full_2;
    case 10185: return BridgeKind::full_3;
    case 10188: return BridgeKind::half_1;
    case 10189: return BridgeKind::half_2;
    case 10271: return BridgeKind::quarter_1;
    case 10272: return BridgeKind::quarter_2;
    default: throw NoScale(fmt::format("strain configuration {:.6g} is unknown", configuration));
  }
}

Bridge bridge_of(const Scale& scale) {
  const Bridge bridge{kind_of(scale.number("Strain_Configuration")),
                      scale.number("Strain_Gage_Factor"),
                      scale.number_or("Strain_Poisson_Ratio", 0),
                      scale.number("Strain_Voltage_Excitation"),
                      scale.number_or("Strain_Initial_Bridge_Voltage", 0),
                      scale.number_or("Strain_Gage_Resistance", 0),
                      scale.number_or("Strain_Lead_Wire_Resistance", 0),
                      scale.number_or("Strain_Bridge_Shunt_Calibration_Gain_Adjustment", 1)};
  if (const std::string wrong = what_is_wrong(bridge); !wrong.empty()) throw NoScale(wrong);
  return bridge;
}

class ScalingChain {
 public:
  ScalingChain(const TdmsProperties& properties, const RawValues& raw) : properties_(&properties), raw_(&raw) {}

  /// What stands behind the scale `index`. `depth` ends circles, and chains in which every scale is worked out twice over.
  Values after(std::uint32_t index, int depth = 0) const {
    if (const auto found = raw_->find(index); found != raw_->end()) return found->second;
    if (index == no_scaler) {
      if (raw_->size() == 1) return raw_->begin()->second;
      throw NoScale("it is not said which of several raw scalers is meant");
    }
    if (depth > 16) throw NoScale("the scales go round in a circle");
    const Scale scale(*properties_, index);
    const std::string kind = scale.kind();
    if (kind == "AdvancedAPI") return after(no_scaler, depth + 1);
    if (kind == "Add" || kind == "Subtract") return combined(scale, kind, depth);
    Values values;
    const auto each = [&](const std::string& prefix, const auto& map) {
      values = after(scale.source(prefix + "_Input_Source"), depth + 1);
      for (double& x : values) x = map(x);
      return values;
    };
    if (kind == "Linear") return each(kind, [slope = scale.number("Linear_Slope"), at_zero = scale.number("Linear_Y_Intercept")](double x) { return slope * x + at_zero; });
    if (kind == "Polynomial") return each(kind, [c = scale.numbers("Polynomial_Coefficients", 4)](double x) { return polynomial(c, x); });
    if (kind == "Strain") return each(kind, [bridge = bridge_of(scale)](double x) { return bridge.strain(x); });
    if (kind == "Table") {
      const Values from = scale.numbers("Table_Scaled_Values", 0), to = scale.numbers("Table_Pre_Scaled_Values", 0);  // NI's names for input and output
      if (from.size() < 2 || from.size() != to.size() || std::adjacent_find(from.begin(), from.end(), std::greater_equal<>()) != from.end())
        throw NoScale("a table scale has no increasing points");
      return each(kind, [&](double x) { return interpolated(from, to, x); });
    }
    throw NoScale("scales of the kind \"" + kind + "\" are not known here");
  }

 private:
  Values combined(const Scale& scale, const std::string& kind, int depth) const {
    const Values left = after(scale.source(kind + "_Left_Operand_Input_Source"), depth + 8), right = after(scale.source(kind + "_Right_Operand_Input_Source"), depth + 8);
    if (left.size() != right.size()) throw NoScale("operands of a scale differ in length");
    Values out(left.size());
    // LabVIEW subtracts the left operand from the right one.
    for (std::size_t k = 0; k < out.size(); ++k) out[k] = kind == "Add" ? left[k] + right[k] : right[k] - left[k];
    return out;
  }

  const TdmsProperties* properties_;
  const RawValues* raw_;
};

}  // namespace

const double* number_in(const TdmsProperties& properties, const std::string& name) {
  const auto found = properties.find(name);
  return found == properties.end() ? nullptr : std::get_if<double>(&found->second);
}

const std::string* text_in(const TdmsProperties& properties, const std::string& name) {
  const auto found = properties.find(name);
  return found == properties.end() ? nullptr : std::get_if<std::string>(&found->second);
}

TdmsScaled scaled(const TdmsProperties& properties, RawValues raw, bool integers) {
  const std::string* status = text_in(properties, "NI_Scaling_Status");
  const double* count = number_in(properties, "NI_Number_Of_Scales");
  const bool daqmx = !raw.empty() && raw.begin()->first != no_scaler;
  const auto unscaled = [&](const std::string& why) { return TdmsScaled{raw.empty() ? Values() : raw.begin()->second, why}; };
  if (status && *status == "scaled" && !daqmx) return unscaled("");
  if (!count || !(*count >= 1)) {
    if (daqmx || integers || (status && *status == "unscaled")) return unscaled("the file gives readings of the converter and no scale");
    return unscaled("");
  }
  if (!(*count < 10000)) return unscaled("the file gives a senseless number of scales");
  try {
    return {ScalingChain(properties, raw).after(static_cast<std::uint32_t>(*count) - 1), ""};
  } catch (const NoScale& e) {
    return unscaled(e.what());
  }
}

}  // namespace unrig
