#include "tests/verification/seed.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/run/run.h"

namespace unrig::seed {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;

constexpr double inch = 0.0254;
constexpr double pound = 0.45359237;  // kg

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Index>(values.size()));
}

// Polynomials, lowest power first.
VectorXd product(const VectorXd& a, const VectorXd& b) {
  VectorXd c = VectorXd::Zero(a.size() + b.size() - 1);
  for (Index i = 0; i < a.size(); ++i) c.segment(i, b.size()) += a[i] * b;
  return c;
}

VectorXd difference(const VectorXd& a, const VectorXd& b) {
  VectorXd c = VectorXd::Zero(std::max(a.size(), b.size()));
  c.head(a.size()) = a;
  c.head(b.size()) -= b;
  return c;
}

std::complex<double> value(const VectorXd& polynomial, std::complex<double> s) {
  std::complex<double> sum = 0;
  for (Index k = polynomial.size() - 1; k >= 0; --k) sum = sum * s + polynomial[k];
  return sum;
}

VectorXd derivative(const VectorXd& polynomial) {
  VectorXd d(polynomial.size() - 1);
  for (Index k = 0; k < d.size(); ++k) d[k] = static_cast<double>(k + 1) * polynomial[k + 1];
  return d;
}

/// Products of a coefficient with Wagner's two amplitudes; Appendix B rounds each.
struct Lag {
  double first, second;
};

struct LagProducts {
  Lag q, g, p;
};

Transform cramer(const Equations& e, const LagProducts& lag, double p2, double p1, double n2, double n1, double nl) {
  const VectorXd both = product(vector({e.b[0], 1}), vector({e.b[1], 1}));
  const auto lags = [&](const Lag& l) { return vector({l.first * e.b[1] + l.second * e.b[0], l.first + l.second}); };
  const VectorXd qq = difference(product(vector({e.k, e.lq, e.m}), both), product(vector({0, 0, 1}), lags(lag.q)));
  const VectorXd qg = difference(product(vector({e.lg, e.cg + e.lg, e.mg}), both), product(vector({0, 1, 1}), lags(lag.g)));
  const VectorXd right_n = difference(product(vector({nl, n1 + nl, n2}), both), product(vector({0, 1, 1}), lags(lag.p)));  // times s
  const VectorXd t = vector({e.kt, e.tg, e.tgg}), tq = vector({0, 0, e.tq}), right_t = vector({p1, p2}), s = vector({0, 1});
  Transform out;
  out.denominator = product(s, difference(product(qq, t), product(tq, qg)));
  out.q = difference(product(right_n, t), product(s, product(qg, right_t)));
  out.g = difference(product(tq, right_n), product(s, product(qq, right_t)));
  return out;
}

}  // namespace

const VectorXd printed_normal_shape =
    vector({.0017, .0043, .0115, .0246, .0343, .0394, .0454, .0523, .0599, .0813, .118, .148, .174, .203, .332, .641, 1});
const VectorXd printed_torsion_shape = vector({.0317, .0567, .0897, .109, .2, .363, .526, .688, .851, .943, .964, .986, 1});

Equations printed_equations() {
  return {1.8526, 1.192, 2.066, 9.662, 3.186,          4.132,          1.192,         1.4752,
          3.142,  1749,  1.518, 3.151, 0.021 / degree, 0.036 / degree, 0.072 / degree};
}

