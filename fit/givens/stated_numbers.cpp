#include "fit/givens/stated_numbers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "core/rig/gauge_lever.h"
#include "core/numerics/in_parallel.h"
#include "fit/fit_description.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The same rig with a gauge that reads so many times as much.
void amplify(Rig& rig, double gain) {
  for (ModalMode& mode : rig.modal) mode.gauge_gain *= gain;
  if (rig.is_modal()) return;
  GaugeFilter amplifier{DualMatrix(MatrixXd(0, 0)), DualMatrix(MatrixXd(0, 1)), Eigen::RowVectorXd(0), gain};
  rig.gauge_filters.push_back(std::move(amplifier));
}

/// A run at other numbers: all weighted residuals, channel by channel, and its first offset in units of the load that it is converted to.
struct Moved {
  MatrixXd residual;  ///< samples x channels, the angle last
  double offset = 0;
};

VectorXd weighted(const VectorXd& weight, const VectorXd& measured, const VectorXd& predicted) {
  VectorXd left(weight.size());
  for (Index k = 0; k < left.size(); ++k) left[k] = weight[k] > 0 && std::isfinite(measured[k]) ? weight[k] * (measured[k] - predicted[k]) : 0;
  return left;
}

Moved look_at(const RunResidual& run, const VectorXd& theta, double gauge_factor) {
  const RunResidual::Prediction p = run.predict(theta);
  const bool with_angle = p.angle_offset.size() > 0;
  const auto channels = static_cast<Index>(p.channels.size());
  Moved moved{MatrixXd(run.run().samples(), channels + (with_angle ? 1 : 0)), p.offset[0]};
  for (Index c = 0; c < channels; ++c) {
    const auto which = static_cast<std::size_t>(c);
    moved.residual.col(c) = weighted(run.channel_weight(which), run.run().channel(p.channels[which]).value, p.output.col(c));
  }
  if (with_angle) moved.residual.col(channels) = weighted(run.angle_weight(), run.run().channel("alpha").value, p.motion.angle.array() + p.angle_offset[0]);
  if (const double unit = reading_of_steady_load(run); unit != 0) moved.offset *= gauge_factor / unit;
  return moved;
}

/// A model whose laws search for their motion answers only to within that search: differences over as much as tells from it.
constexpr double of_linear = 1e-4, of_nonlinear = 0.03;  // standard deviations of a number

double step_of(const RunResidual& run, const VectorXd& theta) { return run.largest_arguments(theta).size() > 0 ? of_nonlinear : of_linear; }

/// Run `r` of the fit with one deviation moved by `step`.
Moved moved_run(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z, Index deviation, double step, std::size_t r) {
  const RunResidual& now = at.joint.runs()[r];
  const VectorXd there = z + step * VectorXd::Unit(z.size(), deviation);
  const double gain = numbers.gauge_factor(r, there) / numbers.gauge_factor(r, z);  // the readings stay, and their noise: the model reads less
  Rig rig = numbers.rig_at(there);
  if (gain != 1) amplify(rig, 1 / gain);
  Run run = numbers.run_at(r, there);
  for (Channel& channel : run.channels)
    if (channel.name == "gauge") channel.value = now.run().channel("gauge").value;
  const Basis& basis = at.model->basis();
  AeroelasticModel model(rig, rig.is_modal() ? Basis{} : make_basis(rig, basis.normal_modes, basis.torsion_modes), at.model->circulation());
  if (!at.model->effect_ids().empty()) model = model.with_effects(at.model->effect_ids());
  RunResidual residual(model, run, at.windows[r]);
  residual.keep_noise_of(now);
  residual.follow_in(now.finer());
  residual.start_from(now);
  VectorXd theta = at.joint.theta(r);
  for (const Unknown& u : at.joint.unknowns())  // what is held at the rig file's number goes with it
    if (u.held) theta[u.parameter] += model.parameters()[static_cast<std::size_t>(u.parameter)].start - at.joint.parameter(u).start;
  return look_at(residual, theta, gain);
}

}  // namespace

bool states_errors(const Rig& rig, const std::vector<Run>& runs) {
  return rig.givens || std::any_of(runs.begin(), runs.end(), [](const Run& run) { return run.givens != nullptr; });
}

