#include "fit/likelihood/run_residual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <tuple>
#include <utility>

#include "core/files/error.h"
#include "fit/likelihood/motion_prior.h"
#include "tests/fit/run_cases.h"
#include "tests/support/slope.h"

namespace unrig::run_cases {
namespace {

TEST(RunResidual, CompressionIsExact) {
  for (const Case& c : every_case()) {
    const RunResidual residual = c.residual();
    const Dense dense = brute_force(c, residual);
    const RunResidual::Evaluation e = residual.evaluate(c.theta, Partials::none);
    ASSERT_EQ(e.linear.size(), dense.solution.size()) << c.name;
    EXPECT_EQ(residual.linear_unknowns(), dense.solution.size()) << c.name;
    EXPECT_EQ(residual.observations(), (dense.columns.rowwise().norm().array() > 0).count()) << c.name;
    // Both carry the round-off of a least-squares problem whose condition is some thousands.
    EXPECT_NEAR(e.chi2 / dense.chi2, 1, 1e-9) << c.name;
    EXPECT_LT((dense.columns * (e.linear - dense.solution)).norm(), 1e-6 * std::sqrt(dense.chi2)) << c.name;
  }
}

TEST(RunResidual, PredictionIsWhatChiSquareCompares) {
  for (const Case& c : every_case()) {
    const RunResidual residual = c.residual();
    const RunResidual::Prediction p = residual.predict(c.theta);
    double chi2 = 0;
    for (std::size_t k = 0; k < p.channels.size(); ++k) {
      const VectorXd left = c.run.channel(p.channels[k]).value - p.output.col(static_cast<Index>(k));
      for (Index i = 0; i < left.size(); ++i)
        if (residual.channel_weight(k)[i] > 0) chi2 += std::pow(residual.channel_weight(k)[i] * left[i], 2);
    }
    if (p.angle_offset.size() > 0)
      for (Index i = 0; i < samples; ++i)
        if (residual.angle_weight()[i] > 0)
          chi2 += std::pow(residual.angle_weight()[i] * (c.run.channel("alpha").value[i] - p.angle_offset[0] - p.motion.angle[i]), 2);
    EXPECT_NEAR(chi2 / residual.evaluate(c.theta, Partials::none).chi2, 1, 1e-8) << c.name;
  }
}

TEST(RunResidual, LeavesOutWhatIsMissingWeightlessOrASpike) {
  const Case c = damaged(step(1));
  const RunResidual residual = c.residual();
  EXPECT_EQ(residual.channel_weight(0)[52], 0) << "a missing reading";
  EXPECT_EQ(residual.channel_weight(0)[25], 0) << "a weight of zero";
  EXPECT_NEAR(residual.channel_weight(0)[95] * residual.sigma(0), 0.5, 1e-12) << "a weight of 1/4 is twice the noise";
  EXPECT_EQ(residual.angle_weight()[55], 0);
  EXPECT_EQ(residual.angle_weight()[110], 0) << "60 sigma, alone";
  EXPECT_EQ(residual.spikes(), 1);
  EXPECT_EQ(residual.observations(), 2 * (samples - 9) - 3 - 2 - 1);
  EXPECT_EQ(residual.degrees_of_freedom(), residual.observations() - residual.linear_unknowns());
}

TEST(RunResidual, ChiSquareIsTheNumberOfReadingsAtTheTruth) {
  for (const Case& c : every_case()) {
    RunResidual residual = c.residual();
    const VectorXd truth = c.model->start_values();
    residual.settle_noise(truth);
    const double freedom = static_cast<double>(residual.degrees_of_freedom());
    // The noise level is itself estimated from some 250 samples: 9 % in chi-square (motion_test), and chi-square scatters by sqrt(2 / freedom).
    const double scatter = 3 * std::sqrt(0.09 * 0.09 + 2 / freedom);
    if (c.name.find("damaged") == std::string::npos)
      EXPECT_NEAR(residual.evaluate(truth, Partials::none).chi2 / freedom, 1, scatter) << c.name;
    else  // the weights of 1/4 claim half of the noise that is there less than they should
      EXPECT_LT(residual.evaluate(truth, Partials::none).chi2 / freedom, 1 + scatter) << c.name;
  }
}

TEST(RunResidual, HorizonCountsFromTheOnset) {
  const Case decay = pluck({"gauge"}), turned = step(1);
  EXPECT_EQ(decay.residual({50}).observations(), 50);
  EXPECT_EQ(turned.residual({50}).observations(), 2 * (40 + 50)) << "gauge and angle, from the first knot on";
  EXPECT_LT(turned.residual({50}).evaluate(turned.theta, Partials::none).chi2, turned.residual().evaluate(turned.theta, Partials::none).chi2);
}

/// Piece by piece, with a prior on the motion and without, or all unknowns at once, as where a row of it that says nothing holds the first and the last knot together; a record that breaks off in the motion leaves the knots behind it open.
TEST(RunResidual, PiecesOfAMotionMakeTheWhole) {
  for (const Case& c : {restless(1), restless(3), damaged(restless(2)), step(1)})
    for (const auto& [horizon, with_prior] : {std::pair<Index, bool>{0, false}, {70, false}, {130, false}, {0, true}, {130, true}}) {
      RunResidual pieces = c.residual({horizon});
      const MatrixXd prior = with_prior ? motion_prior(c.residual(), c.theta) : MatrixXd(0, pieces.linear_unknowns());
      MatrixXd far = MatrixXd::Zero(prior.rows() + 1, prior.cols());
      far.topRows(prior.rows()) = prior;
      far(prior.rows(), 0) = far(prior.rows(), pieces.motion().unknowns() - 1) = 1e-12;
      RunResidual whole = pieces;
      pieces.set_motion_prior(prior);
      whole.set_motion_prior(far);
      const RunResidual::Evaluation a = pieces.evaluate(c.theta, Partials::all), b = whole.evaluate(c.theta, Partials::all);
      const MatrixXd factor = pieces.linear_factor(pieces.solve(c.theta)), its = whole.linear_factor(whole.solve(c.theta));
      EXPECT_NEAR(a.chi2 / b.chi2, 1, 1e-9) << c.name << ", " << horizon;
      EXPECT_LT((factor * (a.linear - b.linear)).norm(), 1e-6 * std::sqrt(b.chi2)) << c.name << ", " << horizon;
      EXPECT_TRUE((a.jacobian.transpose() * a.jacobian).isApprox(b.jacobian.transpose() * b.jacobian, 1e-7)) << c.name << ", " << horizon;
      EXPECT_TRUE((factor.transpose() * factor).isApprox(its.transpose() * its, 1e-9)) << c.name << ", " << horizon;
      EXPECT_TRUE(factor.isUpperTriangular(1e-300));
      if (horizon == 0) {  // no knot is left undetermined
        const RunResidual::Levels levels = pieces.levels(pieces.solve(c.theta)), its_levels = whole.levels(whole.solve(c.theta));
        EXPECT_TRUE((levels.factor.transpose() * levels.factor).isApprox(its_levels.factor.transpose() * its_levels.factor, 1e-7)) << c.name;
      }
      for (std::size_t k = 0; k < 2; ++k) {
        const RunResidual::Sensitivity::PerChannel s = pieces.sensitivity(c.theta).channels[k], t = whole.sensitivity(c.theta).channels[k];
        EXPECT_TRUE(s.slope.isApprox(t.slope, 1e-6)) << c.name << ", " << horizon;
        EXPECT_TRUE(s.into_offset.isApprox(t.into_offset, 1e-6)) << c.name << ", " << horizon;
      }
    }
}

TEST(RunResidual, WindowsThatTouchAreOneMotion) {
  Case c = step(2);
  c.windows = {{{40, 64}, 2}, {{69, 90}, 2}, {{140, 158}, 2}};  // the first window's last splines act until sample 72
  const RunResidual residual = c.residual();
  const Dense dense = brute_force(c, residual);
  EXPECT_NEAR(residual.evaluate(c.theta, Partials::none).chi2 / dense.chi2, 1, 1e-9);
}

// ---------------------------------------------------------------------------------------------------------------- derivatives

TEST(RunResidual, GradientIsThatOfChiSquare) {
  for (const Case& c : every_case()) {
    for (const RunOptions& options : {RunOptions{}, RunOptions{70}}) {
      const RunResidual residual = c.residual(options);
      const RunResidual::Evaluation e = residual.evaluate(c.theta, Partials::all);
      EXPECT_NEAR(e.residual.squaredNorm() / e.chi2, 1, 1e-8) << c.name;
      for (Index j = 0; j < c.theta.size(); ++j) {
        const std::string& name = c.model->parameters()[static_cast<std::size_t>(j)].name;
        const MatrixXd gradient = MatrixXd::Constant(1, 1, 2 * e.jacobian.col(j).dot(e.residual));
        const auto chi2 = [&](double h) {
          return MatrixXd::Constant(1, 1, residual.evaluate(c.theta + h * VectorXd::Unit(c.theta.size(), j), Partials::none).chi2).eval();
        };
        const double sensitivity = e.jacobian.col(j).norm();
        if (!(sensitivity > 0)) {
          EXPECT_EQ(chi2(0.1 * std::abs(c.theta[j]))(0, 0), chi2(0)(0, 0)) << c.name << ", " << name << " does not act";
          continue;
        }
        // A step that changes the residual by 2 %, or the parameter by 10 %.
        const double h = std::min(0.1 * std::abs(c.theta[j]), 0.02 * std::sqrt(e.chi2) / sensitivity);
        EXPECT_TRUE(test::is_slope(chi2, gradient, h, 3e-12)) << c.name << ", horizon " << options.horizon << ", " << name;
      }
    }
  }
}

TEST(RunResidual, LinearUnknownsFollowTheta) {
  for (const Case& c : {step(1), pluck({"gauge"})}) {
    const RunResidual residual = c.residual();
    // Kaufman's slope of c leaves out a term in the residual: it is exact where the model explains the run.
    const VectorXd theta = c.model->start_values();
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    const MatrixXd factor = residual.linear_factor(residual.solve(theta));
    for (Index j = 0; j < 4; ++j) {
      const double h = 1e-4 * std::abs(theta[j]);
      const auto linear = [&](double step_size) { return residual.evaluate(theta + step_size * VectorXd::Unit(theta.size(), j), Partials::none).linear; };
      const VectorXd slope = (linear(h) - linear(-h)) / (2 * h);
      // In units of the linear unknowns' own errors: R (dc/dtheta).
      EXPECT_LT((factor.triangularView<Eigen::Upper>() * (slope - e.linear_slope.col(j))).norm(), 0.05 * (factor.triangularView<Eigen::Upper>() * slope).norm()) << c.name << ", " << c.model->parameters()[static_cast<std::size_t>(j)].name;
    }
  }
}

TEST(RunResidual, DifferentiatesOnlyWhatIsAsked) {
  const Case c = step(1);
  RunResidual residual = c.residual();
  const MatrixXd all = residual.evaluate(c.theta, Partials::all).jacobian;
  residual.differentiate_only({0, 4});
  const RunResidual::Evaluation few = residual.evaluate(c.theta, Partials::all);
  EXPECT_EQ(few.jacobian.col(1).norm(), 0);
  // Rotations of the residual's rows may differ; lengths and angles may not.
  for (const Index a : {0, 4})
    for (const Index b : {0, 4}) EXPECT_NEAR(few.jacobian.col(a).dot(few.jacobian.col(b)) / (all.col(a).norm() * all.col(b).norm()), all.col(a).dot(all.col(b)) / (all.col(a).norm() * all.col(b).norm()), 1e-8);
}

TEST(RunResidual, AModelThatRunsAwayIsInfiniteAndSaysNothing) {
  const Rig rig = read_rig(test::null_campaign("rig.toml"));
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones)).with_effects({"cubic-stiffness"});
  VectorXd theta = model.start_values();
  theta[model.index("cubic-stiffness.coefficient")] = std::nan("");
  for (const char* file : {"wet_pluck.csv", "step_a.csv"}) {
    const unrig::Run run = read_run(test::null_campaign(file));
    const RunResidual residual(model, run, {});
    EXPECT_TRUE(std::isinf(residual.solve(theta).chi2)) << file;
    const RunResidual::Evaluation e = residual.evaluate(theta, Partials::all);
    EXPECT_TRUE(std::isinf(e.chi2) && !e.residual.allFinite() && e.jacobian.isZero()) << file;
    const RunResidual::Prediction p = residual.predict(theta);
    EXPECT_TRUE(p.output.array().isNaN().all()) << file;
    EXPECT_EQ(p.motion.angle.size(), residual.motion().unknowns() > 0 ? run.samples() : 0) << file;
    EXPECT_EQ(residual.largest_arguments(theta).size(), 1) << "it is no linear model: " << file;
  }
}

