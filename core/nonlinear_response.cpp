#include "core/nonlinear_response.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A handful of feedbacks, so that a step allocates nothing.
constexpr int most_feedbacks = 16;
using FewVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, most_feedbacks, 1>;
using FewMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_feedbacks, most_feedbacks>;

/// The laws of all feedbacks at one sample.
struct Forces {
  FewVector force, slope;
  MatrixXd partial;  // feedbacks x P
};

class Laws {
 public:
  Laws(const LinearSystem& system, const VectorXd& theta, Index parameters) : system_(system), theta_(theta) {
    const auto count = static_cast<Index>(system.feedback.size());
    sees.resize(count, system.states());
    for (Index i = 0; i < count; ++i) sees.row(i) = system.feedback[static_cast<std::size_t>(i)].sees;
    now.force = now.slope = FewVector::Zero(count);
    now.partial = MatrixXd::Zero(count, parameters);
  }
  const Forces& at(const FewVector& z) {
    for (Index i = 0; i < z.size(); ++i) {
      const Feedback& f = system_.feedback[static_cast<std::size_t>(i)];
      double partial[8] = {};
      now.force[i] = f.law(z[i], theta_.data() + f.first_parameter, now.slope[i], partial);
      for (Index k = 0; k < f.parameters && now.partial.cols() > 0; ++k) now.partial(i, f.first_parameter + k) = partial[k];
    }
    return now;
  }
  MatrixXd sees;  // feedbacks x n
  Forces now;

 private:
  const LinearSystem& system_;
  const VectorXd& theta_;
};

