#include "fit/trial/hidden_law.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/effects/effect.h"
#include "core/files/error.h"
#include "core/model/simulate.h"
#include "fit/trial/trial_campaign.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using Random = std::mt19937_64;

constexpr Effect::Band force_size{0.02, 0.3}, exponent{0.5, 4}, corner_place{0.2, 1}, time_constant{0.02, 0.2};
constexpr double softest = 0.7;  // of the stiffness: beyond it a spring that pushes makes a rig with several places of rest

/// Other ranges than the usual ones, in the same counts.
struct Exception {
  std::string_view law, parameter;
  Effect::Band range;
};
constexpr std::array exceptions{
    // With a lower power an even force has its own place of rest beside nought.
    Exception{"spring with an even power", "p", {1.2, 4}}, Exception{"twist with an even power", "p", {1.2, 4}},
    // A corner at the end of the reach is never met.
    Exception{"spring on one side", "s", {0.2, 0.8}}, Exception{"spring on the other side", "s", {0.2, 0.8}}, Exception{"spring behind a gap", "s", {0.2, 0.8}},
    Exception{"pull across two gaps", "g", {1.5, 4}},  // the gap closes at 1
    Exception{"dry friction", "s", {0.01, 0.5}}, Exception{"torsional friction", "s", {0.01, 0.5}}, Exception{"friction of Stribeck", "s", {0.05, 0.5}}, Exception{"friction of Stribeck", "r", {0.2, 3}},
    Exception{"hysteresis of Bouc and Wen", "b", {0.2, 0.8}}, Exception{"spring and damper in series", "tau", {0.002, 0.05}},
    Exception{"spring with two corners", "s", {0.1, 0.4}}, Exception{"spring with two corners", "q", {0.5, 0.8}}, Exception{"stiffness that remembers", "tau", {0.02, 0.1}}, Exception{"damping in bands", "s", {0.15, 0.4}},
};

/// What would drive the rig without end if it had the other sign.
struct Damps {
  std::string_view law, parameter;
};
constexpr std::array damps{Damps{"damping with the amplitude", "c"}, Damps{"damping that changes with time", "c"}, Damps{"curve of the velocity", "c3"}, Damps{"curve of the velocity", "c5"}, Damps{"curve of the velocity", "c7"}};

/// A law that no line of the dictionary can say.
struct Outside {
  const char* name;
  const char* force;
  const char* memory;
  std::vector<std::pair<const char*, const char*>> parameters;  // name and unit
  std::vector<Symbol> scaled;
};

std::vector<Outside> outside_laws() {
  using enum Symbol;
  return {
      {"drag that grows with the square of the displacement", "-c * x^2 * v * abs(v)", "", {{"c", "N"}}, {x, v}},
      {"ratchet", "-f * abs(sin(x / s))", "", {{"f", "N"}, {"s", "m"}}, {}},
      {"logarithmic damping", "-f * sign(v) * log(1 + abs(v) / s)", "", {{"f", "N"}, {"s", "m/s"}}, {}},
      {"exponential stiffening", "-f * (exp(x / s) - exp(-x / s))", "", {{"f", "N"}, {"s", "m"}}, {}},
      {"friction that grows with the displacement", "-f * abs(x) * tanh(v / s)", "", {{"f", "N/m"}, {"s", "m/s"}}, {}},
      {"spring with two corners", "-k * (max(0, x - s) - max(0, x - q))", "", {{"k", "N/m"}, {"s", "m"}, {"q", "m"}}, {}},
      {"damping in bands", "-c * v * sin(x / s)^2", "", {{"c", "N"}, {"s", "m"}}, {v}},
      {"stiffness that remembers", "-f * x * z", "(abs(x) - z) / tau", {{"f", "N"}, {"tau", "s"}}, {x}},
  };
}

double scale_of(Symbol symbol, const Reach& r) { return symbol == Symbol::x ? r.x : symbol == Symbol::v ? r.v : 1; }

Law law_of(const Outside& one, const Reach& r) {
  Law law;
  law.name = one.name;
  law.force_text = one.force;
  law.memory_text = one.memory;
  if (!law.memory_text.empty()) law.memory.emplace();
  law.scales.fill(1);
  for (const Symbol s : one.scaled) law.scales[index_of(s)] = scale_of(s, r);
  for (const auto& [name, unit] : one.parameters) law.parameters.push_back({name, unit, 1, 0, 1e30, false, ""});
  return parse_law(law_text(law), "the laws of a trial");
}

/// Sizes stand in front of a force, which is linear in all of them together.
bool is_size(const Parameter& p) { return p.unit == "N" || p.unit == "N.m" || p.unit == "N/m"; }