TEST(RunResidual, PriorRowsCountInChiSquare) {
  const Case c = step(1);
  RunResidual residual = c.residual();
  const double before = residual.evaluate(c.theta, Partials::none).chi2;
  const VectorXd linear = residual.evaluate(c.theta, Partials::none).linear;
  MatrixXd row = MatrixXd::Zero(1, residual.linear_unknowns());
  row(0, 3) = 1e9 / linear[3];  // "unknown 3 is zero", firmly
  residual.set_motion_prior(row);
  const RunResidual::Evaluation held = residual.evaluate(c.theta, Partials::none);
  EXPECT_GT(held.chi2, before);
  EXPECT_LT(std::abs(held.linear[3]), 1e-4 * std::abs(linear[3]));
  residual.set_motion_prior({});
  EXPECT_NEAR(residual.evaluate(c.theta, Partials::none).chi2 / before, 1, 1e-12);
}

// ---------------------------------------------------------------------------------------------------------------- noise, spikes, windows

TEST(RunResidual, SettlesOnTheNoiseUnderAFastSignal) {
  // 31 Hz at 250 Hz: differences of the raw channel keep a part of it.
  const Case c = forced();
  RunResidual residual = c.residual();
  const double raw = residual.sigma(0);
  residual.settle_noise(c.model->start_values());
  const VectorXd& y = c.run.channel("gauge").value;
  const double planted = 1e-3 * (y.array() - 0.3).matrix().norm() / std::sqrt(static_cast<double>(samples));
  EXPECT_LE(residual.sigma(0), raw);
  EXPECT_NEAR(residual.sigma(0) / planted, 1, 0.2);  // first differences of 260 samples: 4 standard deviations of 5 %
}

