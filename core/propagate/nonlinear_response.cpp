#include "core/propagate/nonlinear_response.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/propagate/feedback_force.h"
#include "core/numerics/small_product.h"

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
    for (std::size_t i = 0; i < system_.feedback.size(); ++i) {
      const Index first = arguments_.first[i], count = system_.feedback[i].sees.rows();
      const FeedbackForce f = force_of(system_.feedback[i], z.data() + first, theta_);
      force[static_cast<Index>(i)] = f.value;
      for (Index a = 0; a < count; ++a) slope[first + a] = f.slope[static_cast<std::size_t>(a)];
    }
  }
  /// d force / d theta at z, feedbacks x P.
  void partials_at(const Few<M>& z, Eigen::Ref<MatrixXd> partials) const {
    partials.setZero();
    for (std::size_t i = 0; i < system_.feedback.size(); ++i) {
      const Feedback& f = system_.feedback[i];
      const FeedbackForce at_z = force_of(f, z.data() + arguments_.first[i], theta_);
      for (Index k = 0; k < f.parameters; ++k) partials(static_cast<Index>(i), f.first_parameter + k) = at_z.partial[static_cast<std::size_t>(k)];
    }
  }
  Few<M> force;  ///< of each feedback
  Few<M> slope;  ///< in each argument, of the feedback whose it is

 private:
  const LinearSystem& system_;
  const Arguments& arguments_;
  const VectorXd& theta_;
};

template <int M>
Few<M> solve_few(const FewSquare<M>& matrix, const Few<M>& right) {
  if constexpr (M == one)
    return right / matrix(0, 0);
  else
    return matrix.partialPivLu().solve(right);
}

/// z with z = known + gain f(z): Newton's method, halved where the residual does not fall. `by_argument`: the column of `gain` for each argument's feedback.
template <int M>
Few<M> implicit_argument(Laws<M>& laws, const Few<M>& known, const FewSquare<M>& gain, const FewSquare<M>& by_argument, Few<M> z) {
  constexpr int most = 60;
  const Index m = z.size();
  const auto residual_of = [&](const Few<M>& at) -> Few<M> {
    laws.at(at);
    return at - known - gain * laws.force;
  };
  Few<M> residual = residual_of(z);
  for (int i = 0; i < most; ++i) {
    const double size = residual.norm(), scale = 1e-13 * (known.norm() + z.norm()) + 1e-300;
    if (!(size > scale)) return z;
    const Few<M> step = solve_few<M>(FewSquare<M>::Identity(m, m) - by_argument * laws.slope.asDiagonal(), residual);
    double fraction = 1;
    Few<M> next = z - step, after = residual_of(next);
    while (!(after.norm() < size) && fraction > 1e-4) {
      fraction /= 2;
      next = z - fraction * step;
      after = residual_of(next);
    }
    const bool stuck = !(after.norm() < size);
    if (stuck) break;
    z = next;
    residual = after;
  }
  laws.at(z);
  return z;
}

/// All that one sample step does linearly, as one matrix from v = [x; f; jerk; u now; u next] to [x without the force at the end of the step; what the laws see
/// of that; outputs now]. The rows are padded for small_product.
struct StepMatrices {
  Index states, feedbacks, arguments, channels, measured, parameters;
  MatrixXd step;     // rows x inputs
  MatrixXd late;     // rows x feedbacks: what the force at the end of the step adds
  MatrixXd partial;  // (rows P) x inputs, parameter by parameter
  MatrixXd late_partial;

  Index rows() const { return step.rows(); }
  Index inputs() const { return step.cols(); }
  Index force() const { return states; }
  Index jerk() const { return states + feedbacks; }
  Index input() const { return jerk() + 1; }
  Index argument() const { return states; }
  Index output() const { return states + arguments; }

