#include "fit/force/missing_force.h"

#include <Eigen/LU>
#include <cmath>

#include "core/propagate/exact_step.h"
#include "core/propagate/nonlinear_response.h"
#include "core/numerics/in_parallel.h"
#include "core/numerics/product.h"
#include "core/numerics/work.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// z = [x; f]: z_{k+1} = F z_k + G w_k, r_k = H z_k + v_k.
struct Walk {
  MatrixXd F;
  VectorXd G;
  RowVectorXd H;
};

Walk walk_of(const LinearSystem& system, double dt) {
  const ExactStep step = exact_step(system, dt);
  const Index n = system.states();
  Walk walk{MatrixXd::Zero(n + 1, n + 1), VectorXd(n + 1), RowVectorXd(n + 1)};
  walk.F.topLeftCorner(n, n) = step.transition.value;
  walk.F.col(n) << step.input0.value.col(0) + step.input1.value.col(0), 1;
  walk.G << step.input1.value.col(0), 1;
  walk.H << system.C.value.row(0), system.D.value(0, 0);
  return walk;
}

/// Doubled until it no longer changes: X = Q + A^T X (I + S X)^-1 A.
MatrixXd riccati(MatrixXd A, MatrixXd S, MatrixXd X) {
  constexpr int most = 60;
  for (int i = 0; i < most; ++i) {
    const MatrixXd inverse = (MatrixXd::Identity(A.rows(), A.cols()) + product(S, X)).inverse();
    const MatrixXd change = product(product(product(A.transpose(), X), inverse), A), carried = product(A, inverse);
    add_product(product(carried, S), A.transpose(), S);
    X += change;
    A = product(carried, A);
    X = (0.5 * (X + X.transpose())).eval();
    S = (0.5 * (S + S.transpose())).eval();
    if (!(change.norm() > 1e-14 * X.norm())) break;
  }
  return X;
}

/// Of a steady unit force.
double steady_reading(const Walk& walk) {
  const Index last = walk.F.rows() - 1;
  return std::abs((walk.H.head(last) * (MatrixXd::Identity(last, last) - walk.F.topLeftCorner(last, last)).fullPivLu().solve(walk.F.col(last).head(last)))(0) + walk.H[last]);
}

struct Filter {
  MatrixXd P;         // covariance of the predicted state
  VectorXd gain;      // P H^T / variance
  double variance = 0;  // of the innovations
};

Filter filter_for(const Walk& walk, double roughness_per_sample, double noise) {
  Filter f;
  f.P = riccati(walk.F.transpose(), walk.H.transpose() * walk.H / (noise * noise), roughness_per_sample * roughness_per_sample * walk.G * walk.G.transpose());
  f.variance = walk.H.dot(f.P * walk.H.transpose()) + noise * noise;
  f.gain = f.P * walk.H.transpose() / f.variance;
  return f;
}

/// Innovations, 0 where there is no sample; the states before each of them where `states` is given.
VectorXd innovations(const Walk& walk, const Filter& filter, const VectorXd& residual, MatrixXd* states = nullptr) {
  VectorXd z = VectorXd::Zero(walk.F.rows()), next(z.size()), e(residual.size());
  if (states) states->resize(z.size(), residual.size());
  for (Index k = 0; k < residual.size(); ++k) {
    if (states) states->col(k) = z;
    e[k] = std::isfinite(residual[k]) ? residual[k] - walk.H.dot(z) : 0;
    z += filter.gain * e[k];
    next.noalias() = walk.F * z;
    z.swap(next);
  }
  return e;
}

/// -2 ln likelihood of the residual for this roughness.
double deviance(const Walk& walk, double roughness_per_sample, double noise, const VectorXd& residual) {
  const Filter filter = filter_for(walk, roughness_per_sample, noise);
  const double n = static_cast<double>(residual.size());
  return innovations(walk, filter, residual).squaredNorm() / filter.variance + n * std::log(filter.variance);
}

/// Where a function of one variable is least, between `low` and `high`: a coarse grid, then golden sections around its best.
template <class Function>
double least_between(double low, double high, Function f) {
  constexpr int grid = 12, sections = 12;
  const double step = (high - low) / grid;
  double best = low, least = INFINITY;
  for (int i = 0; i <= grid; ++i)
    if (const double value = f(low + i * step); value < least) least = value, best = low + i * step;
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double a = best - step, b = best + step;
  for (int i = 0; i < sections; ++i) {
    const double c = b - golden * (b - a), d = a + golden * (b - a);
    if (f(c) < f(d))
      b = d;
    else
      a = c;
  }
  return 0.5 * (a + b);
}

}  // namespace

ForceFilter::ForceFilter(const LinearSystem& system, double dt, double roughness, double noise) {
  const Walk walk = walk_of(system, dt);
  const Filter filter = filter_for(walk, roughness * std::sqrt(dt), noise);
  const ExactStep step = exact_step(system, dt);
  forward_ = walk.F;
  observe_ = walk.H;
  gain_ = filter.gain;
  variance_ = filter.variance;
  input0_ = VectorXd::Zero(forward_.rows());
  input1_ = input0_;
  input0_.head(system.states()) = step.input0.value.col(0);
  input1_.head(system.states()) = step.input1.value.col(0);
  direct_ = system.D.value(0, 0);
}

VectorXd ForceFilter::innovations(const VectorXd& readings) const { return unrig::innovations({forward_, {}, observe_}, {{}, gain_, variance_}, readings); }

