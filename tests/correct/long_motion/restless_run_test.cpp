// A shaft that never rests for ten thousand samples: the correction whose cost goes with the record.

#include "correct/long_motion/restless_run.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/files/error.h"
#include "tests/correct/recorded_run.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;
using ::testing::HasSubstr;
using ::testing::ElementsAre;
using test::channel_of;
using test::free_circulation;
using test::record;
using test::Recorded;
using test::rms;
using test::soft;

constexpr double slope = test::recorded_slope;

double sine(double t) { return 2 * soft((t - 0.2) / 0.3) * std::sin(2 * pi * 1.5 * (t - 0.2)); }
double many_frequencies(double t) {
  double sum = 0;
  for (int i = 1; i <= 12; ++i) sum += std::sin(2 * pi * 0.41 * i * (1 + 1e-3 * std::sqrt(i)) * (t - 0.2) + 2.39996 * i * i) / i;
  return 1.5 * soft((t - 0.2) / 0.3) * sum;
}

/// From 0.2 to 5 Hz in three minutes: its end is far rougher than its beginning.
double chirp(double t) {
  constexpr double first = 0.2, last = 5, duration = 180;
  const double growth = std::log(last / first);
  return 2 * soft((t - 0.2) / 0.3) * std::sin(2 * pi * first * duration / growth * std::expm1((t - 0.2) / duration * growth));
}

/// Derivative of a function of theta with respect to theta_j, by the central difference over steps of 1e-4 of it.
template <class F>
double difference(const F& f, const VectorXd& theta, Index j) {
  const double h = 1e-4 * std::abs(theta[j]);
  VectorXd up = theta, down = theta;
  up[j] += h, down[j] -= h;
  return (f(up) - f(down)) / (2 * h);
}

TEST(RestlessRun, SlopesOfChiSquareAreItsDifferences) {
  const Recorded r = record(&many_frequencies, 1200);
  const AeroelasticModel model = free_circulation();
  RestlessRun run(model, r.run);
  const VectorXd theta = theta_for(model, test::null_fit(), "");
  run.settle_roughness(theta, RestlessRun::Look::everywhere);
  std::vector<Index> all;
  for (Index j = 0; j < theta.size(); ++j) all.push_back(j);
  const RunResidual::Evaluation e = run.differentiate(run.solve(theta), all);
  EXPECT_NEAR(e.residual.squaredNorm(), e.chi2, 1e-8 * e.chi2);
  const VectorXd gradient = 2 * e.jacobian.transpose() * e.residual;
  for (const std::string name : {"normal_force_slope", "normal.stiffness_scale", "apparent_mass_coefficient", "circulation.amplitude[3]"}) {
    const Index j = model.index(name);
    const double expected = difference([&](const VectorXd& at) { return run.solve(at).chi2; }, theta, j);
    // Beside truncation, h^2: the uncertainty of the first state depends on theta, which the slope leaves out; 4e-3 measured in so short a record.
    EXPECT_NEAR(gradient[j], expected, 0.01 * std::abs(expected)) << name << " off by " << gradient[j] / expected - 1;
  }
}

/// The readings that the motion takes: n tr R^-1 cov(C x) in the filter's own terms, and by differences where theta moves.
TEST(RestlessRun, FreedomOfTheMotionIsThatOfTheSmoother) {
  const Recorded r = record(&many_frequencies, 1200);
  const AeroelasticModel model = free_circulation();
  RestlessRun run(model, r.run);
  const VectorXd theta = theta_for(model, test::null_fit(), "");
  run.settle_roughness(theta, RestlessRun::Look::everywhere);
  const RestlessRun::Point point = run.at(theta);
  double freedom = 0;
  for (Index c = 0; c <= run.outputs(); ++c) freedom += 1200 * point.smoother->variance(point.smoother->filter().C.row(c))[600] / std::pow(run.sigma()[c], 2);
  EXPECT_NEAR(point.freedom, freedom, 1e-3 * freedom);  // at its middle the record still knows of its ends: 4e-5 measured

  const std::vector<Index> moved = {model.index("normal_force_slope"), model.index("normal.stiffness_scale"), model.index("apparent_mass_coefficient"), model.index("circulation.amplitude[3]")};
  VectorXd slopes(4);
  run.slopes(point, run.motion(point), moved, {}, [&](Index place, const RestlessRun::Slope& s) { slopes[place] = s.freedom; });
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const double expected = difference([&](const VectorXd& at) { return run.at(at).freedom; }, theta, moved[i]);
    EXPECT_NEAR(slopes[static_cast<Index>(i)], expected, 1e-4 * std::abs(expected));  // the step's square is 1e-8
  }
}