  StepMatrices(const LinearSystem& system, const ExactStep& exact, const Arguments& seen, Index parameter_count)
      : states(system.states()), feedbacks(static_cast<Index>(system.feedback.size())), arguments(seen.count()), channels(system.C.rows()), measured(system.B.cols() - feedbacks), parameters(parameter_count) {
    const auto value = [](const DualMatrix& m) { return &m.value; };
    fill(system, exact, seen.sees.value, value, step, late);
    see(seen.sees_input.value, step, late);
    partial.resize(parameters * rows(), inputs());
    late_partial.resize(parameters * rows(), feedbacks);
    MatrixXd d_step, d_late;
    for (Index j = 0; j < parameters; ++j) {
      fill(system, exact, seen.sees.value, [j](const DualMatrix& m) { return m.depends_on(j) ? &m.d(j) : nullptr; }, d_step, d_late);
      if (seen.sees.depends_on(j)) {
        d_step.middleRows(argument(), arguments) += seen.sees.d(j) * step.topRows(states);
        d_late.middleRows(argument(), arguments) += seen.sees.d(j) * late.topRows(states);
      }
      if (seen.sees_input.depends_on(j)) see(seen.sees_input.d(j), d_step, d_late);
      partial.middleRows(j * rows(), rows()) = d_step;
      late_partial.middleRows(j * rows(), rows()) = d_late;
    }
  }

 private:
  /// What the laws see of inputs and forces at the end of the step.
  void see(const MatrixXd& sees_input, MatrixXd& all, MatrixXd& at_end) const {
    all.block(argument(), input() + measured, arguments, measured) += sees_input.leftCols(measured);
    at_end.middleRows(argument(), arguments) += sees_input.rightCols(feedbacks);
  }

  template <typename Part>
  void fill(const LinearSystem& system, const ExactStep& exact, const MatrixXd& sees, Part part, MatrixXd& all, MatrixXd& at_end) const {
    all = MatrixXd::Zero(padded_rows(states + arguments + channels), states + feedbacks + 1 + 2 * measured);
    at_end = MatrixXd::Zero(all.rows(), feedbacks);
    if (const MatrixXd* m = part(exact.transition)) all.topLeftCorner(states, states) = *m;
    if (const MatrixXd* m = part(exact.input0)) {
      all.block(0, force(), states, feedbacks) = m->rightCols(feedbacks);
      all.block(0, input(), states, measured) = m->leftCols(measured);
    }
    if (const MatrixXd* m = part(exact.input1)) {
      at_end.topRows(states) = m->rightCols(feedbacks);
      all.block(0, input() + measured, states, measured) = m->leftCols(measured);
    }
    if (exact.jerk.value.size() > 0)
      if (const MatrixXd* m = part(exact.jerk)) all.col(jerk()).head(states) = m->col(0);
    all.middleRows(argument(), arguments) = sees * all.topRows(states);
    at_end.middleRows(argument(), arguments) = sees * at_end.topRows(states);
    if (const MatrixXd* m = part(system.C)) all.block(output(), 0, channels, states) = *m;
    if (const MatrixXd* m = part(system.D)) {
      all.block(output(), force(), channels, feedbacks) = m->rightCols(feedbacks);
      all.block(output(), input(), channels, measured) = m->leftCols(measured);
    }
  }
};

Index steps_per_sample(const LinearSystem& system) {
  Index most = 1;
  for (const Feedback& f : system.feedback) most = std::max(most, f.steps_per_sample);
  return most;
}

template <int M>
class Follower {
 public:
  Follower(const LinearSystem& system, const ExactStep& exact, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials)
      : drive_(drive),
        per_sample_(steps_per_sample(system)),
        samples_(samples),
        steps_(samples * per_sample_),
        arguments_(system),
        laws_(system, arguments_, theta),
        one_(system, exact, arguments_, partials == Partials::all ? system.A.parameters() : 0),
        directions_(drive.start_tangent.cols()),
        columns_(directions_ + one_.parameters),
        gain_(one_.late.middleRows(one_.argument(), one_.arguments)),
        by_argument_(gain_(Eigen::all, arguments_.owner)) {}

  NonlinearResponse run() {
    begin();
    for (Index first = 0; first < steps_ && response_.finite; first += most_at_a_time) {
      const Index count = std::min(most_at_a_time, steps_ - first);
      march(first, count);
      if (columns_ > 0 && response_.finite) carry_tangents(first, count);
      now_.col(0) = now_.col(count);
      slope_.col(0) = slope_.col(count);
    }
    response_.largest_argument = largest_;
    response_.end = now_.col(0).head(one_.states);
    response_.end_tangent = tangent_.topRows(one_.states);
    return std::move(response_);
  }

 private:
  static constexpr Index most_at_a_time = 256;

