// What is known before a run is corrected, and how it enters: by limits, and against least squares without any economy.

#include "correct/estimate/prior.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "correct/modal/modal_load.h"
#include "correct/estimate/uncertainty_budget.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const VectorXd rates{{0.02, 0.1, 0.8}};

AeroelasticModel free_model() {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  return {rig, make_basis(rig, Index{1}, Index{1}), {"free", VectorXd{{0.1, 0.2, 0.15}}, rates}, AeroelasticModel::Circulation::free};
}

/// A fit of "fitted.csv" with five parameters of the rig, of which the first two go together with this correlation; an error is missing where the fit could not tell.
FittedRig fit_with(double correlation) {
  FittedRig fit;
  fit.file = "fit.json";
  fit.runs = {"fitted.csv"};
  const std::vector<std::tuple<std::string, double, double>> parameters{
      {"normal.stiffness_scale", 0.8, 0.004}, {"apparent_mass_coefficient", 1.1, 0.02}, {"torsion.stiffness_scale", 0.7, 0.05}, {"normal.damping_ratio", 0.01, 0.001}, {"torsion.damping_ratio", 0.03, std::nan("")}};
  for (const auto& [name, value, std_error] : parameters) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = name;
    fit.parameters.back().value = value;
    fit.parameters.back().std_error = std_error;
  }
  fit.correlation = MatrixXd::Identity(5, 5);
  fit.correlation(0, 1) = fit.correlation(1, 0) = correlation;
  return fit;
}

/// The covariance that the fit states, over theta.
MatrixXd stated_covariance(const AeroelasticModel& model, const FittedRig& fit, const VectorXd& theta) {
  MatrixXd covariance = MatrixXd::Zero(theta.size(), theta.size());
  for (Index i = 0; i < 5; ++i)
    for (Index k = 0; k < 5; ++k) {
      const auto deviation = [&](Index j) {
        const double std_error = fit.parameters[static_cast<std::size_t>(j)].std_error;
        return std::isfinite(std_error) ? std_error : std::abs(fit.parameters[static_cast<std::size_t>(j)].value);
      };
      covariance(model.index(fit.parameters[static_cast<std::size_t>(i)].name), model.index(fit.parameters[static_cast<std::size_t>(k)].name)) = fit.correlation(i, k) * deviation(i) * deviation(k);
    }
  return covariance;
}

TEST(Prior, TheRigIsKnownWithTheCovarianceOfItsFit) {
  const AeroelasticModel model = free_model();
  for (const double correlation : {0.0, 0.95, -0.95}) {
    const FittedRig fit = fit_with(correlation);
    const VectorXd theta = theta_for(model, fit, "other.csv");
    const MatrixXd covariance = stated_covariance(model, fit, theta);
    std::vector<Index> rig;
    for (const FittedParameter& p : fit.parameters) rig.push_back(model.index(p.name));

    // A run that took no part: the parameters are free, with the inverse of the covariance as information.
    const Prior other = prior_of(model, fit, theta, "other.csv");
    EXPECT_TRUE(other.held.empty());
    EXPECT_EQ(other.free.size(), model.parameters().size());
    const MatrixXd information = (other.known.transpose() * other.known)(rig, rig), expected = covariance(rig, rig).inverse();
    EXPECT_LT((information - expected).norm(), 1e-9 * expected.norm()) << correlation;
    EXPECT_LT((other.known * theta - other.known_value).norm(), 1e-9) << "around the fitted values";

    // One that took part: they are held, and as uncertain as that.
    const Prior own = prior_of(model, fit, theta, "fitted.csv");
    EXPECT_EQ(own.held.size(), 5u);
    EXPECT_EQ(own.known.rows(), 0);
    const MatrixXd held = own.held_root * own.held_root.transpose();
    EXPECT_LT((held - covariance(own.held, own.held)).norm(), 1e-12 * held.norm()) << correlation;
  }
}