/// With all channels missing for long chi-square falls by steps: once the missing samples have settled, they stay where they are.
TEST(RestlessRun, MissingSamplesSettle) {
  Recorded r = record(&many_frequencies, 3000);
  const AeroelasticModel model = free_circulation();
  const VectorXd theta = theta_for(model, test::null_fit(), "");
  for (const char* channel : {"alpha", "gauge"}) channel_of(r.run, channel).segment(1000, 300).setConstant(std::nan(""));
  RestlessRun run(model, r.run);
  run.settle_roughness(theta, RestlessRun::Look::everywhere);
  const double on_a_straight_line = run.solve(theta).chi2, fall = run.settle_missing(theta);
  EXPECT_GT(fall, 100);
  EXPECT_NEAR(run.solve(theta).chi2, on_a_straight_line - fall, 1e-6 * on_a_straight_line) << "as conjugate gradients say";
  EXPECT_LT(run.settle_missing(theta), 1e-3) << "what counts as little";
}

/// What a piece begins with is handed on to it, slow lags and all: the same numbers as from the record in one piece.
TEST(RestlessRun, PiecesMakeTheWholeRecord) {
  const Recorded r = record(&many_frequencies, 70000);
  const AeroelasticModel model = free_circulation();
  VectorXd theta = theta_for(model, test::null_fit(), "");
  std::vector<Index> all;
  for (Index j = 0; j < theta.size(); ++j) all.push_back(j);
  RestlessRun pieces(model, r.run), whole(model, r.run, r.run.samples());
  pieces.settle_roughness(theta, RestlessRun::Look::near);
  whole.take_roughness_of(pieces);
  const RunResidual::Solution at_pieces = pieces.solve(theta), at_whole = whole.solve(theta);
  ASSERT_GT(pieces.at(theta).smoother->convolution().far(), 0);
  ASSERT_EQ(whole.at(theta).smoother->convolution().far(), 0);
  EXPECT_NEAR(at_pieces.chi2, at_whole.chi2, 1e-8 * at_whole.chi2);
  const RestlessRun::Point& one = whole.at(theta);
  EXPECT_LT((pieces.at(theta).white - one.white).cwiseAbs().maxCoeff(), 1e-6) << "of the noise: the splines between nodes";
  const VectorXd uncertain = one.linear_factor.inverse().rowwise().norm();
  EXPECT_LT((at_pieces.linear - at_whole.linear).cwiseQuotient(uncertain).cwiseAbs().maxCoeff(), 1e-4);

  const RunResidual::Evaluation e = pieces.differentiate(at_pieces, all), expected = whole.differentiate(at_whole, all);
  ASSERT_LT(pieces.looked().at.size(), whole.looked().at.size() / 2);
  EXPECT_NEAR(pieces.looked().weight.sum(), static_cast<double>(r.run.samples()), 1e-6);
  const VectorXd size = expected.jacobian.colwise().norm();
  const VectorXd downhill = e.jacobian.transpose() * e.residual, expected_downhill = expected.jacobian.transpose() * expected.residual;
  EXPECT_LT((downhill - expected_downhill).cwiseQuotient(size).cwiseAbs().maxCoeff(), 1e-4 * std::sqrt(at_whole.chi2));
  // Information, from some samples for all: that of any direction, in which parameters may nearly cancel, to a part in a thousand.
  const Eigen::MatrixXd root = (expected.jacobian * size.cwiseInverse().asDiagonal()).topRows(theta.size()), found = (e.jacobian * size.cwiseInverse().asDiagonal()).topRows(theta.size());
  const Eigen::MatrixXd ratio = root.transpose().fullPivLu().solve(found.transpose());
  EXPECT_LT((ratio * ratio.transpose() - Eigen::MatrixXd::Identity(theta.size(), theta.size())).cwiseAbs().maxCoeff(), 1e-3);
}

