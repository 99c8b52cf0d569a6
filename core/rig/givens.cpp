#include "core/rig/givens.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Adds to one entry, or to all where `row` is -1.
void add(VectorXd& values, Index row, double off) {
  if (row < 0) values.array() += off;
  else values[row] += off;
}

void scale(VectorXd& values, Index row, double factor) {
  if (row < 0) values *= factor;
  else values[row] *= factor;
}

void add_symmetric(MatrixXd& values, Index row, Index column, double off) {
  values(row, column) += off;
  if (row != column) values(column, row) += off;
}

/// A spring's compliance once its stiffness is another.
double compliance(double stiffness, double off) { return 1 / (stiffness + off); }

/// A chain whose numbers are being changed: its drawing, where it has one.
struct Drawings {
  std::optional<SteppedBeam> normal, torsion;
};

void move_modal(ModalMode& mode, GivenNumber number, double off) {
  if (number == GivenNumber::modal_mass) mode.mass += off;
  else if (number == GivenNumber::modal_frequency) mode.frequency += off;
  else if (number == GivenNumber::modal_damping_ratio) mode.damping_ratio += off;
  else mode.gauge_gain += off;
}

void move(const Given& given, double off, const Givens& givens, Drawings& drawn, Rig& rig) {
  const Index row = given.row;
  const double factor = 1 + off / given.value;
  switch (given.number) {
    case GivenNumber::chord: rig.chord += off; break;
    case GivenNumber::pitch_axis: rig.pitch_axis += off; break;
    case GivenNumber::strip_length: rig.strip_length += off; break;
    case GivenNumber::station:
      add(rig.station, row, off);
      if (drawn.normal) add(drawn.normal->station, row, off);
      if (drawn.torsion && !givens.torsion_has_station && row < drawn.torsion->station.size()) add(drawn.torsion->station, row, off);
      break;
    case GivenNumber::mass: add(rig.normal.inertia, row, off); break;
    case GivenNumber::mass_centre: add(rig.mass_centre, row, off); break;
    case GivenNumber::inertia: add(rig.torsion.inertia, row, off); break;
    case GivenNumber::normal_flexibility: row < 0 ? void(rig.normal.flexibility *= factor) : add_symmetric(rig.normal.flexibility, row, given.column, off); break;
    case GivenNumber::torsion_flexibility: row < 0 ? void(rig.torsion.flexibility *= factor) : add_symmetric(rig.torsion.flexibility, row, given.column, off); break;
    case GivenNumber::normal_length:
      add(drawn.normal->length, row, off);
      if (drawn.torsion && !givens.torsion_has_length && row < drawn.torsion->length.size()) add(drawn.torsion->length, row, off);
      break;
    case GivenNumber::youngs_modulus:
    case GivenNumber::second_moment: scale(drawn.normal->stiffness, row, factor); break;
    case GivenNumber::normal_clamp_spring: drawn.normal->clamp_rotation = compliance(given.value, off); break;
    case GivenNumber::clamp_translation: drawn.normal->clamp_translation = compliance(given.value, off); break;
    case GivenNumber::torsion_station: add(drawn.torsion->station, row, off); break;
    case GivenNumber::torsion_length: add(drawn.torsion->length, row, off); break;
    case GivenNumber::shear_modulus:
    case GivenNumber::polar_moment: scale(drawn.torsion->stiffness, row, factor); break;
    case GivenNumber::torsion_clamp_spring: drawn.torsion->clamp_rotation = compliance(given.value, off); break;
    case GivenNumber::modal_mass:
    case GivenNumber::modal_frequency:
    case GivenNumber::modal_damping_ratio:
    case GivenNumber::modal_gauge_gain: move_modal(rig.modal[static_cast<std::size_t>(row)], given.number, off); break;
    default: break;  // of a run
  }
}

/// Refuses what no rig is.
void check(const Rig& rig) {
  const auto refuse_unless = [](bool good, const char* what) {
    if (!good) throw std::invalid_argument(what);
  };
  if (rig.is_modal()) {
    for (const ModalMode& mode : rig.modal) refuse_unless(mode.mass > 0 && mode.frequency > 0 && mode.damping_ratio >= 0 && mode.gauge_gain != 0, "a mode without mass, frequency or gain");
    return;
  }
  refuse_unless(rig.chord > 0 && rig.strip_length > 0, "a section without chord or length");
  refuse_unless((rig.normal.inertia.array() > 0).all() && (rig.torsion.inertia.array() > 0).all(), "a mass that is not positive");
  refuse_unless((rig.normal.flexibility.diagonal().array() > 0).all() && (rig.torsion.flexibility.diagonal().array() > 0).all(), "a flexibility that is not positive");
  for (Index k = 1; k < rig.station.size(); ++k) refuse_unless(rig.station[k] > rig.station[k - 1], "stations that do not increase");
}