/// Two parameters whose sum alone matters: held, they leave var1 + var2 + 2 cov of it, and nothing where they are each other's opposite.
TEST(Prior, CorrelationsOfTheRigReachTheBudget) {
  const AeroelasticModel model = free_model();
  const Index parameters = static_cast<Index>(model.parameters().size());
  const Index a = model.index("normal.stiffness_scale"), b = model.index("apparent_mass_coefficient");
  for (const double correlation : {0.0, 0.9, -0.9}) {
    const FittedRig fit = fit_with(correlation);
    const VectorXd theta = theta_for(model, fit, "fitted.csv");
    const auto rig_part = [&](const std::string& run) {
      const Prior prior = prior_of(model, fit, theta, run);
      // Readings that tell the run's own parameters and nothing of the rig.
      RunResidual::Evaluation e;
      e.jacobian = MatrixXd::Zero(parameters, parameters);
      for (Index j = 0; j < parameters; ++j)
        if (model.parameters()[static_cast<std::size_t>(j)].per_run) e.jacobian(j, j) = 100;
      e.linear = VectorXd::Zero(1);
      e.linear_slope = MatrixXd::Zero(1, parameters);
      e.linear_factor = MatrixXd::Ones(1, 1);
      const auto nothing = [](const MatrixXd& F, const MatrixXd&) -> UncertaintyBudget::Shares { return {MatrixXd::Zero(F.cols(), F.cols()), MatrixXd::Zero(F.cols(), F.cols())}; };
      const UncertaintyBudget budget(e, prior, nothing, [](const MatrixXd& F, const MatrixXd&) -> VectorXd { return VectorXd::Zero(F.rows()); }, 0, 1);
      MatrixXd by_theta = MatrixXd::Zero(1, parameters);
      by_theta(0, a) = by_theta(0, b) = 1;
      return budget.of(by_theta, MatrixXd::Zero(1, 1)).by_source(0, static_cast<Index>(Source::rig));
    };
    const double expected = std::sqrt(0.004 * 0.004 + 0.02 * 0.02 + 2 * correlation * 0.004 * 0.02);
    EXPECT_NEAR(rig_part("fitted.csv"), expected, 1e-9) << "held, " << correlation;
    EXPECT_NEAR(rig_part("other.csv"), expected, 1e-9) << "free, " << correlation;
  }
}

/// Mass and stiffness that are off by the same share leave a rig's frequency and what a steady load reads where they were. So an error of both in which they go together is hardly one of the load, and an
/// error in which they go against each other is one of their ratio by twice as much: variances (1 - rho) times that without correlation.
TEST(Prior, CorrelationsOfTheRigReachTheModalLoad) {
  Rig rig;
  rig.name = rig.file = "oscillator.toml";
  rig.modal = {{1, 8, 0.02, 500, "N"}};
  const AeroelasticModel model(rig, {}, {});
  FittedRig fit;
  for (const Parameter& p : model.parameters()) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = p.name;
    fit.parameters.back().value = p.start;
    const bool uncertain = p.name == "modal[1].mass" || p.name == "modal[1].stiffness";
    fit.parameters.back().std_error = uncertain ? 1e-3 * p.start : std::nan("");
  }
  unrig::Run run;
  run.file = "pushed.csv";
  run.kind = RunKind::moved;
  run.dt = 0.005;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  // A load that excites the rig's own frequency: its answer in closed form is not needed, only that the load is asked to explain this.
  VectorXd gauge(600);
  for (Index k = 0; k < gauge.size(); ++k) gauge[k] = 20 * std::sin(50 * run.time(k)) * std::exp(-std::pow((run.time(k) - 1.5) / 0.7, 2)) + 0.05 * normal(random);
  run.channels = {{"mount_acceleration", "m/s^2", "m/s^2", 1, 1e-6 * VectorXd::Unit(gauge.size(), gauge.size() / 2)}, {"gauge", "N", "N", 1, gauge}};
  const auto rig_variance = [&](double correlation) {
    fit.correlation = MatrixXd::Identity(4, 4);
    fit.correlation(0, 1) = fit.correlation(1, 0) = correlation;
    return modal_load({rig, fit, run}).by_source.col(static_cast<Index>(Source::rig)).squaredNorm();
  };
  const double alone = rig_variance(0);
  ASSERT_GT(alone, 0);
  for (const double correlation : {0.9, 0.5, -0.9}) EXPECT_NEAR(rig_variance(correlation) / alone, 1 - correlation, 0.05) << "to first order in errors of a thousandth, and damping goes with neither";
}

