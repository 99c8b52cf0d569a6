// What a rig does under every nonlinear effect of the table, over inputs and a shaft that turns.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/propagate/nonlinear_response.h"
#include "tests/core/effects/effect_cases.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double dt = 0.002;
constexpr Index samples = 60;

/// A rig in a stream that records a force and the motion of its mount.
class ResponseOfARig {
 public:
  ResponseOfARig(const Rig& rig, const Effect& e) : model_(effect_cases::model_with(rig, e.id)), conditions_(effect_cases::conditions_for(rig)) {
    std::mt19937_64 random(11);
    theta_ = model_.start_values();
    if (e.draw && !rig.is_modal()) theta_.tail(static_cast<Index>(e.parameters.size())) = e.draw(model_, 20, random);
    for (double& p : theta_)
      if (p == 0) p = 1e-3;
    system_ = system(theta_);
    start_ = VectorXd::Constant(system_.states(), 0.3);  // memories too: at rest a law may have a corner
    start_.head(system_.free_states()).setConstant(0.003);
    start_.head(system_.coordinates).setConstant(5e-5);
    start_.segment(system_.coordinates, system_.coordinates).setConstant(5e-3);
    if (system_.motion >= 0) start_.segment(system_.motion, 3).setZero();
    jerk_ = VectorXd::Zero(system_.motion >= 0 ? samples : 0);
    for (Index k = 0; k < jerk_.size(); ++k) jerk_[k] = 100 * std::sin(0.2 * static_cast<double>(k));
    inputs_ = MatrixXd(samples + 1, 6);
    const double push = 0.1, shake = 0.15;  // radians per sample
    for (Index k = 0; k <= samples; ++k)
      inputs_.row(k).head(3) << std::cos(push * static_cast<double>(k)), 0.002 * std::sin(shake * static_cast<double>(k)), 0.15 * std::cos(shake * static_cast<double>(k));
    inputs_.rightCols(3) = inputs_.leftCols(3) * Eigen::Vector3d(-push * push, -shake * shake, -shake * shake).asDiagonal() / (dt * dt);
  }

  const AeroelasticModel& model() const { return model_; }
  const LinearSystem& system() const { return system_; }
  const VectorXd& theta() const { return theta_; }
  LinearSystem system(const VectorXd& theta) const { return model_.system(conditions_, theta, {"gauge"}); }

  NonlinearResponse follow(const VectorXd& theta, const VectorXd& start, Partials partials, Index directions = 0) const {
    const LinearSystem there = system(theta);
    NonlinearDrive drive{start, jerk_, inputs_, MatrixXd::Identity(there.states(), directions), MatrixXd()};
    return unrig::follow(there, step_to_follow(there, dt), theta, drive, samples, partials);
  }
  const VectorXd& start() const { return start_; }

 private:
  AeroelasticModel model_;
  Conditions conditions_;
  VectorXd theta_, start_, jerk_;
  MatrixXd inputs_;
  LinearSystem system_;
};

std::vector<effect_cases::Case> nonlinear_effects() {
  std::vector<effect_cases::Case> all = effect_cases::cases();
  std::erase_if(all, [](const effect_cases::Case& c) { return ResponseOfARig(c.rig, *c.effect).system().feedback.empty(); });
  return all;
}

/// Tangents in every parameter of the model and in every state of the start, beside central differences with their error of second order taken out.
TEST(Responses, UnderEveryLawHaveExactTangents) {
  int looked_at = 0;
  for (const auto& [e, rig] : nonlinear_effects()) {
    const ResponseOfARig one(rig, *e);
    if (one.system().feedback.front().steps_per_sample > 1) continue;  // where a difference crosses a corner it is no slope (tests/core/propagate/nonlinear_response_test.cpp)
    const Index n = one.system().states();
    const NonlinearResponse at = one.follow(one.theta(), one.start(), Partials::all, n);
    ASSERT_TRUE(at.finite) << e->id;
    const auto expect_slope = [&](Index column, double h, const auto& output, const std::string& what) {
      const auto difference = [&](double by) -> VectorXd { return (output(by) - output(-by)) / (2 * by); };
      const VectorXd slope = (4 * difference(h / 2) - difference(h)) / 3;
      const double rounding = 1e-12 * at.output.norm() / h;  // each step solves for its force to 1e-13
      EXPECT_LT((at.tangent[0].col(column) - slope).norm(), 1e-6 * slope.norm() + rounding) << e->id << " of " << rig.file << ": " << what;
      ++looked_at;
    };
    for (Index j = 0; j < one.theta().size(); ++j)
      expect_slope(n + j, 2e-4 * std::abs(one.theta()[j]), [&](double by) -> VectorXd { return one.follow(one.theta() + by * VectorXd::Unit(one.theta().size(), j), one.start(), Partials::none).output.col(0); },
                   one.model().parameters()[static_cast<std::size_t>(j)].name);
    for (Index i = 0; i < n; ++i)
      expect_slope(i, 1e-8, [&](double by) -> VectorXd { return one.follow(one.theta(), one.start() + by * VectorXd::Unit(n, i), Partials::none).output.col(0); }, "state " + std::to_string(i));
  }
  EXPECT_GT(looked_at, 100);
}

/// What is known of a state in the middle is all that the rest depends on: laws that see accelerations too find the same force there again.
TEST(Responses, GoOnFromWhereTheyWereCut) {
  for (const auto& [e, rig] : nonlinear_effects()) {
    const ResponseOfARig one(rig, *e);
    const LinearSystem& system = one.system();
    const ExactStep step = step_to_follow(system, dt);
    const Index inputs = system.B.cols() - static_cast<Index>(system.feedback.size());
    const auto over = [&](const VectorXd& start, Index count) {
      return follow(system, step, one.theta(), {start, VectorXd::Zero(system.motion >= 0 ? count : 0), MatrixXd::Zero(count + 1, inputs), MatrixXd(system.states(), 0), {}}, count, Partials::none);
    };
    const NonlinearResponse whole = over(one.start(), samples), first = over(one.start(), samples / 2), second = over(first.end, samples - samples / 2);
    ASSERT_TRUE(whole.finite) << e->id;
    EXPECT_LT((whole.output.bottomRows(second.output.rows()) - second.output).norm(), 1e-9 * whole.output.norm()) << e->id;
  }
}

}  // namespace
}  // namespace unrig