// Where the section moves with negative damping no record like this one exists; the responses that slopes are made of would overflow over a long one.
TEST(RestlessRun, ARigThatWouldFlutterIsNoCandidate) {
  const Recorded r = record(many_frequencies, 2000);
  const AeroelasticModel model(test::null_rig(), make_basis(test::null_rig(), test::null_fit().normal_modes, test::null_fit().torsion_modes), wagner(Wagner::jones));
  const RestlessRun run(model, r.run);
  VectorXd theta = theta_for(model, test::null_fit(), "");
  EXPECT_TRUE(std::isfinite(run.solve(theta).chi2));
  theta[model.index("torsion.damping_ratio")] = -0.5;
  EXPECT_TRUE(std::isinf(run.solve(theta).chi2));
}

/// The settled filter is for linear rigs, and 2000 knots do not follow such a motion: it must say so, and what to do.
TEST(Restless, ANonlinearForceIsRefusedWithAdvice) {
  const Recorded r = record(&sine, 20000);
  try {
    correct({test::null_rig(), test::with_friction(), r.run, 0});
    FAIL() << "corrected";
  } catch (const NoAnswer& refusal) {
    EXPECT_THAT(refusal.what(), HasSubstr("nonlinear force"));
    EXPECT_THAT(refusal.what(), HasSubstr("in parts of at most 16000 samples"));
  }
}

/// Both loads of a shaft that never rests.
void expect_found_within_its_band(const CorrectResult& result, const Recorded& r) {
  for (const bool circulatory : {true, false}) {
    const CorrectedLoad& load = circulatory ? result.circulatory : result.normal_force;
    const VectorXd& truth = circulatory ? r.circulatory : r.normal_force;
    const VectorXd off = load.value - truth, in_deviations = off.cwiseAbs().cwiseQuotient(load.std);
    // 0.001 and 0.003 of the range measured; the rest is a margin for another draw of the noise.
    EXPECT_LT(rms(off), (circulatory ? 0.0015 : 0.005) * (truth.maxCoeff() - truth.minCoeff()));
    const Index tenth = off.size() / 10;
    for (Index i = 0; i < 10; ++i) EXPECT_GT((in_deviations.segment(i * tenth, tenth).array() < 1.96).cast<double>().mean(), 0.85) << i;
    EXPECT_LT(in_deviations.maxCoeff(), load.simultaneous + 1) << "the whole curve: 95 % of such records stay below the first";
    EXPECT_GT(in_deviations.mean(), 0.4) << "0.8 for errors as large as their band says: no band that is wide for nothing";
    EXPECT_LT((load.by_source.rowwise().norm() - load.std).cwiseAbs().maxCoeff(), 1e-12);
  }
}

TEST(Restless, LoadIsFoundInTimeThatGoesWithTheRecord) {
  for (double (*const motion)(double) : {&sine, &many_frequencies}) {
    constexpr Index samples = 10000;
    const Recorded r = record(motion, samples);
    const CorrectResult result = correct({test::null_rig(), test::null_fit(), r.run, 0});
    expect_found_within_its_band(result, r);
    EXPECT_NEAR(result.reduced_chi2, 1, 0.05);
    EXPECT_NEAR(result.slope, slope, 3 * result.slope_std);
    EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
  }
}