/// z with z = known + gain f(z): Newton's method, halved where the residual does not fall.
FewVector implicit_argument(Laws& laws, const FewVector& known, const FewMatrix& gain, FewVector z) {
  constexpr int most = 60;
  const Index m = z.size();
  const auto residual_of = [&](const FewVector& at) -> FewVector { return at - known - gain * laws.at(at).force; };
  FewVector residual = residual_of(z);
  for (int i = 0; i < most; ++i) {
    const double size = residual.norm(), scale = 1e-13 * (known.norm() + z.norm()) + 1e-300;
    if (!(size > scale)) return z;
    const FewMatrix derivative = FewMatrix::Identity(m, m) - gain * laws.now.slope.asDiagonal();
    const FewVector step = m == 1 ? FewVector(residual / derivative(0, 0)) : FewVector(derivative.partialPivLu().solve(residual));
    double fraction = 1;
    FewVector next = z - step, after = residual_of(next);
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

}  // namespace

NonlinearResponse follow(const LinearSystem& system, const ExactStep& step, const VectorXd& theta, const NonlinearDrive& drive, Index samples,
                         Partials partials) {
  const Index n = system.states(), channels = system.C.rows(), m = static_cast<Index>(system.feedback.size()), measured = system.B.cols() - m;
  const Index parameters = partials == Partials::all ? system.A.parameters() : 0, directions = drive.start_tangent.cols(), columns = directions + parameters;
  const MatrixXd early = step.input0.value.rightCols(m), late = step.input1.value.rightCols(m), direct = system.D.value.rightCols(m);
  Laws laws(system, theta, parameters);
  const FewMatrix gain = laws.sees * late;  // how the force at the end of a step moves what the laws see there

  const auto partial_of = [&](const DualMatrix& a, Index j) -> const MatrixXd* { return a.depends_on(j) ? &a.d(j) : nullptr; };

  NonlinearResponse response;
  response.output.resize(samples, channels);
  response.tangent.assign(static_cast<std::size_t>(columns > 0 ? channels : 0), MatrixXd(samples, columns));
  VectorXd x = drive.start, free(n), y(channels);
  FewVector z = laws.sees * x;
  MatrixXd tangent = MatrixXd::Zero(n, columns), next(n, columns), force_tangent(m, columns), outputs(channels, columns);
  if (directions > 0) tangent.leftCols(directions) = drive.start_tangent;
  if (parameters > 0 && drive.start_partial.size() > 0) tangent.rightCols(parameters) = drive.start_partial;

  laws.at(z);
  Forces f = laws.now;
  force_tangent.noalias() = f.slope.asDiagonal() * (laws.sees * tangent);
  force_tangent.rightCols(parameters) += f.partial;
  VectorXd known_input = VectorXd::Zero(measured), next_input = known_input;
  FewVector product = FewVector::Zero(m), square = product, largest = product;
  for (Index k = 0; k < samples; ++k) {
    if (measured > 0) known_input = drive.input.row(k).transpose(), next_input = drive.input.row(k + 1).transpose();
    // Outputs now.
    y.noalias() = system.C.value * x;
    y.noalias() += direct * f.force;
    if (measured > 0) y.noalias() += system.D.value.leftCols(measured) * known_input;
    response.output.row(k) = y.transpose();
    if (columns > 0) {
      outputs.noalias() = system.C.value * tangent;
      outputs.noalias() += direct * force_tangent;
      for (Index j = 0; j < parameters; ++j) {
        if (const MatrixXd* d = partial_of(system.C, j)) outputs.col(directions + j).noalias() += *d * x;
        if (const MatrixXd* d = partial_of(system.D, j)) {
          outputs.col(directions + j).noalias() += d->rightCols(m) * f.force;
          if (measured > 0) outputs.col(directions + j).noalias() += d->leftCols(measured) * known_input;
        }
      }
      for (Index c = 0; c < channels; ++c) response.tangent[static_cast<std::size_t>(c)].row(k) = outputs.row(c);
    }
    // One step, without the force at its end; then that.
    free.noalias() = step.transition.value * x;
    free.noalias() += early * f.force;
    if (drive.jerk.size() > 0) free += drive.jerk[k] * step.jerk.value.col(0);
    if (measured > 0) {
      free.noalias() += step.input0.value.leftCols(measured) * known_input;
      free.noalias() += step.input1.value.leftCols(measured) * next_input;
    }
    if (columns > 0) {
      next.noalias() = step.transition.value * tangent;
      next.noalias() += early * force_tangent;
      if (drive.jerk_tangent.size() > 0 && !drive.jerk_tangent.row(k).isZero(0)) next.leftCols(directions).noalias() += step.jerk.value.col(0) * drive.jerk_tangent.row(k);
      for (Index j = 0; j < parameters; ++j) {
        auto column = next.col(directions + j);
        if (const MatrixXd* d = partial_of(step.transition, j)) column.noalias() += *d * x;
        if (drive.jerk.size() > 0)
          if (const MatrixXd* d = partial_of(step.jerk, j)) column += drive.jerk[k] * d->col(0);
        if (const MatrixXd* d = partial_of(step.input0, j)) {
          column.noalias() += d->rightCols(m) * f.force;
          if (measured > 0) column.noalias() += d->leftCols(measured) * known_input;
        }
        if (measured > 0)
          if (const MatrixXd* d = partial_of(step.input1, j)) column.noalias() += d->leftCols(measured) * next_input;
      }
    }
    z = implicit_argument(laws, laws.sees * free, gain, z);
    f = laws.now;
    x = free;
    x.noalias() += late * f.force;
    for (Index i = 0; i < m; ++i) product[i] += f.force[i] * z[i], square[i] += z[i] * z[i], largest[i] = std::max(largest[i], std::abs(z[i]));
    if (columns > 0) {
      // dx = dfree + late df + dlate f, df = slope sees dx + partial.
      for (Index j = 0; j < parameters; ++j)
        if (const MatrixXd* d = partial_of(step.input1, j)) next.col(directions + j).noalias() += d->rightCols(m) * f.force;
      next.rightCols(parameters).noalias() += late * f.partial;
      const FewMatrix derivative = FewMatrix::Identity(m, m) - gain * f.slope.asDiagonal();
      const MatrixXd seen = derivative.partialPivLu().solve(laws.sees * next);
      force_tangent.noalias() = f.slope.asDiagonal() * seen;
      next.noalias() += late * force_tangent;
      force_tangent.rightCols(parameters) += f.partial;
      tangent.swap(next);
    }
    if (!x.allFinite()) {
      response.finite = false;
      break;
    }
  }
  response.equivalent_slope = (square.array() > 0).select(product.array() / square.array().max(1e-300), 0.0);
  response.largest_argument = largest;
  response.end = x;
  response.end_tangent = tangent;
  return response;
}

}  // namespace unrig