TEST(RunResidual, SettlesOnTheNoiseOfRestsNotOnWhatTheKnotsLeaveOfAMotion) {
  // As many knots as samples in a window of 150 of 260: of the noise of gauge and angle together they take half.
  const Case c = step(1);
  const Windows wide{{{40, 190}, 1}};
  constexpr int draws = 20;
  constexpr double angle_noise = 2e-3;  // clearly more than the case has
  const double gauge_noise = 2e-2 * c.run.channel("gauge").value.norm() / std::sqrt(static_cast<double>(samples));
  double angle = 0, gauge = 0;
  for (unsigned seed = 0; seed < draws; ++seed) {
    unrig::Run run = c.run;
    for (Channel& channel : run.channels) channel.value += white_noise(samples, channel.name == "alpha" ? angle_noise : gauge_noise, 100 + 2 * seed + (channel.name == "alpha" ? 1 : 0));
    RunResidual residual(*c.model, run, wide);
    residual.settle_noise(c.model->start_values());
    angle += residual.angle_sigma() / angle_noise / draws;
    gauge += residual.sigma(0) / gauge_noise / draws;
  }
  // First differences of 100 samples scatter by 9 %, those of the raw channel too; of two such numbers the lesser lies 5 % low. The mean of 20 scatters by 2 %.
  EXPECT_NEAR(angle, 0.95, 0.06);
  EXPECT_NEAR(gauge, 0.95, 0.06);
}