/// Dry friction in the rig, and a shaft that moves up to 5 Hz from its beginning to the end of the record: a knot on every sample. The last few samples are known from one side only.
TEST(Restless, ANonlinearForceIsFollowedByKnots) {
  const FittedRig fit = test::with_friction(0.5, 0.004);
  const Recorded r = record(&many_frequencies, 1000, 11, fit);
  const CorrectResult result = correct({test::null_rig(), fit, r.run, 0});
  for (const auto& [load, truth] : {std::pair{&result.circulatory, &r.circulatory}, std::pair{&result.normal_force, &r.normal_force}}) {
    constexpr Index first = 0, count = 995;
    const VectorXd in_deviations = (load->value - *truth).cwiseQuotient(load->std).segment(first, count).cwiseAbs();
    EXPECT_GT((in_deviations.array() < 1.96).cast<double>().mean(), 0.9);
    EXPECT_GT(in_deviations.mean(), 0.4) << "no band that is wide for nothing";
    EXPECT_LT(in_deviations.maxCoeff(), load->simultaneous + 1);
  }
  EXPECT_NEAR(result.reduced_chi2, 1, 0.15) << "1.10 measured: noise alone scatters by 0.04, and friction as sharp as that is followed in whole samples";
  EXPECT_NEAR(result.slope, slope, 3 * result.slope_std);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
}

TEST(Restless, ItsBandDoesNotAllowForWhatTheFitLeftAndSaysSo) {
  FittedRig fit = test::null_fit();
  fit.left = {{"dry_pluck.csv", "gauge", false, {0.3, VectorXd::Ones(8)}}};
  EXPECT_THAT(correct({test::null_rig(), fit, record(&sine, 10000).run, 0}).warnings, testing::Contains(testing::HasSubstr("does not allow for what it leaves of them")));
}

/// Long enough for a search that begins on a part of the record and for several pieces.
TEST(Restless, ALongRecordIsFoundPieceByPiece) {
  for (double (*const motion)(double) : {&many_frequencies, &chirp}) {
    constexpr Index samples = 90000;
    const Recorded r = record(motion, samples);
    const CorrectResult result = correct({test::null_rig(), test::null_fit(), r.run, 0});
    expect_found_within_its_band(result, r);
    // Of 180 000 readings, 0.0033: three times that. 1.02 where fast readings of the chirp were taken for spikes.
    EXPECT_NEAR(result.reduced_chi2, 1, 0.01);
    EXPECT_NEAR(result.slope, slope, 3 * result.slope_std);
    EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
  }
}

/// What chi-square gains from noise that the motion takes upon itself grows with the record, and what a sine of one frequency says of the response's limit does not: without the motion's freedom
/// the slope came out as 10.2 +- 1.1, the load 3.6 times its standard deviation off; of a million samples 11.3 +- 1.2 and 7.4 times.
TEST(Restless, ALongSineDoesNotBendTheSlope) {
  const Recorded r = record(&sine, 300000);
  const CorrectResult result = correct({test::null_rig(), test::null_fit(), r.run, 0});
  EXPECT_TRUE(result.warnings.empty());
  EXPECT_NEAR(result.slope, slope, 3 * result.slope_std);
  EXPECT_LT(result.slope_std, 1);
  EXPECT_LT((result.circulatory.value - r.circulatory).cwiseAbs().cwiseQuotient(result.circulatory.std).maxCoeff(), result.circulatory.simultaneous);
}

