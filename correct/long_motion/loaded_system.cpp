#include "correct/long_motion/loaded_system.h"

#include <algorithm>

#include "core/model/rigid_system.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// The same without the partials of other parameters.
DualMatrix only(const DualMatrix& a, const std::vector<Index>& parameters) {
  DualMatrix part(a.value, a.parameters());
  for (const Index j : parameters)
    if (a.depends_on(j)) part.partial[static_cast<std::size_t>(j)] = a.d(j);
  return part;
}

}  // namespace

LinearSystem loaded_system(const AeroelasticModel& model, const Conditions& conditions, const VectorXd& theta, const std::vector<std::string>& channels) {
  LinearSystem system = model.system(conditions, theta, channels);
  const LinearSystem rigid = rigid_system(model, conditions, theta);
  const Index states = system.states(), lags = rigid.lags, own = system.C.rows(), inputs = system.B.cols();
  const auto place = [&](const MatrixXd& rows) {  // over [lags, p, p', p''] -> over all states
    MatrixXd all = MatrixXd::Zero(rows.rows(), states + lags);
    all.middleCols(system.motion, 3) = rows.rightCols(3);
    all.rightCols(lags) = rows.leftCols(lags);
    return all;
  };
  DualMatrix loads(place(rigid.C.value.topRows(2)), theta.size());
  for (Index j = 0; j < theta.size(); ++j)
    if (rigid.C.depends_on(j)) loads.add_partial(j, place(rigid.C.d(j).topRows(2)));
  system.A = system.A.grown(states + lags, states + lags);
  system.A.value.bottomRows(lags) = place(rigid.A.value.topRows(lags));
  system.B = system.B.grown(states + lags, inputs);
  system.C = system.C.grown(own + 2, states + lags);
  system.C.set_block(own, 0, loads);
  system.D = system.D.grown(own + 2, inputs);
  system.outputs.insert(system.outputs.end(), {"circulatory", "normal_force"});
  return system;
}

LinearSystem with_partials_of(LinearSystem system, const std::vector<Index>& parameters) {
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) *m = only(*m, parameters);
  return system;
}

ExactStep with_partials_of(ExactStep step, const std::vector<Index>& parameters) {
  for (DualMatrix* m : {&step.transition, &step.jerk, &step.input0, &step.input1}) *m = only(*m, parameters);
  return step;
}

Response spline_response(const LinearSystem& system, const ExactStep& step, Index samples, const std::vector<Index>& parameters) {
  const LinearSystem few = with_partials_of(system, parameters);
  const ExactStep few_step = with_partials_of(step, parameters);
  const Partials partials = parameters.empty() ? Partials::none : Partials::all;
  constexpr Index width = 4;  // samples in which a spline has a jerk
  const VectorXd jerk = (VectorXd(width) << 1, -3, 3, -1).finished() / (step.dt * step.dt * step.dt);
  const Response rise = drive(few, few_step, DualMatrix(MatrixXd::Zero(system.states(), 1)), std::min(width, samples), jerk, {}, partials);
  if (samples <= width) return rise;
  DualMatrix behind = rise.end;
  stand_still(behind.value, system.motion, Eigen::RowVectorXd::Zero(1));
  const Response fall = FreeResponse(few, few_step, partials).from(behind, samples - width);
  const auto join = [&](const MatrixXd& first, const MatrixXd& second) {
    MatrixXd all(samples, second.cols());
    all << first, second;
    return all;
  };
  Response whole;
  whole.output = join(rise.output, fall.output);
  whole.end = fall.end;
  whole.partial.resize(fall.partial.size());
  for (std::size_t j = 0; j < fall.partial.size(); ++j)
    if (fall.partial[j].size() > 0) whole.partial[j] = join(rise.partial[j], fall.partial[j]);
  return whole;
}

}  // namespace unrig
