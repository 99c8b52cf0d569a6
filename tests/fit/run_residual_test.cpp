#include "fit/run_residual.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/exact_step.h"
#include "core/run_inputs.h"
#include "tests/support/sample_data.h"
#include "tests/support/slope.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;
using Windows = std::vector<MotionBasis::Window>;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

VectorXd white_noise(Index samples, double sigma, unsigned seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal(0, sigma);
  return VectorXd::NullaryExpr(samples, [&] { return normal(engine); });
}

/// A model, a run of it that was never recorded, and theta off the truth.
struct Case {
  std::string name;
  std::unique_ptr<AeroelasticModel> model;
  unrig::Run run;
  Windows windows;
  VectorXd theta;

  RunResidual residual(RunOptions options = {}) const { return {*model, run, windows, options}; }
};

void add_channel(unrig::Run& run, const std::string& name, const VectorXd& value, const std::string& unit = "N") {
  run.channels.push_back({name, unit, unit, 1, value, 0});
}

/// Fills in the fitted channels: the model at `truth`, from a state that moves, and noise of a thousandth of it.
void simulate(Case& c, const VectorXd& truth, const std::vector<std::string>& channels, const VectorXd& motion) {
  const Conditions conditions = conditions_of(c.run);
  const LinearSystem system = c.model->system(conditions, truth, channels);
  const ExactStep step = exact_step(system, c.run.dt);
  VectorXd start = VectorXd::Zero(system.states());
  if (c.run.kind != RunKind::step) start.head(system.coordinates) = white_noise(system.coordinates, 0.01, 5);
  VectorXd jerk;
  if (motion.size() > 0) jerk = motion_of(motion, c.run.dt).jerk;
  const MatrixXd clean = drive(system, step, DualMatrix(MatrixXd(start)), c.run.samples(), jerk, run_inputs(c.run, conditions), Partials::none).output;
  for (std::size_t k = 0; k < channels.size(); ++k) {
    const VectorXd y = clean.col(static_cast<Index>(k));
    add_channel(c.run, channels[k], (y + white_noise(y.size(), 1e-3 * y.norm() / std::sqrt(static_cast<double>(y.size())), 6)).array() + 0.3);
  }
}

unrig::Run empty_run(RunKind kind, double speed, double dt) {
  unrig::Run run;
  run.file = "synthetic.csv";
  run.kind = kind;
  run.density = 998.2;
  run.speed = speed;
  run.dt = dt;
  return run;
}

Sensor sensor(const std::string& column, SensorKind reads, int element) {
  Sensor s;
  s.column = column;
  s.reads = reads;
  s.element = element;
  return s;
}

Rig seed_rig() {
  Rig rig = read_rig(test::null_campaign("rig.toml"));
  rig.sensors = {sensor("tip", SensorKind::acceleration, 17), sensor("twist", SensorKind::twist, 13)};
  return rig;
}

Rig modal_rig() {
  Rig rig;
  rig.name = "two modes";
  rig.modal = {{1.5, 7, 0.01, 1000, "N"}, {0.4, 31, 0.03, -200, "N"}};
  return rig;
}

std::unique_ptr<AeroelasticModel> beam_model() {
  const Rig rig = seed_rig();
  return std::make_unique<AeroelasticModel>(rig, make_basis(rig, Index{2}, Index{1}), wagner(Wagner::jones));
}

std::unique_ptr<AeroelasticModel> modal_model() { return std::make_unique<AeroelasticModel>(modal_rig(), Basis{}, wagner(Wagner::jones)); }

VectorXd off(const VectorXd& truth) {
  VectorXd theta = truth;
  for (Index j = 0; j < theta.size(); ++j) theta[j] *= j % 2 == 0 ? 1.02 : 0.97;
  return theta;
}

constexpr Index samples = 260;
constexpr double dt = 0.004;