TEST(RunResidual, ACoarseConverterIsNeverTrustedBeyondItsQuantum) {
  Case c = pluck({"gauge"});
  const double quantum = 0.5;
  for (Channel& channel : c.run.channels)
    if (channel.name == "gauge") channel.value = (channel.value / (4 * channel.value.cwiseAbs().maxCoeff()) * 8 / quantum).array().round() * quantum;
  RunResidual residual = c.residual();
  residual.settle_noise(c.model->start_values());
  EXPECT_GE(residual.sigma(0), rounding_level(c.run.channel("gauge").value));
}

TEST(RunResidual, RejectsASpikeInsideTheMotion) {
  Case c = step(1);
  for (Channel& channel : c.run.channels)
    if (channel.name == "alpha") channel.value[53] += 0.02;
  RunResidual residual = c.residual();
  const VectorXd theta = c.model->start_values();
  Index rejected = 0;
  while (const Index more = residual.reject_spikes(theta)) rejected += more;
  EXPECT_EQ(residual.angle_weight()[53], 0) << "at once where its neighbours show it, at the latest when the model is known";
  EXPECT_LE(rejected, 3) << "the spline follows the spike a little, so that a neighbour on either side may go with it";
  EXPECT_NEAR(residual.evaluate(theta, Partials::none).chi2 / static_cast<double>(residual.degrees_of_freedom()), 1, 0.33);
}

