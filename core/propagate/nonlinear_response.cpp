#include "core/propagate/nonlinear_response.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include <fmt/format.h>

#include "core/numerics/small_product.h"
#include "core/numerics/work.h"
#include "core/propagate/block_of_steps.h"
#include "core/propagate/feedback_force.h"
#include "core/propagate/step_matrices.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// How many forces and arguments a step has, in its middle and at its end together. Known numbers, or known bounds, so that a step allocates nothing.
template <int forces, int arguments, int most>
struct Sizes {
  static constexpr int most_forces = forces == Eigen::Dynamic ? most : forces, most_arguments = arguments == Eigen::Dynamic ? most : arguments;
  static constexpr bool is_one_law = forces != Eigen::Dynamic;
  using Forces = Eigen::Matrix<double, forces, 1, 0, most_forces, 1>;
  using Seen = Eigen::Matrix<double, arguments, 1, 0, most_arguments, 1>;
  using Slopes = Eigen::Matrix<double, forces, arguments, 0, most_forces, most_arguments>;
  using Gain = Eigen::Matrix<double, arguments, forces, 0, most_arguments, most_forces>;
  using Square = Eigen::Matrix<double, forces, forces, 0, most_forces, most_forces>;
};
constexpr int in_a_handful = 32;
using LawOfOne = Sizes<2, 2, 2>;  ///< argument
using LawOfSeveral = Sizes<2, Eigen::Dynamic, 2 * most_law_arguments>;
using AHandful = Sizes<Eigen::Dynamic, Eigen::Dynamic, in_a_handful>;
using Many = Sizes<Eigen::Dynamic, Eigen::Dynamic, Eigen::Dynamic>;  ///< a law on each of many strips

/// The laws of all feedbacks at some instants, one behind the other.
template <class S>
class Laws {
 public:
  Laws(const LinearSystem& system, const Arguments& arguments, const VectorXd& theta, Index instants)
      : force(S::Forces::Zero(instants * feedbacks_of(system))), slope(S::Seen::Zero(instants * arguments.count())), system_(system), arguments_(arguments), theta_(theta), instants_(instants) {}
  /// At the arguments z of all feedbacks in turn.
  void at(const typename S::Seen& z) {
    constexpr int of_a_law = 50;  // about, with the powers in it
    count_work(of_a_law * force.size());
    for (Index k = 0, i = 0; k < instants_; ++k)
      for (std::size_t law = 0; law < system_.feedback.size(); ++law, ++i) {
        const Index first = k * arguments_.count() + arguments_.first[law], count = system_.feedback[law].sees.rows();
        const FeedbackForce f = force_of(system_.feedback[law], z.data() + first, theta_);
        force[i] = f.value;
        for (Index a = 0; a < count; ++a) slope[first + a] = f.slope[static_cast<std::size_t>(a)];
      }
  }
  /// d force / d theta at z, forces x those parameters that are carried. `place`: of each among these.
  void partials_at(const typename S::Seen& z, const std::vector<Index>& place, Eigen::Ref<MatrixXd> partials) const {
    partials.setZero();
    for (Index k = 0, i = 0; k < instants_; ++k)
      for (std::size_t law = 0; law < system_.feedback.size(); ++law, ++i) {
        const Feedback& f = system_.feedback[law];
        const FeedbackForce at_z = force_of(f, z.data() + k * arguments_.count() + arguments_.first[law], theta_);
        for (Index p = 0; p < f.parameters; ++p) partials(i, place[static_cast<std::size_t>(f.first_parameter + p)]) = at_z.partial[static_cast<std::size_t>(p)];
      }
  }
  /// Slopes as forces x arguments.
  typename S::Slopes of_each(const typename S::Seen& slopes) const {
    const Index arguments = arguments_.count(), feedbacks = feedbacks_of(system_);
    typename S::Slopes own = S::Slopes::Zero(force.size(), slopes.size());
    for (Index a = 0; a < slopes.size(); ++a) own(a / arguments * feedbacks + arguments_.owner[static_cast<std::size_t>(a % arguments)], a) = slopes[a];
    return own;
  }
  typename S::Forces force;  ///< of each feedback
  typename S::Seen slope;    ///< in each argument, of the feedback whose it is

