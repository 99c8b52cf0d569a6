// Do the bands of `unrig correct` hold what they say? Simulated runs with known load: everything that the bands claim to cover is drawn at random (gauge and
// angle noise, rig parameters within the covariance of a fit, calibration), and the load is looked for inside its bands.
//
// The truth is simulated at a quarter of the sampling interval from an angle that is a formula, with a circulation that may not be Wagner's.
//
//   correct_study [--trials N] [--seed S] [--threads T] [--only WORD] [--samples N]       table as Markdown on standard output; exit status 1 where coverage leaves its bounds

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <random>

#include "core/model/simulate.h"
#include "core/files/text_file.h"
#include "correct/correct.h"
#include "fit/fit.h"
#include "tests/studies/crew.h"
#include "tests/support/sample_data.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Truth {
  const char* name;
  IndicialFunction circulation;
};

IndicialFunction slow_separation() {
  IndicialFunction phi = wagner(Wagner::within_1e6);
  const Index n = phi.rate.size();
  phi.amplitude.conservativeResize(n + 2);
  phi.rate.conservativeResize(n + 2);
  phi.amplitude.tail(2) << -0.3, 0.3;
  phi.rate.tail(2) << 0.1, 0.5;
  return phi;
}

std::vector<Truth> truths() {
  // Elliptic wings of aspect ratio 3 and 6: R. T. Jones, NACA Report 681 (1940), normalised to 1 at infinity.
  return {{"Wagner", wagner(Wagner::within_1e6)},
          {"elliptic wing, aspect ratio 3", {"span 3", VectorXd::Constant(1, 0.283), VectorXd::Constant(1, 0.540)}},
          {"elliptic wing, aspect ratio 6", {"span 6", VectorXd::Constant(1, 0.361), VectorXd::Constant(1, 0.381)}},
          {"slow separation: Wagner + 0.3 (exp(-s/10) - exp(-s/2))", slow_separation()}};
}

struct Shaft {
  const char* name;
  double (*angle)(double t);  ///< rad, at rest before 1 s
};

double smooth(double x) { return x <= 0 ? 0 : x >= 1 ? 1 : x * x * x * (10 - 15 * x + 6 * x * x); }
double degrees(double x) { return x * std::numbers::pi / 180; }

double steps_in_turn(double t) {
  const double since = std::max(0.0, t - 1), step = std::floor(since / 1.9), risen = smooth((since - 1.9 * step) / 0.04);
  return degrees(1.3) * (std::fmod(step, 2) == 0 ? risen : 1 - risen);
}

/// Amplitudes fall with the frequency; phases by the golden angle, so that nothing repeats.
double arbitrary(double t) {
  constexpr double golden = 2.39996;
  double sum = 0;
  for (int i = 1; i <= 12; ++i) sum += std::sin(2 * std::numbers::pi * 0.41 * i * (t - 1) + golden * i * i) / i;
  return degrees(1.5) * smooth((t - 1) / 0.3) * sum;
}

std::vector<Shaft> shafts() {
  return {{"step of 1.3 deg in 40 ms, 5 % overshoot",
           [](double t) {
             const double since = t - 1.04;
             return degrees(1.3) * (smooth((t - 1) / 0.04) + (since > 0 ? 0.05 * smooth(since / 0.02) * std::exp(-since / 0.03) * std::sin(since / 0.008) : 0));
           }},
          {"ramp of 3 deg in 0.1 s", [](double t) { return degrees(3) * smooth((t - 1) / 0.1); }},
          {"nod of 3 deg within 0.1 s", [](double t) { return degrees(3) * smooth((t - 1) / 0.05) * smooth((1.1 - t) / 0.05); }},
          {"up and down by 2 deg, five times in 2.5 s",
           [](double t) { return t < 1 || t > 3.5 ? 0.0 : degrees(1) * smooth((t - 1) / 0.1) * smooth((3.5 - t) / 0.1) * (1 - std::cos(2 * std::numbers::pi * 2 * (t - 1))); }},
          {"sinusoid of 2 deg at 1.5 Hz to the end", [](double t) { return degrees(2) * smooth((t - 1) / 0.2) * std::sin(2 * std::numbers::pi * 1.5 * (t - 1)); }},
          {"arbitrary, twelve frequencies up to 5 Hz, to the end", &arbitrary},
          {"steps of 1.3 deg in 40 ms, up and down in turn every 1.9 s, to the end", &steps_in_turn}};
}