TEST(RunResidual, KeepsItsNoiseWithOtherWindows) {
  const Case c = step(1);
  RunResidual residual = c.residual();
  residual.settle_noise(c.model->start_values());
  const RunResidual wider = residual.with_motion({{{36, 70}, 1}, {{136, 162}, 1}});
  EXPECT_EQ(wider.sigma(0), residual.sigma(0));
  EXPECT_EQ(wider.angle_weight(), residual.angle_weight());
  EXPECT_GT(wider.linear_unknowns(), residual.linear_unknowns());
  EXPECT_LE(wider.evaluate(c.theta, Partials::none).chi2, residual.evaluate(c.theta, Partials::none).chi2 * (1 + 1e-9)) << "a richer motion fits no worse";
}

TEST(MotionWindows, CoverTheStepsOfARun) {
  const unrig::Run run = read_run(test::null_campaign("step_a.csv"));
  const Windows windows = motion_windows(run);
  ASSERT_EQ(windows.size(), 1u);
  EXPECT_LT(windows[0].knots.first, 500) << "the ramp begins at 1 s";
  EXPECT_GT(windows[0].knots.first, 470);
  EXPECT_GT(windows[0].knots.last, 560) << "and rings for a while";
  EXPECT_EQ(windows[0].stride, 1);
  EXPECT_TRUE(motion_windows(read_run(test::null_campaign("wet_pluck.csv"))).empty());
}

TEST(MotionWindows, CoverASoftStartAndAShaftThatNeverStops) {
  // Like t^3 from sample 500 on, then a sine to the end of the record: six samples show that it moves from about 530 on only.
  unrig::Run run = read_run(test::null_campaign("step_a.csv"));
  Channel& alpha = *std::find_if(run.channels.begin(), run.channels.end(), [](const Channel& c) { return c.name == "alpha"; });
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1.8e-4);
  for (Index k = 0; k < run.samples(); ++k) {
    const double t = run.dt * static_cast<double>(k - 500);
    alpha.value[k] = (t > 0 ? 0.03 * std::min(1.0, std::pow(t / 0.3, 3)) * std::sin(4 * t) : 0) + noise(random);
  }
  const Windows windows = motion_windows(run);
  ASSERT_EQ(windows.size(), 1u);
  EXPECT_LE(windows[0].knots.first, 520) << "the angle is within its noise up to here";
  EXPECT_GT(windows[0].knots.first, 350);
  EXPECT_GE(windows[0].knots.last, run.samples() - 2) << "free to the end";
}

