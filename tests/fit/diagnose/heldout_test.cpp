// Runs that were not fitted, against least squares in closed form.

#include "fit/diagnose/heldout.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "tests/fit/one_mode.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index samples = 500;
constexpr double noise = 0.01, stiffer = 1.02;  // times the frequency: the two are out of step within the record

unrig::Run decay(const std::string& file, double frequency, unsigned seed) {
  return one_mode::decay(file, (one_mode::free_response(samples, frequency) * Eigen::Vector2d(1, 0.4) + noise * one_mode::white_noise(samples, seed)).array() + 0.3);
}

/// R.m.s. that a rig of this frequency leaves of a reading when only the start and the offset are its own.
double left_by(double frequency, const VectorXd& reading) {
  MatrixXd columns(reading.size(), 3);
  columns << one_mode::free_response(reading.size(), frequency), VectorXd::Ones(reading.size());
  const VectorXd left = reading - columns * columns.householderQr().solve(reading);
  return left.norm() / std::sqrt(static_cast<double>(left.size()));
}

struct Campaign {
  FitProblem problem;
  Arrival arrival;

  /// The fit stands at the rig's own values, which are the truth of all decays but the stiffer ones.
  explicit Campaign(std::vector<unrig::Run> runs) : problem(problem_of(std::move(runs))), arrival(arrival_of(problem)) {}

 private:
  static FitProblem problem_of(std::vector<unrig::Run> runs) {
    FitProblem problem;
    problem.rig = one_mode::rig();
    problem.runs = std::move(runs);
    return problem;
  }
  static Arrival arrival_of(const FitProblem& problem) {
    const auto model = std::make_shared<const AeroelasticModel>(one_mode::model());
    std::vector<RunResidual> residuals;
    for (const unrig::Run& run : problem.runs) residuals.emplace_back(*model, run, std::vector<MotionBasis::Window>{});
    return {model, std::vector<std::vector<MotionBasis::Window>>(problem.runs.size()), JointProblem(*model, std::move(residuals))};
  }
};

TEST(Heldout, ARunIsPredictedWithTheParametersOfTheOthers) {
  const Campaign campaign({decay("fitted.csv", one_mode::hertz, 1)});
  const unrig::Run like = decay("like.csv", one_mode::hertz, 2), other = decay("other.csv", stiffer * one_mode::hertz, 3);
  const HeldoutResidual of_like = predict_heldout(campaign.arrival, like), of_other = predict_heldout(campaign.arrival, other);
  EXPECT_EQ(of_like.channel, "gauge");
  EXPECT_NEAR(of_like.noise, noise, 0.1 * noise);  // 500 samples tell it to 5 %
  EXPECT_NEAR(of_like.rms, left_by(one_mode::hertz, like.channel("gauge").value), 1e-6 * of_like.rms);
  // Fitted by itself it would be left with its noise.
  EXPECT_GT(of_other.rms, 5 * noise);
  EXPECT_NEAR(of_other.rms, left_by(one_mode::hertz, other.channel("gauge").value), 1e-6 * of_other.rms);
}

TEST(Heldout, ARunThatIsLeftOutHasNoPartInTheFitThatPredictsIt) {
  const Campaign campaign({decay("a.csv", one_mode::hertz, 1), decay("b.csv", one_mode::hertz, 2), decay("stiffer.csv", stiffer * one_mode::hertz, 3)});
  const HeldoutResidual left_out = predict_left_out(campaign.arrival, 2);
  // The others tell the frequency to 1e-5 of it. With a third of the say in it the run would pull it by a third of the way, and be left with two thirds.
  const double expected = left_by(one_mode::hertz, campaign.problem.runs[2].channel("gauge").value);
  EXPECT_NEAR(left_out.rms, expected, 0.01 * expected);
}

}  // namespace
}  // namespace unrig
