#include "core/rig/beam_flexibility.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A station that lies on the end of its element may miss it by the rounding of unit conversions.
constexpr double conversion_slack = 1e-9;

void require_positive(const VectorXd& values, const char* what) {
  for (Index k = 0; k < values.size(); ++k) {
    if (!(values[k] > 0)) throw std::invalid_argument(fmt::format("the {} of element {} is {}, not above zero", what, k + 1, values[k]));
  }
}

void check(const SteppedBeam& beam) {
  const Index count = beam.length.size();
  if (beam.stiffness.size() != count || beam.station.size() != count) {
    throw std::invalid_argument(fmt::format("{} lengths, {} stiffnesses and {} stations do not belong to the same elements", count,
                                            beam.stiffness.size(), beam.station.size()));
  }
  require_positive(beam.length, "length");
  require_positive(beam.stiffness, "stiffness");
  if (!(beam.clamp_rotation >= 0 && beam.clamp_translation >= 0)) throw std::invalid_argument("the compliance of the clamp is negative");
  double begin = 0;
  for (Index k = 0; k < count; ++k) {
    const double end = begin + beam.length[k];
    const double slack = conversion_slack * end;
    if (!(beam.station[k] >= begin - slack && beam.station[k] <= end + slack)) {
      throw std::invalid_argument(
          fmt::format("the station of element {}, {:.6g} m, lies outside the element, which reaches from {:.6g} to {:.6g} m", k + 1,
                      beam.station[k], begin, end));
    }
    begin = end;
  }
}

struct Deflection {
  double value;
  double slope;
};

/// Deflection and slope at distance `load` from the clamp under a unit force there, by marching outward over the elements. Where an
/// element begins, the bending moment is `arm`, the distance left to the load, and every term below is positive.
Deflection at_load(const SteppedBeam& beam, double load) {
  Deflection at{beam.clamp_translation, load * beam.clamp_rotation};
  double arm = load;
  for (Index k = 0; k < beam.length.size() && arm > 0; ++k) {
    const double h = std::min(beam.length[k], arm);
    at.value += at.slope * h + h * h * (arm / 2 - h / 6) / beam.stiffness[k];
    at.slope += h * (arm - h / 2) / beam.stiffness[k];
    arm -= h;
  }
  return at;
}

}  // namespace

MatrixXd bending_flexibility(const SteppedBeam& beam) {
  check(beam);
  const Index count = beam.station.size();
  MatrixXd flexibility(count, count);
  for (Index j = 0; j < count; ++j) {
    const Deflection loaded = at_load(beam, beam.station[j]);
    for (Index i = j; i < count; ++i) {
      // Outboard of the load the beam is straight; inboard Maxwell's reciprocity fills in.
      flexibility(i, j) = loaded.value + loaded.slope * (beam.station[i] - beam.station[j]);
      flexibility(j, i) = flexibility(i, j);
    }
  }
  return flexibility;
}

MatrixXd torsion_flexibility(const SteppedBeam& shaft) {
  check(shaft);
  const Index count = shaft.station.size();
  MatrixXd flexibility(count, count);
  double begin = 0;
  double twist_at_begin = shaft.clamp_rotation;
  for (Index j = 0; j < count; ++j) {
    // Outboard of the torque the shaft turns as a whole.
    const double twist = twist_at_begin + (shaft.station[j] - begin) / shaft.stiffness[j];
    flexibility.col(j).tail(count - j).setConstant(twist);
    flexibility.row(j).tail(count - j).setConstant(twist);
    twist_at_begin += shaft.length[j] / shaft.stiffness[j];
    begin += shaft.length[j];
  }
  return flexibility;
}

double circular_torsion_constant(double diameter) {
  if (!(diameter > 0)) throw std::invalid_argument(fmt::format("the diameter of a section is {} m, not above zero", diameter));
  return std::numbers::pi * std::pow(diameter, 4) / 32;
}

double rectangular_torsion_constant(double a, double b) {
  const auto [shorter, longer] = std::minmax(a, b);
  if (!(shorter > 0)) throw std::invalid_argument(fmt::format("a side of a section is {} m, not above zero", shorter));
  return rectangular_torsion_factor(longer / shorter) * std::pow(shorter, 3) * longer;
}

double rectangular_torsion_factor(double ratio) {
  if (!(ratio >= 1)) throw std::invalid_argument(fmt::format("the ratio {} of long to short side is below one", ratio));
  using std::numbers::pi;
  // tanh is 1 - 2/(exp + 1): the ones sum to 31/32 zeta(5), and what is left falls by exp(-2 pi) from term to term, so that seven reach
  // round-off.
  const double zeta5 = 1.0369277551433699263;
  double sum = 31.0 / 32 * zeta5;
  for (int n = 13; n >= 1; n -= 2) sum -= 2 / ((std::exp(n * pi * ratio) + 1) * std::pow(n, 5));
  return (1 - 192 / (std::pow(pi, 5) * ratio) * sum) / 3;
}

}  // namespace unrig