/// Twelve frequencies up to 20 Hz for six seconds, and up to 4 Hz: as many knots as the angle asks for.
TEST(MotionWindows, OfAFitAreAsCloseAsTheAngleAsksFor) {
  for (const auto& [fastest, least, most] : {std::tuple<double, Index, Index>{20, 1, 5}, {4, 8, 8}}) {
    unrig::Run run = empty_run(RunKind::step, 0.6, 0.002);
    VectorXd angle = white_noise(3000, 1.7e-4, 3);
    for (Index k = 0; k < angle.size(); ++k) {
      const double t = run.dt * static_cast<double>(k), begins = std::clamp((t - 0.1) / 0.3, 0.0, 1.0);
      for (int i = 1; i <= 12; ++i) angle[k] += 0.02 * begins * begins * (3 - 2 * begins) / i * std::sin(2 * pi * fastest * i / 12 * t + 2.4 * i * i);
    }
    add_channel(run, "alpha", angle, "rad");
    const Windows windows = windows_to_fit(run);
    ASSERT_EQ(windows.size(), 1u) << fastest;
    EXPECT_EQ(motion_windows(run)[0].stride, 8) << "400 knots at most";
    EXPECT_GE(windows[0].stride, least) << fastest;
    EXPECT_LE(windows[0].stride, most) << fastest;
    EXPECT_LT(off_its_knots(run, windows, windows[0].stride), 1.1) << fastest;
    // A spike is no motion.
    for (const Index at : {700, 1500, 2200}) run.channels.back().value[at] += 0.1;
    EXPECT_EQ(windows_to_fit(run)[0].stride, windows[0].stride) << fastest;
  }
}

/// Electrical spikes before the shaft moves, while it does and after: each moves the mean of twenty samples by ten times what noise does, and a motion that seems long has sparse knots.
TEST(MotionWindows, AreNoWiderForSpikesBesideTheMotion) {
  unrig::Run run = read_run(test::null_campaign("step_a.csv"));
  const Windows windows = motion_windows(run);
  Channel& alpha = *std::find_if(run.channels.begin(), run.channels.end(), [](const Channel& c) { return c.name == "alpha"; });
  for (const auto& [sample, degrees] : {std::pair<Index, double>{469, 0.5}, {488, -0.4}, {532, -0.3}, {560, 0.3}}) alpha.value[sample] += degrees * std::numbers::pi / 180;
  const Windows spiked = motion_windows(run);
  ASSERT_EQ(spiked.size(), windows.size());
  for (std::size_t w = 0; w < windows.size(); ++w) {
    EXPECT_EQ(spiked[w].stride, windows[w].stride);
    EXPECT_NEAR(static_cast<double>(spiked[w].knots.first), static_cast<double>(windows[w].knots.first), 8);
    EXPECT_NEAR(static_cast<double>(spiked[w].knots.last), static_cast<double>(windows[w].knots.last), 8);
  }
}

/// "A window of the motion needs knots inside the record": the knots of a long record lie further apart than its shortest motions last.
TEST(MotionWindows, OfAShaftThatWandersHaveAKnotEach) {
  unrig::Run run;
  run.kind = RunKind::step;
  run.dt = 0.002;
  run.channels.push_back({"alpha", "rad", "rad", 1, VectorXd(100'000)});
  std::mt19937_64 random(1);
  std::normal_distribution<double> step(0, 1.7e-4);
  double angle = 0;
  for (double& alpha : run.channels[0].value) alpha = angle += step(random);
  const Windows windows = motion_windows(run);
  ASSERT_FALSE(windows.empty());
  for (std::size_t w = 0; w < windows.size(); ++w) {
    EXPECT_GE(windows[w].knots.length(), windows[w].stride);
    EXPECT_EQ(windows[w].stride, windows[0].stride);
    if (w > 0) {
      EXPECT_GT(windows[w].knots.first, windows[w - 1].knots.last);
    }
  }
  EXPECT_NO_THROW(MotionBasis(run.samples(), windows));
}

/// They never change, and the fit after ten seconds of search ended in "a transform needs finite samples".
TEST(RunResidual, RefusesWhatDrivesItsRunAndNeverChanges) {
  Case c = pluck({"gauge"});
  c.run.kind = RunKind::step;
  c.run.channels.push_back({"alpha", "rad", "rad", 1, VectorXd::Constant(c.run.samples(), 0.03)});
  EXPECT_THROW(RunResidual(*c.model, c.run, motion_windows(c.run)), InputError);
}

TEST(RunResidual, RefusesARunThatDoesNotBelong) {
  Case c = pluck({"gauge"});
  for (Channel& channel : c.run.channels)
    if (channel.name == "gauge") channel.name = "strain";
  EXPECT_THROW(c.residual(), InputError);
}

}  // namespace
}  // namespace unrig::run_cases
