#include "fit/laws/dictionary.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/law/law_effect.h"

namespace unrig {
namespace {

using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

/// What a parameter is counted in.
enum class In { number, force, moment, x, v, twist, twist_rate, seconds, force_per_x, moment_per_twist };

struct FormParameter {
  const char* name;
  In in;
  std::vector<double> starts;
  double lower = -INFINITY, upper = INFINITY;
  bool scanned = true;  // false: the rig's own damping makes its change good
};

/// One line of the dictionary. Symbols that have a scale there are divided by what the runs reach.
struct Line {
  const char* name;
  ActsOn acts_on;
  const char* force;
  const char* memory;
  std::vector<FormParameter> parameters;
  std::vector<Symbol> scaled;
  const char* listed = "";
  int power = 0;  // of its symbol's scale, per which that effect counts its first parameter
};

constexpr double little = 0.02, more = 0.1;  // of the force that the runs reach: starts, between which a search finds its way

std::vector<Line> lines() {
  using enum Symbol;
  const FormParameter either{"c", In::force, {little, -little}}, damped{"c", In::force, {little}, 0}, falling{"c", In::force, {little, -little}};
  const auto power = [](double start, double lower = 0.1) { return FormParameter{"p", In::number, {start}, lower, 8}; };
  const FormParameter gap{"s", In::x, {0.2, 0.6}, 0, 1};
  std::vector<Line> all{
      {"spring with a power", ActsOn::normal, "-c * abs(x)^p * sign(x)", "", {either, power(3)}, {x}},
      {"spring with an even power", ActsOn::normal, "-c * abs(x)^p", "", {either, power(2)}, {x}},
      {"spring on one side", ActsOn::normal, "-k * max(0, x - s)", "", {{"k", In::force_per_x, {more}}, gap}, {}},
      {"spring on the other side", ActsOn::normal, "-k * min(0, x + s)", "", {{"k", In::force_per_x, {more}}, gap}, {}},
      {"spring behind a gap", ActsOn::normal, "-k * (max(0, x - s) + min(0, x + s))", "", {{"k", In::force_per_x, {more, -more}}, gap}, {}},
      {"spring that saturates", ActsOn::normal, "-f * tanh(x / s)", "", {{"f", In::force, {more, -more}}, {"s", In::x, {0.4}, 0.02, 20}}, {}},
      {"spring with a sine", ActsOn::normal, "-f * sin(x / s)", "", {{"f", In::force, {more, -more}}, {"s", In::x, {0.7}, 0.05, 20}}, {}},
      {"pull across two gaps", ActsOn::normal, "f * ((1 - x / g)^(-2) - (1 + x / g)^(-2))", "", {{"f", In::force, {more, -more}}, {"g", In::x, {2.5}, 1.2, 30}}, {}},
      {"damping with a power", ActsOn::normal, "-c * abs(v)^p * sign(v)", "", {damped, power(2, 0.05)}, {v}},
      {"damping with an even power", ActsOn::normal, "-c * abs(v)^p", "", {either, power(2)}, {v}},
      {"damping with the amplitude", ActsOn::normal, "-c * abs(x)^p * v", "", {falling, power(2)}, {x, v}},
      {"damping of van der Pol", ActsOn::normal, "c * (1 - (x / s)^2) * v", "", {damped, {"s", In::x, {1}, 0.02, 20, false}}, {v}},
      {"spring with the speed squared", ActsOn::normal, "-c * x * v^2", "", {either}, {x, v}},
      {"dry friction", ActsOn::normal, "-f * tanh(v / s)", "", {{"f", In::force, {little}, 0}, {"s", In::v, {0.02}, 1e-3, 2}}, {}, "coulomb-friction"},
      {"friction of Stribeck", ActsOn::normal, "-f * (1 + r * exp(-abs(v) / s)) * tanh(v / (0.1 * s))", "", {{"f", In::force, {little}, 0}, {"r", In::number, {0.3}, -1, 10}, {"s", In::v, {0.05}, 5e-3, 2}}, {}},
      {"hysteresis of Bouc and Wen", ActsOn::normal, "-f * z", "v / xy * (1 - abs(z)^n * (b + (1 - abs(b)) * sign(v * z)))", {{"f", In::force, {more}, 0}, {"xy", In::x, {0.2, 0.05}, 1e-3, 3}, {"b", In::number, {0.5}, -1, 1}, {"n", In::number, {1}, 0.5, 4}}, {}, "bouc-wen"},
      {"spring and damper in series", ActsOn::normal, "-f * z", "v - z / tau", {{"f", In::force, {10 * more}, 0}, {"tau", In::seconds, {0.01, 0.1}, 1e-4, 1}}, {v}},
      {"mass with a power of the amplitude", ActsOn::normal, "-c * abs(x)^p * a", "", {either, power(2)}, {x, a}},
      {"stiffness that changes with time", ActsOn::normal, "-c * x * (1 - exp(-t / tau))", "", {either, {"tau", In::seconds, {0.1, 0.5}, 0.003, 30}}, {x}},
      {"damping that changes with time", ActsOn::normal, "-c * v * (1 - exp(-t / tau))", "", {either, {"tau", In::seconds, {0.1, 0.5}, 0.003, 30}}, {v}},
      {"stiffness that changes with the shaft's angle", ActsOn::normal, "-c * x * theta", "", {either}, {x}},
      {"stiffness that changes with the speed", ActsOn::normal, "-c * x * U^2", "", {either}, {x}},
      {"twist with a power", ActsOn::torsion, "-c * abs(twist)^p * sign(twist)", "", {{"c", In::moment, {little, -little}}, power(3)}, {twist}},
      {"twist with an even power", ActsOn::torsion, "-c * abs(twist)^p", "", {{"c", In::moment, {little, -little}}, power(2)}, {twist}},
      {"torsional damping with a power", ActsOn::torsion, "-c * abs(twist_rate)^p * sign(twist_rate)", "", {{"c", In::moment, {little}, 0}, power(2, 0.05)}, {twist_rate}},
      {"torsional friction", ActsOn::torsion, "-f * tanh(twist_rate / s)", "", {{"f", In::moment, {little}, 0}, {"s", In::twist_rate, {0.02}, 1e-3, 2}}, {}},
      {"lift that bends", ActsOn::lift, "-c * U^2 * abs(alpha)^p * sign(alpha)", "", {{"c", In::force, {0.01, -0.01}}, power(3)}, {alpha, U}},
      {"curve of the displacement", ActsOn::normal, "-(c2 * x^2 + c3 * x^3 + c4 * x^4 + c5 * x^5 + c7 * x^7)", "", {{"c2", In::force, {1e-4}}, {"c3", In::force, {little, -little}}, {"c4", In::force, {1e-4}}, {"c5", In::force, {1e-4}}, {"c7", In::force, {1e-4}}}, {x}},
      {"curve of the velocity", ActsOn::normal, "-(c2 * v^2 + c3 * v^3 + c4 * v^4 + c5 * v^5 + c7 * v^7)", "", {{"c2", In::force, {1e-4}}, {"c3", In::force, {little, -little}}, {"c4", In::force, {1e-4}}, {"c5", In::force, {1e-4}}, {"c7", In::force, {1e-4}}}, {v}},
  };
  return all;
}

/// Laws of the list as formulas, beside those of the lines above that are on it.
std::vector<Line> listed_lines() {
  using enum Symbol;
  const FormParameter either{"c", In::force, {little, -little}};
  std::vector<Line> all{
      {"cubic stiffness", ActsOn::normal, "-c * x^3", "", {either}, {x}, "cubic-stiffness", 3},
      {"cubic damping", ActsOn::normal, "-c * v^3", "", {{"c", In::force, {little}, 0}}, {v}, "cubic-damping", 3},
      {"gap in the torsional drive", ActsOn::torsion, "k * max(-s, min(s, twist))", "", {{"s", In::twist, {0.1}, 0, 1}, {"k", In::moment_per_twist, {more}, 0}}, {}, "freeplay"},
  };
  for (Line& line : lines())
    if (*line.listed != 0) all.push_back(std::move(line));
  return all;
}

struct Count {
  double size;
  const char* unit;
};

/// One of what a parameter is counted in, in SI.
Count one_of(In in, const Reach& r) {
  switch (in) {
    case In::force: return {r.force, "N"};
    case In::moment: return {r.moment, "N.m"};
    case In::x: return {r.x, "m"};
    case In::v: return {r.v, "m/s"};
    case In::twist: return {r.twist, "rad"};
    case In::twist_rate: return {r.twist_rate, "rad/s"};
    case In::seconds: return {r.seconds, "s"};
    case In::force_per_x: return {r.force / r.x, "N/m"};
    case In::moment_per_twist: return {r.moment / r.twist, "N.m/rad"};
    case In::number: break;
  }
  return {1, "1"};
}

double scale_of(Symbol symbol, const Reach& r) {
  switch (symbol) {
    case Symbol::x: return r.x;
    case Symbol::v: return r.v;
    case Symbol::a: return r.a;
    case Symbol::twist: return r.twist;
    case Symbol::twist_rate: return r.twist_rate;
    case Symbol::alpha: return r.alpha;
    default: return 1;
  }
}

/// Whether the runs move what the law looks at.
bool moved(const Line& line, const Reach& r) {
  if (line.acts_on == ActsOn::torsion) return r.twist > 0 && r.moment > 0;
  if (line.acts_on == ActsOn::lift) return r.alpha > 0;
  return r.x > 0 && r.force > 0;
}

Form put(const Line& line, const Reach& r) {
  Form form;
  form.listed = line.listed;
  Law law;
  law.name = line.name;
  law.acts_on = line.acts_on;
  law.force_text = line.force;
  law.memory_text = line.memory;
  if (!law.memory_text.empty()) law.memory.emplace();
  law.scales.fill(1);
  for (const Symbol s : line.scaled) law.scales[static_cast<std::size_t>(s)] = rounded(scale_of(s, r));
  std::vector<VectorXd> starts{VectorXd::Zero(static_cast<Eigen::Index>(line.parameters.size()))};
  for (std::size_t k = 0; k < line.parameters.size(); ++k) {
    const FormParameter& p = line.parameters[k];
    const Count one = one_of(p.in, r);
    law.parameters.push_back({p.name, one.unit, rounded(p.starts.front() * one.size), std::isfinite(p.lower) ? rounded(p.lower * one.size) : -1e30, std::isfinite(p.upper) ? rounded(p.upper * one.size) : 1e30, false, ""});
    std::vector<VectorXd> each;
    for (const double start : p.starts)
      for (VectorXd values : starts) {
        values[static_cast<Eigen::Index>(k)] = rounded(start * one.size);
        each.push_back(std::move(values));
      }
    starts = std::move(each);
  }
  form.law = parse_law(law_text(law), "the dictionary of laws");
  if (line.power != 0) form.per_coefficient = std::pow(form.law.scales[static_cast<std::size_t>(line.scaled.front())], -line.power);
  for (const FormParameter& p : line.parameters)
    for (std::size_t i = 0; i < form.law.parameters.size(); ++i)
      if (form.law.parameters[i].name == p.name) {
        form.listed_order.push_back(static_cast<Eigen::Index>(i));
        if (!p.scanned) form.stays.push_back(static_cast<Eigen::Index>(i));
      }
  // The reader has sorted parameters as the formulas name them.
  for (const VectorXd& values : starts) {
    VectorXd sorted(values.size());
    for (std::size_t k = 0; k < line.parameters.size(); ++k) sorted[form.listed_order[k]] = values[static_cast<Eigen::Index>(k)];
    form.starts.push_back(std::move(sorted));
  }
  return form;
}

}  // namespace

double rounded(double value) { return value == 0 || !std::isfinite(value) ? value : std::stod(fmt::format("{:.3g}", value)); }

Reach reach_of(const BesideUnknownForces& beside) {
  const JointProblem& joint = beside.joint;
  Reach reach;
  double per_second = 0;
  for (std::size_t r = 0; r < joint.runs().size(); ++r) {
    const RunResidual& run = joint.runs()[r];
    reach.seconds = std::max(reach.seconds, run.run().dt * static_cast<double>(run.run().samples()));
    const VectorXd theta = joint.theta(r);
    if (const MatrixXd& states = beside.states[r]; states.size() > 0 && states.allFinite()) {
      const LinearSystem system = run.model().system(run.conditions(), theta, {});
      const auto most = [&](const RowVectorXd& read) { return (read * states.topRows(read.size())).cwiseAbs().maxCoeff(); };
      const RowVectorXd shape = first_mode(run.model(), system.coordinates);
      reach.x = std::max(reach.x, most(displacement_of(system, shape)));
      reach.v = std::max(reach.v, most(rate_of(system, shape)));
      const Basis& basis = run.model().basis();
      if (basis.torsion_modes > 0) {
        RowVectorXd twist = RowVectorXd::Zero(system.coordinates);
        twist[basis.normal_modes] = basis.twist(run.model().rig().submerged.back() - 1, basis.normal_modes);
        reach.twist = std::max(reach.twist, most(displacement_of(system, twist)));
        reach.twist_rate = std::max(reach.twist_rate, most(rate_of(system, twist)));
      }
    }
    if (run.conditions().speed > 0) {
      const VectorXd& angle = run.run().channel("alpha").value;
      double moved = 0;
      for (const double a : angle)
        if (std::isfinite(a)) moved = std::max(moved, std::abs(a));
      reach.alpha = std::max({reach.alpha, std::abs(run.conditions().onset_angle), moved});
    }
    per_second = first_mode_momentum(run.model());
  }
  if (reach.x > 0) reach.a = reach.v * reach.v / reach.x;
  reach.force = per_second * reach.v;
  const Rig& rig = joint.model().rig();
  if (joint.model().basis().torsion_modes > 0 && reach.twist > 0) {
    const Basis& basis = joint.model().basis();
    const double shape = basis.twist(rig.submerged.back() - 1, basis.normal_modes);
    const double omega = reach.twist_rate / reach.twist;
    // Per unit of the first torsional mode, whose mass is one, the outermost strip turns by `shape`.
    reach.moment = omega * omega * reach.twist / (shape * shape);
  }
  return reach;
}

namespace {

std::vector<Form> put_all(const std::vector<Line>& lines, const Rig& rig, const Reach& reach) {
  std::vector<Form> forms;
  for (const Line& line : lines) {
    const bool needs_section = line.acts_on == ActsOn::lift || line.acts_on == ActsOn::torsion || std::string_view(line.force).find("theta") != std::string_view::npos;
    if (moved(line, reach) && !(needs_section && rig.is_modal())) forms.push_back(put(line, reach));
  }
  return forms;
}

}  // namespace

std::vector<Form> dictionary(const Rig& rig, const Reach& reach) { return put_all(lines(), rig, reach); }

std::vector<Form> laws_of_the_list(const Rig& rig, const Reach& reach) { return put_all(listed_lines(), rig, reach); }

VectorXd as_listed(const Form& form, const VectorXd& own) {
  const std::vector<Parameter>& parameters = effect(form.listed).parameters;
  VectorXd values(static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t k = 0; k < parameters.size(); ++k) values[static_cast<Eigen::Index>(k)] = k < form.listed_order.size() ? own[form.listed_order[k]] : parameters[k].start;
  values[0] *= form.per_coefficient;
  return values;
}

std::vector<std::string> listed_forms() {
  std::vector<std::string> ids;
  for (const Line& line : lines())
    if (*line.listed != 0) ids.emplace_back(line.listed);
  return ids;
}

std::vector<Eigen::Index> coefficients_of(const Law& law) {
  std::vector<Eigen::Index> found;
  for (std::size_t k = 0; k < law.parameters.size(); ++k)
    if (const char c = law.parameters[k].name.front(); c == 'c' || c == 'f' || c == 'k') found.push_back(static_cast<Eigen::Index>(k));
  return found;
}

std::vector<VectorXd> shapes_of(const Form& form, Grid grid) {
  const bool fine = grid == Grid::fine, first = grid == Grid::first;
  const Law& law = form.law;
  std::vector<VectorXd> shapes{form.starts.front()};
  const std::vector<Eigen::Index> linear = coefficients_of(law);
  for (std::size_t k = 0; k < law.parameters.size(); ++k) {
    const auto is_among = [k](const std::vector<Eigen::Index>& places) { return std::find(places.begin(), places.end(), static_cast<Eigen::Index>(k)) != places.end(); };
    if (is_among(linear) || is_among(form.stays)) continue;
    const Parameter& p = law.parameters[k];
    std::vector<double> values;
    const bool is_corner = p.lower == 0 && p.upper < 1e30;  // between nothing and all that the runs reach
    if (is_corner)
      for (const double share : fine ? std::vector<double>{0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9} : std::vector<double>{0.2, 0.5, 0.8}) values.push_back(share * p.upper);
    else if (first) values = {shapes.front()[static_cast<Eigen::Index>(k)]};
    else if (p.name == "p") values = fine ? std::vector<double>{0.5, 1.5, 2, 2.5, 3, 4, 5} : std::vector<double>{0.5, 1.2, 2, 4};
    else
      for (const double factor : fine ? std::vector<double>{0.2, 0.5, 1, 2, 4} : std::vector<double>{0.3, 1, 3}) values.push_back(factor * shapes.front()[static_cast<Eigen::Index>(k)]);
    std::vector<VectorXd> each;
    for (const double value : values)
      if (value >= p.lower && value <= p.upper)
        for (VectorXd shape : shapes) {
          shape[static_cast<Eigen::Index>(k)] = value;
          each.push_back(std::move(shape));
        }
    shapes = std::move(each);
  }
  return shapes;
}

std::shared_ptr<const Effect> as_effect(const Form& form) {
  auto effect = std::make_shared<LawEffect>(*law_effect(form.law));
  effect->starts = form.starts;
  return effect;
}

}  // namespace unrig
