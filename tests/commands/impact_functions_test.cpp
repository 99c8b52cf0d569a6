// `unrig new rig --from impact-test FRF`: an impact test simulated in time, its frequency response functions and coherence estimated as analysers do, and the rig that comes of them.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <filesystem>
#include <numbers>
#include <random>

#include <fmt/format.h>

#include "core/files/text_file.h"
#include "core/numerics/spectrum.h"
#include "core/rig/parse_rig.h"
#include "tests/commands/run_unrig.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using std::numbers::pi;
using test::Finished;
using test::run_unrig;
using test::TemporaryDirectory;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double frequency[] = {18.3, 64}, damping_ratio[] = {0.02, 0.015}, mass[] = {2.1, 1.4}, gain[] = {27800, -50000};
constexpr int blows = 8;

struct Estimate {
  VectorXd frequency, coherence;
  VectorXcd response;
};

/// H1 and coherence of accelerometer (0) and gauge (1) from `blows` of a hammer, of the shape of a squared sine, 8 ms: two oscillators by Runge and Kutta's method noise on both readings. 4096 Hz, so that nothing of what is looked at is folded down and the step's error of a frequency, (w h)^4/120, is below 5e-5 Hz.
std::vector<Estimate> analysed(unsigned seed) {
  constexpr Index samples = 32768;
  constexpr double rate = 4096, h = 1 / rate, width = 32 * h, begin = 400 * h;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<VectorXcd> cross(2, VectorXcd::Zero(samples / 2 + 1));
  std::vector<VectorXd> power(2, VectorXd::Zero(samples / 2 + 1));
  VectorXd input = VectorXd::Zero(samples / 2 + 1);
  for (int blow = 0; blow < blows; ++blow) {
    const double size = 150 + 100 * std::uniform_real_distribution<double>()(random);
    const auto force = [&](double t) { return t < begin || t > begin + width ? 0.0 : size * std::pow(std::sin(pi * (t - begin) / width), 2); };
    VectorXd f(samples), acc(samples), gauge(samples);
    Eigen::Vector2d x = Eigen::Vector2d::Zero(), v = x;
    const auto acceleration = [&](double t, const Eigen::Vector2d& at, const Eigen::Vector2d& speed) {
      Eigen::Vector2d a;
      for (int i = 0; i < 2; ++i) {
        const double w = 2 * pi * frequency[i];
        a[i] = force(t) / mass[i] - 2 * damping_ratio[i] * w * speed[i] - w * w * at[i];
      }
      return a;
    };
    for (Index k = 0; k < samples; ++k) {
      const double t = h * static_cast<double>(k);
      f[k] = force(t);
      acc[k] = acceleration(t, x, v).sum() + 0.5 * normal(random);
      gauge[k] = gain[0] * x[0] + gain[1] * x[1] + 0.5 * normal(random);
      const Eigen::Vector2d k1 = v, a1 = acceleration(t, x, v), k2 = v + h / 2 * a1, a2 = acceleration(t + h / 2, x + h / 2 * k1, k2), k3 = v + h / 2 * a2, a3 = acceleration(t + h / 2, x + h / 2 * k2, k3),
                            k4 = v + h * a3, a4 = acceleration(t + h, x + h * k3, k4);
      x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    const VectorXcd lines_of_force = fourier(f), lines[] = {fourier(acc), fourier(gauge)};
    input += lines_of_force.cwiseAbs2();
    for (std::size_t j = 0; j < 2; ++j) {
      cross[j] += lines_of_force.conjugate().cwiseProduct(lines[j]);
      power[j] += lines[j].cwiseAbs2();
    }
  }
  std::vector<Estimate> found(2);
  constexpr Index first = 32, last = 800;  // 4 to 100 Hz
  for (std::size_t j = 0; j < 2; ++j) {
    found[j].frequency = VectorXd::LinSpaced(last - first, rate * first / samples, rate * (last - 1) / samples);
    found[j].response = cross[j].segment(first, last - first).cwiseQuotient(input.segment(first, last - first).cast<std::complex<double>>());
    found[j].coherence = cross[j].segment(first, last - first).cwiseAbs2().cwiseQuotient(input.segment(first, last - first).cwiseProduct(power[j].segment(first, last - first)));
  }
  return found;
}

std::string table(const Estimate& e, const std::string& unit, bool polar, bool coherence) {
  std::string text = "frequency [Hz]," + (polar ? "magnitude [" + unit + "],phase [deg]" : "real [" + unit + "],imaginary [" + unit + "]") + (coherence ? ",coherence\n" : "\n");
  for (Index k = 0; k < e.frequency.size(); ++k) {
    const std::complex<double> h = e.response[k];
    text += fmt::format("{:.6f},{:.9e},{:.9e}", e.frequency[k], polar ? std::abs(h) : h.real(), polar ? std::arg(h) * 180 / pi : h.imag());
    text += coherence ? fmt::format(",{:.8f}\n", e.coherence[k]) : "\n";
  }
  return text;
}

/// Dataset 58 of even spacing, double precision: complex (type 4) or real (type 6).
std::string dataset_58(int type, int node, int direction, int reference, const VectorXd& frequency_axis, const VectorXcd& value, const std::string& unit, bool single_precision) {
  const bool complex = type == 4;
  std::string text = "    -1\n    58\nFRF\nNONE\n24-Nov-26 10:00:00\nNONE\nNONE\n";
  text += fmt::format("{:5}{:10}{:5}{:10} {:<10}{:10}{:4} {:<10}{:10}{:4}\n", type, 1, 1, 0, "NONE", node, direction, "NONE", reference, 3);
  text += fmt::format("{:10}{:10}{:10}{:13.5e}{:13.5e}{:13.5e}\n", (complex ? 5 : 2) + (single_precision ? 0 : complex ? 1 : 2), value.size(), 1, frequency_axis[0], frequency_axis[1] - frequency_axis[0], 0.0);
  text += fmt::format("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", 18, 0, 0, 0, "Frequency", "Hz");
  text += fmt::format("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", 12, 0, 0, 0, "Response", unit);
  text += fmt::format("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", 13, 0, 0, 0, "Force", complex ? "N" : "NONE");
  text += fmt::format("{:10}{:5}{:5}{:5} {:<20} {:<20}\n", 0, 0, 0, 0, "NONE", "NONE");
  const std::size_t in_a_line = single_precision ? 6 : 4;
  std::vector<double> numbers;
  for (const std::complex<double> v : value) {
    numbers.push_back(v.real());
    if (complex) numbers.push_back(v.imag());
  }
  for (std::size_t k = 0; k < numbers.size(); ++k) text += (single_precision ? fmt::format("{:13.5e}", numbers[k]) : fmt::format("{:20.12e}", numbers[k])) + (k % in_a_line == in_a_line - 1 || k + 1 == numbers.size() ? "\n" : "");
  return text + "    -1\n";
}

/// Values of a rig file against the truth, within `sigmas` of the file's own standard deviations.
void expect_truth(const std::string& rig_file, double sigmas, bool masses) {
  const Rig rig = read_rig(rig_file);
  const std::string text = read_text(rig_file);
  ASSERT_EQ(rig.modal.size(), 2u) << text;
  std::size_t at = 0;
  for (std::size_t k = 0; k < 2; ++k) {
    at = text.find("[[modal]]", at) + 1;
    const auto std_of = [&](const std::string& key) {
      const std::size_t found = text.find(key + "_std = ", at);
      const std::size_t digits = text.find_first_of("0123456789", found);
      return std::stod(text.substr(digits));
    };
    const ModalMode& m = rig.modal[k];
    EXPECT_NEAR(m.frequency, frequency[k], sigmas * std_of("frequency")) << text;
    EXPECT_NEAR(m.damping_ratio, damping_ratio[k], sigmas * std_of("damping_ratio")) << text;
    EXPECT_LT(std_of("frequency"), 1e-3 * frequency[k]);
    if (masses) {
      EXPECT_NEAR(m.mass, mass[k], sigmas * std_of("mass")) << text;
      EXPECT_LT(std_of("mass"), 0.02 * mass[k]);
    }
    if (m.gauge_gain != 0) {
      EXPECT_NEAR(m.gauge_gain, gain[k] / (masses ? 1 : mass[k]), sigmas * std_of("gauge_gain")) << text;
      EXPECT_EQ(m.gauge_unit, "N");
    }
  }
}

TEST(NewFromFunctions, TheRigOfAnImpactTestIsTheOneThatWasStruck) {
  const TemporaryDirectory directory;
  const std::vector<Estimate> estimates = analysed(7);
  const std::string acc = directory.file("acc.csv", table(estimates[0], "m/s^2/N", false, true)), gauge = directory.file("bridge.csv", table(estimates[1], "N/N", true, true)), rig = directory.path("rig.toml");
  const Finished finished = run_unrig(directory, {"new", "rig", "--from", "impact-test", acc, gauge, "--averages", std::to_string(blows), "-o", rig});
  ASSERT_EQ(finished.status, 0) << finished.err;
  EXPECT_THAT(finished.err, IsEmpty());
  EXPECT_THAT(finished.out, HasSubstr("2 modes from 2 frequency response functions"));
  expect_truth(rig, 4, true);
  const Rig read = read_rig(rig);
  ASSERT_EQ(read.sensors.size(), 1u);
  EXPECT_EQ(read.sensors[0].column, "acc");
  EXPECT_EQ(read.sensors[0].reads, SensorKind::acceleration);
  EXPECT_NEAR(read.modal[0].sensor_shape[0], 1, 1e-9);
  EXPECT_EQ(run_unrig(directory, {"check", "--rig", rig}).status, 0);

  // The gauge alone: its gain over the mass is what it knows.
  const std::string alone = directory.path("alone.toml");
  ASSERT_EQ(run_unrig(directory, {"new", "rig", "--from", "impact-test", gauge, "--averages", std::to_string(blows), "-o", alone}).status, 0);
  expect_truth(alone, 4, false);
  EXPECT_EQ(read_rig(alone).modal[0].mass, 1);
  EXPECT_THAT(read_text(alone), HasSubstr("put down as 1 kg"));

  // Without coherence, and in inches: a warning, and the same rig.
  Estimate inches = estimates[0];
  inches.response /= 0.0254;
  const std::string plain = directory.path("plain.toml");
  const Finished without = run_unrig(directory, {"new", "rig", "--from", "impact-test", directory.file("acc.csv", table(inches, "in/s^2/N", true, false)), "-o", plain});
  ASSERT_EQ(without.status, 0) << without.err;
  EXPECT_THAT(without.err, HasSubstr("no coherence of \"acc\""));
  expect_truth(plain, 5, true);
}

TEST(NewFromFunctions, UniversalFilesSayWhereResponseAndForceAre) {
  const TemporaryDirectory directory;
  const std::vector<Estimate> estimates = analysed(8);
  for (const bool single_precision : {false, true}) {
    std::string text;
    // Struck at 3:+Z; the accelerometer there looks the other way, another one elsewhere reads half of it, the bridge is at no node of the structure's.
    text += dataset_58(4, 7, 3, 3, estimates[0].frequency, 0.5 * estimates[0].response, "m/s^2", single_precision);
    text += dataset_58(4, 3, -3, 3, estimates[0].frequency, -estimates[0].response, "m/s^2", single_precision);
    text += dataset_58(4, 9, 3, 3, estimates[1].frequency, estimates[1].response, "N", single_precision);
    const VectorXcd coherence[] = {estimates[0].coherence.cast<std::complex<double>>(), estimates[1].coherence.cast<std::complex<double>>()};
    text += dataset_58(6, 3, -3, 3, estimates[0].frequency, coherence[0], "NONE", false) + dataset_58(6, 7, 3, 3, estimates[0].frequency, coherence[0], "NONE", false) + dataset_58(6, 9, 3, 3, estimates[1].frequency, coherence[1], "NONE", false);
    const std::string file = directory.file("frf.unv", text), rig = directory.path("rig.toml");
    const Finished finished = run_unrig(directory, {"new", "rig", "--from", "impact-test", file, "--averages", std::to_string(blows), "-o", rig, "--force"});
    ASSERT_EQ(finished.status, 0) << finished.err;
    EXPECT_THAT(finished.err, IsEmpty());
    expect_truth(rig, 4.5, true);
    const Rig read = read_rig(rig);
    ASSERT_EQ(read.sensors.size(), 2u);
    EXPECT_NEAR(read.modal[1].sensor_shape[0], 0.5, 1e-3);
    EXPECT_NEAR(read.modal[1].sensor_shape[1], 1, 1e-9) << "of the driving point, wherever it stands in the file";
    // As recordings such functions are none; the list says what to do.
    const Finished listed = run_unrig(directory, {"import", file});
    EXPECT_THAT(listed.err + listed.out, HasSubstr("new rig --from impact-test"));
  }
}

TEST(NewFromFunctions, RefusesWhatIsNoResponse) {
  const TemporaryDirectory directory;
  std::vector<Estimate> estimates = analysed(9);
  const std::string good = table(estimates[0], "m/s^2/N", false, true);
  const auto said = [&](std::vector<std::string> words, int status) {
    words.insert(words.begin(), {"new", "rig", "--from", "impact-test"});
    words.insert(words.end(), {"-o", directory.path("rig.toml")});
    const Finished finished = run_unrig(directory, words);
    EXPECT_EQ(finished.status, status) << finished.out << finished.err;
    EXPECT_FALSE(std::filesystem::exists(directory.path("rig.toml")));
    return finished.err;
  };
  const auto file = [&](const std::string& name, const std::string& text) { return directory.file(name, text); };
  const auto changed = [](std::string text, const std::string& what, const std::string& by) { return text.replace(text.find(what), what.size(), by); };
  EXPECT_THAT(said({file("a.csv", changed(good, "frequency", "f"))}, 2), HasSubstr("a.csv:1: no column \"frequency\""));
  EXPECT_THAT(said({file("b.csv", changed(good, "imaginary", "im"))}, 2), HasSubstr("neither real and imaginary nor magnitude and phase"));
  EXPECT_THAT(said({file("c.csv", changed(good, "real [m/s^2/N]", "real"))}, 2), HasSubstr("real is in \"\""));
  EXPECT_THAT(said({file("d.csv", table(estimates[0], "banana/N", false, true))}, 2), HasSubstr("unknown unit"));
  EXPECT_THAT(said({file("e.csv", good.substr(0, 600))}, 2), HasSubstr("e.csv"));
  EXPECT_THAT(said({file("f.csv", changed(good, "4.000000,", "400.000000,"))}, 2), HasSubstr("wanted increasing frequencies"));
  estimates[0].coherence[5] = 1.2;
  EXPECT_THAT(said({file("g.csv", table(estimates[0], "m/s^2/N", false, true))}, 2), HasSubstr("a coherence of 1.2"));
  estimates[0].response = -estimates[0].response;
  estimates[0].coherence[5] = 0.9;
  EXPECT_THAT(said({file("h.csv", table(estimates[0], "m/s^2/N", false, true))}, 2), HasSubstr("every mode of \"h\" has a negative mass"));
  EXPECT_THAT(said({file("i.csv", table(estimates[1], "N/N", false, true)), file("j.csv", table(estimates[1], "V/N", false, true))}, 2), HasSubstr("wanted one gauge at most"));
  EXPECT_THAT(said({file("k.unv", "    -1\n   164\n  1  SI\n    -1\n")}, 2), HasSubstr("no dataset 58"));
  EXPECT_THAT(said({"--modes", "3"}, 2), HasSubstr("wanted it only beside frequency response functions"));
  EXPECT_EQ(run_unrig(directory, {"new", "rig", "--from", "tube", directory.path("a.csv")}).status, 2);
}

}  // namespace
}  // namespace unrig