MatrixXd ForceFilter::innovations_of_forces(const MatrixXd& forces, const VectorXd& counts) const {
  const Index n = states(), known = forces.cols(), samples = forces.rows();
  MatrixXd state = MatrixXd::Zero(n, known + n), next(n, known + n), out(known + n, samples);
  state.rightCols(n).setIdentity();
  const MatrixXd per_sample = forces.transpose();
  RowVectorXd e(known + n);
  for (Index k = 0; k < samples; ++k) {
    e.noalias() = observe_ * state;
    e.head(known) += direct_ * per_sample.col(k).transpose();
    if (counts[k] == 0) e.setZero();
    out.col(k) = e.transpose();
    state.noalias() -= gain_ * e;
    set_product(forward_, state, next);
    next.leftCols(known).noalias() += input0_ * per_sample.col(k).transpose();
    if (k + 1 < samples) next.leftCols(known).noalias() += input1_ * per_sample.col(k + 1).transpose();
    state.swap(next);
  }
  count_work(samples * n * (n + 3) * (known + n));
  return out.transpose();
}

MissingForce estimate_force(const LinearSystem& system, double dt, const VectorXd& residual, double noise, MatrixXd* smoothed) {
  const Walk walk = walk_of(system, dt);
  const Index n = walk.F.rows(), last = n - 1;
  // From a force that would change by a thousandth of the noise over the record to one that may change by all of its range at every sample.
  double range = noise;
  for (const double r : residual)
    if (std::isfinite(r)) range = std::max(range, std::abs(r));
  const double unit = std::max(steady_reading(walk), 1e-6);
  const double low = std::log(1e-3 * noise / unit / std::sqrt(static_cast<double>(residual.size()))), high = std::log(10 * range / unit);
  const double roughness = std::exp(least_between(low, high, [&](double q) { return deviance(walk, std::exp(q), noise, residual); }));

  const Filter filter = filter_for(walk, roughness, noise);
  MatrixXd states;
  const VectorXd e = innovations(walk, filter, residual, &states);
  // Adjoint of the filter, backwards: what later samples say.
  const MatrixXd kept = MatrixXd::Identity(n, n) - filter.gain * walk.H, carried = walk.F * kept;
  MissingForce force{"", dt, VectorXd(residual.size()), 0, roughness / std::sqrt(dt), 0};
  VectorXd later = VectorXd::Zero(n);
  for (Index k = residual.size() - 1; k >= 0; --k) {
    if (std::isfinite(residual[k]))
      later = (carried.transpose() * later + walk.H.transpose() * (e[k] / filter.variance)).eval();
    else
      later = (walk.F.transpose() * later).eval();
    force.value[k] = states(last, k) + filter.P.row(last).dot(later);
    if (smoothed) states.col(k) += filter.P * later;
  }
  if (smoothed) *smoothed = states.topRows(last);
  // Its information, doubled to the steady state: L = H^T H / variance + carried^T L carried.
  MatrixXd L = walk.H.transpose() * walk.H / filter.variance, power = carried;
  for (int i = 0; i < 40; ++i) {
    const MatrixXd more = power.transpose() * L * power;
    L += more;
    power = (power * power).eval();
    if (!(more.norm() > 1e-14 * L.norm())) break;
  }
  force.standard_deviation = std::sqrt(std::max(0.0, filter.P(last, last) - (filter.P * L * filter.P)(last, last)));
  return force;
}

namespace {

/// What a gauge reads in all, its mean removed, as the steady force that would read so (r.m.s.).
double as_steady_force(const LinearSystem& system, const RunResidual& run) {
  const VectorXd& gauge = run.run().channel("gauge").value;
  double count = 0, sum = 0, squares = 0;
  for (Index k = 0; k < gauge.size(); ++k)
    if (run.channel_weight(0)[k] > 0 && std::isfinite(gauge[k])) ++count, sum += gauge[k], squares += gauge[k] * gauge[k];
  const double steady = steady_reading(walk_of(system, run.run().dt));
  if (!(steady > 0) || count == 0) return 0;
  return std::sqrt(std::max(0.0, squares / count - std::pow(sum / count, 2))) / steady;
}

}  // namespace

std::vector<MissingForce> missing_forces(const JointProblem& joint) {
  std::vector<MissingForce> forces(joint.runs().size());
  in_parallel(forces.size(), [&](std::size_t r) {
    const RunResidual& run = joint.runs()[r];
    const Rig& rig = joint.model().rig();
    if (run.is_aside()) return;  // what the model leaves of it is no force but a trajectory that was not found
    if (run.channels().front() != "gauge" || !rig.takes_force()) return;
    const VectorXd theta = joint.theta(r);
    Conditions conditions = run.conditions();
    if (conditions.mount || conditions.force) return;  // driven already
    conditions.force = true;
    const LinearSystem system = under_one_input(joint.model().system(conditions, theta, {"gauge"}), 0);
    const RunResidual::Prediction p = run.predict(theta);
    VectorXd left = run.run().channel("gauge").value - p.output.col(0);
    for (Index k = 0; k < left.size(); ++k)
      if (!(run.channel_weight(0)[k] > 0)) left[k] = std::nan("");
    forces[r] = estimate_force(system, run.run().dt, left, run.noise(0));
    forces[r].run = run.run().file;
    forces[r].as_read = as_steady_force(system, run);
  });
  std::erase_if(forces, [](const MissingForce& f) { return f.run.empty(); });
  return forces;
}

}  // namespace unrig
