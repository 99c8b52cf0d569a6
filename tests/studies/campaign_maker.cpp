#include "tests/studies/campaign_maker.h"

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/model/simulate.h"
#include "core/numerics/smooth_ramp.h"
#include "fit/trial/trial_campaign.h"
#include "tests/support/sample_data.h"

namespace unrig::studies {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using std::numbers::pi;

using Random = std::mt19937_64;

double between(Random& random, double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }
double near(Random& random, double value, double factor) { return value * std::exp(between(random, -std::log(factor), std::log(factor))); }

/// Noise of standard deviation 1.
class Noise {
 public:
  Noise(NoiseColour colour, double dt, Random& random) : random_(random), coloured_(colour == studies::NoiseColour::coloured) {
    if (coloured_) memory_ = std::exp(-2 * pi * near(random, 7, 3.5) * dt);
    state_ = normal_(random_);
  }
  VectorXd operator()(Index samples) {
    VectorXd noise(samples);
    for (double& x : noise) {
      if (coloured_) state_ = memory_ * state_ + std::sqrt(1 - memory_ * memory_) * normal_(random_);
      x = coloured_ ? std::sqrt(2.0 / 3) * state_ + std::sqrt(1.0 / 3) * normal_(random_) : normal_(random_);
    }
    return noise;
  }

 private:
  Random& random_;
  bool coloured_;
  double memory_ = 0, state_ = 0;
  std::normal_distribution<double> normal_;
};

void put(Run& run, const std::string& name, const std::string& unit, const VectorXd& value) { run.channels.push_back({name, unit, unit, 1, value, 0}); }

constexpr Index finer = 4;  // the rig answers on a grid finer than the recording's by this

/// What a kind of rig is recorded with.
struct Setting {
  double dt, seconds, speed, ramp;  // s, s, m/s, s
  double release;                   // N
};

Setting setting_of(RigKind kind) {
  switch (kind) {
    case RigKind::tow_tank: return {0.004, 4.0, 0.55, 0.08, 30};
    case RigKind::one_mode_cantilever:
    case RigKind::cantilever: return {0.002, 2.0, 1.5, 0.04, 60};
    case RigKind::oscillator: return {0.01, 10.0, 0, 0, 5};
    case RigKind::two_modes: return {0.005, 8.0, 0, 0, 5};
  }
  throw std::invalid_argument("no such rig");
}

Run bare_run(const std::string& name, const Setting& s, Random& random) {
  Run run;
  run.file = name + ".csv";
  run.name = name;
  run.dt = s.dt / finer;
  run.density = name.starts_with("dry") ? 1.2 : 998.2;
  run.kind = name.find("pluck") != std::string::npos ? RunKind::pluck : name.starts_with("step") ? RunKind::step : RunKind::forced;
  run.medium = name.starts_with("dry") ? "air" : "water";
  const auto samples = static_cast<Index>(std::lround(s.seconds / s.dt));
  const VectorXd t = VectorXd::LinSpaced(finer * samples, 0, s.dt * static_cast<double>(samples) - run.dt);
  if (run.kind == RunKind::step) {
    run.speed = near(random, s.speed, 1.2);
    const double first = between(random, 1, 4), step = between(random, 1, 3), begin = 0.25 * s.seconds, over = between(random, 0, 0.05);
    const double ramp = near(random, s.ramp, 1.3);
    const auto angle = [&](double time) {
      const double x = (time - begin) / ramp;
      return first + step * (smooth_ramp(x) + over * smooth_ramp(x) * (1 - smooth_ramp((x - 1) / 1.5)));
    };
    put(run, "alpha", "rad", t.unaryExpr(angle) * pi / 180);
  } else if (run.kind == RunKind::forced) {
    VectorXd force = VectorXd::Zero(t.size());  // a multisine over the modes
    for (int line = 0; line < 40; ++line) {
      const double f = between(random, 0.5, 0.12 / s.dt), phase = between(random, 0, 2 * pi);
      force += t.unaryExpr([&](double x) { return std::sin(2 * pi * f * x + phase); });
    }
    put(run, "force", "N", force / std::sqrt(20.0));
  } else {
    put(run, "alpha", "rad", VectorXd::Zero(t.size()));
  }
  return run;
}

/// True parameters of one campaign, before those of its runs.
VectorXd draw(const AeroelasticModel& model, Random& random) {
  VectorXd theta = model.start_values();
  for (std::size_t j = 0; j < model.parameters().size(); ++j) {
    const Parameter& p = model.parameters()[j];
    double& value = theta[static_cast<Index>(j)];
    if (p.name.ends_with("damping_ratio")) value = near(random, 0.015, 2);
    else if (p.name.ends_with(".damping")) value = near(random, p.start, 2);
    else if (p.name.ends_with("mount_participation")) continue;
    else if (!p.per_run) value = near(random, p.start, 1.2);
  }
  return theta;
}

}  // namespace

std::string CampaignRecipe::name() const {
  static const char* const rigs[] = {"tow-tank beam", "cantilever", "oscillator", "two modes", "cantilever of one mode"};
  std::string text = std::string(rigs[static_cast<int>(rig)]) + (noise == studies::NoiseColour::white ? ", white:" : ", coloured:");
  for (const std::string& run : runs) text += " " + run;
  return text;
}

