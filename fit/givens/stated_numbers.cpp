#include "fit/givens/stated_numbers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include "core/effects/effect.h"
#include "core/numerics/in_parallel.h"
#include "core/rig/bridge.h"
#include "fit/fit_description.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The change of a run's linear system per unit of one deviation: matrices over all ports, before what lies behind the bridge.
struct SystemSlope {
  MatrixXd A, B, C, D;
  double unit = 0;   ///< of the logarithm of what a steady load reads
  double gauge = 0;  ///< and of the gauge's calibration
};

/// The relative error of a number of a run's head per deviation; 0 where the head does not state it.
double relative(const Run& run, const VectorXd& off, GivenNumber number) {
  for (std::size_t i = 0; run.givens && i < run.givens->numbers.size(); ++i)
    if (run.givens->numbers[i].number == number) return off[static_cast<Index>(i)] / run.givens->numbers[i].value;
  return 0;
}

/// With the time column's rate too high by 1 at nominal rates of the shaft: everything but the shaft goes as much faster in nominal time, and the shaft as much slower in its own.
void add_clock(const LinearSystem& system, double rate, SystemSlope& slope) {
  MatrixXd A = system.A.value, B = system.B.value, C = MatrixXd::Zero(system.C.rows(), system.C.cols());
  if (const Index motion = system.motion; motion >= 0) {
    A.col(motion + 1).setZero();
    A.col(motion + 2) *= -1;
    A.middleRows(motion, 3).setZero();
    B.middleRows(motion, 3).setZero();
    C.col(motion + 1) = -system.C.value.col(motion + 1);
    C.col(motion + 2) = -2 * system.C.value.col(motion + 2);
  }
  slope.A += rate * A;
  slope.B += rate * B;
  slope.C += rate * C;
}

/// The slopes of one run's system at the present numbers.
class SystemSlopes {
 public:
  SystemSlopes(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z, std::size_t r) : at_(at), numbers_(numbers), z_(z), r_(r), run_(at.joint.runs()[r]), conditions_(run_.conditions()) {
    conditions_.force = conditions_.mount = conditions_.ports = true;  // as AeroelasticModel::system has them before an effect
    const VectorXd theta = at.joint.theta(r);
    const AeroelasticModel here = model_of(at.model->rig());
    theta_ = theta.head(static_cast<Index>(here.parameters().size()));
    start_ = here.start_values();
    system_ = here.system(conditions_, theta_, run_.channels());
  }

  Index own_parameters() const { return theta_.size(); }

  /// By central differences of its matrices, which depend on the numbers smoothly however long the record is.
  SystemSlope of(Index deviation) const {
    constexpr double step = 1e-3;  // of a standard deviation: per cents of numbers, and third derivatives of the order of the first, leave 1e-10
    SystemSlope slope{MatrixXd::Zero(system_.A.rows(), system_.A.cols()), MatrixXd::Zero(system_.B.rows(), system_.B.cols()), MatrixXd::Zero(system_.C.rows(), system_.C.cols()),
                      MatrixXd::Zero(system_.D.rows(), system_.D.cols()), 0, 0};
    if (!numbers_.acts(r_, deviation)) return slope;
    add_difference(deviation, step, 1 / (2 * step), slope);
    add_difference(deviation, -step, -1 / (2 * step), slope);
    const VectorXd off = numbers_.errors_of_run(r_, VectorXd::Unit(z_.size(), deviation));
    const Run& stated = numbers_.stated_run(r_);
    if (const double rate = relative(stated, off, GivenNumber::clock); rate != 0) add_clock(system_, rate, slope);
    if (const double force = relative(stated, off, GivenNumber::force_calibration); force != 0) {
      slope.B.col(0) += force * system_.B.value.col(0);
      slope.D.col(0) += force * system_.D.value.col(0);
    }
    slope.gauge = relative(stated, off, GivenNumber::calibration);
    if (run_.channels().front() == "gauge") {  // the reading stays, the model reads less
      slope.C.row(0) -= slope.gauge * system_.C.value.row(0);
      slope.D.row(0) -= slope.gauge * system_.D.value.row(0);
    }
    return slope;
  }

 private:
  AeroelasticModel model_of(Rig rig) const {
    rig.gauge_filters.clear();
    rig.laws.clear();
    const Basis& basis = at_.model->basis();
    Basis own = make_basis(rig, basis.normal_modes, basis.torsion_modes);
    return {std::move(rig), std::move(own), at_.model->circulation()};
  }