Case pluck(const std::vector<std::string>& channels) {
  Case c{"pluck", beam_model(), empty_run(RunKind::pluck, 0, dt), {}, {}};
  add_channel(c.run, "note", VectorXd::Zero(samples));
  simulate(c, c.model->start_values(), channels, {});
  c.theta = off(c.model->start_values());
  return c;
}

/// A step of 1.5 degrees within 40 ms and a smaller one back, angle noise of 0.01 degrees; splines on every `stride`-th sample.
Case step(Index stride) {
  Case c{"step, stride " + std::to_string(stride), beam_model(), empty_run(RunKind::step, 0.6, dt), {{{40, 64}, stride}, {{140, 158}, stride}}, {}};
  const MotionBasis basis(samples, dt, c.windows);
  VectorXd u(basis.unknowns());
  Index j = 0;
  for (const auto& window : c.windows) {
    const bool first = window.knots.first == 40;
    for (Index knot = window.knots.first; knot <= window.knots.last; knot += stride) {
      const double s = std::clamp(static_cast<double>(knot - window.knots.first - 8) / 8, 0.0, 1.0);
      u[j++] = (first ? 0.026 : -0.01) * s * s * (3 - 2 * s);
    }
  }
  EXPECT_EQ(j, basis.unknowns());
  const VectorXd motion = basis.coefficients(u);
  add_channel(c.run, "alpha", (motion_of(motion, dt).angle + white_noise(samples, 1.7e-4, 7)).array() + 0.04, "rad");
  simulate(c, c.model->start_values(), {"gauge"}, motion);
  c.theta = off(c.model->start_values());
  return c;
}

Case forced() {
  Case c{"forced", modal_model(), empty_run(RunKind::forced, 0, dt), {}, {}};
  add_channel(c.run, "force", white_noise(samples, 1, 8));
  simulate(c, c.model->start_values(), {"gauge"}, {});
  c.theta = off(c.model->start_values());
  return c;
}

Case moved(bool beam) {
  Case c{beam ? "moved beam" : "moved modes", beam ? beam_model() : modal_model(), empty_run(RunKind::moved, 0, dt), {}, {}};
  VectorXd velocity(samples);
  for (Index k = 0; k < samples; ++k) velocity[k] = 0.1 * std::sin(2 * pi * 5 * dt * static_cast<double>(k)) + 0.02 * std::sin(2 * pi * 23 * dt * static_cast<double>(k));
  add_channel(c.run, "mount_velocity", velocity, "m/s");
  simulate(c, c.model->start_values(), {"gauge"}, {});
  c.theta = off(c.model->start_values());
  return c;
}

/// Weights, missing readings and a spike.
Case damaged(Case c) {
  c.name += ", damaged";
  VectorXd weight = VectorXd::Ones(samples);
  weight.segment(20, 9).setZero();
  weight.segment(90, 30).setConstant(0.25);
  add_channel(c.run, "weight", weight, "1");
  for (Channel& channel : c.run.channels) {
    if (channel.name == "gauge") channel.value[33] = channel.value[52] = channel.value[200] = nan;
    if (channel.name != "alpha") continue;
    channel.value[15] = channel.value[55] = nan;
    channel.value[110] += 0.01;
  }
  return c;
}

std::vector<Case> every_case() {
  std::vector<Case> cases;
  cases.push_back(pluck({"gauge"}));
  cases.push_back(pluck({"gauge", "tip", "twist"}));
  cases.push_back(step(1));
  cases.push_back(step(2));
  cases.push_back(forced());
  cases.push_back(moved(false));
  cases.push_back(moved(true));
  cases.push_back(damaged(pluck({"gauge", "twist"})));
  cases.push_back(damaged(step(1)));
  return cases;
}

// ---------------------------------------------------------------------------------------------------------------- the least chi-square

/// The same least-squares problem without any economy: one row per reading, one column per linear unknown, each column a simulation of its own.
struct Dense {
  MatrixXd columns;
  VectorXd right, solution;
  double chi2 = 0;
};