 private:
  static Index feedbacks_of(const LinearSystem& system) { return static_cast<Index>(system.feedback.size()); }

  const LinearSystem& system_;
  const Arguments& arguments_;
  const VectorXd& theta_;
  Index instants_;
};

template <class Square>
Square inverse_of(const Square& m) {
  if constexpr (Square::RowsAtCompileTime == Eigen::Dynamic) return m.partialPivLu().inverse();
  return m.inverse();
}

/// z = known + gain f with f = laws(z), from f = `start`; leaves f in laws.force. Newton's method. Where a step does not take the residual down it is tried once along the slopes at `before`, what the laws saw a step
/// before (friction that sticks is as steep there as it will be), and then halved. Several laws keep the inverse of an earlier step as long as that takes the residual down. The rounding of a steep law stays in the residual:
/// a step that moves z by no more than rounding is not taken. `inverse`: of 1 - slope gain.
template <class S>
typename S::Seen solve_forces(Laws<S>& laws, const typename S::Seen& known, const typename S::Gain& gain, const typename S::Forces& start, const typename S::Seen& before, typename S::Square& inverse) {
  constexpr int most = 60;
  constexpr double quickly = 0.1;
  typename S::Forces force = start, left;
  typename S::Seen z;
  const auto missed_at = [&](const typename S::Forces& f) {
    z = known + gain.lazyProduct(f);
    laws.at(z);
    left = laws.force - f;
    return gain.lazyProduct(left).norm();
  };
  double missed = missed_at(force);
  for (int i = 0; i < most; ++i) {
    const double rounding = 1e-13 * (known.norm() + z.norm()) + 1e-300;
    if (!(missed > rounding)) return z;
    const typename S::Forces from = force, residual = left;
    double after = INFINITY;
    const auto go = [&](double share) {
      force = from + share * inverse.lazyProduct(residual);
      after = missed_at(force);
    };
    const auto invert = [&] { inverse = inverse_of<typename S::Square>(S::Square::Identity(force.size(), force.size()) - laws.of_each(laws.slope).lazyProduct(gain)); };
    if constexpr (S::is_one_law) {
      invert();
      if (!(gain.lazyProduct(inverse.lazyProduct(residual)).norm() > rounding)) return z;
      go(1);
    } else {
      const typename S::Seen slope = laws.slope;
      go(1);
      if (!(after < quickly * missed)) {
        laws.slope = slope;
        invert();
        go(1);
      }
    }
    if (i == 0 && !(after < missed)) {
      const typename S::Square here = inverse;
      laws.at(before);
      const typename S::Slopes own = laws.of_each(laws.slope);
      inverse = inverse_of<typename S::Square>(S::Square::Identity(force.size(), force.size()) - own.lazyProduct(gain));
      const typename S::Forces along = laws.force + own.lazyProduct(known - before);
      force = inverse.lazyProduct(along);
      after = missed_at(force);
      if (!(after < missed)) inverse = here;
    }
    for (double share = 0.5; !(after < missed) && share > 1e-4; share /= 2) go(share);
    if (!(after < missed)) {  // stuck
      missed_at(from);
      return z;
    }
    missed = after;
  }
  return z;
}

Index steps_per_sample(const LinearSystem& system) {
  Index most = 1;
  for (const Feedback& f : system.feedback) most = std::max(most, f.steps_per_sample);
  return most;
}

template <class S>
class Follower {
 public:
  Follower(const LinearSystem& system, const ExactStep& half, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials)
      : system_(system),
        drive_(drive),
        theta_(theta),
        dt_(2 * half.dt),
        per_sample_(steps_per_sample(system)),
        samples_(samples),
        steps_(samples * per_sample_),
        arguments_(system),
        laws_(system, arguments_, theta, StepMatrices::nodes),
        one_(system, half, arguments_, partials == Partials::all ? system.A.parameters() : 0),
        directions_(drive.start_tangent.cols()),
        carried_(parameters_that_act(system)),
        gain_(one_.late.middleRows(one_.argument(), one_.seen())),
        inverse_(S::Square::Identity(one_.forces(), one_.forces())),
        seen_(S::Seen::Zero(one_.seen())) {
    place_.assign(static_cast<std::size_t>(one_.parameters), -1);
    for (std::size_t a = 0; a < carried_.size(); ++a) place_[static_cast<std::size_t>(carried_[a])] = static_cast<Index>(a);
  }

