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

// How many feedbacks and arguments there are: one of each, a handful of both, so that a step allocates nothing, or any number (a law on each of many strips).
constexpr int one = 1, handful = Eigen::Dynamic, many = -2;
constexpr int in_a_handful = 16;
constexpr int rows_of(int M) { return M == one ? 1 : Eigen::Dynamic; }
constexpr int most_rows_of(int M) { return M == one ? 1 : M == handful ? in_a_handful : Eigen::Dynamic; }
template <int M>
using Few = Eigen::Matrix<double, rows_of(M), 1, 0, most_rows_of(M), 1>;
template <int M>
using FewSquare = Eigen::Matrix<double, rows_of(M), rows_of(M), 0, most_rows_of(M), most_rows_of(M)>;

/// The laws of all feedbacks at one sample.
template <int M>
class Laws {
 public:
  Laws(const LinearSystem& system, const Arguments& arguments, const VectorXd& theta) : system_(system), arguments_(arguments), theta_(theta) {
    force = Few<M>::Zero(static_cast<Index>(system.feedback.size()));
    slope = Few<M>::Zero(arguments.count());
  }
  /// At the arguments z of all feedbacks in turn.
  void at(const Few<M>& z) {
    constexpr int of_a_law = 50;  // about, with the powers in it
    count_work(of_a_law * static_cast<std::int64_t>(system_.feedback.size()));
    for (std::size_t i = 0; i < system_.feedback.size(); ++i) {
      const Index first = arguments_.first[i], count = system_.feedback[i].sees.rows();
      const FeedbackForce f = force_of(system_.feedback[i], z.data() + first, theta_);
      force[static_cast<Index>(i)] = f.value;
      for (Index a = 0; a < count; ++a) slope[first + a] = f.slope[static_cast<std::size_t>(a)];
    }
  }
  /// d force / d theta at z, feedbacks x those parameters that are carried. `place`: of each among these.
  void partials_at(const Few<M>& z, const std::vector<Index>& place, Eigen::Ref<MatrixXd> partials) const {
    partials.setZero();
    for (std::size_t i = 0; i < system_.feedback.size(); ++i) {
      const Feedback& f = system_.feedback[i];
      const FeedbackForce at_z = force_of(f, z.data() + arguments_.first[i], theta_);
      for (Index k = 0; k < f.parameters; ++k) partials(static_cast<Index>(i), place[static_cast<std::size_t>(f.first_parameter + k)]) = at_z.partial[static_cast<std::size_t>(k)];
    }
  }
  Few<M> force;  ///< of each feedback
  Few<M> slope;  ///< in each argument, of the feedback whose it is

 private:
  const LinearSystem& system_;
  const Arguments& arguments_;
  const VectorXd& theta_;
};

/// z with z = known + gain f(z): Newton's method with the inverse of an earlier step as long as that takes the residual down, halved where it does not fall. `by_argument`: the
/// column of `gain` for each argument's feedback. `inverse`: of 1 - by_argument slope.
template <int M>
Few<M> implicit_argument(Laws<M>& laws, const Few<M>& known, const FewSquare<M>& gain, const FewSquare<M>& by_argument, Few<M> z, FewSquare<M>& inverse) {
  constexpr int most = 60;
  constexpr double quickly = 0.1;
  const Index m = z.size();
  const auto residual_of = [&](const Few<M>& at) -> Few<M> {
    laws.at(at);
    return at - known - gain.lazyProduct(laws.force);
  };
  Few<M> residual = residual_of(z);
  for (int i = 0; i < most; ++i) {
    const double size = residual.norm(), scale = 1e-13 * (known.norm() + z.norm()) + 1e-300;
    if (!(size > scale)) return z;
    Few<M> next, after;
    const auto go = [&](double fraction) {
      next = z - fraction * inverse.lazyProduct(residual);
      after = residual_of(next);
    };
    bool fell = false;
    if constexpr (M == one) {
      inverse(0, 0) = 1 / (1 - by_argument(0, 0) * laws.slope[0]);
    } else {
      const Few<M> slope = laws.slope;
      go(1);
      fell = after.norm() < quickly * size;
      if (!fell) inverse = (FewSquare<M>::Identity(m, m) - by_argument * slope.asDiagonal()).partialPivLu().inverse();
    }
    if (!fell) go(1);
    for (double fraction = 0.5; !(after.norm() < size) && fraction > 1e-4; fraction /= 2) go(fraction);
    if (!(after.norm() < size)) break;  // stuck
    z = next;
    residual = after;
  }
  laws.at(z);
  return z;
}