void scale_column(Run& run, const char* name, double factor) {
  for (Channel& channel : run.channels)
    if (channel.name == name) channel.value *= factor, channel.factor *= factor;
}

/// A group of numbers that one relative error moves.
class Groups {
 public:
  void add(GivenNumber number, const std::string& name, const char* unit, double value, Index row = -1) {
    if (value == 0) return;
    if (group_of_last_ != name) group_.push_back(name), group_of_last_ = name;
    numbers_.push_back({number, row, -1, row < 0 ? name : fmt::format("{}[{}]", name, row + 1), unit, value, 0.01 * std::abs(value)});
    place_.push_back(static_cast<Index>(group_.size()) - 1);
  }
  void add(GivenNumber number, const std::string& name, const char* unit, const VectorXd& values) {
    for (Index k = 0; k < values.size(); ++k) add(number, name, unit, values[k], k);
  }
  Givens givens() {
    Givens all;
    all.spread = MatrixXd::Zero(static_cast<Index>(numbers_.size()), static_cast<Index>(group_.size()));
    for (std::size_t i = 0; i < numbers_.size(); ++i) all.spread(static_cast<Index>(i), place_[i]) = 0.01 * numbers_[i].value;
    all.numbers = std::move(numbers_);
    all.common.assign(group_.size(), true);
    all.group = std::move(group_);
    return all;
  }

 private:
  std::vector<Given> numbers_;
  std::vector<Index> place_;
  std::vector<std::string> group_;
  std::string group_of_last_;
};

}  // namespace

Rig with_errors(const Rig& rig, const VectorXd& off) {
  if (!rig.givens || off.isZero(0)) return rig;
  const Givens& givens = *rig.givens;
  Rig moved = rig;
  Drawings drawn{givens.normal_beam, givens.torsion_beam};
  for (std::size_t i = 0; i < givens.numbers.size(); ++i)
    if (const double by = off[static_cast<Index>(i)]; by != 0) move(givens.numbers[i], by, givens, drawn, moved);
  if (drawn.normal) moved.normal.flexibility = bending_flexibility(*drawn.normal);
  if (drawn.torsion) moved.torsion.flexibility = torsion_flexibility(*drawn.torsion);
  check(moved);
  return moved;
}

Run with_errors(const Run& run, const VectorXd& off) {
  if (!run.givens || off.isZero(0)) return run;
  Run moved = run;
  for (std::size_t i = 0; i < run.givens->numbers.size(); ++i) {
    const Given& given = run.givens->numbers[i];
    const double by = off[static_cast<Index>(i)], factor = 1 + by / given.value;
    if (!(factor > 0)) throw std::invalid_argument("a " + given.name + " that is not positive");
    switch (given.number) {
      case GivenNumber::speed: moved.speed += by; break;
      case GivenNumber::density: moved.density += by; break;
      case GivenNumber::calibration: scale_column(moved, "gauge", factor); break;
      case GivenNumber::force_calibration: scale_column(moved, "force", factor); break;
      case GivenNumber::clock:
        moved.dt *= factor;
        moved.start *= factor;
        break;
      default: break;
    }
  }
  return moved;
}

Givens one_per_cent_of_everything(const Rig& rig) {
  Groups groups;
  if (rig.is_modal()) {
    for (std::size_t m = 0; m < rig.modal.size(); ++m) groups.add(GivenNumber::modal_gauge_gain, "modal.gauge_gain", "", rig.modal[m].gauge_gain, static_cast<Index>(m));
    return groups.givens();
  }
  groups.add(GivenNumber::mass, "normal.mass", "kg", rig.normal.inertia);
  groups.add(GivenNumber::station, "normal.station", "m", rig.station);
  groups.add(GivenNumber::mass_centre, "normal.mass_centre", "m", rig.mass_centre);
  groups.add(GivenNumber::normal_flexibility, "normal.flexibility", "m/N", 1);
  groups.add(GivenNumber::inertia, "torsion.inertia", "kg.m^2", rig.torsion.inertia);
  groups.add(GivenNumber::torsion_flexibility, "torsion.flexibility", "rad/(N.m)", 1);
  groups.add(GivenNumber::chord, "section.chord", "m", rig.chord);
  groups.add(GivenNumber::pitch_axis, "section.pitch_axis", "1", rig.pitch_axis);
  groups.add(GivenNumber::strip_length, "submerged.strip_length", "m", rig.strip_length);
  return groups.givens();
}

Givens one_per_cent_of_everything(const Run& run) {
  Groups groups;
  groups.add(GivenNumber::speed, "speed", "m/s", run.speed);
  groups.add(GivenNumber::density, "density", "kg/m^3", run.density);
  if (run.find("gauge")) groups.add(GivenNumber::calibration, "calibration", "1", 1);
  if (run.find("force")) groups.add(GivenNumber::force_calibration, "force_calibration", "1", 1);
  groups.add(GivenNumber::clock, "clock", "1", 1);
  return groups.givens();
}

}  // namespace unrig