/// One of what a parameter is counted in, in SI.
double one_of(const Parameter& p, const Reach& r) {
  if (p.unit == "N") return r.force;
  if (p.unit == "N.m") return r.moment;
  if (p.unit == "N/m") return r.force / r.x;
  if (p.unit == "m") return r.x;
  if (p.unit == "m/s") return r.v;
  if (p.unit == "rad/s") return r.twist_rate;
  if (p.unit == "rad") return r.twist;
  return p.unit == "s" ? r.seconds : 1;
}

Effect::Band range_of(const Law& form, const Parameter& p) {
  for (const Exception& e : exceptions)
    if (e.law == form.name && e.parameter == p.name) return e.range;
  return p.unit == "1" ? exponent : p.unit == "s" ? time_constant : corner_place;
}

bool either_sign(const Law& form, const Parameter& p) {
  return p.lower < 0 && std::none_of(damps.begin(), damps.end(), [&](const Damps& d) { return d.law == form.name && d.parameter == p.name; });
}

/// What a law does where the runs take the rig.
struct Acts {
  double force = 0;   // largest
  double pushes = 0;  // largest slope in the displacement, or in the twist
};

Acts acts(const Law& law, const Reached& reached) {
  std::vector<double> values, partial(law.parameters.size());
  for (const Parameter& p : law.parameters) values.push_back(p.start);
  std::array<double, symbol_count> slope{};
  const bool twists = law.acts_on == ActsOn::torsion;
  const std::size_t place = index_of(twists ? Symbol::twist : Symbol::x);
  Acts most;
  for (std::size_t r = 0; r < reached.symbols.size(); ++r) {
    const double still = law.uses(Symbol::t) ? 0 : law.force(reached.rest[r].data(), values.data(), slope.data(), partial.data());
    RowVectorXd nearly = reached.rest[r];  // where the slope of a low power is steepest
    nearly[static_cast<Index>(place)] = 1e-4 * (twists ? reached.reach.twist : reached.reach.x);
    law.force(nearly.data(), values.data(), slope.data(), partial.data());
    most.pushes = std::max(most.pushes, slope[place]);
    double z = 0;
    for (const auto& sample : reached.symbols[r].rowwise()) {
      RowVectorXd symbols = sample;
      symbols[static_cast<Index>(index_of(Symbol::z))] = z;
      most.force = std::max(most.force, std::abs(law.force(symbols.data(), values.data(), slope.data(), partial.data()) - still));
      most.pushes = std::max(most.pushes, slope[place]);
      if (law.memory) z += reached.dt * (*law.memory)(symbols.data(), values.data(), slope.data(), partial.data());
    }
  }
  if (law.acts_on == ActsOn::lift) most.force *= static_cast<double>(reached.strips);
  return most;
}

void draw_shape(Law& law, const Reach& reach, Random& random) {
  const bool several = std::count_if(law.parameters.begin(), law.parameters.end(), is_size) > 1;
  for (Parameter& p : law.parameters) {
    const double one = one_of(p, reach);
    if (!is_size(p)) {
      const auto [low, high] = range_of(law, p);
      p.start = std::clamp(one * log_between(random, low, high), p.lower, p.upper);
      continue;
    }
    constexpr double least_share = 0.1;  // of the coefficients of a curve
    const bool negative = std::bernoulli_distribution(0.5)(random) && either_sign(law, p);
    p.start = (negative ? -one : one) * (several ? log_between(random, least_share, 1) : 1);
  }
}

/// Columns of what laws look at; no run of a user has such a name.
constexpr std::array sensed{std::pair{Symbol::x, "laws:x"}, std::pair{Symbol::v, "laws:v"}, std::pair{Symbol::a, "laws:a"}, std::pair{Symbol::twist, "laws:twist"}, std::pair{Symbol::twist_rate, "laws:twist_rate"}};

Rig with_sensors_of_laws(Rig rig) {
  constexpr std::array kinds{SensorKind::displacement, SensorKind::velocity, SensorKind::acceleration, SensorKind::twist, SensorKind::twist_rate};
  constexpr std::array units{"m", "m/s", "m/s^2", "rad", "rad/s"};
  for (std::size_t k = 0; k < sensed.size(); ++k) rig.sensors.push_back({sensed[k].second, kinds[k], k < 3 ? rig.calibration_element : rig.submerged.back(), 1, units[k]});
  return rig;
}

