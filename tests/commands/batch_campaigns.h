#pragma once
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>
#include <string>

#include <fmt/format.h>

namespace unrig::test {

/// A rig known as one mode, and free decays of it: campaigns that take milliseconds.
inline void write_oscillator(const std::string& path) {
  std::ofstream(path) << "unrig_rig = 1\nname = \"oscillator\"\n[[modal]]\nmass = \"1 kg\"\nfrequency = \"7.7 Hz\"\ndamping_ratio = 0.01\ngauge_gain = \"1000 N/m\"\n";
}

/// The decay number `seed`: 2 s at 200 Hz with a noise of 0.02 N; its frequency is drawn within some per cent of the rig file's and returned [Hz].
inline double write_decay(const std::string& path, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const double frequency = 7.7 * (1 + 0.02 * normal(random)), omega = 2 * std::numbers::pi * frequency, ratio = 0.012;
  std::string text = "# unrig_run = 1\n# kind = \"pluck\"\n# medium = \"air\"\n# density = \"1.2 kg/m^3\"\n# speed = \"0 m/s\"\ntime [s],gauge [N]\n";
  for (int k = 0; k < 400; ++k) {
    const double t = 0.005 * k;
    text += fmt::format("{:.3f},{:.5f}\n", t, 20 * std::exp(-ratio * omega * t) * std::cos(omega * std::sqrt(1 - ratio * ratio) * t) + 0.02 * normal(random));
  }
  std::ofstream(path) << text;
  return frequency;
}

/// `rig.toml` and a folder for each of `count` campaigns, c0000 and so on, of one decay each; `campaigns.toml` names all of them in two lines.
inline void write_decays(const std::filesystem::path& folder, int count) {
  write_oscillator((folder / "rig.toml").string());
  for (int i = 0; i < count; ++i) {
    const std::filesystem::path own = folder / fmt::format("c{:04}", i);
    std::filesystem::create_directories(own);
    write_decay((own / "decay.csv").string(), static_cast<unsigned>(i));
  }
  std::ofstream(folder / "campaigns.toml") << "unrig_batch = 1\nrig = \"rig.toml\"\ncommands = [\"check\", \"fit\"]\n[[campaign]]\nfolder = \"c????\"\nruns = [\"*.csv\"]\n";
}

}  // namespace unrig::test