  void add_difference(Index deviation, double step, double weight, SystemSlope& slope) const {
    const VectorXd there = z_ + step * VectorXd::Unit(z_.size(), deviation);
    const Run head = numbers_.head_at(r_, there);
    const AeroelasticModel model = model_of(numbers_.rig_at(there));
    Conditions conditions = conditions_;
    conditions.speed = head.speed;
    conditions.density = head.density;
    VectorXd theta = theta_;
    for (const Unknown& u : at_.joint.unknowns())  // what is held at the rig file's number goes with it
      if (u.held && u.parameter < theta.size()) theta[u.parameter] += model.start_values()[u.parameter] - start_[u.parameter];
    const LinearSystem system = model.system(conditions, theta, run_.channels());
    slope.A += weight * system.A.value;
    slope.B += weight * system.B.value;
    slope.C += weight * system.C.value;
    slope.D += weight * system.D.value;
    if (reading_of_steady_load(run_) != 0) slope.unit += weight * std::log(reading_of_unit_coefficient(model.rig(), gauge_levers(model.rig()), head.density, head.speed));
  }

  const Arrival& at_;
  const StatedNumbers& numbers_;
  const VectorXd& z_;
  std::size_t r_;
  const RunResidual& run_;
  Conditions conditions_;
  VectorXd theta_, start_;
  LinearSystem system_;
};

/// The deviations as parameters of a model, all of them 0: what the model makes of its own parameters, exact slopes along the record, it then makes of them.
std::shared_ptr<const Effect> as_effect(const std::shared_ptr<const std::vector<SystemSlope>>& slopes) {
  auto e = std::make_shared<Effect>();
  e->id = "stated-numbers";
  for (std::size_t k = 0; k < slopes->size(); ++k) e->parameters.push_back({std::to_string(k), "1", 0, -1e9, 1e9, false});
  e->acts = [](const Rig&, const Conditions&) { return true; };
  e->apply = [slopes](LinearSystem& system, const EffectContext& context) {
    for (std::size_t k = 0; k < slopes->size(); ++k) {
      const SystemSlope& slope = (*slopes)[k];
      const Index parameter = context.first_parameter + static_cast<Index>(k);
      const auto add = [&](DualMatrix& to, const MatrixXd& change) {
        if (change.isZero(0)) return;
        to.partial.resize(static_cast<std::size_t>(context.theta.size()));
        to.add_partial(parameter, change);
      };
      add(system.A, slope.A);
      add(system.B, slope.B);
      add(system.C, slope.C);
      add(system.D, slope.D);
    }
  };
  return e;
}

/// The columns of an effect that comes first, behind those of all others.
MatrixXd with_deviations_last(const MatrixXd& columns, Index own, Index deviations) {
  MatrixXd sorted(columns.rows(), columns.cols());
  const Index others = columns.cols() - own - deviations;
  sorted << columns.leftCols(own), columns.rightCols(others), columns.middleCols(own, deviations);
  return sorted;
}

void look_at_run(const Arrival& at, const StatedNumbers& numbers, const VectorXd& z, std::size_t r, NumberSlopes& slopes) {
  const RunResidual& now = at.joint.runs()[r];
  const Index deviations = numbers.deviations();
  const SystemSlopes system(at, numbers, z, r);
  auto table = std::make_shared<std::vector<SystemSlope>>(static_cast<std::size_t>(deviations));
  in_parallel(table->size(), [&](std::size_t k) { (*table)[k] = system.of(static_cast<Index>(k)); });

  Rig rig = at.model->rig();
  rig.laws.push_back(as_effect(table));
  std::vector<std::string> ids{rig.laws.back()->id};
  ids.insert(ids.end(), at.model->effect_ids().begin(), at.model->effect_ids().end());
  const AeroelasticModel model = AeroelasticModel(rig, at.model->basis(), at.model->circulation()).with_effects(ids);
  RunResidual run(model, now.run(), at.windows[r]);
  run.keep_noise_of(now);
  run.follow_in(now.finer());
  run.start_from(now);
  const VectorXd theta = at.joint.theta(r);
  const Index own = system.own_parameters();
  VectorXd extended = VectorXd::Zero(theta.size() + deviations);
  extended.head(own) = theta.head(own);
  extended.tail(theta.size() - own) = theta.tail(theta.size() - own);

  slopes.runs[r] = run.sensitivity(extended);
  for (RunResidual::Sensitivity::PerChannel& channel : slopes.runs[r].channels) channel.slope = with_deviations_last(channel.slope, own, deviations);
  const RunResidual::Evaluation e = run.evaluate(extended, Partials::all);
  const double offset = e.linear[run.first_offset()];
  for (Index k = 0; k < deviations; ++k) {
    const SystemSlope& slope = (*table)[static_cast<std::size_t>(k)];
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