/// Symbols of one simulated run; `rest`: before it begins. x, v, a and twist count from there; a pluck is let go away from it.
MatrixXd symbols_of(const Run& run, RowVectorXd& rest) {
  const VectorXd& theta = run.channel("alpha").value;
  rest = RowVectorXd::Zero(symbol_count);
  rest[static_cast<Index>(index_of(Symbol::theta))] = theta[0];
  rest[static_cast<Index>(index_of(Symbol::alpha))] = theta[0];
  rest[static_cast<Index>(index_of(Symbol::U))] = run.speed;
  MatrixXd symbols = rest.replicate(theta.size(), 1);
  const auto column = [&](Symbol s) { return symbols.col(static_cast<Index>(index_of(s))); };
  for (const auto& [symbol, name] : sensed) {
    const VectorXd& value = run.channel(name).value;
    column(symbol) = value.array() - (run.kind == RunKind::pluck ? 0 : value[0]);
  }
  column(Symbol::theta) = theta;
  column(Symbol::theta_rate).tail(theta.size() - 1) = (theta.tail(theta.size() - 1) - theta.head(theta.size() - 1)) / run.dt;
  column(Symbol::alpha) = run.speed > 0 ? VectorXd(theta + column(Symbol::twist)) : VectorXd::Zero(theta.size());
  column(Symbol::t) = VectorXd::LinSpaced(theta.size(), 0, run.dt * static_cast<double>(theta.size() - 1));
  return symbols;
}

}  // namespace

Reached reached_by(const Rig& rig, const std::vector<PlannedRun>& runs, const std::optional<VectorXd>& truth) {
  const AeroelasticModel model = whole_model(with_sensors_of_laws(rig), runs);
  Reached reached;
  Reach& reach = reached.reach;
  for (const PlannedRun& planned : runs) {
    const Run run = simulate(problem_of(model, truth ? *truth : model.start_values(), planned)).run;
    reached.symbols.push_back(symbols_of(run, reached.rest.emplace_back()));
    reached.dt = std::max(reached.dt, run.dt);
    const auto most = [&](Symbol s) { return reached.symbols.back().col(static_cast<Index>(index_of(s))).cwiseAbs().maxCoeff(); };
    for (const auto& [symbol, largest] : {std::pair{Symbol::x, &reach.x}, {Symbol::v, &reach.v}, {Symbol::twist, &reach.twist}, {Symbol::twist_rate, &reach.twist_rate}, {Symbol::alpha, &reach.alpha}, {Symbol::t, &reach.seconds}})
      *largest = std::max(*largest, most(symbol));
  }
  reached.strips = static_cast<Index>(rig.submerged.size());
  if (reach.x > 0) reach.a = reach.v * reach.v / reach.x;
  reach.force = first_mode_momentum(model) * reach.v;
  const Basis& basis = model.basis();
  if (basis.torsion_modes > 0 && reach.twist > 0) reach.moment = std::pow(reach.twist_rate / basis.twist(rig.submerged.back() - 1, basis.normal_modes), 2) / reach.twist;
  return reached;
}

std::vector<Law> laws_to_hide(const Rig& rig, const Reached& reached, bool outside) {
  std::vector<Law> laws;
  if (outside)
    for (const Outside& one : outside_laws()) laws.push_back(law_of(one, reached.reach));
  else
    for (Form& form : dictionary(rig, reached.reach)) laws.push_back(std::move(form.law));
  const auto moved = [&](Symbol s) { return std::any_of(reached.symbols.begin(), reached.symbols.end(), [&](const MatrixXd& run) { return !run.col(static_cast<Index>(index_of(s))).isZero(0); }); };
  std::erase_if(laws, [&](const Law& law) {
    for (std::size_t s = 0; s < symbol_count; ++s)
      if (static_cast<Symbol>(s) != Symbol::z && law.uses(static_cast<Symbol>(s)) && !moved(static_cast<Symbol>(s))) return true;
    return false;
  });
  return laws;
}

double largest_force(const Law& law, const Reached& reached) { return acts(law, reached).force; }

Law draw_law(const Law& form, const Reached& reached, Random& random) {
  const Reach& reach = reached.reach;
  const bool twists = form.acts_on == ActsOn::torsion;
  const double holds = twists ? reach.moment : reach.force, stiffness = holds / (twists ? reach.twist : reach.x);
  constexpr int most_draws = 1000;
  for (int draw = 0; draw < most_draws; ++draw) {
    Law law = form;
    draw_shape(law, reach, random);
    const double wanted = holds * log_between(random, force_size.first, force_size.second);
    const double times = wanted / acts(law, reached).force;
    if (!std::isfinite(times)) continue;  // nothing in these runs moves it
    for (Parameter& p : law.parameters)
      if (is_size(p)) p.start *= times;
    if (law.acts_on != ActsOn::lift && acts(law, reached).pushes > softest * stiffness) continue;
    return parse_law(law_text(law), "the laws of a trial");
  }
  throw InputError({"--law", 0}, "the law \"" + form.name + "\"", "wanted runs that move what it looks at", "");
}

}  // namespace unrig