  NonlinearResponse run() {
    begin();
    for (Index first = 0; first < steps_ && response_.finite; first += most_at_a_time) {
      const Index count = std::min(most_at_a_time, steps_ - first);
      march(first, count);
      if (directions_ > 0 && response_.finite) carry_directions(first, count);
      if (carried() > 0 && response_.finite) carry_parameters(first, count);
      now_.col(0) = now_.col(count);
    }
    response_.largest_argument = largest_;
    response_.end = now_.col(0).head(one_.states);
    response_.end_tangent = MatrixXd::Zero(one_.states, directions_ + one_.parameters);
    response_.end_tangent.leftCols(directions_) = work_.changes.topLeftCorner(directions_, one_.states).transpose();
    for (Index a = 0; a < carried(); ++a) response_.end_tangent.col(column(a)) = tangent_.col(a).head(one_.states);
    return std::move(response_);
  }

 private:
  static constexpr Index most_at_a_time = 256;

  /// Those of which anything in the step, the laws or the start depends.
  std::vector<Index> parameters_that_act(const LinearSystem& system) const {
    std::vector<char> acts(static_cast<std::size_t>(one_.parameters), 0);
    if (one_.parameters > 0)
      for (const Feedback& f : system.feedback)
        for (Index k = 0; k < f.parameters; ++k) acts[static_cast<std::size_t>(f.first_parameter + k)] = 1;
    for (const StepMatrices::Partial& p : one_.partials) acts[static_cast<std::size_t>(p.parameter)] = 1;
    std::vector<Index> carried;
    for (Index j = 0; j < one_.parameters; ++j) {
      const bool begins = drive_.start_partial.size() > 0 && !drive_.start_partial.col(j).isZero(0);
      if (acts[static_cast<std::size_t>(j)] || begins || arguments_.sees.depends_on(j) || arguments_.sees_input.depends_on(j)) carried.push_back(j);
    }
    return carried;
  }
  Index carried() const { return static_cast<Index>(carried_.size()); }
  /// Of a carried parameter in the tangents of the response.
  Index column(Index a) const { return directions_ + carried_[static_cast<std::size_t>(a)]; }

  void begin() {
    const Index block = std::min(most_at_a_time, steps_);
    response_.output.resize(samples_, one_.channels);
    const Index columns = directions_ + one_.parameters;
    response_.tangent.assign(static_cast<std::size_t>(columns > 0 ? one_.channels : 0), MatrixXd::Zero(samples_, columns));
    now_ = MatrixXd::Zero(one_.inputs() + one_.forces(), block + 1);
    slope_ = MatrixXd::Zero(one_.seen(), block);
    stepped_ = VectorXd::Zero(one_.rows());
    law_partial_ = MatrixXd::Zero(one_.forces(), carried() * block);
    largest_ = VectorXd::Zero(one_.feedbacks);
    now_.col(0).head(one_.states) = drive_.start;
    start_laws();
  }

  /// The forces where the stretch begins, which the laws may see in the accelerations.
  void start_laws() {
    const Index m = one_.feedbacks;
    Laws<Many> laws(system_, arguments_, theta_, 1);
    const MatrixXd of_forces = arguments_.sees_input.value.rightCols(m);
    VectorXd known = arguments_.sees.value * drive_.start;
    if (one_.measured > 0) known += arguments_.sees_input.value.leftCols(one_.measured) * drive_.input.row(0).transpose();
    MatrixXd inverse = MatrixXd::Identity(m, m);
    const VectorXd z = solve_forces<Many>(laws, known, of_forces, VectorXd::Zero(m), known, inverse);
    now_.col(0).segment(one_.force(), m) = laws.force;
    MatrixXd partials(m, carried());
    if (carried() > 0) laws.partials_at(z, place_, partials);
    start_tangents(laws, partials);
  }

