#include "core/model/wagner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/model/theodorsen.h"

namespace unrig {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The absolute error that wagner.h and theodorsen.h promise for the exact functions.
constexpr double promised = 1e-12;

/// `count` points from `from` to `to`, equidistant in the logarithm.
std::vector<double> log_grid(double from, double to, int count) {
  std::vector<double> grid;
  for (int i = 0; i < count; ++i) grid.push_back(from * std::pow(to / from, static_cast<double>(i) / (count - 1)));
  return grid;
}

// ---------------------------------------------------------------------------------------------------------------- Wagner's function, exact

TEST(WagnerExact, AgreesWithThirtyDigitQuadrature) {
  // Adaptive quadrature of Eq. 2.4 in 30-digit arithmetic, printed to 15 digits; the tolerance is the promise of wagner.h.
  const double table[][2] = {
      {0.01, .501246884083775}, {0.1, .512196316527404}, {0.5, .555663868895974}, {1, .600605598398806},    {2, .669289564315686},
      {3, .719560216025821},    {4, .757966814398338},   {5, .788203166469517},   {6, .812552505175392},    {8, .849128669877039},
      {10, .875044712139766},   {15, .914780178621632},  {20, .936649270015234},  {30, .959158900449045},   {50, .976763902437608},
      {100, .989059034878162},  {200, .994735513668193}, {500, .997951337600976}, {1000, .998986574994711}, {10000, .999899821504887},
  };
  for (const auto& [s, phi] : table) EXPECT_NEAR(wagner_exact(s), phi, promised) << "s = " << s;
}

TEST(WagnerExact, StartsAtOneHalfWithSlopeOneEighth) {
  EXPECT_NEAR(wagner_exact(0), 0.5, promised);
  // Derivatives at the step from the sum; they are those of Theodorsen's function at high frequency, 1/2 + z/8 - z^2/16, z = 1/(i k).
  const IndicialFunction& phi = wagner_quadrature();
  EXPECT_NEAR((phi.amplitude.array() * phi.rate.array()).sum(), 1.0 / 8, promised);
  EXPECT_NEAR((phi.amplitude.array() * phi.rate.array().square()).sum(), 1.0 / 16, promised);
  // And by difference: phi = 1/2 + s/8 - s^2/32 + O(s^3) with a third derivative of 7/128.
  const double s = 1e-3;
  EXPECT_NEAR(wagner_exact(s), 0.5 + s / 8 - s * s / 32, 7.0 / 128 / 6 * s * s * s + promised);
}

TEST(WagnerExact, EndsAsOneMinusOneOverS) {
  // Expanding the integrand for small x gives 1 - phi = 1/s + 2 (ln 2s - 1)/s^2 + O(ln^2 s / s^3). The next term is 6 ln^2(2s)/s^3 less a
  // term in ln s, so that 6 ln^2(2s)/s^3 bounds the remainder; at s = 100 that is 20 % of the second term, at 1e5 it is 0.04 %.
  for (const double s : {1e2, 1e3, 1e4, 1e5}) {
    const double l = std::log(2 * s);
    EXPECT_NEAR(1 - wagner_exact(s), 1 / s + 2 * (l - 1) / (s * s), 6 * l * l / (s * s * s)) << "s = " << s;
  }
  EXPECT_EQ(wagner_exact(infinity), 1);
}

TEST(WagnerExact, RisesAllTheWay) {
  double before = wagner_exact(0);
  for (const double s : log_grid(1e-6, 1e6, 2000)) {
    const double phi = wagner_exact(s);
    EXPECT_GT(phi, before) << "s = " << s;
    before = phi;
  }
  EXPECT_LT(before, 1);
}

TEST(WagnerExact, IsZeroBeforeTheStepAndHandsNotANumberOn) {
  EXPECT_EQ(wagner_exact(-1e-3), 0);
  EXPECT_EQ(wagner_exact(-infinity), 0);
  EXPECT_TRUE(std::isnan(wagner_exact(std::numeric_limits<double>::quiet_NaN())));
}

TEST(WagnerExact, IsAStableStateModel) {
  const IndicialFunction& phi = wagner_quadrature();
  ASSERT_EQ(phi.amplitude.size(), phi.rate.size());
  EXPECT_GT(phi.amplitude.minCoeff(), 0);
  EXPECT_GT(phi.rate.minCoeff(), 0);
}

// ------------------------------------------------------------------------------------------------------------------------- approximations

/// What wagner.h states about each approximation; the errors are printed there rounded up in the third digit, so the measured ones may be
/// smaller by 1 % and not larger at all.
struct Stated {
  Wagner which;
  std::string name;
  int poles;
  double largest;       ///< |error| of phi over all s >= 0
  double largest_of_c;  ///< |error| of C(k) over all k
};

const std::vector<Stated> stated = {
    {Wagner::within_1e4, "1e-4", 6, 9.66e-5, 2.86e-4},
    {Wagner::within_1e6, "1e-6", 13, 7.29e-7, 2.68e-6},
    {Wagner::jones, "jones", 2, 9.59e-3, 1.46e-2},
    {Wagner::seed, "seed", 2, 2.26e-2, 3.18e-2},
};

struct Ripple {
  double s;
  double error;
};

/// The error of an approximation on a grid that stands for all s >= 0: s = 0 and 20000 points from 1e-6 to 1e8. Beyond, both functions are
/// below their value of at most 1e-8 at the last point and fall.
std::vector<Ripple> error_curve(const IndicialFunction& phi) {
  std::vector<Ripple> curve{{0, phi(0) - wagner_exact(0)}};
  for (const double s : log_grid(1e-6, 1e8, 20000)) curve.push_back({s, phi(s) - wagner_exact(s)});
  return curve;
}

bool smaller(const Ripple& a, const Ripple& b) { return std::abs(a.error) < std::abs(b.error); }

/// The largest error between each two changes of its sign.
std::vector<Ripple> extremes(const std::vector<Ripple>& curve) {
  std::vector<Ripple> found;
  for (const Ripple& here : curve) {
    if (found.empty() || (here.error > 0) != (found.back().error > 0)) found.push_back(here);
    if (smaller(found.back(), here)) found.back() = here;
  }
  return found;
}

/// |e(0)| plus the total variation of e, which ends at 0: the bound of theodorsen.h on the error of C.
double bound_on_c(const std::vector<Ripple>& curve) {
  double bound = std::abs(curve.front().error) + std::abs(curve.back().error);
  for (std::size_t i = 1; i < curve.size(); ++i) bound += std::abs(curve[i].error - curve[i - 1].error);
  return bound;
}

Ripple largest(const std::vector<Ripple>& curve) { return *std::max_element(curve.begin(), curve.end(), smaller); }

TEST(WagnerApproximation, LargestErrorIsTheStatedOne) {
  for (const Stated& s : stated) {
    const IndicialFunction phi = wagner(s.which);
    const double error = std::abs(largest(error_curve(phi)).error);
    EXPECT_LE(error, s.largest) << s.name;
    EXPECT_GE(error, 0.99 * s.largest) << s.name;
    EXPECT_LT(1 - phi(1e8), 1e-8 * 1.01) << s.name << ": the tail beyond the grid";
  }
  // The names are promises of their own.
  EXPECT_LE(std::abs(largest(error_curve(wagner(Wagner::within_1e4))).error), 1e-4);
  EXPECT_LE(std::abs(largest(error_curve(wagner(Wagner::within_1e6))).error), 1e-6);
}

/// The grid step in ln s is 1.6e-3, and the ripples of the two best sums are 0.38 apart or more: an extreme between two grid points is
/// underestimated by up to (pi/0.38)^2 (1.6e-3/2)^2 / 2 of its size.
constexpr double ripple_tolerance = 2.2e-5;

TEST(WagnerApproximation, EqualRippleProvesTheBestOfItsNumberOfPoles) {
  // 2 n + 1 extremes of alternating sign: no n real exponentials do better than the smallest of them, because the difference of two such
  // sums has at most 2 n - 1 zeros.
  for (const Wagner which : {Wagner::within_1e4, Wagner::within_1e6}) {
    const IndicialFunction phi = wagner(which);
    const std::vector<Ripple> found = extremes(error_curve(phi));
    ASSERT_EQ(found.size(), 2 * static_cast<std::size_t>(phi.rate.size()) + 1) << phi.name;
    EXPECT_EQ(found.front().s, 0) << phi.name;
    const auto [least, most] = std::minmax_element(found.begin(), found.end(), smaller);
    EXPECT_GE(std::abs(least->error), (1 - ripple_tolerance) * std::abs(most->error)) << phi.name;
  }
}

TEST(WagnerApproximation, JonesIsWorstInTheTail) {
  // Independent figures, each held to its printed digits: 9.6e-3 at s = 82, 6.6e-3 up to s = 20, and 84 % of 1 - phi missing by s = 100.
  const IndicialFunction jones = wagner(Wagner::jones);
  EXPECT_EQ(jones(0), 0.5);
  const std::vector<Ripple> curve = error_curve(jones);
  const Ripple worst = largest(curve);
  EXPECT_NEAR(worst.error, 9.6e-3, 0.05e-3);
  EXPECT_NEAR(worst.s, 82, 0.5);
  EXPECT_NEAR((jones(100) - wagner_exact(100)) / (1 - wagner_exact(100)), 0.84, 0.005);
  double early = 0;
  for (const Ripple& r : curve) {
    if (r.s <= 20) early = std::max(early, std::abs(r.error));
  }
  EXPECT_NEAR(early, 6.6e-3, 0.05e-3);
}

TEST(WagnerApproximation, SeedStartsBelowOneHalf) {
  // Errata, 1: 0.165 + 0.355 leaves 0.48 at the step. Two rounding errors of double.
  EXPECT_NEAR(wagner(Wagner::seed)(0), 0.48, 2e-16);
  EXPECT_NEAR(largest(error_curve(wagner(Wagner::seed))).s, 0.5, 0.05);  // one printed digit
}

TEST(WagnerApproximation, StatesDecayAndComeInOrder) {
  for (const Stated& s : stated) {
    const IndicialFunction phi = wagner(s.which);
    EXPECT_EQ(phi.name, s.name);
    ASSERT_EQ(phi.amplitude.size(), s.poles) << s.name;
    ASSERT_EQ(phi.rate.size(), s.poles) << s.name;
    EXPECT_GT(phi.amplitude.minCoeff(), 0) << s.name;
    EXPECT_GT(phi.rate.minCoeff(), 0) << s.name;
    EXPECT_TRUE(std::is_sorted(phi.rate.begin(), phi.rate.end())) << s.name;
    EXPECT_EQ(phi(-1), 0) << s.name;
    EXPECT_EQ(phi(infinity), 1) << s.name;
  }
}

TEST(WagnerApproximation, IsFoundByNameAndNoOther) {
  for (const Stated& s : stated) EXPECT_EQ(wagner_from_name(s.name), s.which);
  for (const std::string name : {"", "Jones", "1e-5", "1E-4", "jones "}) {
    try {
      wagner_from_name(name);
      ADD_FAILURE() << "'" << name << "' was taken for an approximation";
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find("'" + name + "'"), std::string::npos) << e.what();
      for (const Stated& s : stated) EXPECT_NE(std::string(e.what()).find(s.name), std::string::npos) << e.what();
    }
  }
}