TEST(Restless, MissingSamplesCostLittleAndAGapIsNamed) {
  Recorded r = record(&many_frequencies, 6000);
  for (const Index k : {1000, 2500, 2501}) channel_of(r.run, "gauge")[k] = std::nan("");
  for (const Index k : {1500, 4000}) channel_of(r.run, "alpha")[k] = std::nan("");
  channel_of(r.run, "alpha")[3000] += 1;  // rad: an electrical spike
  const CorrectResult few = correct({test::null_rig(), test::null_fit(), r.run, 0});
  EXPECT_TRUE(few.warnings.empty());
  EXPECT_LT((few.circulatory.value - r.circulatory).cwiseAbs().cwiseQuotient(few.circulatory.std).maxCoeff(), few.circulatory.simultaneous + 1);
}

/// What is missing is what the rest makes likely: as long a gap as there may be bends neither slope nor load, and the band knows how little is known inside.
TEST(Restless, GapsWidenTheBandAndNothingElse) {
  Recorded r = record(&many_frequencies, 6000);
  const CorrectResult whole = correct({test::null_rig(), test::null_fit(), r.run, 0});
  channel_of(r.run, "gauge").segment(1000, 1000).setConstant(std::nan(""));
  channel_of(r.run, "alpha").segment(3000, 50).setConstant(std::nan(""));
  for (const char* channel : {"alpha", "gauge"}) channel_of(r.run, channel).segment(4000, 60).setConstant(std::nan(""));
  const CorrectResult result = correct({test::null_rig(), test::null_fit(), r.run, 0});
  EXPECT_THAT(result.warnings, ElementsAre(HasSubstr("1000 samples are missing from 2 s on")));
  EXPECT_NEAR(result.reduced_chi2, whole.reduced_chi2, 0.03);  // its own scatter is 0.013
  EXPECT_NEAR(result.slope, slope, 3 * result.slope_std);
  EXPECT_NEAR(result.slope_std, whole.slope_std, 0.1 * whole.slope_std);
  const VectorXd off = (result.circulatory.value - r.circulatory).cwiseQuotient(result.circulatory.std);
  EXPECT_LT(off.cwiseAbs().maxCoeff(), result.circulatory.simultaneous);
  EXPECT_LT(rms(off), 1.15);  // 0.92 measured
  const VectorXd wider = result.circulatory.std.cwiseQuotient(whole.circulatory.std);
  EXPECT_NEAR(wider[2600], 1, 0.03) << "far from gaps";
  EXPECT_GT(wider[1500], 1.3) << "the angle alone says less";  // 1.70 measured
  EXPECT_GT(wider[4030], 1.3) << "nothing is read there";  // 1.54 measured
  // Over a quarter of the slowest period: what the shaft does there remains a guess, but the rest of the record does not suffer.
  for (const char* channel : {"alpha", "gauge"}) channel_of(r.run, channel).segment(4000, 300).setConstant(std::nan(""));
  const CorrectResult longer = correct({test::null_rig(), test::null_fit(), r.run, 0});
  EXPECT_NEAR(longer.slope, slope, 3 * longer.slope_std);
  const VectorXd still_off = (longer.circulatory.value - r.circulatory).cwiseQuotient(longer.circulatory.std);
  EXPECT_LT(std::max(still_off.head(3950).cwiseAbs().maxCoeff(), still_off.tail(1650).cwiseAbs().maxCoeff()), longer.circulatory.simultaneous);
  EXPECT_GT(longer.circulatory.std[4150], 20 * whole.circulatory.std[4150]);  // 25.4 measured
}

TEST(Restless, SourcesAddUpAndACalibrationErrorScalesTheLoad) {
  const Recorded r = record(&sine, 6000);
  CorrectProblem problem{test::null_rig(), test::null_fit(), r.run, 0.01};
  const CorrectResult result = correct(problem);
  for (const CorrectedLoad* load : {&result.circulatory, &result.normal_force}) EXPECT_LT((load->by_source.rowwise().norm() - load->std).cwiseAbs().maxCoeff(), 1e-12);
  channel_of(problem.run, "gauge") *= 1.01;
  const CorrectResult high = correct(problem);
  const VectorXd moved = high.circulatory.value - result.circulatory.value, predicted = result.circulatory.by_source.col(static_cast<Index>(Source::calibration));
  // To first order in the error, and as far as the regularisation is not chosen anew: 3 % measured.
  EXPECT_LT(rms(moved.cwiseAbs() - predicted), 0.06 * rms(predicted));
}