  void start_tangents(const Laws<Many>& laws, const MatrixXd& partials) {
    const Index n = one_.states, m = one_.feedbacks, p = carried();
    MatrixXd start = MatrixXd::Zero(n, directions_ + p);
    if (directions_ > 0) start.leftCols(directions_) = drive_.start_tangent;
    if (p > 0 && drive_.start_partial.size() > 0) start.rightCols(p) = drive_.start_partial(Eigen::all, carried_);
    const MatrixXd force = force_tangents(start, laws, partials);
    tangent_.resize(n + m, p);
    tangent_ << start.rightCols(p), force.rightCols(p);
    next_.resize(one_.rows(), p);
    work_.changes.resize(0, n);
    if (directions_ == 0) return;
    const bool jerks = drive_.jerk_tangent.size() > 0;
    block_.emplace(one_, BlockOfSteps::best_length(one_), jerks);
    work_ = block_->work(directions_);
    work_.changes.topLeftCorner(directions_, n + m) << start.leftCols(directions_).transpose(), force.leftCols(directions_).transpose();
  }

  /// Of the forces where the stretch begins: df = slope dz + partial, dz = sees dx + dsees x + the same of inputs and forces.
  MatrixXd force_tangents(const MatrixXd& state, const Laws<Many>& laws, const MatrixXd& partials) {
    const Index m = one_.feedbacks;
    MatrixXd seen = arguments_.sees.value * state, partial = MatrixXd::Zero(m, state.cols());
    partial.rightCols(carried()) = partials;
    const MatrixXd own = laws.of_each(laws.slope);
    if (!arguments_.accelerations) return own * seen + partial;
    VectorXd inputs(one_.measured + m);
    if (one_.measured > 0) inputs.head(one_.measured) = drive_.input.row(0).transpose();
    inputs.tail(m) = laws.force;
    for (Index a = 0; a < carried(); ++a) {
      const Index j = carried_[static_cast<std::size_t>(a)];
      if (arguments_.sees.depends_on(j)) seen.col(directions_ + a) += arguments_.sees.d(j) * drive_.start;
      if (arguments_.sees_input.depends_on(j)) seen.col(directions_ + a) += arguments_.sees_input.d(j) * inputs;
    }
    const MatrixXd answer = MatrixXd::Identity(m, m) - own * arguments_.sees_input.value.rightCols(m);
    return answer.partialPivLu().solve(own * seen + partial);
  }

  auto law_partials(Index k) { return law_partial_.middleCols(k * carried(), carried()); }

  /// The response itself; leaves v and the forces in the middle and at the end of every step in now_, the laws' slopes in slope_.
  void march(Index first, Index count) {
    const Index n = one_.states, m = one_.feedbacks, q = one_.measured;
    for (Index k = 0; k < count; ++k) {
      auto v = now_.col(k), next = now_.col(k + 1);
      const Index sample = (first + k) / per_sample_, part = (first + k) % per_sample_;
      v[one_.jerk()] = drive_.jerk.size() > 0 ? drive_.jerk[sample] : 0;
      for (Index i = 0; i < q; ++i) {
        v[one_.input() + i] = input_at(sample, part, i);
        v[one_.input() + q + i] = input_at(sample, part + 1, i);
      }
      small_product(one_.step.data(), one_.rows(), one_.inputs(), v.data(), 0, 1, stepped_.data(), 0);
      if (part == 0) response_.output.row(sample) = stepped_.segment(one_.output(), one_.channels).transpose();
      typename S::Forces held(one_.forces());
      held << v.segment(one_.force(), m), v.segment(one_.force(), m);
      const typename S::Seen z = solve_forces<S>(laws_, stepped_.segment(one_.argument(), one_.seen()), gain_, held, seen_, inverse_);
      for (Index node = 0; node < StepMatrices::nodes; ++node) seen_.segment(node * one_.arguments, one_.arguments) = z.tail(one_.arguments);
      next.head(n) = stepped_.head(n);
      for (Index i = 0; i < one_.forces(); ++i) {
        next.head(n) += laws_.force[i] * one_.late.col(i).head(n);
        v[one_.inputs() + i] = laws_.force[i];
      }
      for (Index i = 0; i < m; ++i) {
        next[one_.force() + i] = laws_.force[m + i];
        largest_[i] = std::max(largest_[i], std::abs(z[one_.arguments + arguments_.first[static_cast<std::size_t>(i)]]));
      }
      slope_.col(k) = laws_.slope;
      if (carried() > 0) laws_.partials_at(z, place_, law_partials(k));
      if (!next.head(n).allFinite()) {
        response_.finite = false;
        return;
      }
    }
  }