// ------------------------------------------------------------------------------------------------------------------- Theodorsen's function

TEST(TheodorsenExact, AgreesWithHighPrecision) {
  // K1(i k) / (K0(i k) + K1(i k)) in 25-digit arithmetic, which is the same function in other Bessel functions; tolerance promised.
  const struct {
    double k;
    std::complex<double> c;
  } table[] = {
      {0.05, {.9090089974773357, -.1306443896938562}}, {0.1, {.8319241049652762, -.172302228734195}},
      {0.5, {.597936064250132, -.1507095031626353}},   {1, {.5394348710777939, -.1002729028641078}},
      {2, {.5129548124291316, -.05769128342167991}},   {10, {.500617885388891, -.01244662155391188}},
  };
  for (const auto& [k, c] : table) EXPECT_LT(std::abs(theodorsen_exact(k) - c), promised) << "k = " << k;
}

TEST(TheodorsenExact, GoesFromOneToOneHalf) {
  EXPECT_EQ(theodorsen_exact(0), 1.0);
  EXPECT_EQ(theodorsen_exact(infinity), 0.5);
  EXPECT_EQ(theodorsen_exact(-0.3), std::conj(theodorsen_exact(0.3)));
  // Both ways of computing it meet at k = 1000, within the promise of either.
  EXPECT_LT(std::abs(theodorsen_exact(1000) - theodorsen_exact(std::nextafter(1000, infinity))), 2 * promised);
}