Equations equations_of(const Rig& rig) {
  const Modes normal = chain_modes(rig.normal), torsion = chain_modes(rig.torsion);
  const VectorXd phi = normal.shape.col(0) / normal.shape(16, 0), twist = torsion.shape.col(0) / torsion.shape(12, 0);
  const double rho = density * pound / std::pow(inch, 3), b = semichord * inch, l = span * inch, U = speed * inch;
  const double m = (rig.normal.inertia.array() * phi.array().square()).sum(),
               j = (rig.torsion.inertia.array() * twist.array().square()).sum();
  double sum = 0, squares = 0;  // of phi over the strips, each a third of the span
  for (const int element : rig.submerged) sum += phi[element - 1], squares += phi[element - 1] * phi[element - 1];
  const double unbalance = (rig.normal.inertia.array() * rig.mass_centre.array() * phi.array()).sum();

  Equations e{};
  e.m = m / (rho * b * b * l) + pi / 3 * squares;
  e.mg = unbalance / (rho * b * b * b * l) + pi / 6 * sum;
  e.cg = pi / 3 * sum;
  e.k = normal.omega[0] * normal.omega[0] * m / (rho * U * U * l);
  e.lq = 2 * pi / 3 * squares;
  e.lg = 2 * pi / 3 * sum;
  e.tq = e.mg;
  e.tgg = j / (rho * std::pow(b, 4) * l) + 3 * pi / 8;
  e.tg = pi;
  e.kt = torsion.omega[0] * torsion.omega[0] * j / (rho * U * U * b * b * l);
  e.p2 = rig.torsion.inertia[rig.rigid_from - 1] / (rho * std::pow(b, 4) * l) + 3 * pi / 8;
  e.p1 = pi;
  e.n2 = e.mg, e.n1 = e.cg, e.nl = e.lg;
  return e;
}

Transform printed_appendix_b() {
  return {vector({0, 230.67, 5915.0, 18513, 3832.3, 3258.4, 3.7056, 1.3124}),
          vector({1.7189, 37.805, 117.82, 135.99, 36.725, -0.0030852, -0.0006088}),
          -vector({0, 0.0072537, 0.18832, 0.64569, 0.3194, 0.066728, 0.024067})};
}

Transform solve(const Equations& e, double amplitude) {
  const auto lag = [&](double c) { return Lag{c * e.A[0], c * e.A[1]}; };
  return cramer(e, {lag(e.lq), lag(e.lg), lag(e.nl * amplitude)}, e.p2 * amplitude, e.p1 * amplitude, e.n2 * amplitude, e.n1 * amplitude,
                e.nl * amplitude);
}

Transform solve_appendix_b_input() {
  Equations e = printed_equations();
  e.m = 1.8528;
  return cramer(e, {{0.526, 1.13}, {0.682, 1.467}, {0.0119, 0.0256}}, 0.0265, 0.055, 0.021, 0.036, 0.072);
}

VectorXcd roots(const VectorXd& polynomial) {
  const Index n = polynomial.size() - 1;
  MatrixXd companion = MatrixXd::Zero(n, n);
  companion.diagonal(-1).setOnes();
  companion.col(n - 1) = -polynomial.head(n) / polynomial[n];
  return Eigen::EigenSolver<MatrixXd>(companion, false).eigenvalues();
}

Constants constants_of(const VectorXcd& pole, const Eigen::RowVectorXcd& residue, double steady) {
  // Slow and fast oscillation, slow and fast lag: by where the seed finds them. Poles that are no part of the form must not carry anything.
  Constants c{};
  c.A = steady;
  for (Index k = 0; k < pole.size(); ++k) {
    const std::complex<double> p = pole[k], r = residue[k];
    if (std::abs(p) < 1e-9)
      c.A += r.real();
    else if (p.imag() == 0)
      (p.real() < -0.15 ? c.B : c.C) += r.real();
    else if (p.imag() > 20)
      c.F = -2 * r.imag(), c.G = 2 * r.real();
    else if (p.imag() > 0)
      c.D = -2 * r.imag(), c.E = 2 * r.real();
  }
  return c;
}

Constants constants_of(const VectorXd& numerator, const VectorXd& denominator) {
  VectorXcd pole = roots(denominator);
  Eigen::RowVectorXcd residue(pole.size());
  const VectorXd slope = derivative(denominator);
  for (Index k = 0; k < pole.size(); ++k) residue[k] = value(numerator, pole[k]) / value(slope, pole[k]);
  return constants_of(pole, residue, 0);
}

Constants appendix_c(const VectorXd& numerator) {
  const auto pair = [](double decay, double frequency) { return vector({decay * decay + frequency * frequency, 2 * decay, 1}); };
  const VectorXd monic =
      product(product(product(vector({0, 1}), vector({0.29, 1})), product(vector({0.0454, 1}), pair(0.825, 49.75))), pair(0.42, 2.29));
  return constants_of(numerator, monic);
}

