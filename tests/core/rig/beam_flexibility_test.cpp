#include "core/rig/beam_flexibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <stdexcept>
#include <string>

namespace unrig {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd vector(std::initializer_list<double> values) {
  return Eigen::Map<const VectorXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

/// Terms of one sign, some twenty operations each: a handful of roundings of 1.1e-16.
constexpr double round_off = 4e-15;

/// A cantilever of uniform stiffness 3 N m^2 in four elements.
SteppedBeam uniform() {
  SteppedBeam beam;
  beam.length = vector({0.5, 0.2, 0.3, 1.0});
  beam.stiffness = VectorXd::Constant(4, 3.0);
  beam.station = vector({0.3, 0.6, 0.9, 2.0});
  return beam;
}

/// Thick at the clamp, thin outboard, on a soft clamp, with stations off the middle.
SteppedBeam uneven() {
  SteppedBeam beam;
  beam.length = vector({0.1, 0.02, 0.02, 0.3, 1.5});
  beam.stiffness = vector({4e4, 2.5e3, 40, 9e2, 7e3});
  beam.station = vector({0.04, 0.11, 0.135, 0.4, 1.7});
  beam.clamp_rotation = 3e-6;
  beam.clamp_translation = 2e-8;
  return beam;
}

/// The integral of Eq. A.1 as it is printed, by Simpson's rule on every element cut at the inboard station. The integrand is a parabola
/// there, so that the rule is exact.
double printed_integral(const SteppedBeam& beam, double xi, double xj, const std::function<double(double)>& moments) {
  double sum = 0;
  double begin = 0;
  for (Eigen::Index k = 0; k < beam.length.size(); ++k) {
    const double end = begin + beam.length[k];
    const double a = std::min(begin, std::min(xi, xj));
    const double b = std::min(end, std::min(xi, xj));
    sum += (b - a) / 6 * (moments(a) + 4 * moments((a + b) / 2) + moments(b)) / beam.stiffness[k];
    begin = end;
  }
  return sum;
}

TEST(BendingFlexibility, UniformCantileverHasItsClosedForm) {
  const SteppedBeam beam = uniform();
  const MatrixXd a = bending_flexibility(beam);
  for (Eigen::Index i = 0; i < 4; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      const double x = beam.station[j];
      const double expected = x * x * (3 * beam.station[i] - x) / (6 * 3.0);  // load at x, deflection outboard of it
      EXPECT_NEAR(a(i, j) / expected, 1, round_off) << i << ", " << j;
    }
  }
  EXPECT_NEAR(a(3, 3) / (std::pow(2.0, 3) / (3 * 3.0)), 1, round_off) << "P L^3 / 3 E I at the tip";
}

TEST(BendingFlexibility, SteppedCantileverHasItsClosedForm) {
  SteppedBeam beam;
  const double l1 = 0.4;
  const double l2 = 0.7;
  const double s1 = 50;
  const double s2 = 2;
  beam.length = vector({l1, l2});
  beam.stiffness = vector({s1, s2});
  beam.station = vector({l1, l1 + l2});
  const MatrixXd a = bending_flexibility(beam);
  // The thick part carries force and moment l2; the thin part is a cantilever on its end.
  const double deflection = l1 * l1 * l1 / (3 * s1) + l2 * l1 * l1 / (2 * s1);
  const double slope = l1 * l1 / (2 * s1) + l2 * l1 / s1;
  EXPECT_NEAR(a(1, 1) / (deflection + slope * l2 + l2 * l2 * l2 / (3 * s2)), 1, round_off);
  EXPECT_NEAR(a(0, 1) / deflection, 1, round_off);
}

TEST(BendingFlexibility, IsThePrintedIntegral) {
  SteppedBeam beam = uneven();
  beam.clamp_rotation = beam.clamp_translation = 0;
  const MatrixXd a = bending_flexibility(beam);
  for (Eigen::Index i = 0; i < 5; ++i) {
    for (Eigen::Index j = 0; j < 5; ++j) {
      const double xi = beam.station[i];
      const double xj = beam.station[j];
      const double integral = printed_integral(beam, xi, xj, [&](double x) { return (xi - x) * (xj - x); });
      EXPECT_NEAR(a(i, j) / integral, 1, 1e-14) << i << ", " << j;  // Simpson's rule sums thirty roundings
    }
  }
}

TEST(BendingFlexibility, CompliantClampAddsRotationAndTranslation) {
  const SteppedBeam soft = uneven();
  SteppedBeam rigid = soft;
  rigid.clamp_rotation = rigid.clamp_translation = 0;
  const MatrixXd clamp = 3e-6 * soft.station * soft.station.transpose() + MatrixXd::Constant(5, 5, 2e-8);
  const MatrixXd expected = bending_flexibility(rigid) + clamp;
  EXPECT_LE((bending_flexibility(soft) - expected).cwiseQuotient(expected).cwiseAbs().maxCoeff(), round_off);
}

TEST(BendingFlexibility, IsReciprocalAndPositiveDefinite) {
  const MatrixXd a = bending_flexibility(uneven());
  EXPECT_EQ(a, a.transpose());
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(a).eigenvalues()[0], 0);
}

