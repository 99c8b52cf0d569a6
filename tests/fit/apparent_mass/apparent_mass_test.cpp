#include "fit/apparent_mass/apparent_mass.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <numbers>
#include <random>

#include <nlohmann/json.hpp>

#include "core/numerics/spectrum.h"
#include "fit/apparent_mass/apparent_mass_files.h"
#include "fit/apparent_mass/rig_frequencies.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using nlohmann::json;
using std::numbers::pi;

std::string campaign(const std::string& name) { return UNRIG_SOURCE_DIR "/sample_data/campaigns/" + name; }

json key(const std::string& name) { return json::parse(std::ifstream(campaign("KEY.json")))[name]["truth"]; }

ApparentMassProblem problem_of(const std::string& name, bool joint_fit = false) {
  const std::string folder = campaign(name);
  return {read_rig(folder + "/rig.toml"), read_run(folder + "/dry_pluck.csv"), read_run(folder + "/wet_pluck.csv"), joint_fit, {}};
}

TEST(NaturalFrequencies, HaveExactDerivatives) {
  const Rig rig = read_rig(campaign("null") + "/rig.toml");
  const UndampedSystem system = undamped_system(rig, make_basis(rig, Index{6}, Index{2}), 998.2);
  const RigScales at(0.8, 1.3, 1.1);
  const NaturalFrequencies f = natural_frequencies(system, at);
  for (Index j = 0; j < 3; ++j) {
    const auto error = [&](double step) -> VectorXd {
      RigScales up = at, down = at;
      up[j] += step;
      down[j] -= step;
      return (natural_frequencies(system, up).hertz - natural_frequencies(system, down).hertz) / (2 * step) - f.slope.col(j);
    };
    // Central differences: halving the step quarters the error.
    EXPECT_NEAR(error(0.02).norm() / error(0.01).norm(), 4, 0.05) << j;
    EXPECT_LT(error(0.01).norm(), 1e-3 * f.slope.col(j).norm()) << j;
  }
}

TEST(NaturalFrequencies, AreThoseOfTheCoupledRig) {
  const Rig rig = read_rig(campaign("null") + "/rig.toml");
  const Basis basis = make_basis(rig, Index{5}, Index{1});
  const VectorXd expected = coupled_frequencies(rig, basis, 998.2, 1.2);
  EXPECT_LT((natural_frequencies(undamped_system(rig, basis, 998.2), {1, 1, 1.2}).hertz - expected).norm(), 1e-10 * expected.norm());
}

/// What the frequency shift must reach on an open campaign.
struct Bound {
  const char* name;
  double relative;  ///< error of C_a
  bool linear;      ///< the campaign's hidden effect leaves frequencies as they are, so that the standard errors hold
};
void PrintTo(const Bound& bound, std::ostream* out) { *out << bound.name; }

class OpenCampaigns : public testing::TestWithParam<Bound> {};
// Measured errors of C_a: null 2e-6, highermode 9e-6, lowpass 3e-5, wave 1e-5: the recordings' noise, bounded here by ten times that and more.
// Friction and drag bend the decay, so that no exponential fits: measured 3.1e-3 and below 1e-5 (by luck: its standard error is 6e-4). That is not
// tuned away but stands in the standard errors, 3.4e-3 for friction. The issue asks for 1 % on null.
INSTANTIATE_TEST_SUITE_P(FrequencyShift, OpenCampaigns,
                         testing::Values(Bound{"null", 5e-5, true}, Bound{"highermode", 1e-4, true}, Bound{"lowpass", 3e-4, true},
                                         Bound{"wave", 1e-4, true}, Bound{"friction", 1e-2, false}, Bound{"drag", 5e-3, false}),
                         [](const auto& p) { return p.param.name; });

