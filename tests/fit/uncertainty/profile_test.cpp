// Profile-likelihood intervals against closed forms.
#include "fit/uncertainty/profile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

namespace unrig {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using End = ProfileLimit::End;

constexpr double tolerance = 2e-3;  // twice the tolerance of a limit, relative to its distance from the value

/// One unknown and one residual.
LeastSquaresProblem one_unknown(LeastSquaresUnknown unknown, std::function<double(double)> residual, std::function<double(double)> slope) {
  LeastSquaresProblem problem;
  problem.unknowns.push_back(std::move(unknown));
  problem.terms.push_back({{0}, 1, [=](const VectorXd& x, VectorXd& r, MatrixXd* j) {
                             r[0] = residual(x[0]);
                             if (j != nullptr) (*j)(0, 0) = slope(x[0]);
                             return true;
                           }});
  return problem;
}

TEST(Profile, OfALinearProblemIsTheStandardErrorWithAllOthersFree) {
  // r = (x + y - 3, x - y - 1, x - 2): the least chi-square is at (2, 1), and the inverse of J^T J is diag(1/3, 1/2).
  LeastSquaresProblem problem;
  problem.unknowns = {{"x", 2}, {"y", 1}};
  problem.terms.push_back({{0, 1}, 3, [](const VectorXd& v, VectorXd& r, MatrixXd* j) {
                             r << v[0] + v[1] - 3, v[0] - v[1] - 1, v[0] - 2;
                             if (j != nullptr) *j << 1, 1, 1, -1, 1, 0;
                             return true;
                           }});
  const double error[] = {std::sqrt(1.0 / 3), std::sqrt(0.5)};
  for (const double confidence : {0.6826894921370859, 0.95})
    for (std::size_t k : {0u, 1u}) {
      ProfileOptions options;
      options.confidence = confidence;
      const ProfileInterval interval = profile(problem, k, options);
      const double half = two_sided_quantile(confidence) * error[k];
      EXPECT_NEAR(interval.upper.value - problem.unknowns[k].value, half, tolerance * half);
      EXPECT_NEAR(problem.unknowns[k].value - interval.lower.value, half, tolerance * half);
      EXPECT_EQ(interval.lower.end, End::crossed);
      EXPECT_EQ(interval.upper.end, End::crossed);
    }
}

TEST(Profile, OfAnUnknownAtItsBoundIsOneSided) {
  // A damping ratio that the data put at -1 standard errors: chi-square is (x + 1)^2, least at the bound 0, and rises by one to x = sqrt(2) - 1.
  const LeastSquaresProblem problem = one_unknown({"damping", 0, 0}, [](double x) { return x + 1; }, [](double) { return 1.0; });
  const ProfileInterval interval = profile(problem, 0);
  EXPECT_EQ(interval.lower.end, End::bound);
  EXPECT_EQ(interval.lower.value, 0);
  EXPECT_EQ(interval.upper.end, End::crossed);
  EXPECT_NEAR(interval.upper.value, std::sqrt(2) - 1, tolerance * (std::sqrt(2) - 1));
  EXPECT_NE(interval.text.find("bound"), std::string::npos) << interval.text;
}

TEST(Profile, FollowsAModelThatIsNotLinear) {
  // chi-square (e^x - 2)^2 rises by one where e^x is 1 and 3.
  const LeastSquaresProblem problem = one_unknown({"x", std::log(2)}, [](double x) { return std::exp(x) - 2; }, [](double x) { return std::exp(x); });
  const ProfileInterval interval = profile(problem, 0);
  EXPECT_NEAR(interval.lower.value, 0, tolerance * std::log(2));
  EXPECT_NEAR(interval.upper.value, std::log(3), tolerance * std::log(1.5));
}

TEST(Profile, SaysWhereTheDataSetNoLimit) {
  // (atan x - 1)^2 never rises above (pi/2 - 1)^2 = 0.33 to the right; to the left it is one where atan x = 0.
  const LeastSquaresProblem problem = one_unknown({"x", std::tan(1)}, [](double x) { return std::atan(x) - 1; }, [](double x) { return 1 / (1 + x * x); });
  const ProfileInterval interval = profile(problem, 0);
  EXPECT_EQ(interval.upper.end, End::unbounded);
  EXPECT_TRUE(std::isinf(interval.upper.value));
  EXPECT_NEAR(interval.lower.value, 0, tolerance * std::tan(1));
}

TEST(Profile, NoticesThatTheFitHadNotArrived) {
  const LeastSquaresProblem problem = one_unknown({"x", 3}, [](double x) { return x - 1; }, [](double) { return 1.0; });
  EXPECT_TRUE(profile(problem, 0).better.has_value()) << "chi-square is 4 here, and 0 at 1";
}

TEST(Profile, RefusesWhatIsNotThere) {
  const LeastSquaresProblem problem = one_unknown({"x", 1}, [](double x) { return x - 1; }, [](double) { return 1.0; });
  EXPECT_THROW((void)profile(problem, 1), std::invalid_argument);
  ProfileOptions certain;
  certain.confidence = 1;
  EXPECT_THROW((void)profile(problem, 0, certain), std::invalid_argument);
}

}  // namespace
}  // namespace unrig
