#include "fit/search/law_smoother.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/run_inputs.h"
#include "core/numerics/triangularise.h"
#include "core/numerics/work.h"
#include "core/propagate/feedback_force.h"
#include "core/propagate/memory.h"

namespace unrig {
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

LawSmoother::LawSmoother(const RunResidual& run, std::vector<Index> parameters) : run_(run), parameters_(std::move(parameters)), inputs_(run_inputs(run.run(), run.conditions())) {
  const std::vector<std::string> names = run.model().output_channels(run.run());
  const LinearSystem first = run.model().system(run.conditions(), run.model().start_values(), names);
  for (const Feedback& f : first.feedback) parts_ = std::max(parts_, std::min(most_parts, f.steps_per_sample));
  for (const Index state : run.free_states())
    if (state < first.states()) free_.push_back(state);  // behind them those of its noise's colour
  readings_ = std::min(run.run().samples(), most_samples);
  samples_ = (readings_ - 1) * parts_ + 1;
  channels_ = static_cast<Index>(names.size());
  changes_ = static_cast<Index>(parameters_.size());
  measured_ = weight_ = MatrixXd::Zero(samples_, channels_);
  for (Index c = 0; c < channels_; ++c) {
    const VectorXd& value = run.run().channel(names[static_cast<std::size_t>(c)]).value;
    const VectorXd weight = run.channel_weight(static_cast<std::size_t>(c));
    for (Index k = 0; k < readings_; ++k)
      if (weight[k] > 0) {
        weight_(k * parts_, c) = 1 / (run.tempered() * run.noise(static_cast<std::size_t>(c)));  // of all colours, taken for white
        measured_(k * parts_, c) = value[k];
      }
  }
  if (parts_ > 1 && inputs_.cols() > 0) {
    const MatrixXd at_samples = inputs_;
    inputs_.resize(samples_, at_samples.cols());
    for (Index k = 0; k < samples_; ++k)
      for (Index i = 0; i < inputs_.cols(); ++i)
        inputs_(k, i) = input_between(first, at_samples, run.run().dt, k / parts_, static_cast<double>(k % parts_) / static_cast<double>(parts_), i);
  }
}

void LawSmoother::prepare(const VectorXd& theta) {
  system_ = run_.model().system(run_.conditions(), theta, run_.model().output_channels(run_.run()));
  exact_ = exact_step(system_, run_.run().dt / static_cast<double>(parts_));
  states_ = system_.states();
  laws_ = static_cast<Index>(system_.feedback.size());
  gamma0_ = exact_.input0.value.rightCols(laws_);
  gamma1_ = exact_.input1.value.rightCols(laws_);
  if (disturb_.size() == 0) {  // kept: a theta that makes a law stronger must not make its error cheaper
    show_ = laws_that_show();
    const MatrixXd by_laws = (gamma0_ + gamma1_)(Eigen::all, show_);
    disturbances_ = by_laws.cols() + system_.coordinates;
    disturb_.resize(states_, disturbances_);
    disturb_ << by_laws, exact_.dt * MatrixXd::Identity(states_, states_).middleCols(system_.coordinates, system_.coordinates);
  }
  arguments_ = Arguments(system_);
}

/// Laws whose force reaches a channel through the linear part.
std::vector<Index> LawSmoother::laws_that_show() const {
  MatrixXd state = gamma0_ + gamma1_;
  VectorXd seen = VectorXd::Zero(laws_);
  for (Index k = 0; k <= states_; ++k, state = exact_.transition.value * state) seen += (system_.C.value * state).colwise().squaredNorm().transpose();
  std::vector<Index> show;
  for (Index i = 0; i < laws_; ++i)
    if (seen[i] > 0) show.push_back(i);
  return show;
}

VectorXd LawSmoother::enough_to_move(const VectorXd& theta) {
  prepare(theta);
  MatrixXd state = disturb_;
  VectorXd answer = VectorXd::Zero(disturbances_);
  for (Index k = 1; k < samples_; ++k, state = exact_.transition.value * state) answer += (system_.C.value * state).colwise().squaredNorm().transpose();
  const MatrixXd readings = measured_(Eigen::seqN(0, readings_, parts_), Eigen::all), moves = readings.rowwise() - readings.colwise().mean();
  return (moves.squaredNorm() / static_cast<double>(readings_) / answer.array().max(1e-300)).sqrt();
}

/// Forces of the laws along the trajectory, and their derivatives.
void LawSmoother::look_at_laws(const VectorXd& theta) {
  force_ = MatrixXd::Zero(laws_, samples_);
  answer_ = MatrixXd::Zero(laws_, arguments_.count() * samples_);
  law_partial_ = MatrixXd::Zero(laws_, changes_ * samples_);
  if (!followed_) {
    state_ = MatrixXd::Zero(states_, samples_);
    offset_ = VectorXd::Zero(channels_);
    return;
  }
  follow_memories(theta);
  for (Index k = 0; k < samples_; ++k) answer_at(k, theta);
}

/// Memories along the trajectory as their laws have them, by the trapezoidal rule: no disturbance acts on them, and about a memory that has not been followed its law has slopes that lead astray.
void LawSmoother::follow_memories(const VectorXd& theta) {
  if (arguments_.accelerations) return;
  constexpr int most = 20;
  constexpr double arrived = 1e-9;
  const Index given = system_.B.cols() - laws_;
  for (Index i = 0; i < laws_; ++i) {
    const Index memory = memory_of(system_, i);
    if (memory < 0) continue;
    const Feedback& f = system_.feedback[static_cast<std::size_t>(i)];
    const auto own = Eigen::seqN(arguments_.first[static_cast<std::size_t>(i)], f.sees.rows());
    const MatrixXd sees = arguments_.sees.value(own, Eigen::all), sees_input = arguments_.sees_input.value(own, Eigen::seqN(0, given));
    const auto seen_at = [&](Index k) { return VectorXd(given > 0 ? VectorXd(sees * state_.col(k) + sees_input * inputs_.row(k).transpose()) : VectorXd(sees * state_.col(k))); };
    for (Index k = 0; k + 1 < samples_; ++k) {
      const double before = state_(memory, k), half = exact_.dt / 2, rate = force_of(f, seen_at(k).data(), theta).value;
      double& z = state_(memory, k + 1);
      z = before;
      for (int step = 0; step < most; ++step) {
        const FeedbackForce at_z = force_of(f, seen_at(k + 1).data(), theta);
        double slope = 0;
        for (Index a = 0; a < f.sees.rows(); ++a) slope += at_z.slope[static_cast<std::size_t>(a)] * sees(a, memory);
        const double change = (before + half * (rate + at_z.value) - z) / (1 - half * slope);
        if (!std::isfinite(change)) break;
        z += change;
        if (!(std::abs(change) > arrived * (std::abs(z) + arrived))) break;
      }
    }
  }
}

/// The forces at one sample, f = law(sees x + sees_input [u; f]), by Newton's method where a law sees them itself; and how they answer to a change of the state and of theta.
void LawSmoother::answer_at(Index k, const VectorXd& theta) {
  constexpr int most = 20;
  constexpr double arrived = 1e-12;
  const Index arguments = arguments_.count(), given = system_.B.cols() - laws_;
  const auto of_forces = arguments_.sees_input.value.rightCols(laws_);
  VectorXd known = arguments_.sees.value * state_.col(k);
  if (given > 0) known += arguments_.sees_input.value.leftCols(given) * inputs_.row(k).transpose();
  auto force = force_.col(k);
  auto partial = law_partial_.middleCols(k * changes_, changes_);
  MatrixXd slope = MatrixXd::Zero(laws_, arguments);
  Eigen::PartialPivLU<MatrixXd> beside_forces;  // 1 - slope sees_input, over the forces
  for (int step = 0; step < (arguments_.accelerations ? most : 1); ++step) {
    const VectorXd seen = known + of_forces * force;
    VectorXd law(laws_);
    for (Index i = 0; i < laws_; ++i) {
      const Feedback& f = system_.feedback[static_cast<std::size_t>(i)];
      const Index first = arguments_.first[static_cast<std::size_t>(i)];
      const FeedbackForce at_z = force_of(f, seen.data() + first, theta);
      law[i] = at_z.value;
      for (Index a = 0; a < f.sees.rows(); ++a) slope(i, first + a) = at_z.slope[static_cast<std::size_t>(a)];
      for (Index a = 0; a < changes_; ++a)
        if (const Index own = parameters_[static_cast<std::size_t>(a)] - f.first_parameter; own >= 0 && own < f.parameters) partial(i, a) = at_z.partial[static_cast<std::size_t>(own)];
    }
    if (!arguments_.accelerations) {
      force = law;
      break;
    }
    beside_forces.compute(MatrixXd::Identity(laws_, laws_) - slope * of_forces);
    const VectorXd change = beside_forces.solve(law - force);
    force += change;
    if (!(change.norm() > arrived * force.norm())) break;
  }
  if (arguments_.accelerations) {
    VectorXd inputs(given + laws_);
    if (given > 0) inputs.head(given) = inputs_.row(k).transpose();
    inputs.tail(laws_) = force;
    for (Index a = 0; a < changes_; ++a) {
      const Index j = parameters_[static_cast<std::size_t>(a)];
      if (arguments_.sees.depends_on(j)) partial.col(a) += slope * (arguments_.sees.d(j) * state_.col(k));
      if (arguments_.sees_input.depends_on(j)) partial.col(a) += slope * (arguments_.sees_input.d(j) * inputs);
    }
    partial = beside_forces.solve(partial).eval();
    slope = beside_forces.solve(slope).eval();
  }
  answer_.middleCols(k * arguments, arguments) = slope;
}

/// What a change of theta does to every step along the trajectory, at fixed forces: a column per step, parameter below parameter.
MatrixXd LawSmoother::moved_by_theta() const {
  const Index steps = samples_ - 1, given = system_.B.cols() - laws_;
  MatrixXd drive(states_ + 2 * laws_ + 2 * given, steps);
  drive.topRows(states_) = state_.leftCols(steps);
  drive.middleRows(states_, laws_) = force_.leftCols(steps);
  drive.middleRows(states_ + laws_, laws_) = force_.rightCols(steps);
  if (given > 0) {
    drive.middleRows(states_ + 2 * laws_, given) = inputs_.topRows(steps).transpose();
    drive.bottomRows(given) = inputs_.middleRows(1, steps).transpose();
  }
  MatrixXd by_parameter = MatrixXd::Zero(states_ * changes_, drive.rows());
  for (Index a = 0; a < changes_; ++a) {
    const Index j = parameters_[static_cast<std::size_t>(a)];
    auto part = by_parameter.middleRows(a * states_, states_);
    if (exact_.transition.depends_on(j)) part.leftCols(states_) = exact_.transition.d(j);
    if (exact_.input0.depends_on(j)) {
      part.middleCols(states_, laws_) = exact_.input0.d(j).rightCols(laws_);
      part.middleCols(states_ + 2 * laws_, given) = exact_.input0.d(j).leftCols(given);
    }
    if (exact_.input1.depends_on(j)) {
      part.middleCols(states_ + laws_, laws_) = exact_.input1.d(j).rightCols(laws_);
      part.rightCols(given) = exact_.input1.d(j).leftCols(given);
    }
  }
  return by_parameter * drive;
}

/// x_{k+1} near the trajectory, where the force at the end of the step is solved for.
void LawSmoother::write_step(Index k, const Eigen::Ref<const MatrixXd>& moved) {
  const Index given = system_.B.cols() - laws_;
  const MatrixXd before = gamma0_ * answer(k), behind = gamma1_ * answer(k + 1);
  const MatrixXd& sees = arguments_.sees.value;
  MatrixXd& step = ahead_[static_cast<std::size_t>(k)];
  step.resize(states_, states_ + disturbances_ + changes_ + 1);
  step.leftCols(states_) = exact_.transition.value + before * sees;
  step.middleCols(states_, disturbances_) = disturb_;
  step.middleCols(states_ + disturbances_, changes_) = moved + gamma0_ * law_partials(k) + gamma1_ * law_partials(k + 1);
  step.rightCols(1) = gamma0_ * force_.col(k) - before * (sees * state_.col(k)) + gamma1_ * force_.col(k + 1) - behind * (sees * state_.col(k + 1));
  if (given > 0) step.rightCols(1) += exact_.input0.value.leftCols(given) * inputs_.row(k).transpose() + exact_.input1.value.leftCols(given) * inputs_.row(k + 1).transpose();
  if (followed_ && laws_ > 0)  // (1 - gamma1 slope sees)^-1, of low rank
    step += behind * (MatrixXd::Identity(behind.cols(), behind.cols()) - sees * behind).partialPivLu().solve(sees * step);
}

/// A reading near the trajectory, in units of its noise, over [x | change | offsets | right].
void LawSmoother::write_reading(Index k, Index channel, Eigen::Ref<RowVectorXd> row) const {
  const double w = weight_(k, channel);
  const Index given = system_.B.cols() - laws_;
  const auto direct = system_.D.value.row(channel).tail(laws_);
  const RowVectorXd by_argument = direct * answer(k);
  row.head(states_) = w * (system_.C.value.row(channel) + by_argument * arguments_.sees.value);
  for (Index a = 0; a < changes_; ++a) {
    const Index j = parameters_[static_cast<std::size_t>(a)];
    double change = direct.dot(law_partials(k).col(a));
    if (system_.C.depends_on(j)) change += system_.C.d(j).row(channel).dot(state_.col(k));
    if (system_.D.depends_on(j)) change += system_.D.d(j).row(channel).tail(laws_).dot(force_.col(k));
    row[states_ + a] = w * change;
  }
  row[states_ + changes_ + channel] = w;
  double known = direct.dot(force_.col(k)) - by_argument.dot(arguments_.sees.value * state_.col(k));
  if (given > 0) known += system_.D.value.row(channel).head(given).dot(inputs_.row(k));
  row[row.size() - 1] = w * (measured_(k, channel) - known);
}

/// What the channels read of the disturbances of a sample at once, channels x disturbances: of the laws' errors what they read of the laws. Errors that last a part of a sample would be another noise of every reading.
MatrixXd LawSmoother::read_disturbances() const {
  MatrixXd reads = MatrixXd::Zero(channels_, disturbances_);
  if (parts_ == 1) reads.leftCols(static_cast<Index>(show_.size())) = system_.D.value.rightCols(laws_)(Eigen::all, show_);
  return reads;
}

LawSmoother::Information LawSmoother::information(const VectorXd& theta, const VectorXd& sigma) {
  prepare(theta);
  look_at_laws(theta);
  constexpr Index stack = 32;  // samples whose readings are put together before they are triangularised
  const Index steps = samples_ - 1, n = states_, u = disturbances_, all = n + changes_ + channels_;
  const MatrixXd moved = moved_by_theta(), at_once = read_disturbances();
  ahead_.resize(static_cast<std::size_t>(steps));
  best_disturbance_.resize(static_cast<std::size_t>(steps));
  // What all later samples say: of the state behind the step over [x | change | offsets | right], and of [change | offsets | right] beside any state.
  const Index beside = changes_ + channels_ + 1;
  count_work(2 * steps * n * n * (n + u + beside));  // beside those of triangularise
  MatrixXd later = MatrixXd::Zero(n, n + beside), known = MatrixXd::Zero(beside + channels_ * stack, beside);
  MatrixXd rows(n + u + channels_, u + n + beside);
  RowVectorXd row(all + 1);
  Index filled = beside;
  for (Index k = steps; k >= 0; --k) {
    rows.setZero();
    if (k < steps) {
      write_step(k, Eigen::Map<const MatrixXd>(moved.col(k).data(), n, changes_));
      const MatrixXd& step = ahead_[static_cast<std::size_t>(k)];
      const auto of_state = later.leftCols(n).triangularView<Eigen::Upper>();
      rows.topLeftCorner(n, u) = of_state * step.middleCols(n, u);
      rows.block(0, u, n, n) = of_state * step.leftCols(n);
      rows.topRightCorner(n, beside) = later.rightCols(beside);
      rows.block(0, u + n, n, changes_) += of_state * step.middleCols(n + u, changes_);
      rows.topRightCorner(n, 1) -= of_state * step.rightCols(1);
      rows.block(n, 0, u, u).diagonal() = sigma.cwiseInverse();
    }
    for (Index c = 0; c < channels_; ++c)
      if (weight_(k, c) > 0) {
        row.setZero();
        write_reading(k, c, row);
        rows.row(n + u + c).tail(all + 1) = row;
        if (k < steps) rows.row(n + u + c).head(u) = weight_(k, c) * at_once.row(c);
      }
    triangularise(rows, u + n);
    if (k < steps) best_disturbance_[static_cast<std::size_t>(k)] = rows.topRows(u);
    later = rows.block(u, u, n, all + 1);
    known.middleRows(filled, channels_) = rows.bottomRightCorner(channels_, beside);
    filled += channels_;
    if (filled == known.rows() || k == 0) {
      triangularise(known.topRows(filled), beside);
      filled = beside;
    }
  }

  // Of the first state only some is free; what the readings do not determine of it stays zero.
  constexpr double hardly = 1e-9;
  const auto free = static_cast<Index>(free_.size());
  first_ = MatrixXd::Zero(n + beside + free, free + beside);
  for (Index i = 0; i < free; ++i) {
    first_.col(i).head(n) = later.col(free_[static_cast<std::size_t>(i)]);
    first_(n + beside + i, i) = hardly * first_.col(i).norm() + 1e-300;
  }
  first_.block(0, free, n, beside) << later.middleCols(n + changes_, channels_), later.middleCols(n, changes_), later.rightCols(1);
  first_.block(n, free, beside, beside) << known.block(0, changes_, beside, channels_), known.topLeftCorner(beside, changes_), known.topRightCorner(beside, 1);
  triangularise(first_, first_.cols());
  const Index solved = free + channels_;
  return {first_.block(solved, solved, changes_, changes_), first_.block(solved, solved + changes_, changes_, 1)};
}

void LawSmoother::step(const VectorXd& change) {
  const auto free = static_cast<Index>(free_.size());
  const Index n = states_, u = disturbances_, solved = free + channels_;
  const VectorXd start = first_.topLeftCorner(solved, solved)
                             .triangularView<Eigen::Upper>()
                             .solve(first_.topRows(solved).rightCols(1).col(0) - first_.block(0, solved, solved, changes_) * change);
  offset_ = start.tail(channels_);
  state_.col(0).setZero();
  for (Index i = 0; i < free; ++i) state_(free_[static_cast<std::size_t>(i)], 0) = start[i];
  disturbance_.resize(u, samples_ - 1);
  VectorXd right(u);
  for (Index k = 0; k + 1 < samples_; ++k) {
    const MatrixXd &best = best_disturbance_[static_cast<std::size_t>(k)], &ahead = ahead_[static_cast<std::size_t>(k)];
    right = best.rightCols(1);
    right.noalias() -= best.middleCols(u, n) * state_.col(k);
    right.noalias() -= best.middleCols(u + n, changes_) * change;
    right.noalias() -= best.middleCols(u + n + changes_, channels_) * offset_;
    disturbance_.col(k) = best.leftCols(u).triangularView<Eigen::Upper>().solve(right);
    state_.col(k + 1) = ahead.rightCols(1);
    state_.col(k + 1).noalias() += ahead.leftCols(n) * state_.col(k);
    state_.col(k + 1).noalias() += ahead.middleCols(n, u) * disturbance_.col(k);
    state_.col(k + 1).noalias() += ahead.middleCols(n + u, changes_) * change;
  }
  followed_ = true;
}

double LawSmoother::cost(const VectorXd& sigma) const {
  const Index given = system_.B.cols() - laws_;
  MatrixXd left = measured_ - (system_.C.value * state_ + system_.D.value.rightCols(laws_) * force_).transpose();
  if (given > 0) left -= inputs_.topRows(samples_) * system_.D.value.leftCols(given).transpose();
  left.topRows(samples_ - 1) -= (read_disturbances() * disturbance_).transpose();
  left.rowwise() -= offset_.transpose();
  return left.cwiseProduct(weight_).squaredNorm() + (sigma.cwiseInverse().asDiagonal() * disturbance_).squaredNorm();
}

VectorXd LawSmoother::disturbance() const { return (disturbance_.rowwise().squaredNorm() / static_cast<double>(disturbance_.cols())).cwiseSqrt(); }

VectorXd LawSmoother::linear() const {
  VectorXd c = VectorXd::Zero(static_cast<Index>(run_.free_states().size()) + channels_);
  for (std::size_t i = 0; i < free_.size(); ++i) c[static_cast<Index>(i)] = state_(free_[i], 0);
  c.tail(channels_) = offset_;
  return c;
}

MatrixXd LawSmoother::states() const {
  MatrixXd at_samples(states_, readings_);
  for (Index k = 0; k < readings_; ++k) at_samples.col(k) = state_.col(k * parts_);
  return at_samples;
}

}  // namespace unrig