TEST_P(OpenCampaigns, GiveTheCoefficientWithoutTheJointFit) {
  const Bound bound = GetParam();
  const json truth = key(bound.name);
  const ApparentMassResult result = apparent_mass(problem_of(bound.name));
  EXPECT_EQ(result.method, ApparentMassMethod::mode_shapes);
  EXPECT_FALSE(result.joint_fit.has_value());
  const double ca = truth["Ca"];
  EXPECT_NEAR(result.coefficient->value, ca, bound.relative * ca);
  EXPECT_LT(std::abs(result.coefficient->value - ca), 3 * result.coefficient->std_error);
  EXPECT_NEAR(result.mass.value, ca * pi * 998.2 * 0.0762 * 0.0762, bound.relative * ca * 18.2);
  EXPECT_NEAR(*result.theory, pi * 998.2 * 0.0762 * 0.0762, 1e-9);
  EXPECT_EQ(result.mass_unit, "kg/m");
  // Stiffness: k_t from a torsional mode that is hardly heard.
  EXPECT_NEAR(result.parameters[0].value, truth["kn"], 3 * result.parameters[0].std_error);
  if (bound.linear) {
    EXPECT_NEAR(result.parameters[1].value, truth["kt"], 3 * result.parameters[1].std_error);
  }
  // The dry shape with more mass is not the wet mode: off by 0.4 to 0.8 % on this rig.
  EXPECT_GT(std::abs(*result.same_shape_coefficient / ca - 1), 3e-3);
  for (const RunModes* run : {&result.dry, &result.wet}) EXPECT_EQ(run->lowest().poles == 1, bound.linear || (run == &result.dry && std::string(bound.name) == "drag"));
}

TEST(ApparentMass, AgreesWithTheJointFitWhereNothingIsHidden) {
  const ApparentMassResult result = apparent_mass(problem_of("null", true));
  ASSERT_TRUE(result.joint_fit && result.joint_fit->value);
  EXPECT_TRUE(result.joint_fit->converged);
  // The same recordings: the two values differ by far less than either's error.
  EXPECT_LT(std::abs(result.joint_fit->value->value - result.coefficient->value), 2 * result.coefficient->std_error);
  EXPECT_THAT(result.agreement, testing::HasSubstr("agrees"));
  const json out = json::parse(to_json(result));
  EXPECT_EQ(out["unrig"], "apparent-mass");
  EXPECT_EQ(out["method"], "mode shapes");
  EXPECT_EQ(out["apparent_mass"]["unit"], "kg/m");
  EXPECT_EQ(out["joint_fit"]["agrees"], true);
  for (const char* run : {"dry", "wet"}) {
    EXPECT_EQ(out[run]["unit"], "Hz");
    EXPECT_GT(out[run]["std_error"], 0);
    EXPECT_GE(out[run]["modes"].size(), 3u);
  }
  EXPECT_NEAR(out["dry"]["damping_ratio"], key("null")["zeta_n"], 1e-4);
  EXPECT_THAT(report(result), testing::HasSubstr("The wet mode is not the dry mode with more mass"));
}

TEST(ApparentMass, AJointFitThatDoesNotDescribeTheDecaysConfirmsNothing) {
  const ApparentMassResult result = apparent_mass(problem_of("friction", true));
  ASSERT_TRUE(result.joint_fit && result.joint_fit->value);
  EXPECT_GT(result.joint_fit->reduced_chi2, 100);
  EXPECT_FALSE(result.joint_fit->agrees);
  EXPECT_THAT(result.agreement, testing::HasSubstr("confirms nothing: it leaves a reduced chi-square of "));
  EXPECT_FALSE(json::parse(to_json(result))["joint_fit"]["agrees"].get<bool>());
}

TEST(ApparentMass, ErrorsFromModeShapesCoverTheTruth) {
  // Decays in closed form at the natural frequencies of a rig with known scales, as strong and as damped as those of `null`.
  const Rig rig = problem_of("null").rig;
  const RigScales truth(0.85, 0.7, 1.1);
  const Basis basis = make_basis(rig, Index{10}, Index{3});
  const Index n = 2500;
  const double dt = 0.002;
  double pull2 = 0;
  constexpr unsigned trials = 30;
  for (unsigned trial = 0; trial < trials; ++trial) {
    std::mt19937_64 random(300 + trial);
    std::normal_distribution<double> normal;
    ApparentMassProblem problem = problem_of("null");
    for (unrig::Run* run : {&problem.dry, &problem.wet}) {
      const VectorXd hertz = natural_frequencies(undamped_system(rig, basis, run->density), truth).hertz;
      const double amplitude[] = {30, 1.5, 0.4, 0.3}, zeta = run == &problem.dry ? 0.008 : 0.004;
      run->channels = {{"gauge", "N", "N", 1, VectorXd::NullaryExpr(n, [&](Index k) {
        double y = 0.02 * normal(random);
        for (Index m = 0; m < 4; ++m) {
          const double omega = 2 * pi * hertz[m], t = dt * static_cast<double>(k);
          y += amplitude[m] * std::exp(-zeta * omega * t) * std::cos(omega * std::sqrt(1 - zeta * zeta) * t + static_cast<double>(m));
        }
        return y;
      }), 0}};
    }
    const ApparentMassResult result = apparent_mass(problem);
    for (Index i = 0; i < 3; ++i) {
      const FittedParameter& p = result.parameters[static_cast<std::size_t>(i)];
      pull2 += std::pow((p.value - truth[i]) / p.std_error, 2) / (3 * trials);
      EXPECT_LT(std::abs(p.value - truth[i]), 5 * p.std_error) << p.name << ", trial " << trial;
    }
  }
  // Measured 0.65, and 0.80 over 150 trials: the errors grow where chi-square exceeds one by chance and do not shrink where it falls below. 90 squares,
  // correlated in pairs: 15 to 20 % standard deviation; three of them.
  EXPECT_GT(pull2, 0.4);
  EXPECT_LT(pull2, 1.3);
}