Index steps_per_sample(const LinearSystem& system) {
  Index most = 1;
  for (const Feedback& f : system.feedback) most = std::max(most, f.steps_per_sample);
  return most;
}

template <int M>
class Follower {
 public:
  Follower(const LinearSystem& system, const ExactStep& exact, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials)
      : system_(system),
        drive_(drive),
        dt_(exact.dt),
        per_sample_(steps_per_sample(system)),
        samples_(samples),
        steps_(samples * per_sample_),
        arguments_(system),
        laws_(system, arguments_, theta),
        one_(system, exact, arguments_, partials == Partials::all ? system.A.parameters() : 0),
        directions_(drive.start_tangent.cols()),
        carried_(parameters_that_act(system)),
        gain_(one_.late.middleRows(one_.argument(), one_.arguments)),
        by_argument_(gain_(Eigen::all, arguments_.owner)) {
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
      slope_.col(0) = slope_.col(count);
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
    const Index n = one_.states, m = one_.feedbacks, block = std::min(most_at_a_time, steps_);
    response_.output.resize(samples_, one_.channels);
    const Index columns = directions_ + one_.parameters;
    response_.tangent.assign(static_cast<std::size_t>(columns > 0 ? one_.channels : 0), MatrixXd::Zero(samples_, columns));
    now_ = MatrixXd::Zero(one_.inputs() + m, block + 1);
    slope_ = MatrixXd::Zero(one_.arguments, block + 1);
    stepped_ = VectorXd::Zero(one_.rows());
    start_laws();
    now_.col(0).head(n) = drive_.start;
    now_.col(0).segment(one_.force(), m) = laws_.force;
    slope_.col(0) = laws_.slope;
    law_partial_ = MatrixXd::Zero(m, carried() * (block + 1));
    if (carried() > 0) laws_.partials_at(z_, place_, law_partials(0));
    largest_ = VectorXd::Zero(m);
    start_tangents();
  }

  /// The forces where the stretch begins, which the laws may see in the accelerations.
  void start_laws() {
    inverse_ = FewSquare<M>::Identity(one_.arguments, one_.arguments);
    const MatrixXd of_forces = arguments_.sees_input.value.rightCols(one_.feedbacks);
    VectorXd known = arguments_.sees.value * drive_.start;
    if (one_.measured > 0) known += arguments_.sees_input.value.leftCols(one_.measured) * drive_.input.row(0).transpose();
    z_ = known;
    laws_.at(z_);
    if (arguments_.accelerations) z_ = implicit_argument<M>(laws_, known, of_forces, of_forces(Eigen::all, arguments_.owner), z_, inverse_);
  }

