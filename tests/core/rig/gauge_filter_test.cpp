#include "core/rig/gauge_filter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <numbers>

#include "core/model/simulate.h"
#include "core/files/text_file.h"
#include "tests/support/sample_data.h"
#include "tests/support/temporary_directory.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Complex = std::complex<double>;

Complex response_of(const GaugeFilter& f, double hertz) {
  const MatrixXcd resolvent = Complex(0, 2 * pi * hertz) * MatrixXcd::Identity(f.states(), f.states()) - f.F.value.cast<Complex>();
  return (f.h.cast<Complex>() * resolvent.partialPivLu().solve(f.g.value.cast<Complex>()))(0, 0) + f.direct;
}

TEST(GaugeFilter, RespondsAsItsFormula) {
  for (const double hertz : {0.0, 1.0, 9.0, 30.0, 200.0}) {
    const Complex x(0, hertz / 30);
    EXPECT_LT(std::abs(response_of(first_order_low_pass(30), hertz) - 1.0 / (1.0 + x)), 1e-13) << hertz;
    EXPECT_LT(std::abs(response_of(low_pass(30, 0.6), hertz) - 1.0 / (1.0 + 1.2 * x + x * x)), 1e-13) << hertz;
  }
  // The phase that the docstring promises: 1e-3 rad where 2 pi f time is 1.6 for order 3, 5.9 for order 6; the gain is 1 at all frequencies.
  for (const auto& [order, reach] : {std::pair{3, 1.6}, std::pair{6, 5.9}}) {
    const double time = 0.004, hertz = reach / (2 * pi * time);
    const Complex off = response_of(delay(time, order), hertz) * std::polar(1.0, reach);
    EXPECT_LT(std::abs(std::arg(off)), 1e-3) << order;
    EXPECT_NEAR(std::abs(off), 1, 1e-12) << order;
    EXPECT_GT(std::abs(std::arg(response_of(delay(time, order), 1.5 * hertz) * std::polar(1.0, 1.5 * reach))), 1e-3) << "and not much beyond";
  }
}

TEST(GaugeFilter, PartialsAreThoseOfTheParameters) {
  const FilterParameters place{1, 4};
  const auto check = [&](const GaugeFilter& at, const GaugeFilter& above, const GaugeFilter& below, Index parameter, double step) {
    EXPECT_LT(((above.F.value - below.F.value) / (2 * step) - at.F.d(parameter)).norm(), 1e-6 * at.F.d(parameter).norm()) << parameter;
    if (!at.g.depends_on(parameter)) return;
    EXPECT_LT(((above.g.value - below.g.value) / (2 * step) - at.g.d(parameter)).norm(), 1e-6 * at.g.d(parameter).norm()) << parameter;
  };
  check(low_pass(20, 0.7, place), low_pass(20 + 1e-3, 0.7), low_pass(20 - 1e-3, 0.7), 1, 1e-3);
  check(low_pass(20, 0.7, place), low_pass(20, 0.7 + 1e-3), low_pass(20, 0.7 - 1e-3), 2, 1e-3);
  check(delay(0.01, 3, place), delay(0.01 + 1e-6, 3), delay(0.01 - 1e-6, 3), 1, 1e-6);
}

TEST(GaugeFilter, IsFoundFromAMeasuredResponse) {
  // Butterworth's third order behind 1 ms of delay, measured up to 200 Hz: no few poles are exactly this.
  const VectorXd frequency = VectorXd::LinSpaced(80, 0, 200);
  VectorXcd measured(frequency.size());
  for (Index i = 0; i < frequency.size(); ++i) {
    const Complex x(0, frequency[i] / 60);
    measured[i] = std::polar(1.0, -2 * pi * frequency[i] * 1e-3) / ((1.0 + x) * (1.0 + x + x * x));
  }
  double miss = 0;
  const GaugeFilter filter = measured_filter(frequency, measured, miss);
  EXPECT_LT(miss, 1e-3);
  EXPECT_LE(filter.states(), 6);
  EXPECT_LT(filter.F.value.eigenvalues().real().maxCoeff(), 0) << "stable";
  EXPECT_NEAR(response_of(filter, 0).real(), 1, 1e-12) << "dead weights read what they weigh";
  for (const double hertz : {7.0, 33.3, 111.0}) {  // between the measured ones
    const Complex x(0, hertz / 60);
    EXPECT_LT(std::abs(response_of(filter, hertz) - std::polar(1.0, -2 * pi * hertz * 1e-3) / ((1.0 + x) * (1.0 + x + x * x))), 2e-3) << hertz;
  }
}