TEST(ApparentMass, FindsTheModesOfARigFileThatIsFarOff) {
  const double right = apparent_mass(problem_of("null")).coefficient->value;
  for (const double normal : {0.25, 0.6, 1.5, 4.0}) {
    for (const double torsion : {0.5, 1.0, 2.5}) {
      ApparentMassProblem problem = problem_of("null");
      problem.rig.normal.flexibility *= normal;
      problem.rig.torsion.flexibility *= torsion * normal;
      const ApparentMassResult result = apparent_mass(problem);
      EXPECT_NEAR(result.coefficient->value, right, 1e-6) << normal << ", " << torsion;  // the prior on k_t/k_n moves
      EXPECT_NEAR(result.parameters[0].value / normal, 0.7887, 1e-4);
    }
  }
}

// ---------------------------------------------------------------------------------------------------------------------------------------------
// A rig that is known only as a mode: signals in closed form.

constexpr double dry_density = 1.2, wet_density = 998.2;

struct Decay {
  double natural, zeta, phase, amplitude = 1;
};

Run make_run(const std::string& file, const Decay& d, double density, Index n, double dt, double sigma, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const VectorXd y = VectorXd::NullaryExpr(n, [&](Index k) {
    const double t = dt * static_cast<double>(k), omega = 2 * pi * d.natural;
    return 0.2 + d.amplitude * std::exp(-d.zeta * omega * t) * std::cos(omega * std::sqrt(1 - d.zeta * d.zeta) * t + d.phase) + sigma * normal(random);
  });
  Run run;
  run.file = file;
  run.kind = RunKind::pluck;
  run.medium = density < 10 ? "air" : "water";
  run.density = density;
  run.dt = dt;
  run.channels.push_back({"gauge", "N", "N", 1, y, 0});
  return run;
}

Rig modal_rig(double mass, double hertz) {
  Rig rig;
  rig.file = "modal.toml";
  rig.modal.push_back({mass, hertz, 0.01, 1000, "N"});
  return rig;
}

struct Pair {
  double ratio;
  Decay dry, wet;
  ApparentMassProblem problem;
};

/// A random rig with a mass ratio near 1: 2 s at 200 Hz, wet damping 3 %. `of_rms`: 40 dB are the signal's r.m.s. over the noise's, else amplitude
/// over the noise's r.m.s. (noise 2.5 times higher).
Pair random_pair(unsigned seed, bool of_rms) {
  std::mt19937_64 random(seed);
  const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  Pair pair;
  pair.ratio = between(0.8, 1.25);
  pair.dry = {between(5, 10), between(0.005, 0.015), between(0, 2 * pi)};
  pair.wet = {pair.dry.natural / std::sqrt(1 + pair.ratio), 0.03, between(0, 2 * pi)};
  const Index n = 400;
  const double dt = 0.005;
  const auto sigma = [&](const Decay& d) {
    if (!of_rms) return 0.01;
    std::mt19937_64 none;
    const VectorXd clean = make_run("", d, 1, n, dt, 0, none).channels.front().value.array() - 0.2;
    return 0.01 * std::sqrt(clean.squaredNorm() / static_cast<double>(n));
  };
  pair.problem = {modal_rig(2, 7.7), make_run("dry.csv", pair.dry, dry_density, n, dt, sigma(pair.dry), random),
                  make_run("wet.csv", pair.wet, wet_density, n, dt, sigma(pair.wet), random), false, {}};
  return pair;
}

