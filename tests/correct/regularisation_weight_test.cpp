// The answers at half and at twice the weight of the regularisation, which tell a user how much of the answer is the regularisation's: which is which.

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "core/files/csv_table.h"
#include "core/model/indicial_table.h"
#include "core/model/simulate.h"
#include "correct/corrected_files.h"
#include "correct/modal/modal_load.h"
#include "tests/correct/null_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using std::numbers::pi;

/// The null campaign's rig as its key has it (sample_data/campaigns/KEY.json), with errors like those of its fit.
FittedRig true_rig() {
  FittedRig fit = test::written_fit("null", {{"normal.stiffness_scale", 0.78870, 1e-4},
                                             {"torsion.stiffness_scale", 0.80136, 2e-3},
                                             {"normal.damping_ratio", 0.00811606, 2e-5},
                                             {"torsion.damping_ratio", 0.0272022, 2e-3},
                                             {"apparent_mass_coefficient", 1.12190, 2e-4}});
  fit.effects.clear();
  fit.normal_modes = 3;
  fit.torsion_modes = 1;
  return fit;
}

/// Amplitudes of the response's exponentials over the share that the prior leaves each (correct/estimate/prior.h), out of its values: a sum of squares that a heavier weight makes smaller.
double size_of_amplitudes(const IndicialResponse& response, const VectorXd& value) {
  const VectorXd rates = spread_rates(5 * response.semichords.tail(1)[0]);
  const MatrixXd decays = (-response.semichords * rates.transpose()).array().exp();
  const VectorXd amplitudes = decays.colPivHouseholderQr().solve(VectorXd(1 - value.array()));
  EXPECT_LT(((decays * amplitudes + value).array() - 1).abs().maxCoeff(), 1e-8) << "other rates than those of the model";
  return amplitudes.cwiseQuotient((rates / 0.05).cwiseMin(1)).norm();
}

/// Load of a section that changes its angle so, far behind each step of it slope times angle: what the response makes of it, per unit slope and force per coefficient.
VectorXd built_up(const IndicialResponse& response, const VectorXd& value, const VectorXd& angle, double semichords_per_sample) {
  const VectorXd rates = spread_rates(5 * response.semichords.tail(1)[0]), decay = (-semichords_per_sample * rates).array().exp();
  const VectorXd amplitudes = MatrixXd((-response.semichords * rates.transpose()).array().exp()).colPivHouseholderQr().solve(VectorXd(1 - value.array()));
  VectorXd late = VectorXd::Zero(rates.size()), load = VectorXd::Zero(angle.size());
  for (Index k = 1; k < angle.size(); ++k) {
    late = (late.array() + angle[k] - angle[k - 1]) * decay.array();
    load[k] = angle[k] - angle[0] - amplitudes.dot(late);
  }
  return load;
}

/// Which is which: of the response by the size of its amplitudes, of the loads by their answer to the response, since a load is the slope times what the response makes of the motion:
///   load_half - load_twice = F slope (built up by half - built up by twice) + F (slope of half - of twice) built up,  F > 0, nearly.
void expect_half_and_twice(const CorrectResult& r, const VectorXd& angle) {
  const IndicialResponse& response = r.indicial;
  const double half = size_of_amplitudes(response, response.half_weight), twice = size_of_amplitudes(response, response.twice_weight);
  EXPECT_GT(half, twice);
  const double per_sample = r.semichords_per_second * r.dt;
  MatrixXd parts(angle.size(), 3);
  parts << built_up(response, response.half_weight, angle, per_sample) - built_up(response, response.twice_weight, angle, per_sample), built_up(response, response.value, angle, per_sample),
      VectorXd::Ones(angle.size());
  for (const CorrectedLoad* load : {&r.circulatory, &r.normal_force}) {
    const VectorXd share = parts.colPivHouseholderQr().solve(load->half_weight - load->twice_weight);
    EXPECT_GT(share[0], 0) << "exchanged, it is the opposite; its size tells less, since the motion gives way to the response too";
  }
}

/// A run of that rig with the noise of its channels, of this angle [rad].
unrig::Run recorded(const VectorXd& angle) {
  const Rig rig = test::null_rig();
  const FittedRig fit = true_rig();
  const AeroelasticModel model(rig, make_basis(rig, fit.normal_modes, fit.torsion_modes), wagner(Wagner::within_1e6));
  unrig::Run run;
  run.file = "recorded.csv";
  run.density = 998.2;
  run.speed = 0.6096;
  run.dt = 0.002;
  run.channels.push_back({"alpha", "rad", "rad", 1, angle});
  VectorXd theta = theta_for(model, fit, "");
  theta[model.index("normal_force_slope")] = 5.86;
  const SimulateResult truth = simulate({model, theta, run, PitchBetweenSamples::spline, std::nullopt, 0.2});
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  const auto noisy = [&](VectorXd x, double sigma) {
    for (double& value : x) value += sigma * normal(random);
    return x;
  };
  run.channels = {{"alpha", "rad", "rad", 1, noisy(angle, 0.01 * pi / 180)}, {"gauge", "N", "N", 1, noisy(truth.run.channel("gauge").value, 0.027)}};
  return run;
}

/// 0 to 1 for x from 0 to 1.
double soft(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * x * (10 - 15 * x + 6 * x * x); }

TEST(RegularisationWeight, HalfOfItLeavesLargerAmplitudesThanTwiceBehindAStep) {
  const VectorXd angle = VectorXd::NullaryExpr(1200, [](Index k) { return (2 + 1.5 * soft((0.002 * static_cast<double>(k) - 0.5) / 0.08)) * pi / 180; });
  expect_half_and_twice(correct({test::null_rig(), true_rig(), recorded(angle)}), angle);
}