constexpr double gauge_noise = 0.027, calibration_error = 0.0001, dt = 0.002;  // the calibration so good that it does not hide the rest
constexpr Index finer = 4;
Index samples = 3000;  // of each run
const double angle_noise = degrees(0.01);

/// What one corrected run says about the bands.
struct Count {
  std::array<Index, 10> inside{}, all{};
  Index trials = 0, whole_load = 0, response_points = 0, response_inside = 0, whole_response = 0;
  double load_error = 0, early_error = 0, response_error = 0, per_radian_error = 0, trusted_from = 0;
};

class Chance {
 public:
  explicit Chance(std::seed_seq& seeds) : random_(seeds) {}
  VectorXd noise(double sigma, Index count) {
    VectorXd x(count);
    for (double& value : x) value = sigma * normal_(random_);
    return x;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

class Laboratory {
 public:
  Laboratory() : rig_(read_rig(test::null_campaign("rig.toml"))) {
    FitProblem problem;
    problem.rig = rig_;
    for (const char* run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(test::null_campaign(std::string(run) + ".csv")));
    const FitResult result = fit(problem);
    fit_.normal_modes = result.normal_modes;
    fit_.torsion_modes = result.torsion_modes;
    for (std::size_t i = 0; i < result.parameters.size(); ++i)
      if (result.parameters[i].run.empty()) chosen_.push_back(static_cast<Index>(i)), fit_.parameters.push_back(result.parameters[i]);
    fit_.correlation = result.correlation(chosen_, chosen_);
    slope_ = 5.86;
  }

  /// One run and what is counted in it; everything random in it comes from `seeds`.
  Count look(const Truth& truth, const Shaft& shaft, std::seed_seq seeds) const {
    Count count;
    Chance chance(seeds);
    const AeroelasticModel model(rig_, make_basis(rig_, fit_.normal_modes, fit_.torsion_modes), truth.circulation);
    Run run = quiet(shaft);
    VectorXd theta = theta_for(model, fit_, "");
    theta[model.index("normal_force_slope")] = slope_;
    const SimulateResult simulated = simulate({model, theta, run, PitchBetweenSamples::spline, std::nullopt, 0.2});
    const Eigen::VectorXi coarse = Eigen::VectorXi::LinSpaced(samples, 0, static_cast<int>(finer * (samples - 1)));
    const VectorXd load = simulated.run.channel("circulatory").value(coarse);
    run.dt = dt;
    run.channels.front().value = run.channels.front().value(coarse).eval() + chance.noise(angle_noise, samples);
    run.channels.push_back({"gauge", "N", "N", 1, (1 + chance.noise(calibration_error, 1)[0]) * simulated.run.channel("gauge").value(coarse) + chance.noise(gauge_noise, samples), 0});

    const CorrectResult result = correct({rig_, drawn(chance), run, calibration_error});
    const VectorXd off = (result.circulatory.value - load).cwiseAbs();
    bool whole = true;
    for (Index k = 0; k < samples; ++k) {
      const auto tenth = static_cast<std::size_t>(10 * k / samples);
      ++count.all[tenth];
      count.inside[tenth] += off[k] < 1.96 * result.circulatory.std[k] ? 1 : 0;
      whole = whole && off[k] < result.circulatory.simultaneous * result.circulatory.std[k];
    }
    ++count.trials;
    count.whole_load += whole ? 1 : 0;
    const double range = load.maxCoeff() - load.minCoeff();
    const auto first = static_cast<Index>((1 + 0.5 / result.semichords_per_second) / dt), last = static_cast<Index>((1 + 8 / result.semichords_per_second) / dt);
    count.early_error += off.segment(first, last - first).squaredNorm() / static_cast<double>(last - first) / (range * range);
    count.load_error += off.squaredNorm() / static_cast<double>(samples) / (range * range);
    look_at_response(truth, result.indicial, count);
    return count;
  }

 private:
  void look_at_response(const Truth& truth, const IndicialResponse& response, Count& count) const {
    bool whole = true;
    double sum = 0, per_radian = 0;
    Index points = 0;
    for (Index i = 0; i < response.value.size(); ++i) {
      const double off = std::abs(response.value[i] - truth.circulation(response.semichords[i])), deviation = response.uncertainty.std[i];
      whole = whole && off < response.uncertainty.simultaneous * deviation;
      if (response.semichords[i] < 0.5) continue;
      ++points;
      sum += off * off;
      per_radian += std::pow(response.per_radian[i] / slope_ - truth.circulation(response.semichords[i]), 2);
      count.response_inside += off < 1.96 * deviation ? 1 : 0;
    }
    count.response_points += points;
    count.response_error += sum / static_cast<double>(points);
    count.per_radian_error += per_radian / static_cast<double>(points);
    count.whole_response += whole ? 1 : 0;
    count.trusted_from += std::min(response.trusted_from, 100.0);
  }

  Run quiet(const Shaft& shaft) const {
    Run run;
    run.file = "simulated.csv";
    run.medium = "water";
    run.density = 998.2;
    run.speed = 0.6096;
    run.dt = dt / finer;
    VectorXd angle(finer * samples);
    for (Index k = 0; k < angle.size(); ++k) angle[k] = degrees(2) + shaft.angle(run.time(k));
    run.channels.push_back({"alpha", "rad", "rad", 1, angle, 0});
    return run;
  }

  /// The fit as it might have come out.
  FittedRig drawn(Chance& chance) const {
    FittedRig fit = fit_;
    const VectorXd free = chance.noise(1, fit_.correlation.rows()), move = fit_.correlation.llt().matrixL() * free;
    for (std::size_t i = 0; i < fit.parameters.size(); ++i)
      if (fit.parameters[i].std_error > 0) fit.parameters[i].value += fit.parameters[i].std_error * move[static_cast<Index>(i)];
    return fit;
  }

  Rig rig_;
  FittedRig fit_;
  std::vector<Index> chosen_;
  double slope_ = 0;
};

double share(Index part, Index whole) { return 100 * static_cast<double>(part) / static_cast<double>(whole); }

/// One line of the table.
void print(const std::string& name, const Count& c) {
  Index inside = 0, all = 0;
  double worst = 100;
  for (std::size_t i = 0; i < c.all.size(); ++i) inside += c.inside[i], all += c.all[i], worst = std::min(worst, share(c.inside[i], c.all[i]));
  const auto n = static_cast<double>(c.trials);
  fmt::print("| {} | {:.1f} | {:.1f} | {:.0f} | {:.2f} | {:.2f} | {:.1f} | {:.0f} | {:.4f} | {:.4f} | {:.2f} |\n", name, share(inside, all), worst, share(c.whole_load, c.trials),
             100 * std::sqrt(c.load_error / n), 100 * std::sqrt(c.early_error / n), share(c.response_inside, c.response_points), share(c.whole_response, c.trials), std::sqrt(c.response_error / n), std::sqrt(c.per_radian_error / n), c.trusted_from / n);
  std::fflush(stdout);
}

void add(const Count& one, Count& sum) {
  for (std::size_t i = 0; i < one.all.size(); ++i) sum.inside[i] += one.inside[i], sum.all[i] += one.all[i];
  sum.trials += one.trials, sum.whole_load += one.whole_load, sum.whole_response += one.whole_response;
  sum.response_points += one.response_points, sum.response_inside += one.response_inside;
  sum.load_error += one.load_error, sum.early_error += one.early_error, sum.response_error += one.response_error, sum.per_radian_error += one.per_radian_error, sum.trusted_from += one.trusted_from;
}

/// 0 where the pooled coverage is 93 to 97 % and no tenth of the record is below 85 %, both within what chance does to so few runs.
int judge(const Count& c) {
  // Errors of a run hang together: it counts for about three independent numbers, so that the pooled share scatters by sqrt(0.05 0.95 / (3 trials)).
  const double chance = 300 * std::sqrt(0.05 * 0.95 / (3 * static_cast<double>(c.trials))), chance_tenth = 300 * std::sqrt(0.15 * 0.85 / static_cast<double>(c.trials));
  Index inside = 0, all = 0;
  bool good = true;
  for (std::size_t i = 0; i < c.all.size(); ++i) {
    inside += c.inside[i], all += c.all[i];
    good = good && share(c.inside[i], c.all[i]) > 85 - chance_tenth;
  }
  return good && share(inside, all) > 93 - chance && share(inside, all) < 97 + chance ? 0 : 1;
}

}  // namespace
}  // namespace unrig