  void begin() {
    const Index n = one_.states, m = one_.feedbacks, block = std::min(most_at_a_time, steps_);
    response_.output.resize(samples_, one_.channels);
    response_.tangent.assign(static_cast<std::size_t>(columns_ > 0 ? one_.channels : 0), MatrixXd(samples_, columns_));
    now_ = MatrixXd::Zero(one_.inputs(), block + 1);
    slope_ = MatrixXd::Zero(one_.arguments, block + 1);
    stepped_ = VectorXd::Zero(one_.rows());
    start_laws();
    now_.col(0).head(n) = drive_.start;
    now_.col(0).segment(one_.force(), m) = laws_.force;
    slope_.col(0) = laws_.slope;
    law_partial_ = MatrixXd::Zero(m, one_.parameters * (block + 1));
    if (one_.parameters > 0) laws_.partials_at(z_, law_partials(0));
    largest_ = VectorXd::Zero(m);
    tangent_ = next_ = MatrixXd::Zero(std::max(one_.rows(), one_.input()), columns_);  // the jerk is that of the sample
    if (directions_ > 0) tangent_.topLeftCorner(n, directions_) = drive_.start_tangent;
    if (one_.parameters > 0 && drive_.start_partial.size() > 0) tangent_.topRightCorner(n, one_.parameters) = drive_.start_partial;
    start_tangents();
  }

  /// The forces where the stretch begins, which the laws may see in the accelerations.
  void start_laws() {
    const MatrixXd of_forces = arguments_.sees_input.value.rightCols(one_.feedbacks);
    VectorXd known = arguments_.sees.value * drive_.start;
    if (one_.measured > 0) known += arguments_.sees_input.value.leftCols(one_.measured) * drive_.input.row(0).transpose();
    z_ = known;
    laws_.at(z_);
    if (arguments_.accelerations) z_ = implicit_argument<M>(laws_, known, of_forces, of_forces(Eigen::all, arguments_.owner), z_);
  }

  /// Of those forces: df = slope dz + partial, dz = sees dx + dsees x + the same of inputs and forces.
  void start_tangents() {
    const Index n = one_.states, m = one_.feedbacks, P = one_.parameters;
    MatrixXd seen = arguments_.sees.value * tangent_.topRows(n), force = MatrixXd::Zero(m, columns_);
    force.rightCols(P) = law_partials(0);
    if (!arguments_.accelerations) {
      tangent_.middleRows(one_.force(), m) = by_feedback(slope_.col(0).asDiagonal() * seen) + force;
      return;
    }
    VectorXd inputs(one_.measured + m);
    if (one_.measured > 0) inputs.head(one_.measured) = drive_.input.row(0).transpose();
    inputs.tail(m) = laws_.force;
    for (Index j = 0; j < P; ++j) {
      if (arguments_.sees.depends_on(j)) seen.col(directions_ + j) += arguments_.sees.d(j) * drive_.start;
      if (arguments_.sees_input.depends_on(j)) seen.col(directions_ + j) += arguments_.sees_input.d(j) * inputs;
    }
    const MatrixXd of_forces = arguments_.sees_input.value.rightCols(m);
    const MatrixXd answer = MatrixXd::Identity(m, m) - by_feedback(slope_.col(0).asDiagonal() * of_forces);
    tangent_.middleRows(one_.force(), m) = answer.partialPivLu().solve(by_feedback(slope_.col(0).asDiagonal() * seen) + force);
  }

  auto law_partials(Index k) { return law_partial_.middleCols(k * one_.parameters, one_.parameters); }

