#include "core/rig/default_errors.h"

#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Workshop practice, not a fit to any campaign. Elements are cut from drawings and weighed on shop scales, and glue, bolts and cables are left out: one per cent each. A whole that is weighed with
// one balance, or made of one material of tabled density, is off together: again one per cent. Chords and pitch axes are known to about a millimetre or two of 0.15 m.
constexpr double one_per_cent = 0.01;
// The centroid of a lumped element of a tapered or drilled piece: a few millimetres in a rig of a metre or two.
constexpr double of_length = 0.0025;
// Carriage speeds and handbook densities at a temperature that nobody took (water: 0.2 % in ten degrees) are good to one per cent. Clocks of loggers keep 0.01 %; rates that are written rounded, 0.1 %.
constexpr double of_clock = 0.001;

/// Numbers and deviations as they are listed.
class Usual {
 public:
  /// A number with an error of its own, of `std`; a zero is one by definition.
  void own(GivenNumber number, const std::string& name, const char* unit, double value, double std, Index row = -1) {
    if (value == 0) return;
    list(number, row < 0 ? name : fmt::format("{}[{}]", name, row + 1), unit, value, row);
    deviates(name, {{last(), std}});
  }
  void own(GivenNumber number, const std::string& name, const char* unit, const VectorXd& values, double std_of_length = 0) {
    for (Index k = 0; k < values.size(); ++k) own(number, name, unit, values[k], std_of_length > 0 ? std_of_length : one_per_cent * std::abs(values[k]), k);
  }
  /// The last so many numbers are off together, by one per cent of each.
  void common(const std::string& name, Index count) {
    std::vector<std::pair<Index, double>> parts;
    for (Index k = static_cast<Index>(numbers_.size()) - count; k <= last(); ++k) parts.emplace_back(k, one_per_cent * numbers_[static_cast<std::size_t>(k)].value);
    if (!parts.empty()) deviates(name, parts);
  }
  void own_and_common(GivenNumber number, const std::string& name, const char* unit, const VectorXd& values) {
    const std::size_t before = numbers_.size();
    own(number, name, unit, values);
    common(name, static_cast<Index>(numbers_.size() - before));
  }

  Givens givens() const {
    Givens all;
    all.numbers = numbers_;
    all.spread = MatrixXd::Zero(static_cast<Index>(numbers_.size()), static_cast<Index>(deviations_.size()));
    for (std::size_t k = 0; k < deviations_.size(); ++k)
      for (const auto& [row, std] : deviations_[k]) all.spread(row, static_cast<Index>(k)) = std;
    for (std::size_t i = 0; i < all.numbers.size(); ++i) all.numbers[i].std = all.spread.row(static_cast<Index>(i)).norm();
    all.group = groups_;
    all.common.assign(groups_.size(), true);
    return all;
  }

 private:
  Index last() const { return static_cast<Index>(numbers_.size()) - 1; }
  void list(GivenNumber number, const std::string& name, const char* unit, double value, Index row) { numbers_.push_back({number, row, -1, name, unit, value, 0}); }
  void deviates(const std::string& group, std::vector<std::pair<Index, double>> parts) {
    groups_.push_back(group);
    deviations_.push_back(std::move(parts));
  }

  std::vector<Given> numbers_;
  std::vector<std::string> groups_;
  std::vector<std::vector<std::pair<Index, double>>> deviations_;  // rows and standard deviations
};

}  // namespace

Givens usual_errors(const Rig& rig) {
  if (rig.is_modal()) return one_per_cent_of_everything(rig);
  Usual usual;
  usual.own_and_common(GivenNumber::mass, "normal.mass", "kg", rig.normal.inertia);
  usual.own_and_common(GivenNumber::inertia, "torsion.inertia", "kg.m^2", rig.torsion.inertia);
  usual.own(GivenNumber::station, "normal.station", "m", rig.station, of_length * rig.station.tail(1).sum());
  usual.own(GivenNumber::mass_centre, "normal.mass_centre", "m", rig.mass_centre);
  usual.own(GivenNumber::chord, "section.chord", "m", rig.chord, one_per_cent * rig.chord);
  usual.own(GivenNumber::pitch_axis, "section.pitch_axis", "1", rig.pitch_axis, one_per_cent * std::abs(rig.pitch_axis));
  usual.own(GivenNumber::strip_length, "submerged.strip_length", "m", rig.strip_length, one_per_cent * rig.strip_length);
  return usual.givens();
}

Givens usual_errors(const Run& run) {
  Usual usual;
  usual.own(GivenNumber::speed, "speed", "m/s", run.speed, one_per_cent * run.speed);
  usual.own(GivenNumber::density, "density", "kg/m^3", run.density, one_per_cent * run.density);
  if (run.find("gauge")) usual.own(GivenNumber::calibration, "calibration", "1", 1, one_per_cent);
  if (run.find("force")) usual.own(GivenNumber::force_calibration, "force_calibration", "1", 1, one_per_cent);
  usual.own(GivenNumber::clock, "clock", "1", 1, of_clock);
  return usual.givens();
}

}  // namespace unrig