int main(int argc, char** argv) {
  CLI::App app{"Coverage of the bands of `unrig correct`, by simulation."};
  int trials = 2, threads = 1;
  std::uint32_t seed = 1;
  std::string only;
  app.add_option("--trials", trials, "runs per truth and motion")->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "of the random numbers");
  app.add_option("--threads", threads, "at work")->check(CLI::PositiveNumber);
  app.add_option("--only", only, "lines whose name has this in it");
  app.add_option("--samples", unrig::samples, "of each run")->check(CLI::Range(1500, 1000000));
  CLI11_PARSE(app, argc, argv);

  const unrig::Laboratory laboratory;
  const std::vector<unrig::Truth> truths = unrig::truths();
  const std::vector<unrig::Shaft> shafts = unrig::shafts();
  struct Job {
    std::size_t truth, shaft;
    int trial;
  };
  std::vector<Job> jobs;
  std::vector<unrig::Count> lines(truths.size() * shafts.size());
  const auto name_of = [&](std::size_t line) { return std::string(truths[line / shafts.size()].name) + "; " + shafts[line % shafts.size()].name; };
  for (std::size_t line = 0; line < lines.size(); ++line)
    for (int i = 0; i < trials && name_of(line).find(only) != std::string::npos; ++i) jobs.push_back({line / shafts.size(), line % shafts.size(), i});

  std::mutex counting;
  unrig::studies::each(static_cast<int>(jobs.size()), threads, [&](int j) {
    const Job& job = jobs[static_cast<std::size_t>(j)];
    const unrig::Count count = laboratory.look(truths[job.truth], shafts[job.shaft], {seed, static_cast<std::uint32_t>(job.truth), static_cast<std::uint32_t>(job.shaft), static_cast<std::uint32_t>(job.trial)});
    const std::lock_guard guard(counting);
    unrig::add(count, lines[job.truth * shafts.size() + job.shaft]);
  });

  fmt::print("| truth; motion | load: inside its 95 % band, % | worst tenth of the record, % | whole load inside, % of runs | r.m.s. error, % of the load's range | the same from 0.5 to 8 semichords | response from 0.5 "
             "semichords: inside, % | whole response inside, % of runs | r.m.s. error | the same per radian, over the slope | known to 5 % from, semichords |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  unrig::Count pooled;
  for (std::size_t line = 0; line < lines.size(); ++line) {
    if (lines[line].trials == 0) continue;
    unrig::print(name_of(line), lines[line]);
    unrig::add(lines[line], pooled);
  }
  unrig::print("**all**", pooled);
  return unrig::judge(pooled);
}