  /// The response itself; leaves v of every sample in now_, the laws' slopes in slope_.
  void march(Index first, Index count) {
    const Index n = one_.states, m = one_.feedbacks, q = one_.measured;
    for (Index k = 0; k < count; ++k) {
      auto v = now_.col(k), next = now_.col(k + 1);
      const Index sample = (first + k) / per_sample_, part = (first + k) % per_sample_;
      v[one_.jerk()] = drive_.jerk.size() > 0 ? drive_.jerk[sample] : 0;
      for (Index i = 0; i < q; ++i) {
        const double per_step = (drive_.input(sample + 1, i) - drive_.input(sample, i)) / static_cast<double>(per_sample_);
        v[one_.input() + i] = drive_.input(sample, i) + static_cast<double>(part) * per_step;
        v[one_.input() + q + i] = v[one_.input() + i] + per_step;
      }
      small_product(one_.step.data(), one_.rows(), one_.inputs(), v.data(), 0, 1, stepped_.data(), 0);
      if (part == 0) response_.output.row(sample) = stepped_.segment(one_.output(), one_.channels).transpose();
      z_ = implicit_argument<M>(laws_, stepped_.segment(one_.argument(), one_.arguments), gain_, by_argument_, z_);
      next.head(n) = stepped_.head(n);
      for (Index i = 0; i < m; ++i) {
        const double force = laws_.force[i], z = z_[arguments_.first[static_cast<std::size_t>(i)]];
        next.head(n) += force * one_.late.col(i).head(n);
        next[one_.force() + i] = force;
        largest_[i] = std::max(largest_[i], std::abs(z));
      }
      slope_.col(k + 1) = laws_.slope;
      if (one_.parameters > 0) laws_.partials_at(z_, law_partials(k + 1));
      if (!next.head(n).allFinite()) {
        response_.finite = false;
        return;
      }
    }
  }

  /// The tangents over the same samples: dx' = step dv + dstep v + late df + dlate f, df = slope dz + partial, where dz is solved for.
  void carry_tangents(Index first, Index count) {
    const Index m = one_.feedbacks, p = one_.parameters, rows = one_.rows();
    if (p > 0) {
      source_.noalias() = one_.partial * now_.leftCols(count);
      source_.noalias() += one_.late_partial * now_.block(one_.force(), 1, m, count);
    }
    Index ahead = 0;  // steps over which the directions have been carried already
    for (Index k = 0; k < count; ++k) {
      const Index sample = (first + k) / per_sample_;
      const bool reads = (first + k) % per_sample_ == 0;
      if (reads && drive_.jerk_tangent.size() > 0) directions_jerk() = drive_.jerk_tangent.row(sample);
      if (reads && directions_ > 0 && k + per_sample_ <= count && straight_over(k)) {
        const MatrixXd& over_sample = straight_step(slope_.col(k));
        small_product(over_sample.data(), rows, one_.input(), tangent_.data(), tangent_.rows(), directions_, next_.data(), next_.rows());
        read(sample, 0, directions_);
        tangent_.topLeftCorner(one_.jerk(), directions_) = next_.topLeftCorner(one_.jerk(), directions_);
        ahead = per_sample_;
      }
      const Index from = ahead > 0 ? directions_ : 0;  // first column to be carried step by step
      if (from < columns_) {
        small_product(one_.step.data(), rows, one_.input(), tangent_.col(from).data(), tangent_.rows(), columns_ - from, next_.col(from).data(), next_.rows());
        auto by_parameter = next_.rightCols(p);
        for (Index j = 0; j < p; ++j) by_parameter.col(j).head(rows) += source_.col(k).segment(j * rows, rows);
        if (reads) read(sample, from, columns_);
        if (p > 0) by_parameter.topRows(rows) += one_.late.lazyProduct(law_partials(k + 1));
        feed_back(slope_.col(k + 1), from);
        if (p > 0) by_parameter.middleRows(one_.force(), m) += law_partials(k + 1);
        tangent_.block(0, from, one_.jerk(), columns_ - from) = next_.block(0, from, one_.jerk(), columns_ - from);
      }
      if (ahead > 0) --ahead;
    }
  }

  auto directions_jerk() { return tangent_.row(one_.jerk()).head(directions_); }

  void read(Index sample, Index from, Index to) {
    for (Index c = 0; c < one_.channels; ++c) response_.tangent[static_cast<std::size_t>(c)].row(sample).segment(from, to - from) = next_.row(one_.output() + c).segment(from, to - from);
  }

  /// Whether the laws have one slope each all over the sample that begins with step k.
  bool straight_over(Index k) const { return per_sample_ > 1 && (slope_.middleCols(k + 1, per_sample_).colwise() - slope_.col(k)).isZero(0); }