  double input_at(Index sample, Index part, Index column) const {
    if (part == 0) return drive_.input(sample, column);
    if (part == per_sample_) return drive_.input(sample + 1, column);
    const auto parts = static_cast<double>(per_sample_);
    return input_between(system_, drive_.input, dt_ * parts, sample, static_cast<double>(part) / parts, column);
  }

  /// The tangents along the directions over the same steps: df = slope dz, where dz is solved for.
  void carry_directions(Index first, Index count) {
    for (Index done = 0; done < count;) {
      const BlockOfSteps& block = count - done >= block_->steps() ? *block_ : last_block(count - done);
      block.begin(work_);
      for (Index k = 0; k < block.steps(); ++k) {
        if (drive_.jerk_tangent.size() > 0) block.jerk(work_, k).head(directions_) = drive_.jerk_tangent.row((first + done + k) / per_sample_);
        block.add_changes(work_, k);
        block.forces(work_, k) = work_.seen.middleCols(k * block.per_step(), one_.seen()).lazyProduct(answer_to(slope_.col(done + k)).transpose());
      }
      read_directions(block, first + done);
      block.end(work_);
      done += block.steps();
    }
  }

  /// What is left of the steps at their end.
  const BlockOfSteps& last_block(Index steps) {
    if (!last_block_ || last_block_->steps() != steps) last_block_.emplace(one_, steps, drive_.jerk_tangent.size() > 0);
    return *last_block_;
  }

  /// The channels of a block whose first step is `first`, at the steps that begin a sample.
  void read_directions(const BlockOfSteps& block, Index first) {
    const Index sample = (first + per_sample_ - 1) / per_sample_, skipped = sample * per_sample_ - first;
    if (skipped >= block.steps()) return;
    const Index reads = (block.steps() - skipped - 1) / per_sample_ + 1, rows = work_.seen.rows();
    for (Index c = 0; c < one_.channels; ++c) {
      const Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>> seen(work_.seen.col(skipped * block.per_step() + one_.seen() + c).data(), directions_, reads, Eigen::OuterStride<>(per_sample_ * block.per_step() * rows));
      response_.tangent[static_cast<std::size_t>(c)].block(sample, 0, reads, directions_) = seen.transpose();
    }
  }

  /// The tangents in the parameters over the same steps: dx' = step dv + dstep v + late df + dlate f, df = slope dz + partial, where dz is solved for.
  void carry_parameters(Index first, Index count) {
    const Index n = one_.states, m = one_.feedbacks, p = carried(), rows = one_.rows();
    source_.resize(rows, static_cast<Index>(one_.partials.size()) * count);
    for (std::size_t i = 0; i < one_.partials.size(); ++i)
      small_product(one_.partials[i].both.data(), rows, now_.rows(), now_.data(), now_.rows(), count, source_.col(static_cast<Index>(i) * count).data(), rows);
    for (Index k = 0; k < count; ++k) {
      small_product(one_.step.data(), rows, one_.jerk(), tangent_.data(), tangent_.rows(), p, next_.data(), next_.rows());
      for (std::size_t i = 0; i < one_.partials.size(); ++i) next_.col(place_[static_cast<std::size_t>(one_.partials[i].parameter)]) += source_.col(static_cast<Index>(i) * count + k);
      if ((first + k) % per_sample_ == 0)
        for (Index c = 0; c < one_.channels; ++c)
          for (Index a = 0; a < p; ++a) response_.tangent[static_cast<std::size_t>(c)]((first + k) / per_sample_, column(a)) = next_(one_.output() + c, a);
      next_ += one_.late.lazyProduct(law_partials(k));
      const typename S::Slopes answer = answer_to(slope_.col(k));
      for (Index j = 0; j < p; ++j) {
        const typename S::Forces force = answer.lazyProduct(next_.col(j).segment(one_.argument(), one_.seen()));
        for (Index i = 0; i < one_.forces(); ++i) next_.col(j).head(n) += force[i] * one_.late.col(i).head(n);
        tangent_.col(j).head(n) = next_.col(j).head(n);
        tangent_.col(j).tail(m) = force.tail(m) + law_partials(k).col(j).tail(m);
      }
    }
  }

