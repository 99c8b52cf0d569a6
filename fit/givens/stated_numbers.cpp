#include "fit/givens/stated_numbers.h"

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "core/run/deviation_slopes.h"
#include "fit/fit_description.h"
#include "fit/givens/system_slopes.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The columns of the deviations, which stand before those of effects, behind all others.
MatrixXd with_deviations_last(const MatrixXd& columns, Index own, Index deviations) {
  MatrixXd sorted(columns.rows(), columns.cols());
  const Index others = columns.cols() - own - deviations;
  sorted << columns.leftCols(own), columns.rightCols(others), columns.middleCols(own, deviations);
  return sorted;
}

void look_at_run(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z, std::size_t r, NumberSlopes& slopes) {
  const RunResidual& now = at.joint.runs()[r];
  const Index deviations = numbers.deviations();
  const SystemSlopes system(SystemSlopes::Of::whole, at.joint, r, at.model->basis(), numbers, z, r, now.conditions(), reading_of_steady_load(now) != 0);
  const std::vector<NumberSlope> table = system.all();
  Run with_deviations = now.run();
  with_deviations.deviations = std::make_shared<const DeviationSlopes>(DeviationSlopes{true, system.outputs(), {{system.states(), {table.begin(), table.end()}}}});
  Rig rig = at.model->rig();
  rig.deviations = deviations;
  const AeroelasticModel model = AeroelasticModel(rig, at.model->basis(), at.model->circulation()).with_effects(at.model->effect_ids());
  RunResidual run(model, with_deviations, at.windows[r]);
  run.keep_noise_of(now);
  run.follow_in(now.finer());
  run.start_from(now);
  const VectorXd theta = at.joint.theta(r);
  const Index own = static_cast<Index>(AeroelasticModel(at.model->rig(), at.model->basis(), at.model->circulation()).parameters().size());
  VectorXd extended = VectorXd::Zero(theta.size() + deviations);
  extended.head(own) = theta.head(own);
  extended.tail(theta.size() - own) = theta.tail(theta.size() - own);

  slopes.runs[r] = run.sensitivity(extended);
  for (RunResidual::Sensitivity::PerChannel& channel : slopes.runs[r].channels) channel.slope = with_deviations_last(channel.slope, own, deviations);
  const RunResidual::Evaluation e = run.evaluate(extended, Partials::all);
  const double offset = e.linear[run.first_offset()];
  for (Index k = 0; k < deviations; ++k) {
    const NumberSlope& slope = table[static_cast<std::size_t>(k)];
    slopes.offset(static_cast<Index>(r), k) = e.linear_slope(run.first_offset(), own + k) + offset * (slope.gauge - slope.unit);
  }
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
  return stated.givens ? with_errors(stated, errors_of_run(run, z)) : stated;
}

VectorXd StatedNumbers::errors_of_run(std::size_t run, const VectorXd& z) const {
  const Run& stated = (*runs_)[run];
  return stated.givens ? VectorXd(spread_.middleRows(first_number_[run], static_cast<Index>(stated.givens->numbers.size())) * z) : VectorXd();
}

Run StatedNumbers::head_at(std::size_t run, const VectorXd& z) const {
  const Run& stated = (*runs_)[run];
  Run head;
  head.speed = stated.speed;
  head.density = stated.density;
  head.givens = stated.givens;
  return stated.givens ? with_errors(head, errors_of_run(run, z)) : head;
}

bool StatedNumbers::acts(std::size_t run, Index deviation) const {
  if (deviation < of_rig_) return true;
  const Run& stated = (*runs_)[run];
  return stated.givens && !spread_.block(first_number_[run], deviation, static_cast<Index>(stated.givens->numbers.size()), 1).isZero(0);
}

NumberSlopes number_slopes(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z) {
  const std::vector<RunResidual>& runs = at.joint.runs();
  NumberSlopes slopes{std::vector<RunResidual::Sensitivity>(runs.size()), MatrixXd::Zero(static_cast<Index>(runs.size()), numbers.deviations())};
  in_parallel(runs.size(), [&](std::size_t r) { look_at_run(at, numbers, z, r, slopes); });
  return slopes;
}

}  // namespace unrig