  /// What the steps of a sample do to [x; df; djerk] while the laws have these slopes, and what is read at its beginning: a law of straight pieces (a gap) has few.
  const MatrixXd& straight_step(const Few<M>& slope) {
    for (const StraightStep& known : straight_)
      if (known.slope == slope) return known.over_sample;
    constexpr std::size_t most = 8;
    if (straight_.size() == most) straight_.erase(straight_.begin());
    const Index n = one_.states, m = one_.feedbacks, size = one_.input();
    MatrixXd step = MatrixXd::Identity(size, size);
    step.middleRows(n, m) = by_feedback(answer_of(slope) * one_.step.block(one_.argument(), 0, one_.arguments, size));
    step.topRows(n) = one_.step.topLeftCorner(n, size) + one_.late.topRows(n) * step.middleRows(n, m);
    const MatrixXd all = power(step, per_sample_);
    MatrixXd over_sample = MatrixXd::Zero(one_.rows(), size);
    over_sample.topRows(n + m) = all.topRows(n + m);
    over_sample.middleRows(one_.output(), one_.channels) = one_.step.block(one_.output(), 0, one_.channels, size);
    straight_.push_back({slope, std::move(over_sample)});
    return straight_.back().over_sample;
  }

  /// Puts the change of the force where that of its argument stands, and adds what it does to the state, in columns `from` on.
  void feed_back(const Few<M>& slope, Index from) {
    const Index n = one_.states, m = one_.feedbacks;
    const FewSquare<M> answer = answer_of(slope);
    for (Index j = from; j < columns_; ++j) {
      const Few<M> by_argument = answer.lazyProduct(next_.col(j).segment(one_.argument(), one_.arguments));
      const Few<M> force = of_feedbacks(by_argument);
      for (Index i = 0; i < m; ++i) next_.col(j).head(n) += force[i] * one_.late.col(i).head(n);
      next_.col(j).segment(one_.force(), m) = force;
    }
  }

  /// How the force at the end of a step answers, by way of each argument, to what the laws see there without it.
  FewSquare<M> answer_of(const Few<M>& slope) const {
    const Index m = one_.arguments;
    return slope.asDiagonal() * inverse(FewSquare<M>::Identity(m, m) - by_argument_ * slope.asDiagonal());
  }

  /// Of each feedback the sum over its arguments.
  Few<M> of_feedbacks(const Few<M>& by_argument) const {
    if constexpr (M == one) return by_argument;
    Few<M> sum = Few<M>::Zero(one_.feedbacks);
    for (Index a = 0; a < by_argument.size(); ++a) sum[arguments_.owner[static_cast<std::size_t>(a)]] += by_argument[a];
    return sum;
  }
  MatrixXd by_feedback(const MatrixXd& by_argument) const {
    MatrixXd sum = MatrixXd::Zero(one_.feedbacks, by_argument.cols());
    for (Index a = 0; a < by_argument.rows(); ++a) sum.row(arguments_.owner[static_cast<std::size_t>(a)]) += by_argument.row(a);
    return sum;
  }

  static FewSquare<M> inverse(const FewSquare<M>& matrix) {
    if constexpr (M == one)
      return matrix.cwiseInverse();
    else
      return matrix.partialPivLu().inverse();
  }

  const NonlinearDrive& drive_;
  Index per_sample_, samples_, steps_;
  Arguments arguments_;
  Laws<M> laws_;
  StepMatrices one_;
  Index directions_, columns_;
  FewSquare<M> gain_;         // arguments x feedbacks: how the force at the end of a step moves what the laws see there
  FewSquare<M> by_argument_;  // the same for each argument's feedback
  NonlinearResponse response_;
  MatrixXd now_, slope_, law_partial_, source_, tangent_, next_;
  VectorXd stepped_, largest_;
  struct StraightStep {
    Few<M> slope;
    MatrixXd over_sample;  // rows x [x; f; jerk]
  };
  std::vector<StraightStep> straight_;
  Few<M> z_;
};

}  // namespace

ExactStep step_to_follow(const LinearSystem& system, double dt) { return exact_step(system, dt / static_cast<double>(steps_per_sample(system))); }

NonlinearResponse follow(const LinearSystem& system, const ExactStep& step, const VectorXd& theta, const NonlinearDrive& drive, Index samples, Partials partials) {
  Index arguments = 0;
  for (const Feedback& f : system.feedback) arguments += f.sees.rows();
  const auto feedbacks = static_cast<Index>(system.feedback.size());
  if (feedbacks == 1 && arguments == 1) return Follower<one>(system, step, theta, drive, samples, partials).run();
  if (std::max(feedbacks, arguments) <= in_a_handful) return Follower<handful>(system, step, theta, drive, samples, partials).run();
  return Follower<many>(system, step, theta, drive, samples, partials).run();
}

}  // namespace unrig