StatedNumbers::StatedNumbers(const Rig& rig, const std::vector<Run>& runs) : rig_(&rig), runs_(&runs) {
  struct Part {
    const Givens* givens;
    std::vector<Index> place;  // of its deviations
  };
  std::vector<Part> parts;
  const auto list = [&](const Givens& givens, const std::string& file) {
    for (const Given& g : givens.numbers) numbers_.push_back({g.name, g.unit, file, g.value, g.std, g.value, g.std});
  };
  if (rig.givens) {
    of_rig_ = deviations_ = rig.givens->deviations();
    groups_ = rig.givens->group;
    std::vector<Index> place;
    for (Index k = 0; k < deviations_; ++k) place.push_back(k);
    parts.push_back({rig.givens.get(), std::move(place)});
    list(*rig.givens, "");
  }
  std::map<std::string, Index> shared;
  for (const Run& run : runs) {
    first_number_.push_back(static_cast<Index>(numbers_.size()));
    if (!run.givens) continue;
    std::vector<Index> place;
    for (std::size_t k = 0; k < run.givens->group.size(); ++k) {
      const std::string& group = run.givens->group[k];
      const auto known = shared.find(group);
      const bool common = run.givens->common[k];
      if (common && known != shared.end()) {
        place.push_back(known->second);
        continue;
      }
      if (common) shared.emplace(group, deviations_);
      groups_.push_back(group);
      place.push_back(deviations_++);
    }
    parts.push_back({run.givens.get(), std::move(place)});
    list(*run.givens, run.file);
  }
  spread_ = MatrixXd::Zero(static_cast<Index>(numbers_.size()), deviations_);
  Index row = 0;
  for (const Part& part : parts) {
    spread_(Eigen::seqN(row, part.givens->spread.rows()), part.place) = part.givens->spread;
    row += part.givens->spread.rows();
  }
}

Rig StatedNumbers::rig_at(const VectorXd& z) const {
  if (!rig_->givens) return *rig_;
  const auto count = static_cast<Index>(rig_->givens->numbers.size());
  return with_errors(*rig_, spread_.topRows(count) * z);
}

Run StatedNumbers::run_at(std::size_t run, const VectorXd& z) const {
  const Run& stated = (*runs_)[run];
  if (!stated.givens) return stated;
  return with_errors(stated, spread_.middleRows(first_number_[run], static_cast<Index>(stated.givens->numbers.size())) * z);
}

double StatedNumbers::gauge_factor(std::size_t run, const VectorXd& z) const {
  const Run& stated = (*runs_)[run];
  if (!stated.givens) return 1;
  for (std::size_t i = 0; i < stated.givens->numbers.size(); ++i)
    if (const Given& g = stated.givens->numbers[i]; g.number == GivenNumber::calibration) return 1 + spread_.row(first_number_[run] + static_cast<Index>(i)).dot(z) / g.value;
  return 1;
}

bool StatedNumbers::acts(std::size_t run, Index deviation) const {
  if (deviation < of_rig_) return true;
  const Run& stated = (*runs_)[run];
  return stated.givens && !spread_.block(first_number_[run], deviation, static_cast<Index>(stated.givens->numbers.size()), 1).isZero(0);
}

NumberSlopes number_slopes(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z) {
  const std::vector<RunResidual>& runs = at.joint.runs();
  const auto parameters = static_cast<Index>(at.model->parameters().size()), deviations = numbers.deviations();
  NumberSlopes slopes{std::vector<RunResidual::Sensitivity>(runs.size()), MatrixXd::Zero(static_cast<Index>(runs.size()), deviations)};
  std::vector<double> step(runs.size()), unit(runs.size());
  in_parallel(runs.size(), [&](std::size_t r) {
    const VectorXd theta = at.joint.theta(r);
    slopes.runs[r] = runs[r].sensitivity(theta);
    step[r] = step_of(runs[r], theta);
    unit[r] = reading_of_steady_load(runs[r]);
    for (RunResidual::Sensitivity::PerChannel& channel : slopes.runs[r].channels) {
      MatrixXd& slope = channel.slope;
      slope.conservativeResize(Eigen::NoChange, parameters + deviations);
      slope.rightCols(deviations).setZero();
    }
  });
  in_parallel(static_cast<std::size_t>(deviations), [&](std::size_t k) {
    const auto deviation = static_cast<Index>(k);
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (!numbers.acts(r, deviation) || runs[r].is_aside()) continue;
      const Moved more = moved_run(at, numbers, z, deviation, step[r], r), less = moved_run(at, numbers, z, deviation, -step[r], r);
      const MatrixXd slope = (less.residual - more.residual) / (2 * step[r]);  // of the prediction
      for (Index c = 0; c < slope.cols(); ++c) slopes.runs[r].channels[static_cast<std::size_t>(c)].slope.col(parameters + deviation) = slope.col(c);
      slopes.offset(static_cast<Index>(r), deviation) = (more.offset - less.offset) / (2 * step[r]) * (unit[r] != 0 ? unit[r] : 1);
    }
  });
  return slopes;
}

}  // namespace unrig
