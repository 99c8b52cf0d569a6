#include "fit/search/modal_start.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "core/propagate/response.h"
#include "core/model/run_inputs.h"
#include "core/numerics/spectrum.h"
#include "fit/likelihood/modal_frequencies.h"
#include "fit/likelihood/run_linearised.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr Index most_samples = 16384;

/// Readings (missing ones 0, as their weights), weights, and what drives the modes.
struct Part {
  MatrixXd reading, weight;
  MatrixXd force, acceleration;  ///< one more row each; empty where the run has none
  double dt = 0;
};

Part part_of(const RunResidual& run) {
  const Index n = std::min(most_samples, run.run().samples());
  const auto channels = static_cast<Index>(run.channels().size());
  Part part{MatrixXd(n, channels), MatrixXd(n, channels), {}, {}, run.run().dt};
  for (Index c = 0; c < channels; ++c) {
    const auto which = static_cast<std::size_t>(c);
    part.reading.col(c) = run.run().channel(run.channels()[which]).value.head(n).unaryExpr([](double x) { return std::isfinite(x) ? x : 0.0; });
    part.weight.col(c) = run.channel_weight(which).head(n);
  }
  const MatrixXd inputs = run_inputs(run.run(), run.conditions()).topRows(n + 1);
  if (run.conditions().force) part.force = inputs.col(0);
  if (run.conditions().mount) part.acceleration = inputs.col(run.conditions().force ? 2 : 1);
  return part;
}

/// How many of its surroundings a line stands above, before it is one: noise averaged over three lines does so in one of 1e5.
constexpr double clearly = 6;

/// Local maxima of a spectrum that fall to a quarter on both sides before it rises above them, strongest over the floor first.
std::vector<Index> resonant_lines(const VectorXd& power) {
  const VectorXd floor = noise_floor(power, std::max<Index>(16, power.size() / 32));
  std::vector<Index> found;
  for (const Peak& peak : peaks_above(power, floor, clearly)) {
    const double fallen = 0.25 * power[peak.line];
    const auto stands_apart = [&](Index step) {
      for (Index k = peak.line + step; k >= 0 && k < power.size(); k += step) {
        if (power[k] > power[peak.line]) return false;
        if (power[k] < fallen) return true;
      }
      return true;
    };
    if (stands_apart(1) && stands_apart(-1)) found.push_back(peak.line);
  }
  std::sort(found.begin(), found.end(), [&](Index a, Index b) { return power[a] / floor[a] > power[b] / floor[b]; });
  return found;
}

VectorXd without_mean(const VectorXd& x) { return x.array() - x.mean(); }

/// Mean over a line and its neighbours.
template <class Vector>
Vector over_three(const Vector& x) {
  Vector mean = x;
  for (Index k = 1; k + 1 < x.size(); ++k) mean[k] = (x[k - 1] + x[k] + x[k + 1]) / 3.0;
  return mean;
}

/// Response of a mode of unit mass to an input, in every channel and one below the other; columns.
struct ModeColumns {
  MatrixXd by_force, by_mount, free;
};

/// Frequency and damping ratio of one mode, and how it is seen.
struct Attempt {
  double frequency = 0, damping_ratio = 0;
};

ModeColumns columns_of(const Attempt& trial, const RunResidual& run, const Part& part, std::size_t mode) {
  const double omega = 2 * pi * trial.frequency;
  const ModalMode& shape = run.model().rig().modal[mode];
  const auto& sensors = run.model().rig().sensors;
  const Index channels = part.reading.cols(), n = part.reading.rows();
  LinearSystem s;
  s.A = DualMatrix(MatrixXd{{0, 1}, {-omega * omega, -2 * trial.damping_ratio * omega}});
  s.B = DualMatrix(MatrixXd{{0}, {1}});
  s.C = DualMatrix(MatrixXd::Zero(channels, 2));
  s.D = DualMatrix(MatrixXd::Zero(channels, 1));
  s.coordinates = 1;
  for (Index c = 0; c < channels; ++c) {
    const auto sensor = std::find_if(sensors.begin(), sensors.end(), [&](const Sensor& a) { return a.column == run.channels()[static_cast<std::size_t>(c)]; });
    if (sensor == sensors.end()) {
      s.C.value(c, 0) = shape.gauge_gain;
      continue;
    }
    const double gain = sensor->gain * shape.sensor_shape[static_cast<std::size_t>(sensor - sensors.begin())];
    if (sensor->reads == SensorKind::displacement || sensor->reads == SensorKind::twist) s.C.value(c, 0) = gain;
    if (sensor->reads == SensorKind::velocity || sensor->reads == SensorKind::twist_rate) s.C.value(c, 1) = gain;
    if (sensor->reads == SensorKind::acceleration) s.C.value.row(c) = gain * s.A.value.row(1), s.D.value(c, 0) = gain;
  }
  const ExactStep step = exact_step(s, part.dt);
  const DualMatrix rest(MatrixXd::Zero(2, 1));
  ModeColumns columns;
  if (part.force.size() > 0) columns.by_force = drive(s, step, rest, n, {}, part.force, Partials::none).output.reshaped();
  if (part.acceleration.size() > 0) columns.by_mount = -drive(s, step, rest, n, {}, part.acceleration, Partials::none).output.reshaped();
  columns.free.resize(n * channels, 2);
  const std::vector<MatrixXd> free = free_response_rows(s, step, n);
  for (Index c = 0; c < channels; ++c) columns.free.middleRows(c * n, n) = free[static_cast<std::size_t>(c)];
  return columns;
}