TEST(BendingFlexibility, FinerElementsOfTheSameBeamChangeNothing) {
  const MatrixXd coarse = bending_flexibility(uniform());
  SteppedBeam fine;
  fine.length = VectorXd::Constant(20, 0.1);
  fine.stiffness = VectorXd::Constant(20, 3.0);
  fine.station = VectorXd::LinSpaced(20, 0.1, 2.0);  // at the ends of the elements
  const MatrixXd a = bending_flexibility(fine);
  EXPECT_NEAR(a(2, 19) / coarse(0, 3), 1, 1e-14);
  EXPECT_NEAR(a(8, 5) / coarse(2, 1), 1, 1e-14);  // the ends of 20 elements are 20 rounded sums
}

TEST(TorsionFlexibility, IsTheTwistOfTheShaftInboardOfBoth) {
  SteppedBeam shaft;
  shaft.length = vector({1, 2, 1});
  shaft.stiffness = vector({10, 4, 5});
  shaft.station = vector({0.5, 2, 4});
  shaft.clamp_rotation = 0.25;
  const MatrixXd a = torsion_flexibility(shaft);
  const VectorXd twist = vector({0.25 + 0.05, 0.25 + 0.1 + 0.25, 0.25 + 0.1 + 0.5 + 0.2});
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(a(i, j), twist[std::min(i, j)], 1e-15) << i << ", " << j;
  }
}

TEST(TorsionConstant, Circle) { EXPECT_DOUBLE_EQ(circular_torsion_constant(2.0), std::numbers::pi / 2); }

TEST(TorsionConstant, RectangleFromTheSeries) {
  // The series summed with 40 digits; Timoshenko and Goodier's table prints 0.1406, 0.229 and 0.312.
  EXPECT_NEAR(rectangular_torsion_factor(1), 0.140577014955153787, 1e-15);
  EXPECT_NEAR(rectangular_torsion_factor(2), 0.228681677119570765, 1e-15);
  EXPECT_NEAR(rectangular_torsion_factor(10), 0.312325037457205386, 1e-15);
  // Thin strip: tanh is 1 but for exp(-pi ratio), and the sum is 31/32 zeta(5).
  EXPECT_NEAR(rectangular_torsion_factor(1e9), 1.0 / 3, 1e-9);
}

/// The sum as it is printed, term by term; what is left after odd n < N is below 1/(8 N^4).
double printed_factor(double ratio) {
  double sum = 0;
  for (int n = 1999; n >= 1; n -= 2) sum += std::tanh(n * std::numbers::pi * ratio / 2) / std::pow(n, 5);
  return (1 - 192 / (std::pow(std::numbers::pi, 5) * ratio) * sum) / 3;
}

TEST(TorsionConstant, RectangleIsThePrintedSeries) {
  for (const double ratio : {1.0, 1.1, 1.5, 3.0, 7.0})
    EXPECT_NEAR(rectangular_torsion_factor(ratio), printed_factor(ratio), 1e-14) << ratio;
}

TEST(TorsionConstant, SidesOfARectangleMayStandInAnyOrder) {
  EXPECT_EQ(rectangular_torsion_constant(0.01, 0.03), rectangular_torsion_constant(0.03, 0.01));
  EXPECT_NEAR(rectangular_torsion_constant(0.01, 0.03) / (rectangular_torsion_factor(3) * 3e-8), 1, 1e-14);
}

std::string complaint(const SteppedBeam& beam) {
  try {
    bending_flexibility(beam);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "no error";
}

TEST(BeamFlexibility, RefusesWhatIsNoBeamAndNamesTheElement) {
  using ::testing::HasSubstr;
  SteppedBeam beam = uniform();
  beam.station[2] = 1.001;
  EXPECT_THAT(complaint(beam), HasSubstr("station of element 3"));
  beam = uniform();
  beam.station[1] = 0.499;
  EXPECT_THAT(complaint(beam), HasSubstr("station of element 2"));
  beam = uniform();
  beam.stiffness[3] = 0;
  EXPECT_THAT(complaint(beam), HasSubstr("stiffness of element 4"));
  beam = uniform();
  beam.length[0] = std::nan("");
  EXPECT_THAT(complaint(beam), HasSubstr("length of element 1"));
  beam = uniform();
  beam.station.conservativeResize(3);
  EXPECT_THAT(complaint(beam), HasSubstr("3 stations"));
  beam = uniform();
  beam.clamp_rotation = -1;
  EXPECT_THAT(complaint(beam), HasSubstr("clamp"));
  EXPECT_THROW(circular_torsion_constant(0), std::invalid_argument);
  EXPECT_THROW(rectangular_torsion_constant(0.1, 0), std::invalid_argument);
  EXPECT_THROW(rectangular_torsion_factor(0.5), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