std::vector<CampaignRecipe> all_recipes() {
  std::vector<CampaignRecipe> recipes;
  for (const NoiseColour noise : {studies::NoiseColour::white, studies::NoiseColour::coloured}) {
    for (const RigKind rig : {RigKind::tow_tank, RigKind::cantilever})
      for (const std::vector<std::string>& runs : {std::vector<std::string>{"dry_pluck", "wet_pluck", "step_a", "step_b"}, {"dry_pluck", "wet_pluck"}, {"wet_pluck", "step_a"}})
        recipes.push_back({rig, noise, runs});
    for (const RigKind rig : {RigKind::oscillator, RigKind::two_modes})
      for (const std::vector<std::string>& runs : {std::vector<std::string>{"pluck", "forced_a"}, {"forced_a", "forced_b"}, {"pluck"}})
        recipes.push_back({rig, noise, runs});
  }
  return recipes;
}

Rig rig_of(RigKind kind) {
  if (kind == RigKind::tow_tank) return read_rig(test::null_campaign("rig.toml"));
  Rig rig;
  rig.file = "rig.toml";
  if (kind == RigKind::oscillator) {
    rig.modal = {{2, 3, 0.015, 1000, "N"}};
    return rig;
  }
  if (kind == RigKind::two_modes) {
    rig.modal = {{2, 3, 0.015, 1000, "N"}, {0.7, 11, 0.02, 1500, "N"}};
    return rig;
  }
  // A uniform rod, EI 4000 N m^2, GJ 300 N m^2, clamped at its top; its lower half carries a section of 0.12 m chord.
  constexpr Index elements = 8;
  constexpr double length = 0.8, bending = 4000, twisting = 300, piece = length / elements;
  rig.chord = 0.12;
  rig.pitch_axis = 0.3;
  rig.station = VectorXd::LinSpaced(elements, piece / 2, length - piece / 2);
  rig.mass_centre = VectorXd::Zero(elements);
  rig.mass_centre.tail(elements / 2).setConstant(0.01);
  rig.normal.inertia = VectorXd::Constant(elements, 0.35);
  rig.torsion.inertia = VectorXd::Constant(elements, 1.5e-4);
  rig.normal.flexibility = rig.torsion.flexibility = Eigen::MatrixXd(elements, elements);
  for (Index i = 0; i < elements; ++i)
    for (Index j = 0; j < elements; ++j) {
      const double x = std::min(rig.station[i], rig.station[j]), y = std::max(rig.station[i], rig.station[j]);
      rig.normal.flexibility(i, j) = x * x * (3 * y - x) / (6 * bending);
      rig.torsion.flexibility(i, j) = x / twisting;
    }
  rig.normal.modes = kind == RigKind::one_mode_cantilever ? 1 : 2;
  rig.torsion.modes = 1;
  rig.rigid_from = elements;
  rig.submerged = {5, 6, 7, 8};
  rig.strip_length = piece;
  rig.gauge_element = 1;
  rig.calibration_element = 6;
  return rig;
}

double SimulatedCampaign::of(const FittedParameter& p) const { return truth.at(p.run.empty() ? p.name : p.name + " " + p.run); }

double combination_at(const std::function<double(const FittedParameter&)>& truth, const DeterminedCombination& c, const FitResult& result) {
  std::vector<double> values;
  for (const std::size_t unknown : c.unknowns) values.push_back(truth(result.parameters[unknown]));
  return c.at(values);
}

SimulatedCampaign simulate_campaign(const CampaignRecipe& recipe, unsigned seed) {
  Random random(seed);
  const Setting setting = setting_of(recipe.rig);
  SimulatedCampaign campaign;
  campaign.problem.rig = rig_of(recipe.rig);
  std::vector<Run> fine;
  for (const std::string& name : recipe.runs) fine.push_back(bare_run(name, setting, random));
  std::vector<Run> recorded;
  for (const Run& run : fine) recorded.push_back(every_nth(run, finer));
  const AeroelasticModel model = model_of(campaign.problem.rig, recorded, Wagner::within_1e4);
  const VectorXd theta = draw(model, random);
  for (std::size_t j = 0; j < model.parameters().size(); ++j)
    if (!model.parameters()[j].per_run) campaign.truth[model.parameters()[j].name] = theta[static_cast<Index>(j)];

  for (const Run& run : fine) {
    SimulateProblem problem{model, theta, run, PitchBetweenSamples::spline, {}, {}};
    if (run.kind == RunKind::pluck) problem.release_load = near(random, setting.release, 1.5);
    if (run.kind == RunKind::step) {
      const double slope = between(random, 5, 2 * pi), steady = between(random, 0.1, 0.4);
      problem.theta[model.index("normal_force_slope")] = campaign.truth["normal_force_slope " + run.file] = slope;
      problem.steady_normal_force = campaign.truth["steady_normal_force " + run.file] = steady;
    }
    Run measured = every_nth(simulate(problem).run, finer);
    std::erase_if(measured.channels, [](const Channel& c) { return c.name != "alpha" && c.name != "force" && c.name != "gauge"; });
    for (Channel& c : measured.channels) {
      if (c.name == "force") continue;
      Noise noise(recipe.noise, measured.dt, random);
      const double swing = std::sqrt((c.value.array() - c.value.mean()).square().mean());
      const double level = c.name == "alpha" ? 0.01 * pi / 180 : swing * near(random, 3e-3, 3);
      c.value += level * noise(c.value.size());
    }
    campaign.problem.runs.push_back(measured);
  }
  return campaign;
}

}  // namespace unrig::studies