// ------------------------------------------------------------------------------------------------ in the rig file

std::string rig_with(const std::string& gauge) {
  std::string text = read_text(test::null_campaign("rig.toml"));
  return text.insert(text.find("[gauge]") + 7, "\n" + gauge + "\n");
}

VectorXd simulated(const Rig& rig, const std::vector<std::string>& effects, const VectorXd& effect_values) {
  const AeroelasticModel model = AeroelasticModel(rig, make_basis(rig, Index{3}, Index{1}), wagner(Wagner::within_1e4)).with_effects(effects);
  unrig::Run run;
  run.file = "made.csv";
  run.density = 998.2;
  run.speed = 0.6;
  run.dt = 0.001;
  VectorXd angle(1500);
  for (Index k = 0; k < angle.size(); ++k) {
    const double x = std::min(1.0, std::max(0.0, (run.time(k) - 0.2) / 0.1));
    angle[k] = 0.02 + 0.03 * x * x * x * (10 - 15 * x + 6 * x * x);
  }
  run.channels.push_back({"alpha", "rad", "rad", 1, angle, 0});
  VectorXd theta = model.start_values();
  theta.tail(effect_values.size()) = effect_values;
  return simulate({model, theta, run, PitchBetweenSamples::spline, std::nullopt, std::nullopt}).run.channel("gauge").value;
}

TEST(RigGaugeFilter, LowPassIsThatOfTheEffect) {
  const test::TemporaryDirectory directory;
  const Rig plain = read_rig(test::null_campaign("rig.toml")), filtered = read_rig(directory.file("rig.toml", rig_with("lowpass = { order = 2, cutoff = \"12 Hz\", damping_ratio = 0.6 }")));
  const VectorXd effect = simulated(plain, {"gauge-lowpass"}, Eigen::Vector2d(12, 0.6)), known = simulated(filtered, {}, {}), raw = simulated(plain, {}, {});
  EXPECT_LT((effect - known).cwiseAbs().maxCoeff(), 1e-9 * raw.cwiseAbs().maxCoeff());
  EXPECT_GT((raw - known).cwiseAbs().maxCoeff(), 0.1 * raw.cwiseAbs().maxCoeff()) << "it does something";
}

TEST(RigGaugeFilter, FirstOrderSmoothsTheReading) {
  const test::TemporaryDirectory directory;
  const VectorXd raw = simulated(read_rig(test::null_campaign("rig.toml")), {}, {});
  const VectorXd known = simulated(read_rig(directory.file("rig.toml", rig_with("lowpass = { order = 1, cutoff = \"8 Hz\" }"))), {}, {});
  // y_f' = w (y - y_f) with y straight between its samples: off by (w' dt)^2 / 12 for the angular frequencies w' of the ringing, at most 100 Hz: 3 % of what is there of them.
  const double w = 2 * pi * 8, decay = std::exp(-w * 0.001), mean = (1 - decay) / (w * 0.001);
  double y = raw[0], worst = 0;
  for (Index k = 1; k < raw.size(); ++k) {
    y = decay * y + (mean - decay) * raw[k - 1] + (1 - mean) * raw[k];
    worst = std::max(worst, std::abs(y - known[k]));
  }
  EXPECT_LT(worst, 0.003 * raw.cwiseAbs().maxCoeff());
}