/// Some linear model in all parameters, with residuals that it does not explain.
RunResidual::Evaluation some_model(const AeroelasticModel& model, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const Index parameters = static_cast<Index>(model.parameters().size());
  RunResidual::Evaluation e;
  e.jacobian = MatrixXd::NullaryExpr(30, parameters, [&] { return 3 * normal(random); });
  e.residual = VectorXd::NullaryExpr(30, [&] { return normal(random); });
  return e;
}

double cost(const RunResidual::Evaluation& e, const Prior& prior, const VectorXd& theta, const VectorXd& move) {
  return (e.residual + e.jacobian * move).squaredNorm() + prior.off(theta + move).squaredNorm();
}

TEST(Prior, AStepEndsWhereAllThatIsKnownIsLeastMissed) {
  const AeroelasticModel model = free_model();
  const FittedRig fit = fit_with(0.5);
  const VectorXd theta = theta_for(model, fit, "other.csv").array() + 0.05;
  const RunResidual::Evaluation e = some_model(model, 1);
  const Prior prior = prior_of(model, fit, theta, "other.csv");
  const VectorXd move = gauss_newton_step(e, prior, theta);
  const double least = cost(e, prior, theta, move);
  for (Index j = 0; j < theta.size(); ++j)
    for (const double aside : {1e-3, -1e-3}) EXPECT_GT(cost(e, prior, theta, move + aside * VectorXd::Unit(theta.size(), j)), least) << j;
  // Of a run that took part in the fit the rig stays where it is.
  const VectorXd own = gauss_newton_step(e, prior_of(model, fit, theta, "fitted.csv"), theta);
  for (const FittedParameter& p : fit.parameters) EXPECT_EQ(own[model.index(p.name)], 0) << p.name;
}

/// The heavier the regularisation, the smaller the amplitudes in units of their shares; without end they are zero, without any they are those of the data.
TEST(Prior, AHeavierRegularisationMakesSmallerAmplitudes) {
  const AeroelasticModel model = free_model();
  const FittedRig fit = fit_with(0);
  const VectorXd theta = theta_for(model, fit, "fitted.csv");
  const RunResidual::Evaluation e = some_model(model, 2);
  Prior prior = prior_of(model, fit, theta, "fitted.csv");
  EXPECT_LT((prior.share - VectorXd{{0.4, 1, 1}}).norm(), 1e-15) << "a rate of 0.02 has 0.02 / 0.05";
  const auto size = [&](double amplitude) {
    prior.amplitude = amplitude;
    return (theta + gauss_newton_step(e, prior, theta))(prior.amplitudes).cwiseQuotient(prior.share).norm();
  };
  double before = size(1e-8);
  EXPECT_LT(before, 1e-6);
  for (const double amplitude : {0.01, 0.1, 0.5, 2.0, 1e6}) {
    EXPECT_GT(size(amplitude), before) << amplitude;
    before = size(amplitude);
  }
  const VectorXd free = (e.jacobian(Eigen::all, prior.free)).householderQr().solve(-e.residual);
  prior.amplitude = 1e6;
  EXPECT_LT((gauss_newton_step(e, prior, theta)(prior.free) - free).norm(), 1e-6 * free.norm());
}