/// What least squares over all runs leaves: what of the readings is left, and 1/m and g/m of every mode (0 where no run tells).
struct Fitted {
  double left = 0;
  VectorXd per_mass, participation_per_mass;
};

class ModalLeastSquares {
 public:
  explicit ModalLeastSquares(const JointProblem& joint) : joint_(joint) {
    for (const RunResidual& run : joint.runs()) parts_.push_back(part_of(run));
    for (const Part& part : parts_) forced_ |= part.force.size() > 0, moved_ |= part.acceleration.size() > 0;
  }

  Fitted fit(const std::vector<Attempt>& trials) const {
    const auto modes = static_cast<Index>(trials.size()), shared = (forced_ ? modes : 0) + (moved_ ? modes : 0);
    std::vector<MatrixXd> rows;
    for (std::size_t r = 0; r < parts_.size(); ++r) rows.push_back(rows_of(r, trials, shared));
    const MatrixXd all = run_rows::stacked(rows, shared + 1);
    const run_rows::Eliminator eliminate(all.leftCols(shared));
    const MatrixXd rotated = eliminate.rotated(all.rightCols(1));
    const VectorXd found = eliminate.solve(rotated);
    Fitted fitted;
    fitted.left = rotated.bottomRows(rotated.rows() - eliminate.rank()).squaredNorm();
    fitted.per_mass = forced_ ? VectorXd(found.head(modes)) : VectorXd(VectorXd::Zero(modes));
    fitted.participation_per_mass = moved_ ? VectorXd(found.tail(modes)) : VectorXd(VectorXd::Zero(modes));
    return fitted;
  }

 private:
  /// [what all runs share | reading], without what the run's own initial state and offsets can take.
  MatrixXd rows_of(std::size_t r, const std::vector<Attempt>& trials, Index shared) const {
    const Part& part = parts_[r];
    const auto modes = static_cast<Index>(trials.size());
    const Index n = part.reading.rows(), channels = part.reading.cols(), own = 2 * modes + channels;
    MatrixXd rows = MatrixXd::Zero(n * channels, own + shared + 1);
    for (Index i = 0; i < modes; ++i) {
      const ModeColumns columns = columns_of(trials[static_cast<std::size_t>(i)], joint_.runs()[r], part, static_cast<std::size_t>(i));
      rows.middleCols(2 * i, 2) = columns.free;
      if (columns.by_force.size() > 0) rows.col(own + i) = columns.by_force;
      if (columns.by_mount.size() > 0) rows.col(own + shared - modes + i) = columns.by_mount;
    }
    for (Index c = 0; c < channels; ++c) rows.col(2 * modes + c).segment(c * n, n).setOnes();
    rows.col(own + shared) = part.reading.reshaped();
    rows = part.weight.reshaped().asDiagonal() * rows;
    const run_rows::Eliminator eliminate(rows.leftCols(own));
    const MatrixXd rotated = eliminate.rotated(rows.rightCols(shared + 1));
    return rotated.bottomRows(rotated.rows() - eliminate.rank());
  }

  const JointProblem& joint_;
  std::vector<Part> parts_;
  bool forced_ = false, moved_ = false;
};

bool ascending_like(const std::vector<Attempt>& trials, const std::vector<ModalMode>& file) {
  for (std::size_t a = 0; a < trials.size(); ++a)
    for (std::size_t b = 0; b < trials.size(); ++b)
      if (file[a].frequency < file[b].frequency && !(trials[a].frequency < trials[b].frequency)) return false;
  return true;
}

}  // namespace