LinearSystem system_of(const Equations& e) {
  // Circulation of the normal equation: w = -lq q' + lg (g' + g) + nl (p' + p), y_j' = b_j (w - y_j), force (1 - sum A) w + sum A_j y_j.
  constexpr Index states = 9;  // q g q' g' y1 y2 p p' p''
  RowVectorXd w = RowVectorXd::Zero(states);
  w[1] = w[3] = e.lg, w[2] = -e.lq, w[6] = w[7] = e.nl;
  RowVectorXd normal = (1 - e.A[0] - e.A[1]) * w, torsion = RowVectorXd::Zero(states);
  normal[4] += e.A[0], normal[5] += e.A[1];
  normal[0] -= e.k, normal[3] += e.cg, normal[7] += e.n1, normal[8] += e.n2;
  torsion[1] += e.kt, torsion[3] += e.tg, torsion[7] += e.p1, torsion[8] += e.p2;

  MatrixXd right(2, states);
  right << normal, torsion;
  const Eigen::Matrix2d mass{{e.m, -e.mg}, {e.tq, -e.tgg}};
  MatrixXd a = MatrixXd::Zero(states, states);
  a(0, 2) = a(1, 3) = a(6, 7) = a(7, 8) = 1;
  a.middleRows(2, 2) = mass.partialPivLu().solve(right);
  for (Index j = 0; j < 2; ++j) {
    a.row(4 + j) = e.b[j] * w;
    a(4 + j, 4 + j) -= e.b[j];
  }
  LinearSystem system;
  system.A = DualMatrix(a);
  system.B = DualMatrix(MatrixXd::Zero(states, 0));
  system.C = DualMatrix(MatrixXd::Identity(2, states));
  system.D = DualMatrix(MatrixXd::Zero(2, 0));
  system.coordinates = 2;
  system.lags = 2;
  system.motion = 6;
  return system;
}

std::string sample(const std::string& file) { return std::string(UNRIG_SOURCE_DIR) + "/sample_data/seed/" + file; }
Rig rig() { return read_rig(sample("rig.toml")); }
Rig rig_from_drawings() { return read_rig(sample("rig_from_drawings.toml")); }

SampledMotion step_motion() {
  const Run run = read_run(sample("step.csv"));
  const VectorXd& angle = run.channel("alpha").value;
  return {angle, run.dt, interpolated_motion(angle, run.dt)};
}

Conditions towed() { return {density * pound / std::pow(inch, 3), speed * inch, true, false, false}; }
Conditions still_water() { return {density * pound / std::pow(inch, 3), 0, false, false, false}; }

AeroelasticModel model(const Rig& rig, Index normal_modes, Index torsion_modes, const IndicialFunction& circulation) {
  return {rig, make_basis(rig, normal_modes, torsion_modes), circulation};
}

VectorXd undamped(const AeroelasticModel& model) {
  VectorXd theta = model.start_values();
  theta[model.index("normal.damping_ratio")] = theta[model.index("torsion.damping_ratio")] = 0;
  return theta;
}

RowVectorXd curvature_reading(const AeroelasticModel& model) {
  const Rig& rig = model.rig();
  const double gauge = rig.station[rig.gauge_element - 1], lever = rig.station[rig.calibration_element - 1] - gauge;
  const VectorXd arm = (rig.station.array() - gauge).max(0.0) / lever;
  const VectorXd omega_squared = model.basis().omega.cwiseAbs2();
  RowVectorXd reading = arm.cwiseProduct(rig.normal.inertia).transpose() * model.basis().normal;
  return reading.cwiseProduct(omega_squared.transpose());
}

double five_point_curvature(const VectorXd& f) {
  constexpr double h = 0.875;  // in: elements 5 to 9
  return (-f[4] + 16 * f[5] - 30 * f[6] + 16 * f[7] - f[8]) / (12 * h * h);
}

double coefficient(double newtons) {
  const Conditions c = towed();
  return newtons / (c.density * c.speed * c.speed * semichord * inch * span * inch);
}

}  // namespace unrig::seed