  /// How the forces of a step, in its middle and at its end, answer to what the laws see there without them, forces x arguments: df = slope (dz + gain df).
  typename S::Slopes answer_to(const typename S::Seen& slope) const {
    const typename S::Slopes own = laws_.of_each(slope);
    const typename S::Square left = S::Square::Identity(own.rows(), own.rows()) - own.lazyProduct(gain_);
    if constexpr (S::is_one_law) return left.inverse() * own;
    return left.partialPivLu().solve(own);
  }

  const LinearSystem& system_;
  const NonlinearDrive& drive_;
  const VectorXd& theta_;
  double dt_;  // of a step
  Index per_sample_, samples_, steps_;
  Arguments arguments_;
  Laws<S> laws_;
  StepMatrices one_;
  Index directions_;
  std::vector<Index> carried_, place_;  // parameters whose tangents are carried, and of each parameter where among them
  typename S::Gain gain_;       // arguments x forces: how the forces in the middle and at the end of a step move what the laws see there
  typename S::Square inverse_;  // of 1 - slope gain_, at a step before
  typename S::Seen seen_;       // what the laws saw at the end of the step before, for each node
  NonlinearResponse response_;
  MatrixXd now_;  // of each step v, and its forces in the middle and at the end
  MatrixXd slope_, law_partial_, source_;
  MatrixXd tangent_, next_;  // of [x; f] in the carried parameters, and the rows of a step
  std::optional<BlockOfSteps> block_, last_block_;
  BlockOfSteps::Work work_;
  VectorXd stepped_, largest_;
};

}  // namespace

LinearSystem linear_part(LinearSystem system) {
  const Index measured = system.B.cols() - static_cast<Index>(system.feedback.size());
  system.feedback.clear();
  for (DualMatrix* m : {&system.B, &system.D}) *m = m->block(0, 0, m->rows(), measured);
  return system;
}

LinearSystem under_one_input(LinearSystem system, Index input) {
  for (DualMatrix* m : {&system.A, &system.B, &system.C, &system.D}) m->partial.clear();
  for (DualMatrix* m : {&system.B, &system.D}) *m = m->block(0, input, m->rows(), 1);
  system.feedback.clear();
  system.curved = 0;
  return system;
}

ExactStep step_to_follow(const LinearSystem& system, double dt) { return exact_step(system, dt / static_cast<double>(2 * steps_per_sample(system))); }

NonlinearResponse follow(const LinearSystem& system, const ExactStep& half, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials) {
  Index arguments = 0;
  for (const Feedback& f : system.feedback) arguments += f.sees.rows();
  const auto feedbacks = static_cast<Index>(system.feedback.size());
  if (const Index measured = system.B.cols() - feedbacks; drive.input.cols() != measured) throw std::invalid_argument(fmt::format("a system of {} measured inputs cannot be driven by {}", measured, drive.input.cols()));
  if (feedbacks == 1 && arguments == 1) return Follower<LawOfOne>(system, half, theta, drive, samples, partials).run();
  if (feedbacks == 1) return Follower<LawOfSeveral>(system, half, theta, drive, samples, partials).run();
  if (StepMatrices::nodes * std::max(feedbacks, arguments) <= in_a_handful) return Follower<AHandful>(system, half, theta, drive, samples, partials).run();
  return Follower<Many>(system, half, theta, drive, samples, partials).run();
}

}  // namespace unrig