/// The probability of the data with all unknowns integrated out, ln p = -(ln det S + r' S^-1 r) / 2, S the covariance of the readings: the amplitude that evidence() finds has the largest.
TEST(Prior, EvidenceIsTheProbabilityOfTheData) {
  const AeroelasticModel model = free_model();
  const FittedRig fit = fit_with(0.3);
  VectorXd theta = theta_for(model, fit, "other.csv");
  RunResidual::Evaluation e = some_model(model, 3);
  Prior prior = prior_of(model, fit, theta, "other.csv");
  const Index slope = model.index("normal_force_slope");
  VectorXd amplitudes = VectorXd::Zero(theta.size());
  amplitudes(prior.amplitudes) = VectorXd{{0.3, -0.8, 0.5}};
  e.residual -= e.jacobian * (amplitudes - theta);  // readings of a model with these amplitudes and no slope, and noise of one
  const auto logarithm = [&](double amplitude) {
    prior.amplitude = amplitude;
    VectorXd deviation = VectorXd::Zero(theta.size());
    deviation(prior.amplitudes) = amplitude * prior.share;
    deviation[slope] = 1e4;  // free without a prior
    const MatrixXd rig = stated_covariance(model, fit, theta);
    const MatrixXd S = MatrixXd::Identity(30, 30) + e.jacobian * (MatrixXd(deviation.cwiseAbs2().asDiagonal()) + rig) * e.jacobian.transpose();
    // The readings less what the prior expects of them: the rig's parameters at their values, everything else at zero.
    VectorXd expected = theta;
    expected[slope] = 0;
    expected(prior.amplitudes).setZero();
    const VectorXd off = e.residual + e.jacobian * (expected - theta);
    const Eigen::LLT<MatrixXd> llt(S);
    return -MatrixXd(llt.matrixL()).diagonal().array().log().sum() - 0.5 * off.dot(llt.solve(off));
  };
  const Evidence best = evidence(e, prior, theta);
  const double at_best = logarithm(best.amplitude);
  for (const double factor : {0.8, 0.9, 1.1, 1.25}) EXPECT_GT(at_best, logarithm(factor * best.amplitude)) << factor;
  EXPECT_GT(best.determined, 2.5) << "thirty readings with slopes of three tell three amplitudes";
  EXPECT_LE(best.determined, 3);
}

TEST(Prior, WhatIsImposedHolds) {
  const AeroelasticModel model = free_model();
  const FittedRig fit = fit_with(0);
  const VectorXd theta = theta_for(model, fit, "fitted.csv");
  const RunResidual::Evaluation e = some_model(model, 4);
  const VectorXd semichords{{0.1, 1, 10, 100}};
  Imposed imposed;
  imposed.at_step = 0.7;
  const Prior starts = impose(prior_of(model, fit, theta, "fitted.csv"), imposed, model, semichords);
  const VectorXd started = theta + gauss_newton_step(e, starts, theta);
  EXPECT_NEAR(1 - started(starts.amplitudes).sum(), 0.7, 1e-5);  // within a millionth, beside readings with slopes of three

  imposed = {};
  imposed.monotone = true;
  const Prior rises = impose(prior_of(model, fit, theta, "fitted.csv"), imposed, model, semichords);
  const VectorXd risen = theta + gauss_newton_step(e, rises, theta);
  const auto phi = [&](double s) { return 1 - risen(rises.amplitudes).dot((-rates * s).array().exp().matrix()); };
  EXPECT_TRUE(rises.allows(risen));
  for (Index i = 0; i + 1 < semichords.size(); ++i) EXPECT_GT(phi(semichords[i + 1]) - phi(semichords[i]), -1e-9);
  VectorXd falling = theta;
  falling(rises.amplitudes) << 0, 0, -0.1;
  EXPECT_FALSE(rises.allows(falling));
}

}  // namespace
}  // namespace unrig