TEST(RegularisationWeight, AndWhereTheShaftNeverRests) {
  const VectorXd angle = VectorXd::NullaryExpr(1500, [](Index k) {
    const double t = 0.002 * static_cast<double>(k) - 0.2;
    return (2 + 2 * soft(t / 0.3) * std::sin(2 * pi * 1.5 * t)) * pi / 180;
  });
  expect_half_and_twice(correct({test::null_rig(), true_rig(), recorded(angle)}), angle);
}

/// Of a rig known as modes: the load with the least sum of misfit and weight times its squared second derivative. The heavier the weight, the smoother the load.
TEST(RegularisationWeight, HalfOfItLeavesARougherModalLoadThanTwice) {
  Rig rig;
  rig.name = rig.file = "oscillator.toml";
  rig.modal = {{1, 8, 0.02, 500, "N"}};
  const AeroelasticModel model(rig, {}, {});
  FittedRig fit;
  for (const Parameter& p : model.parameters()) {
    fit.parameters.emplace_back();
    fit.parameters.back().name = p.name;
    fit.parameters.back().value = p.start;
  }
  fit.correlation = MatrixXd::Identity(4, 4);
  unrig::Run run;
  run.file = "pushed.csv";
  run.kind = RunKind::moved;
  run.dt = 0.005;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  // The rig follows a load that changes over a second as a rigid one would, to 1e-2 of it.
  VectorXd gauge(800);
  for (Index k = 0; k < gauge.size(); ++k) gauge[k] = 20 * std::exp(-std::pow((run.time(k) - 2) / 0.7, 2)) + 0.5 * normal(random);
  run.channels = {{"mount_acceleration", "m/s^2", "m/s^2", 1, 1e-6 * VectorXd::Unit(gauge.size(), gauge.size() / 2)}, {"gauge", "N", "N", 1, gauge}};
  const ModalLoad result = modal_load({rig, fit, run});
  const auto roughness = [](const VectorXd& x) { return (x.tail(x.size() - 2) - 2 * x.segment(1, x.size() - 2) + x.head(x.size() - 2)).norm(); };
  EXPECT_GT(roughness(result.half_weight), roughness(result.load));
  EXPECT_GT(roughness(result.load), roughness(result.twice_weight));
}

/// Every column of the tables says what its name says.
TEST(RegularisationWeight, TablesNameTheColumnsRightly) {
  constexpr Index rows = 3;
  const auto all = [](double x) -> VectorXd { return VectorXd::Constant(rows, x); };
  CorrectResult r;
  r.dt = r.semichords_per_second = 1;
  r.force_per_coefficient = 2;
  r.gauge = r.unexplained = all(0);
  double next = 10;
  for (CorrectedLoad* load : {&r.circulatory, &r.normal_force}) {
    load->value = all(next), load->std = all(next + 1), load->half_weight = all(next + 2), load->twice_weight = all(next + 3), load->simultaneous = 3;
    load->by_source = VectorXd::Ones(rows) * VectorXd::LinSpaced(sources, next + 4, next + 8).transpose();
    next += 10;
  }
  IndicialResponse& response = r.indicial;
  response.semichords = VectorXd::LinSpaced(rows, 1, rows);
  response.value = all(30), response.uncertainty.std = all(31), response.half_weight = all(32), response.twice_weight = all(33), response.uncertainty.simultaneous = 2;
  response.uncertainty.by_source = VectorXd::Ones(rows) * VectorXd::LinSpaced(sources, 34, 38).transpose();
  response.per_radian = all(40), response.per_radian_std = all(41);
  const auto expect = [](const std::string& text, const std::string& name, double value) {
    const CsvTable table = read_csv(text, 1, "table.csv");
    int found = 0;
    for (const CsvColumn& c : table.columns)
      if (c.name == name) {
        EXPECT_EQ(c.value[1], value) << name;
        ++found;
      }
    EXPECT_EQ(found, 1) << name;
  };
  const std::string loads = to_csv(r), indicial = to_indicial_csv(r);
  const auto expect_all = [&](const std::string& text, const std::string& name, double first, double simultaneous) {
    expect(text, name, first);
    expect(text, name + "_std", first + 1);
    expect(text, name + "_half_weight", first + 2);
    expect(text, name + "_twice_weight", first + 3);
    for (Index s = 0; s < sources; ++s) expect(text, name + "_std_" + source_names[static_cast<std::size_t>(s)], first + 4 + static_cast<double>(s));
    expect(text, name + "_band95", simultaneous * (first + 1));
  };
  expect_all(loads, "circulatory", 10, 3);
  expect_all(loads, "normal_force", 20, 3);
  expect(loads, "cn", 10);
  expect(loads, "cn_std", 10.5);
  expect_all(indicial, "indicial", 30, 2);
  expect(indicial, "cn_per_radian", 40);
  expect(indicial, "cn_per_radian_std", 41);

  ModalLoad modal;
  modal.unit = "V";
  modal.dt = 1;
  modal.gauge = modal.from_inputs = all(0);
  modal.load = all(10), modal.std = all(11), modal.half_weight = all(12), modal.twice_weight = all(13), modal.simultaneous = 3;
  modal.by_source = MatrixXd::Zero(rows, sources);
  expect(to_csv(modal), "normal_force_half_weight", 12);
  expect(to_csv(modal), "normal_force_twice_weight", 13);
}

}  // namespace
}  // namespace unrig
