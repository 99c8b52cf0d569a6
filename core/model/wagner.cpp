#include "core/model/wagner.h"

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>

namespace unrig {
namespace {

struct Pole {
  double amplitude;
  double rate;
};

// Printed by tests/support/fit_wagner.py, which also says in which sense these are the best.
// clang-format off
constexpr Pole within_1e4_poles[] = {
    {1.62165613749757e-03, 5.03606364897936e-04},
    {1.11345851722105e-02, 5.51798132278591e-03},
    {5.12854222488395e-02, 2.86794592624548e-02},
    {1.72415844680658e-01, 1.02405639364402e-01},
    {2.11049517622975e-01, 2.84355261331166e-01},
    {5.23963747961373e-02, 8.49939725592351e-01},
};

constexpr Pole within_1e6_poles[] = {
    {1.21460837188566e-05, 3.79909726597129e-06},
    {7.98578687744939e-05, 4.17926104751385e-05},
    {3.27797213032327e-04, 2.21164652686544e-04},
    {1.07403049795363e-03, 8.53326787976253e-04},
    {3.08196759137793e-03, 2.73022992158829e-03},
    {8.16569550832940e-03, 7.68552110963458e-03},
    {2.07224429779263e-02, 1.96427673629097e-02},
    {5.09579459243005e-02, 4.62687451236397e-02},
    {1.11334655141616e-01, 1.00449516624651e-01},
    {1.58301851219076e-01, 2.01792614387647e-01},
    {1.07277463947682e-01, 3.99460081717131e-01},
    {3.46879710673432e-02, 8.31579804928561e-01},
    {3.97544660097445e-03, 1.83956663850225e+00},
};
// clang-format on

constexpr Pole jones_poles[] = {{0.165, 0.0455}, {0.335, 0.3}};
constexpr Pole seed_poles[] = {{0.165, 0.0455}, {0.355, 0.3}};

struct Choice {
  Wagner which;
  const char* name;
  std::span<const Pole> poles;
};

constexpr std::array choices = {
    Choice{Wagner::within_1e4, "1e-4", within_1e4_poles},
    Choice{Wagner::within_1e6, "1e-6", within_1e6_poles},
    Choice{Wagner::jones, "jones", jones_poles},
    Choice{Wagner::seed, "seed", seed_poles},
};

// The integrand of Eq. 2.4 times x, as a function of u = ln x, is analytic for |Im u| < pi/2 and falls off at both ends (as e^u to the
// left, as exp(-2 e^u) to the right), so the trapezoidal rule of step h is in error by about exp(-pi^2/h). h = 0.18 leaves that far below
// the double's last digit; the ends leave out 1.4e-15 on the left and less than 1e-16 on the right. The largest argument is 18: no Bessel
// function overflows, and the standard library's have a relative error of 2e-15 here.
IndicialFunction quadrature() {
  constexpr double step = 0.18;
  constexpr int first = -190;
  constexpr int last = 16;
  IndicialFunction phi{"quadrature", Eigen::VectorXd(last - first + 1), Eigen::VectorXd(last - first + 1)};
  for (int j = first; j <= last; ++j) {
    const double x = std::exp(j * step);
    const double k = std::cyl_bessel_k(0, x) - std::cyl_bessel_k(1, x);
    const double i = std::numbers::pi * (std::cyl_bessel_i(0, x) + std::cyl_bessel_i(1, x));
    phi.amplitude[j - first] = step / (x * (k * k + i * i));
    phi.rate[j - first] = x;
  }
  return phi;
}

}  // namespace

double IndicialFunction::operator()(double s) const {
  if (std::isnan(s)) return std::numeric_limits<double>::quiet_NaN();
  if (s < 0) return 0;
  return 1 - (amplitude.array() * (rate.array() * -s).exp()).sum();
}

double wagner_exact(double s) { return wagner_quadrature()(s); }

const IndicialFunction& wagner_quadrature() {
  static const IndicialFunction phi = quadrature();
  return phi;
}

IndicialFunction wagner(Wagner which) {
  for (const Choice& choice : choices) {
    if (choice.which != which) continue;
    const auto n = static_cast<Eigen::Index>(choice.poles.size());
    IndicialFunction phi{choice.name, Eigen::VectorXd(n), Eigen::VectorXd(n)};
    for (Eigen::Index j = 0; j < n; ++j) {
      phi.amplitude[j] = choice.poles[static_cast<std::size_t>(j)].amplitude;
      phi.rate[j] = choice.poles[static_cast<std::size_t>(j)].rate;
    }
    return phi;
  }
  throw std::logic_error("wagner: a value outside the enumeration");
}

Wagner wagner_from_name(const std::string& name) {
  std::string names;
  for (const Choice& choice : choices) {
    if (name == choice.name) return choice.which;
    names += (names.empty() ? "" : ", ") + std::string(choice.name);
  }
  throw std::invalid_argument("no approximation of Wagner's function is called '" + name + "'; there are " + names);
}

}  // namespace unrig
