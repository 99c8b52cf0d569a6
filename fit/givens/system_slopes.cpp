#include "fit/givens/system_slopes.h"

#include <cmath>
#include <utility>

#include "core/numerics/in_parallel.h"
#include "core/rig/bridge.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

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

}  // namespace

SystemSlopes::SystemSlopes(Of what, const JointProblem& fit, std::size_t like, const Basis& basis, const StatedNumbers& numbers, const VectorXd& z, std::size_t run, const Conditions& conditions, bool reads_a_steady_load)
    : what_(what), fit_(fit), basis_(basis), numbers_(numbers), z_(z), run_(run), reads_a_steady_load_(reads_a_steady_load), conditions_(conditions) {
  if (what == Of::rig) conditions_.force = conditions_.mount = conditions_.ports = true;  // as AeroelasticModel::system has them before an effect
  const AeroelasticModel here = model_of(fit.model().rig());
  channels_ = here.output_channels(numbers.stated_run(run));
  theta_ = fit.theta(like).head(static_cast<Index>(here.parameters().size()));
  start_ = here.start_values();
  system_ = here.system(conditions_, theta_, channels_);
}

NumberSlope SystemSlopes::of(Index deviation) const {
  constexpr double step = 1e-3;  // of a standard deviation: per cents of numbers, and third derivatives of the order of the first, leave 1e-10
  NumberSlope slope{{MatrixXd::Zero(system_.A.rows(), system_.A.cols()), MatrixXd::Zero(system_.B.rows(), system_.B.cols()), MatrixXd::Zero(system_.C.rows(), system_.C.cols()),
                     MatrixXd::Zero(system_.D.rows(), system_.D.cols())}, 0, 0};
  if (!numbers_.acts(run_, deviation)) return slope;
  add_difference(deviation, step, 1 / (2 * step), slope);
  add_difference(deviation, -step, -1 / (2 * step), slope);
  const VectorXd off = numbers_.errors_of_run(run_, VectorXd::Unit(z_.size(), deviation));
  const Run& stated = numbers_.stated_run(run_);
  if (const double rate = relative(stated, off, GivenNumber::clock); rate != 0) add_clock(system_, rate, slope);
  if (const double force = relative(stated, off, GivenNumber::force_calibration); force != 0) {
    slope.B.col(0) += force * system_.B.value.col(0);
    slope.D.col(0) += force * system_.D.value.col(0);
  }
  slope.gauge = relative(stated, off, GivenNumber::calibration);
  if (channels_.front() == "gauge") {  // the reading stays, the model reads less
    slope.C.row(0) -= slope.gauge * system_.C.value.row(0);
    slope.D.row(0) -= slope.gauge * system_.D.value.row(0);
  }
  return slope;
}

std::vector<NumberSlope> SystemSlopes::all() const {
  std::vector<NumberSlope> slopes(static_cast<std::size_t>(numbers_.deviations()));
  in_parallel(slopes.size(), [&](std::size_t k) { slopes[k] = of(static_cast<Index>(k)); });
  return slopes;
}

AeroelasticModel SystemSlopes::model_of(Rig rig) const {
  rig.deviations = 0;
  if (what_ == Of::rig) rig.gauge_filters.clear();
  Basis own = make_basis(rig, basis_.normal_modes, basis_.torsion_modes);
  const AeroelasticModel model(std::move(rig), std::move(own), fit_.model().circulation());
  return what_ == Of::rig ? model : model.with_effects(fit_.model().effect_ids());
}

void SystemSlopes::add_difference(Index deviation, double step, double weight, NumberSlope& slope) const {
  const VectorXd there = z_ + step * VectorXd::Unit(z_.size(), deviation);
  const Run head = numbers_.head_at(run_, there);
  const AeroelasticModel model = model_of(numbers_.rig_at(there));
  Conditions conditions = conditions_;
  conditions.speed = head.speed;
  conditions.density = head.density;
  VectorXd theta = theta_;
  for (const Unknown& u : fit_.unknowns())  // what is held at the rig file's number goes with it
    if (u.held && u.parameter < theta.size()) theta[u.parameter] += model.start_values()[u.parameter] - start_[u.parameter];
  const LinearSystem system = model.system(conditions, theta, channels_);
  slope.A += weight * system.A.value;
  slope.B += weight * system.B.value;
  slope.C += weight * system.C.value;
  slope.D += weight * system.D.value;
  if (reads_a_steady_load_) slope.unit += weight * std::log(reading_of_unit_coefficient(model.rig(), gauge_levers(model.rig()), head.density, head.speed));
}

}  // namespace unrig
