#include "core/rig/gauge_filter.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "core/model/aeroelastic_model.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

constexpr double per_hertz = 2 * std::numbers::pi;

/// numerator(x) / denominator(x), x = s / rate, ascending coefficients and equally many, in controllable form; F and g without their factor `rate`.
GaugeFilter from_ratio(const VectorXd& numerator, const VectorXd& denominator) {
  const Index n = denominator.size() - 1;
  const VectorXd a = denominator / denominator[n], b = numerator / denominator[n];
  MatrixXd F = MatrixXd::Zero(n, n);
  F.diagonal(1).setOnes();
  F.row(n - 1) = -a.head(n).transpose();
  return {DualMatrix(F), DualMatrix(MatrixXd(VectorXd::Unit(n, n - 1))), (b.head(n) - b[n] * a.head(n)).transpose(), b[n]};
}

/// The filter in time of its own: F and g times `rate`, which changes by `rate_slope` per unit of the first parameter.
GaugeFilter at_rate(GaugeFilter filter, double rate, double rate_slope, FilterParameters parameters) {
  for (DualMatrix* m : {&filter.F, &filter.g}) {
    const MatrixXd unit = m->value;
    *m = DualMatrix(rate * unit, parameters.count);
    if (parameters.first >= 0) m->add_partial(parameters.first, rate_slope * unit);
  }
  return filter;
}

Complex value_at(const VectorXd& coefficients, Complex x) {
  Complex sum = 0;
  for (Index k = coefficients.size() - 1; k >= 0; --k) sum = sum * x + coefficients[k];
  return sum;
}

struct Ratio {
  VectorXd numerator, denominator;
  double miss = 0;
};

/// Of n poles, over x = i f / f_max.
Ratio nearest_ratio(const VectorXd& x, const VectorXcd& response, Index n) {
  constexpr int rounds = 30;
  const Index points = x.size();
  Ratio r{VectorXd::Unit(n + 1, 0), VectorXd::Unit(n + 1, 0)};
  for (int round = 0; round < rounds; ++round) {
    MatrixXd rows(2 * points, 2 * n);
    VectorXd right(2 * points);
    for (Index i = 0; i < points; ++i) {
      const Complex weight = 1.0 / value_at(r.denominator, {0, x[i]});
      Complex power = weight;
      for (Index k = 0; k < n; ++k) {
        power *= Complex(0, x[i]);
        const Complex other = -response[i] * power;
        rows(i, k) = power.real(), rows(points + i, k) = power.imag();
        rows(i, n + k) = other.real(), rows(points + i, n + k) = other.imag();
      }
      const Complex left = (response[i] - 1.0) * weight;
      right[i] = left.real(), right[points + i] = left.imag();
    }
    const VectorXd best = rows.colPivHouseholderQr().solve(right);
    r.numerator.tail(n) = best.head(n);
    r.denominator.tail(n) = best.tail(n);
  }
  for (Index i = 0; i < points; ++i) r.miss = std::max(r.miss, std::abs(value_at(r.numerator, {0, x[i]}) / value_at(r.denominator, {0, x[i]}) - response[i]));
  return r;
}

}  // namespace

GaugeFilter first_order_low_pass(double cutoff) { return at_rate(from_ratio(Eigen::Vector2d(1, 0), Eigen::Vector2d(1, 1)), per_hertz * cutoff, 0, {}); }

GaugeFilter low_pass(double cutoff, double damping_ratio, FilterParameters parameters) {
  GaugeFilter filter = at_rate(from_ratio(Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, 2 * damping_ratio, 1)), per_hertz * cutoff, per_hertz, parameters);
  if (parameters.first >= 0) filter.F.add_partial(parameters.first + 1, (Eigen::Matrix2d() << 0, 0, 0, -2 * per_hertz * cutoff).finished());
  return filter;
}

GaugeFilter delay(double time, int order, FilterParameters parameters) {
  VectorXd numerator(order + 1), denominator(order + 1);
  double c = 1;
  for (int k = 0; k <= order; ++k) {
    denominator[k] = c;
    numerator[k] = k % 2 == 0 ? c : -c;
    c *= static_cast<double>(order - k) / static_cast<double>((2 * order - k) * (k + 1));
  }
  return at_rate(from_ratio(numerator, denominator), 1 / time, -1 / (time * time), parameters);
}

GaugeFilter measured_filter(const VectorXd& frequency, const VectorXcd& response, double& miss) {
  constexpr Index most_poles = 8;
  constexpr double enough = 1e-3;
  const double highest = frequency.maxCoeff();
  GaugeFilter best;
  bool found = false;
  for (Index n = 1; n <= std::min(most_poles, frequency.size() - 1) && (!found || miss > enough); ++n) {
    const Ratio ratio = nearest_ratio(frequency / highest, response, n);
    if (!(std::abs(ratio.denominator[n]) > 1e-12)) continue;  // fewer poles than asked for
    GaugeFilter filter = from_ratio(ratio.numerator, ratio.denominator);
    const bool stable = filter.F.value.allFinite() && filter.F.value.eigenvalues().real().maxCoeff() < 0;
    if (!stable || (found && ratio.miss >= miss)) continue;
    best = at_rate(std::move(filter), per_hertz * highest, 0, {});
    miss = ratio.miss;
    found = true;
  }
  if (!found) throw std::invalid_argument("no stable filter of up to eight poles comes near the measured response");
  return best;
}

void append_gauge_filter(LinearSystem& system, Index row, const GaugeFilter& filter) {
  const Index n = system.states(), k = filter.states(), inputs = system.B.cols();
  const DualMatrix bridge = system.C.block(row, 0, 1, n), bridge_inputs = system.D.block(row, 0, 1, inputs);
  system.A = system.A.grown(n + k, n + k);
  system.A.set_block(n, n, filter.F);
  system.A.set_block(n, 0, filter.g * bridge);
  system.B = system.B.grown(n + k, inputs);
  if (inputs > 0) system.B.set_block(n, 0, filter.g * bridge_inputs);
  system.C = system.C.grown(system.C.rows(), n + k);
  const auto put = [row](DualMatrix& whole, Index column, const DualMatrix& part) {
    for (MatrixXd& p : whole.partial)
      if (p.size() > 0) p.block(row, column, 1, part.cols()).setZero();
    whole.set_block(row, column, part);
  };
  put(system.C, 0, filter.direct * bridge);
  put(system.C, n, DualMatrix(filter.h));
  if (inputs > 0) put(system.D, 0, filter.direct * bridge_inputs);
  for (Index i = 0; i < k; ++i) system.settling.push_back(n + i);
  if (row == 0) system.filters.insert(system.filters.end(), system.settling.end() - k, system.settling.end());
}

}  // namespace unrig