TEST(Restless, AnErrorOfTheRigMovesTheLoadAsItsColumnSays) {
  // A run that took part in the fit, of which one parameter is uncertain: the answer at that parameter one standard deviation off.
  Recorded r = record(&many_frequencies, 6000);
  FittedRig fit = test::null_fit();
  r.run.file = fit.runs.front();
  const auto parameter = [&](const std::string& name) -> FittedParameter& { return *std::find_if(fit.parameters.begin(), fit.parameters.end(), [&](const FittedParameter& p) { return p.name == name; }); };
  for (FittedParameter& p : fit.parameters) p.std_error = 1e-9 * std::abs(p.value);
  for (const std::string name : {"normal.stiffness_scale", "apparent_mass_coefficient"}) {
    FittedParameter& p = parameter(name);
    p.std_error = 1e-3 * p.value;
    const CorrectResult result = correct({test::null_rig(), fit, r.run, 0});
    ASSERT_TRUE(result.in_fit);
    const double value = p.value;
    p.value += p.std_error;
    const CorrectResult off = correct({test::null_rig(), fit, r.run, 0});
    p.value = value;
    p.std_error = 1e-9 * value;
    for (const bool circulatory : {true, false}) {
      const CorrectedLoad &load = circulatory ? result.circulatory : result.normal_force, &other = circulatory ? off.circulatory : off.normal_force;
      const VectorXd predicted = load.by_source.col(static_cast<Index>(Source::rig)), moved = (other.value - load.value).cwiseAbs();
      // To first order, and as far as noise levels, roughness and regularisation are not chosen anew: 9 % measured.
      EXPECT_LT(rms(moved - predicted), 0.2 * rms(predicted)) << name << (circulatory ? ", circulatory" : "");
      EXPECT_GT(rms(predicted), 1e-3) << "newton: it does matter";
    }
  }
}

TEST(Restless, WhatIsImposedHolds) {
  const Recorded r = record(&many_frequencies, 6000);
  CorrectProblem problem{test::null_rig(), test::null_fit(), r.run, 0};
  problem.imposed = {true, 0.5};
  const CorrectResult result = correct(problem);
  EXPECT_NEAR(result.indicial.value[0], 0.5, 2e-3);  // at 0.01 semichords Wagner's function is 0.50125
  for (Index i = 1; i < result.indicial.value.size(); ++i) EXPECT_GE(result.indicial.value[i], result.indicial.value[i - 1] - 1e-8);
  EXPECT_GT(result.indicial.at_step_std, 0) << "without what is imposed";
}

TEST(Restless, ARecordThatBeginsInTheMiddleOfAMotionIsNamed) {
  Recorded r = record(&many_frequencies, 6000);
  for (Channel& channel : r.run.channels) channel.value = channel.value.tail(5000).eval();
  EXPECT_THAT(correct({test::null_rig(), test::null_fit(), r.run, 0}).no_answer, HasSubstr("Begin the record before the motion"));
}

TEST(Restless, APlaceThatIsRougherThanTheRestIsNamed) {
  // A slow oscillation, and a stretch of 2 s in which the drive hammers: one roughness cannot be both.
  const Recorded r = record([](double t) { return sine(t) + (t > 14 && t < 16 ? 0.3 * std::sin(2 * pi * 40 * t) * soft((t - 14) / 0.1) * soft((16 - t) / 0.1) : 0); }, 10000);
  const CorrectResult result = correct({test::null_rig(), test::null_fit(), r.run, 0});
  EXPECT_THAT(result.warnings, Contains(HasSubstr("is rougher there and the band may be too narrow")));
}

}  // namespace
}  // namespace unrig