TEST(RigGaugeFilter, DelayShiftsTheReading) {
  const test::TemporaryDirectory directory;
  const VectorXd raw = simulated(read_rig(test::null_campaign("rig.toml")), {}, {});
  const VectorXd late = simulated(read_rig(directory.file("rig.toml", rig_with("delay = \"25 ms\""))), {}, {});
  EXPECT_LT((late.tail(1475) - raw.head(1475)).cwiseAbs().maxCoeff(), 0.002 * raw.cwiseAbs().maxCoeff());
}

TEST(RigGaugeFilter, MeasuredResponseStandsBesideTheRigFile) {
  const test::TemporaryDirectory directory;
  std::string table = "frequency [Hz],gain [1],phase [deg]\n";
  for (double f = 0; f <= 100; f += 2) {
    const Complex x(0, f / 12), h = 5.0 / (1.0 + 1.2 * x + x * x);  // five volts per volt: part of the calibration
    table += std::to_string(f) + "," + std::to_string(std::abs(h)) + "," + std::to_string(std::arg(h) * 180 / pi) + "\n";
  }
  directory.file("amplifier.csv", table);
  const Rig measured = read_rig(directory.file("rig.toml", rig_with("response = \"amplifier.csv\"")));
  EXPECT_EQ(measured.gauge_filters.size(), 1u);
  const VectorXd effect = simulated(read_rig(test::null_campaign("rig.toml")), {"gauge-lowpass"}, Eigen::Vector2d(12, 0.6)), known = simulated(measured, {}, {});
  EXPECT_LT((effect - known).cwiseAbs().maxCoeff(), 1e-4 * effect.cwiseAbs().maxCoeff());  // six decimals in the table
}

std::string refusal(const std::string& gauge, const std::string& response = "") {
  const test::TemporaryDirectory directory;
  if (!response.empty()) directory.file("a.csv", response);
  try {
    read_rig(directory.file("rig.toml", rig_with(gauge)));
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(RigGaugeFilter, WhatCannotBeUsedIsNamed) {
  EXPECT_THAT(refusal("lowpass = { order = 3, cutoff = \"12 Hz\" }"), AllOf(HasSubstr("rig.toml:"), HasSubstr("gauge.lowpass.order is 3"), HasSubstr("1 or 2")));
  EXPECT_THAT(refusal("lowpass = { order = 1, cutoff = \"12 Hz\", damping_ratio = 1 }"), HasSubstr("damping_ratio"));
  EXPECT_THAT(refusal("lowpass = { order = 2, cutoff = \"12 m\" }"), HasSubstr("gauge.lowpass.cutoff"));
  EXPECT_THAT(refusal("lowpass = { order = 2, cutof = \"12 Hz\" }"), HasSubstr("cutof"));
  EXPECT_THAT(refusal("delay = \"1 s\""), AllOf(HasSubstr("gauge.delay"), HasSubstr("at most 0.2 s")));
  EXPECT_THAT(refusal("calibration_uncertainty = -0.1"), HasSubstr("calibration_uncertainty"));
  EXPECT_THAT(refusal("response = \"missing.csv\""), HasSubstr("missing.csv"));
  EXPECT_THAT(refusal("response = \"a.csv\"", "frequency [Hz],gain [1]\n1,1\n2,1\n"), AllOf(HasSubstr("a.csv:1"), HasSubstr("phase")));
  EXPECT_THAT(refusal("response = \"a.csv\"", "frequency [Hz],gain [1],phase [deg]\n1,1,0\n2,1,0\n2,1,0\n3,1,0\n"), AllOf(HasSubstr("a.csv:4"), HasSubstr("increase")));
  EXPECT_THAT(refusal("response = \"a.csv\"", "frequency [Hz],gain [1],phase [deg]\n1,1,0\n2,1,x\n3,1,0\n4,1,0\n"), HasSubstr("a.csv:3"));
}

}  // namespace
}  // namespace unrig