Dense brute_force(const Case& c, const RunResidual& residual) {
  const Conditions& conditions = residual.conditions();
  const LinearSystem system = c.model->system(conditions, c.theta, residual.channels());
  const ExactStep exact = exact_step(system, c.run.dt);
  const Index n = c.run.samples(), channels = static_cast<Index>(residual.channels().size()), motion = residual.motion().unknowns();
  const Index free = c.run.kind == RunKind::step ? 0 : system.free_states();
  const auto output = [&](const VectorXd& start, const VectorXd& jerk, const MatrixXd& input) {
    return drive(system, exact, DualMatrix(MatrixXd(start)), n, jerk, input, Partials::none).output;
  };
  const VectorXd rest = VectorXd::Zero(system.states());
  const MatrixXd known = output(rest, {}, run_inputs(c.run, conditions));
  const bool angle = motion > 0;

  Dense d;
  d.columns = MatrixXd::Zero(n * (channels + (angle ? 1 : 0)), motion + free + channels + (angle ? 1 : 0));
  d.right = VectorXd::Zero(d.columns.rows());
  const auto put = [&](Index column, const MatrixXd& y) { d.columns.col(column).head(n * channels) = y.reshaped(); };
  for (Index j = 0; j < motion; ++j) {
    const Motion m = motion_of(residual.motion().coefficients(VectorXd::Unit(motion, j)), c.run.dt);
    put(j, output(rest, m.jerk, {}));
    d.columns.col(j).tail(n) = m.angle;
  }
  for (Index j = 0; j < free; ++j) put(motion + j, output(VectorXd::Unit(system.states(), j), {}, {}));
  for (Index k = 0; k < channels; ++k) {
    d.columns.col(motion + free + k).segment(n * k, n).setOnes();
    d.right.segment(n * k, n) = c.run.channel(residual.channels()[static_cast<std::size_t>(k)]).value - known.col(k);
  }
  if (angle) {
    d.columns.col(d.columns.cols() - 1).tail(n).setOnes();
    d.right.tail(n) = c.run.channel("alpha").value;
  }
  VectorXd weight(d.columns.rows());
  for (Index k = 0; k < channels; ++k) weight.segment(n * k, n) = residual.channel_weight(static_cast<std::size_t>(k));
  if (angle) weight.tail(n) = residual.angle_weight();
  d.right = d.right.unaryExpr([](double y) { return std::isfinite(y) ? y : 0.0; }).cwiseProduct(weight);
  d.columns = weight.asDiagonal() * d.columns;
  const VectorXd scale = d.columns.colwise().norm().cwiseInverse();
  d.solution = scale.cwiseProduct((d.columns * scale.asDiagonal()).colPivHouseholderQr().solve(d.right));
  d.chi2 = (d.right - d.columns * d.solution).squaredNorm();
  return d;
}

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
        // A step that changes the residual by 3 %, or the parameter by 10 %.
        const double h = std::min(0.1 * std::abs(c.theta[j]), 0.03 * std::sqrt(e.chi2) / sensitivity);
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
    for (Index j = 0; j < 4; ++j) {
      const double h = 1e-4 * std::abs(theta[j]);
      const auto linear = [&](double step_size) { return residual.evaluate(theta + step_size * VectorXd::Unit(theta.size(), j), Partials::none).linear; };
      const VectorXd slope = (linear(h) - linear(-h)) / (2 * h);
      // In units of the linear unknowns' own errors: R (dc/dtheta).
      EXPECT_LT((e.linear_factor.triangularView<Eigen::Upper>() * (slope - e.linear_slope.col(j))).norm(),
                0.05 * (e.linear_factor.triangularView<Eigen::Upper>() * slope).norm())
          << c.name << ", " << c.model->parameters()[static_cast<std::size_t>(j)].name;
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

TEST(RunResidual, RefusesARunThatDoesNotBelong) {
  Case c = pluck({"gauge"});
  for (Channel& channel : c.run.channels)
    if (channel.name == "gauge") channel.name = "strain";
  EXPECT_THROW(c.residual(), InputError);
}

}  // namespace
}  // namespace unrig