  void start_tangents() {
    const Index n = one_.states, m = one_.feedbacks, p = carried();
    MatrixXd start = MatrixXd::Zero(n, directions_ + p);
    if (directions_ > 0) start.leftCols(directions_) = drive_.start_tangent;
    if (p > 0 && drive_.start_partial.size() > 0) start.rightCols(p) = drive_.start_partial(Eigen::all, carried_);
    const MatrixXd force = force_tangents(start);
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
  MatrixXd force_tangents(const MatrixXd& state) {
    const Index m = one_.feedbacks;
    MatrixXd seen = arguments_.sees.value * state, partial = MatrixXd::Zero(m, state.cols());
    partial.rightCols(carried()) = law_partials(0);
    const auto own = of_each<MatrixXd>(slope_.col(0));
    if (!arguments_.accelerations) return own * seen + partial;
    VectorXd inputs(one_.measured + m);
    if (one_.measured > 0) inputs.head(one_.measured) = drive_.input.row(0).transpose();
    inputs.tail(m) = laws_.force;
    for (Index a = 0; a < carried(); ++a) {
      const Index j = carried_[static_cast<std::size_t>(a)];
      if (arguments_.sees.depends_on(j)) seen.col(directions_ + a) += arguments_.sees.d(j) * drive_.start;
      if (arguments_.sees_input.depends_on(j)) seen.col(directions_ + a) += arguments_.sees_input.d(j) * inputs;
    }
    const MatrixXd answer = MatrixXd::Identity(m, m) - own * arguments_.sees_input.value.rightCols(m);
    return answer.partialPivLu().solve(own * seen + partial);
  }

  auto law_partials(Index k) { return law_partial_.middleCols(k * carried(), carried()); }

  /// The response itself; leaves v and the force at the end of every step in now_, the laws' slopes in slope_.
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
      z_ = implicit_argument<M>(laws_, stepped_.segment(one_.argument(), one_.arguments), gain_, by_argument_, z_, inverse_);
      next.head(n) = stepped_.head(n);
      for (Index i = 0; i < m; ++i) {
        const double force = laws_.force[i], z = z_[arguments_.first[static_cast<std::size_t>(i)]];
        next.head(n) += force * one_.late.col(i).head(n);
        next[one_.force() + i] = v[one_.inputs() + i] = force;
        largest_[i] = std::max(largest_[i], std::abs(z));
      }
      slope_.col(k + 1) = laws_.slope;
      if (carried() > 0) laws_.partials_at(z_, place_, law_partials(k + 1));
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
        block.forces(work_, k) = work_.seen.middleCols(k * block.per_step(), one_.arguments).lazyProduct(answer_to(slope_.col(done + k + 1)).transpose());
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
      const Eigen::Map<const MatrixXd, 0, Eigen::OuterStride<>> seen(work_.seen.col(skipped * block.per_step() + one_.arguments + c).data(), directions_, reads, Eigen::OuterStride<>(per_sample_ * block.per_step() * rows));
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
      next_ += one_.late.lazyProduct(law_partials(k + 1));
      const FewSquare<M> answer = answer_to(slope_.col(k + 1));
      for (Index j = 0; j < p; ++j) {
        const Few<M> force = answer.lazyProduct(next_.col(j).segment(one_.argument(), one_.arguments));
        for (Index i = 0; i < m; ++i) next_.col(j).head(n) += force[i] * one_.late.col(i).head(n);
        tangent_.col(j).head(n) = next_.col(j).head(n);
        tangent_.col(j).tail(m) = force + law_partials(k + 1).col(j);
      }
    }
  }

  /// How the forces at the end of a step, feedbacks x arguments, answer to what the laws see there without them: df = slope (dz + gain df).
  FewSquare<M> answer_to(const Few<M>& slope) const {
    if constexpr (M == one) {
      return slope / (1 - slope[0] * gain_(0, 0));
    } else {
      const auto own = of_each<FewSquare<M>>(slope);
      return (FewSquare<M>::Identity(own.rows(), own.rows()) - own.lazyProduct(gain_)).partialPivLu().solve(own);
    }
  }

  /// The slopes as feedbacks x arguments.
  template <typename Matrix>
  Matrix of_each(const Few<M>& slope) const {
    Matrix own = Matrix::Zero(one_.feedbacks, one_.arguments);
    for (Index a = 0; a < slope.size(); ++a) own(arguments_.owner[static_cast<std::size_t>(a)], a) = slope[a];
    return own;
  }

  const LinearSystem& system_;
  const NonlinearDrive& drive_;
  double dt_;  // of a step
  Index per_sample_, samples_, steps_;
  Arguments arguments_;
  Laws<M> laws_;
  StepMatrices one_;
  Index directions_;
  std::vector<Index> carried_, place_;  // parameters whose tangents are carried, and of each parameter where among them
  FewSquare<M> gain_;         // arguments x feedbacks: how the force at the end of a step moves what the laws see there
  FewSquare<M> by_argument_;  // the same for each argument's feedback
  FewSquare<M> inverse_;      // of 1 - by_argument_ slope, at a step before
  NonlinearResponse response_;
  MatrixXd now_;  // of each step v, and f at its end
  MatrixXd slope_, law_partial_, source_;
  MatrixXd tangent_, next_;  // of [x; f] in the carried parameters, and the rows of a step
  std::optional<BlockOfSteps> block_, last_block_;
  BlockOfSteps::Work work_;
  VectorXd stepped_, largest_;
  Few<M> z_;
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

ExactStep step_to_follow(const LinearSystem& system, double dt) { return exact_step(system, dt / static_cast<double>(steps_per_sample(system))); }

NonlinearResponse follow(const LinearSystem& system, const ExactStep& step, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials) {
  Index arguments = 0;
  for (const Feedback& f : system.feedback) arguments += f.sees.rows();
  const auto feedbacks = static_cast<Index>(system.feedback.size());
  if (const Index measured = system.B.cols() - feedbacks; drive.input.cols() != measured) throw std::invalid_argument(fmt::format("a system of {} measured inputs cannot be driven by {}", measured, drive.input.cols()));
  if (feedbacks == 1 && arguments == 1) return Follower<one>(system, step, theta, drive, samples, partials).run();
  if (std::max(feedbacks, arguments) <= in_a_handful) return Follower<handful>(system, step, theta, drive, samples, partials).run();
  return Follower<many>(system, step, theta, drive, samples, partials).run();
}

}  // namespace unrig