TEST(Theodorsen, ExactStatesGiveTheExactFunction) {
  // Hankel functions on one side, the states of the integral in Eq. 2.4 on the other: the one is the transform of the other.
  for (const double k : log_grid(1e-6, 1e5, 2000)) {
    EXPECT_LT(std::abs(theodorsen(wagner_quadrature(), k) - theodorsen_exact(k)), promised) << "k = " << k;
  }
}

TEST(Theodorsen, ErrorOfAnApproximationIsTheStatedOneAndWithinTheVariation) {
  for (const Stated& s : stated) {
    const IndicialFunction phi = wagner(s.which);
    double error = 0;
    for (const double k : log_grid(1e-9, 1e4, 5000)) error = std::max(error, std::abs(theodorsen(phi, k) - theodorsen_exact(k)));
    EXPECT_LE(error, s.largest_of_c) << s.name;
    EXPECT_GE(error, 0.99 * s.largest_of_c) << s.name;
    EXPECT_LE(error, bound_on_c(error_curve(phi))) << s.name;
  }
}

TEST(Theodorsen, EqualRippleHasTheStatedVariation) {
  // (4 n + 2) E: e jumps to E at the step, runs 2 n times from one sign to the other, and dies out.
  for (const Wagner which : {Wagner::within_1e4, Wagner::within_1e6}) {
    const IndicialFunction phi = wagner(which);
    const std::vector<Ripple> curve = error_curve(phi);
    const double times = 4 * static_cast<double>(phi.rate.size()) + 2;
    EXPECT_NEAR(bound_on_c(curve) / std::abs(largest(curve).error), times, ripple_tolerance * times) << phi.name;
  }
}

TEST(Theodorsen, LimitsAreTheEndAndTheStartOfTheIndicialResponse) {
  // Rounding of a sum of n terms that add up to 1/2.
  for (const Stated& s : stated) {
    const IndicialFunction phi = wagner(s.which);
    EXPECT_EQ(theodorsen(phi, 0), 1.0) << s.name;
    EXPECT_NEAR(theodorsen(phi, infinity).real(), phi(0), 1e-15) << s.name;
    EXPECT_EQ(theodorsen(phi, infinity).imag(), 0) << s.name;
    EXPECT_EQ(theodorsen(phi, -0.3), std::conj(theodorsen(phi, 0.3))) << s.name;
  }
}

}  // namespace
}  // namespace unrig