std::vector<double> resonances(const RunResidual& run) {
  const Part part = part_of(run);
  const Index padded = 2 * part.reading.rows();
  VectorXd power;
  for (Index c = 0; c < part.reading.cols(); ++c) {
    const VectorXcd out = fourier(without_mean(part.reading.col(c)), padded);
    VectorXd response = over_three(VectorXd(out.cwiseAbs2()));
    if (const MatrixXd& input = part.force.size() > 0 ? part.force : part.acceleration; input.size() > 0) {
      const VectorXcd in = fourier(without_mean(input.col(0).head(part.reading.rows())), padded);
      const VectorXd driven = over_three(VectorXd(in.cwiseAbs2()));
      constexpr double hardly = 1e-4;  // of the strongest line: what is hardly driven does not respond either
      response = over_three(VectorXcd(out.cwiseProduct(in.conjugate()))).cwiseAbs2().cwiseQuotient((driven.array() + hardly * driven.maxCoeff()).square().matrix());
    }
    if (power.size() == 0) power = VectorXd::Zero(response.size());
    power += response / std::max(1e-300, response.sum());
  }
  std::vector<double> found;
  for (const Index line : resonant_lines(power)) found.push_back(static_cast<double>(line) / (part.dt * static_cast<double>(padded)));
  return found;
}

bool start_modes_from_spectra(JointProblem& joint) {
  const AeroelasticModel& model = joint.model();
  const std::vector<ModalMode>& file = model.rig().modal;
  const VectorXd theta = joint.theta(0);
  const auto unknown = [&](Index parameter) -> Unknown& { return *std::find_if(joint.unknowns().begin(), joint.unknowns().end(), [&](const Unknown& u) { return u.parameter == parameter; }); };
  std::vector<double> lines;
  constexpr std::size_t some = 8;
  for (const RunResidual& run : joint.runs()) {
    const std::vector<double> of_run = resonances(run);
    lines.insert(lines.end(), of_run.begin(), of_run.begin() + static_cast<std::ptrdiff_t>(std::min(of_run.size(), some)));
  }
  std::vector<Attempt> best(file.size());
  for (std::size_t i = 0; i < file.size(); ++i) {
    const ModalPlace p = place_of_mode(model, i);
    best[i] = {modal_frequency(model, theta, i), theta[p.damping] / (2 * std::sqrt(theta[p.mass] * theta[p.stiffness]))};
  }
  const ModalLeastSquares modes(joint);
  double least = modes.fit(best).left;
  const double before = least;
  const auto consider = [&](std::size_t i, const Attempt& trial) {
    std::vector<Attempt> other = best;
    other[i] = trial;
    if (!ascending_like(other, file)) return false;
    const double left = modes.fit(other).left;
    if (!(left < least)) return false;
    least = left;
    best = other;
    return true;
  };
  constexpr int passes = 4;
  constexpr double reach = 1.5, factor = 3;
  bool any = true;
  for (int pass = 0; pass < passes && any; ++pass) {
    any = false;
    for (std::size_t i = 0; i < file.size(); ++i) {
      const ModalPlace p = place_of_mode(model, i);
      if (!unknown(p.stiffness).held)
        for (const double line : lines)
          if (line > file[i].frequency / reach && line < file[i].frequency * reach) any |= consider(i, {line, best[i].damping_ratio});
      if (!unknown(p.damping).held && pass < 2)
        for (const double times : {1 / factor, factor}) any |= consider(i, {best[i].frequency, std::min(0.9, times * best[i].damping_ratio)});
    }
  }
  if (!(least < before)) return false;
  const Fitted fitted = modes.fit(best);
  for (std::size_t i = 0; i < file.size(); ++i) {
    const ModalPlace p = place_of_mode(model, i);
    const auto set = [&](Index parameter, double value) {
      Unknown& u = unknown(parameter);
      const Parameter& bounds = joint.parameter(u);
      if (!u.held && std::isfinite(value)) u.value = std::clamp(value, bounds.lower, bounds.upper);
    };
    const auto mode = static_cast<Index>(i);
    if (fitted.per_mass[mode] > 0) set(p.mass, 1 / fitted.per_mass[mode]);
    const double mass = unknown(p.mass).value, omega = 2 * pi * best[i].frequency;
    set(p.stiffness, mass * omega * omega);
    set(p.damping, 2 * best[i].damping_ratio * mass * omega);
    if (fitted.participation_per_mass[mode] != 0) set(p.participation, fitted.participation_per_mass[mode] * mass);
  }
  return true;
}

}  // namespace unrig