/// The frequencies that simpler methods read off the spectrum: the highest line, that of a spectrum padded eightfold, and the top of a parabola
/// through a Hann-windowed peak.
double spectral_frequency(const Run& run, int method) {
  const VectorXd y = run.channels.front().value.array() - run.channels.front().value.mean();
  const Spectrum s = amplitude_spectrum(y, run.dt, method == 2 ? Window::hann : Window::rectangular, method == 1 ? 8 * y.size() : 0);
  const VectorXd power = s.line.cwiseAbs2();
  const Peak peak = peaks_above(power, VectorXd::Constant(power.size(), 1e-12), 1).front();
  return s.spacing * (method == 2 ? peak.position : static_cast<double>(peak.line));
}

/// Two decays of the same rig in the same air: whatever shift the noise makes of them is no fluid.
TEST(ApparentMass, AShiftThatIsNoiseIsRefused) {
  const auto refusal = [](const ApparentMassProblem& problem) -> std::string {
    try {
      apparent_mass(problem);
    } catch (const NoAnswer& error) {
      return error.what();
    }
    return "";
  };
  for (const unsigned seed : {1u, 2u, 3u, 4u}) {
    std::mt19937_64 random(seed);
    const Decay decay{8, 0.01, 1, 1};
    const ApparentMassProblem problem{modal_rig(2, 8), make_run("dry.csv", decay, dry_density, 400, 0.005, 0.01, random), make_run("wet.csv", decay, 2 * dry_density, 400, 0.005, 0.01, random), false, {}};
    EXPECT_THAT(refusal(problem), testing::HasSubstr("the frequency shift is not significant")) << seed;
  }
  ApparentMassProblem shapes = problem_of("null");
  shapes.wet.channels = shapes.dry.channels;
  shapes.wet.density = 2 * shapes.dry.density;
  EXPECT_THAT(refusal(shapes), testing::HasSubstr("The lowest frequencies measured are 6.8485 Hz dry and 6.8485 Hz wet")) << "twice the fluid and the same frequency: no stiffness of this rig";
}

// R.m.s. errors of the added mass, in percent, measured by this test, and those of a reference computed elsewhere (ratio 1, 2 s, 40 dB):
//
//                          line of the FFT   padded x8   Hann + interpolation   damped least squares
//   reference                   8.6             1.2             0.34                  0.02
//   40 dB of the r.m.s.        14.6             1.8             0.53                  0.019
//   40 dB of the amplitude     14.6             1.8             0.53                  0.049
//
// The reference does not state its frequencies; here they are 5 to 10 Hz dry and 3.3 to 7.5 Hz wet.
TEST(ApparentMass, OfFiftyRandomPairsErrsByATenthOfAPercentAtMost) {
  for (const bool of_rms : {true, false}) {
    double error2 = 0, pull2 = 0, spectral2[3] = {};
    int within_one = 0;
    constexpr unsigned pairs = 50;
    for (unsigned seed = 0; seed < pairs; ++seed) {
      const Pair pair = random_pair(100 + seed, of_rms);
      const ApparentMassResult result = apparent_mass(pair.problem);
      EXPECT_EQ(result.method, ApparentMassMethod::frequency_ratio);
      EXPECT_EQ(result.mass_unit, "kg");
      const double truth = 2 * pair.ratio;
      error2 += std::pow(result.mass.value / truth - 1, 2) / pairs;
      const double pull = (result.mass.value - truth) / result.mass.std_error;
      pull2 += pull * pull / pairs;
      within_one += std::abs(pull) < 1;
      for (int method = 0; method < 3; ++method)
        spectral2[method] += std::pow((std::pow(spectral_frequency(pair.problem.dry, method) / spectral_frequency(pair.problem.wet, method), 2) - 1) / pair.ratio - 1, 2) / pairs;
    }
    RecordProperty(of_rms ? "rms_error" : "rms_error_harder", std::to_string(std::sqrt(error2)));
    EXPECT_LT(std::sqrt(error2), 1e-3);
    EXPECT_NEAR(pull2, 1, 0.6);            // 20 % standard deviation; three of them
    EXPECT_NEAR(within_one, 34, 10);       // 68 % of 50: standard deviation 3.3; three of them
    for (int method = 0; method < 3; ++method) EXPECT_GT(spectral2[method], 4 * error2) << method;
  }
}

