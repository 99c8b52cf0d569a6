// Pictures of rig and residual against closed forms.

#include "correct/report/rig_sections.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <random>

#include "core/rig/parse_rig.h"
#include "correct/report/result_files.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

Run forced_run() {
  std::string text = "# unrig_run = 1\n# kind = \"forced\"\n# medium = \"air\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],force [N],gauge [N]\n";
  for (int k = 0; k < 200; ++k) text += std::to_string(0.005 * k) + ",0," + std::to_string(std::sin(k)) + "\n";
  return parse_run(text, "forced.csv");
}

/// One mode: H / H(0) = 1 / (1 - r^2 + 2 i zeta r), r = f / f_0.
TEST(RigResponse, OfOneModeIsThatOfAnOscillator) {
  constexpr double f0 = 7, zeta = 0.03;
  const Rig rig = parse_rig("unrig_rig = 1\n[[modal]]\nmass = \"2 kg\"\nfrequency = \"7 Hz\"\ndamping_ratio = 0.03\ngauge_gain = \"1000 N/m\"\n", "rig.toml");
  const RigResponse response = rig_response(rig, FittedRig{}, forced_run());
  ASSERT_EQ(response.modes.size(), 1u);
  EXPECT_NEAR(response.modes[0], f0 * std::sqrt(1 - zeta * zeta), 1e-9) << "the damped frequency";
  ASSERT_GT(response.frequency.size(), 500);
  for (Index k = 0; k < response.frequency.size(); ++k) {
    const double r = response.frequency[k] / f0;
    const std::complex<double> theory = 1.0 / std::complex<double>(1 - r * r, 2 * zeta * r);
    // The reference is not f = 0 but a frequency 20 000 times below the mode, where H/H(0) is 1 to 3e-6.
    EXPECT_LT(std::abs(response.answer[k] - theory) / std::abs(theory), 1e-5) << response.frequency[k];
  }
  // |H| = 1.05 at (1 - r^2)^2 + (2 zeta r)^2 = 1/1.05^2; the grid is 0.7 % fine.
  const double b = 1 - 2 * zeta * zeta, r = std::sqrt(b - std::sqrt(b * b - 1 + 1 / (1.05 * 1.05)));
  EXPECT_NEAR(response.usable / (r * f0), 1, 0.007);
  EXPECT_LE(response.usable, r * f0);
}

nlohmann::json blocks_of(const ReportPage& page) {
  const std::string html = page.html(), open = "id=\"report-data\">";
  const std::size_t first = html.find(open) + open.size();
  return nlohmann::json::parse(html.substr(first, html.find("</script>", first) - first))["blocks"];
}

/// x_k = 0.8 x_{k-1} + e: autocorrelation 0.8^j. White noise: 95 % of it within the band.
TEST(ResidualChecks, TellColourAndTails) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  constexpr Index n = 20000;
  VectorXd white(n), coloured(n);
  double x = 0;
  for (Index k = 0; k < n; ++k) {
    white[k] = 0.3 * normal(random);
    coloured[k] = x = 0.8 * x + normal(random);
  }
  white[100] = std::nan("");
  ReportPage page("");
  add_residual_checks(page, "gauge", white, 0.3, 0.01);
  add_residual_checks(page, "gauge", coloured, coloured.norm() / std::sqrt(n), 0.01);
  const nlohmann::json blocks = blocks_of(page);
  ASSERT_EQ(blocks.size(), 4u);
  const auto &of_white = blocks[0]["series"][0]["v"], &of_coloured = blocks[2]["series"][0]["v"];
  const double sigma = blocks[0]["series"][1]["std"][0];
  EXPECT_NEAR(sigma, 1 / std::sqrt(n), 1e-5);
  int within = 0;
  for (const auto& r : of_white) within += std::abs(r.get<double>()) <= 1.96 * sigma ? 1 : 0;
  EXPECT_NEAR(within / static_cast<double>(of_white.size()), 0.95, 4 * std::sqrt(0.05 * 0.95 / static_cast<double>(of_white.size())));
  // Bartlett: the error of r_j of such a process is at most sqrt((1 + 0.64) / (1 - 0.64) / n) = 0.015.
  for (std::size_t j = 0; j < 10; ++j) EXPECT_NEAR(of_coloured[j].get<double>(), std::pow(0.8, static_cast<double>(j + 1)), 4 * 0.015) << j;
  EXPECT_DOUBLE_EQ(blocks[0]["x"][0], 0.01);
  // Quantiles: z against itself, each within five of its own standard deviations.
  const auto& quantiles = blocks[1];
  for (std::size_t k = 0; k < quantiles["x"].size(); ++k) {
    const double z = quantiles["x"][k], error = quantiles["series"][1]["std"][k];
    EXPECT_NEAR(quantiles["series"][0]["v"][k].get<double>(), z, 5 * error) << z;
  }
  EXPECT_NEAR(quantiles["x"][0].get<double>(), -4.05, 0.03) << "the normal quantile of 0.5/19999, from tables";
}

}  // namespace
}  // namespace unrig