TEST(ApparentMass, ErrorsOfTheFrequencyRatioCoverTheTruth) {
  int within_one = 0, within_two = 0;
  constexpr unsigned pairs = 400;
  for (unsigned seed = 0; seed < pairs; ++seed) {
    const Pair pair = random_pair(10000 + seed, false);
    const ApparentMassResult result = apparent_mass(pair.problem);
    const double pull = std::abs(result.mass.value - 2 * pair.ratio) / result.mass.std_error;
    within_one += pull < 1;
    within_two += pull < 1.96;
  }
  // 68.3 % and 95 % of 400: standard deviations 2.3 % and 1.1 %; three of them. Measured: 70.3 % and 95.0 %.
  EXPECT_NEAR(within_one / 400.0, 0.683, 0.07);
  EXPECT_NEAR(within_two / 400.0, 0.95, 0.033);
}

TEST(ApparentMass, OfAModalRigHasNoTheoryButAJointFit) {
  Pair pair = random_pair(7, true);
  pair.problem.joint_fit = true;
  const ApparentMassResult result = apparent_mass(pair.problem);
  EXPECT_FALSE(result.theory.has_value());
  EXPECT_FALSE(result.coefficient.has_value());
  ASSERT_TRUE(result.joint_fit && result.joint_fit->value) << result.joint_fit->message;
  EXPECT_NEAR(result.joint_fit->value->value / result.mass.value, 1, 2e-4);
  const json out = json::parse(to_json(result));
  EXPECT_EQ(out["method"], "frequency ratio");
  EXPECT_TRUE(out["theory"]["value"].is_null());
  EXPECT_TRUE(out["apparent_mass_coefficient"]["value"].is_null());
  EXPECT_THAT(report(result), testing::HasSubstr("modal mass"));
}

TEST(ApparentMass, LeavesTonesAndFiltersOut) {
  Pair pair = random_pair(8, true);
  for (unrig::Run* run : {&pair.problem.dry, &pair.problem.wet})
    for (Index k = 0; k < run->samples(); ++k) run->channels.front().value[k] += 5 * std::cos(2 * pi * 50 * run->time(k));  // mains hum, five times as strong
  const ApparentMassResult result = apparent_mass(pair.problem);
  EXPECT_NEAR(result.mass.value, 2 * pair.ratio, 4 * result.mass.std_error);
  ASSERT_EQ(result.dry.modes.size(), 2u);
  EXPECT_THAT(result.dry.modes.back().note, testing::HasSubstr("tone"));
}

TEST(ApparentMass, RefusesRunsThatCannotAnswer) {
  const Pair pair = random_pair(9, true);
  const auto message = [](const ApparentMassProblem& problem) -> std::string {
    try {
      apparent_mass(problem);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no InputError";
  };
  ApparentMassProblem swapped = pair.problem;
  std::swap(swapped.dry, swapped.wet);
  EXPECT_THAT(message(swapped), testing::AllOf(testing::HasSubstr("dry.csv"), testing::HasSubstr("Exchange the files")));
  ApparentMassProblem same = pair.problem;
  same.wet.density = same.dry.density;
  EXPECT_THAT(message(same), testing::HasSubstr("denser fluid"));
  ApparentMassProblem step = pair.problem;
  step.wet.kind = RunKind::step;
  EXPECT_THAT(message(step), testing::AllOf(testing::HasSubstr("\"step\""), testing::HasSubstr("free decay")));
  ApparentMassProblem towed = pair.problem;
  towed.wet.speed = 0.6;
  EXPECT_THAT(message(towed), testing::HasSubstr("still fluid"));
  ApparentMassProblem stranger = pair.problem;
  stranger.wet.channels.front().name = "heave";
  EXPECT_THAT(message(stranger), testing::HasSubstr("wet.csv"));
}

TEST(ApparentMass, HasNoAnswerWithoutAShiftOrAFrequency) {
  std::mt19937_64 random(4);
  const Decay decay{7, 0.01, 0.3};
  ApparentMassProblem problem{modal_rig(1, 7), make_run("dry.csv", decay, dry_density, 400, 0.005, 0.01, random),
                              make_run("wet.csv", decay, wet_density, 400, 0.005, 0.01, random), false, {}};
  EXPECT_THROW(apparent_mass(problem), NoAnswer);  // the same frequency
  problem.wet = make_run("wet.csv", {5, 0.03, 0, 0}, wet_density, 400, 0.005, 0.01, random);
  EXPECT_THROW(apparent_mass(problem), NoAnswer);  // noise only
  ApparentMassProblem beam = problem_of("null");
  beam.wet = beam.dry;
  beam.wet.density = 998.2;
  EXPECT_THROW(apparent_mass(beam), NoAnswer);  // decays in air, said to be in water: no apparent mass at all explains them
}

}  // namespace
}  // namespace unrig
