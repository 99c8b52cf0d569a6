#include "fit/laws/screen.h"

#include <Eigen/QR>
#include <array>
#include <cmath>
#include <optional>

#include "core/law/law_effect.h"
#include "core/numerics/in_parallel.h"
#include "core/propagate/nonlinear_response.h"
#include "fit/force/missing_force.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

using Symbols = std::array<double, symbol_count>;

std::size_t at(Symbol s) { return static_cast<std::size_t>(s); }

/// A formula at one shape: what stands in the regression, per unit of its coefficient or coefficients.
struct Column {
  std::size_t form;
  VectorXd parameters;  // coefficients as they start
  std::vector<Index> coefficients;
};

/// The shapes at which forms stand.
std::vector<Column> shapes_of(const std::vector<Form>& forms, ActsOn place) {
  std::vector<Column> all;
  for (std::size_t f = 0; f < forms.size(); ++f)
    if (forms[f].law.acts_on == place)
      for (const VectorXd& shape : forms[f].starts) all.push_back({f, shape, coefficients_of(forms[f].law)});
  return all;
}

/// The linear rig with one input, the place where a law acts, and one output.
struct Port {
  LinearSystem system;
  MatrixXd reads;  // x, v, twist, twist rate over the states
};

Port port_of(const RunResidual& run, const VectorXd& theta, ActsOn place) {
  Rig rig = run.model().rig();
  rig.laws.clear();
  const char* text = place == ActsOn::torsion ? "unrig_law = 1\nname = \"port\"\nacts_on = \"torsion\"\nforce = \"-c * twist\"\n[parameters]\nc = { start = \"0 N.m\" }\n[scales]\ntwist = \"1 rad\"\n"
                                              : "unrig_law = 1\nname = \"port\"\nacts_on = \"normal\"\nforce = \"-c * x\"\n[parameters]\nc = { start = \"0 N\" }\n[scales]\nx = \"1 m\"\n";
  add_law(rig, parse_law(text, "the port of a law"));
  const std::string id = rig.laws.front()->id;
  const AeroelasticModel model = AeroelasticModel(rig, run.model().basis(), run.model().circulation()).with_effects({id});
  VectorXd values = model.start_values();
  const std::vector<Parameter>& own = run.model().parameters();
  for (std::size_t k = 0; k < own.size(); ++k)
    for (std::size_t i = 0; i < model.parameters().size(); ++i)
      if (model.parameters()[i].name == own[k].name) values[static_cast<Index>(i)] = theta[static_cast<Index>(k)];
  Port port{model.system(run.conditions(), values, {run.channels().front()}), {}};
  LinearSystem& s = port.system;
  const Index last = s.B.cols() - 1;
  s = under_one_input(std::move(s), last);
  const RowVectorXd shape = first_mode(model, s.coordinates);
  port.reads = MatrixXd::Zero(4, s.states());
  port.reads.row(0) = displacement_of(s, shape);
  port.reads.row(1) = rate_of(s, shape);
  const Basis& basis = model.basis();
  if (basis.torsion_modes > 0) {
    RowVectorXd twist = RowVectorXd::Zero(s.coordinates);
    twist[basis.normal_modes] = basis.twist(rig.submerged.back() - 1, basis.normal_modes);
    port.reads.row(2) = displacement_of(s, twist);
    port.reads.row(3) = rate_of(s, twist);
  }
  return port;
}

/// Force of a law along the states, its coefficients as they are in `parameters`, the memory followed in small steps.
VectorXd force_along(const Law& law, const VectorXd& parameters, const MatrixXd& states, const Conditions& conditions, double dt) {
  Symbols symbol{}, in_symbols{};
  std::array<double, 64> in_parameters{};
  symbol[at(Symbol::U)] = conditions.speed;
  symbol[at(Symbol::theta)] = conditions.onset_angle;
  const auto look = [&](const VectorXd& s, double t) {
    symbol[at(Symbol::x)] = s[0], symbol[at(Symbol::v)] = s[1], symbol[at(Symbol::twist)] = s[2], symbol[at(Symbol::twist_rate)] = s[3], symbol[at(Symbol::t)] = t;
  };
  constexpr int parts = 8;  // of a sample, for the memory
  constexpr double most = 2;  // times its limit: where steps are too long it is held there
  VectorXd force(states.cols());
  double z = 0;
  for (Index k = 0; k < states.cols(); ++k) {
    look(states.col(k), static_cast<double>(k) * dt);
    const Index before = std::max<Index>(0, k - 1), behind = std::min(states.cols() - 1, k + 1);
    symbol[at(Symbol::a)] = (states(1, behind) - states(1, before)) / (dt * static_cast<double>(std::max<Index>(1, behind - before)));
    symbol[at(Symbol::z)] = z;
    force[k] = law.force(symbol.data(), parameters.data(), in_symbols.data(), in_parameters.data());
    if (!law.memory || k + 1 == states.cols()) continue;
    for (int i = 0; i < parts; ++i) {
      const double share = (i + 0.5) / parts;
      look((1 - share) * states.col(k) + share * states.col(k + 1), (static_cast<double>(k) + share) * dt);
      symbol[at(Symbol::z)] = z;
      z = std::clamp(z + dt / parts * (*law.memory)(symbol.data(), parameters.data(), in_symbols.data(), in_parameters.data()), -most, most);
    }
  }
  return force;
}

/// What one decay says: innovations of readings and of every column, what shifts and initial states explain taken out, at several densities of the unknown force.
struct Said {
  struct Level {
    MatrixXd products;  // of [columns | readings]
    double variance, samples;
  };
  std::vector<Level> levels;
};

constexpr std::array<double, 5> densities{1, 0.1, 0.01, 1e-3, 1e-4};  // times the one that the readings ask for where no law is known

std::optional<Said> ask(const RunResidual& run, const VectorXd& theta, ActsOn place, const std::vector<Form>& forms, const std::vector<Column>& columns, const MatrixXd& states) {
  const RunResidual::Prediction p = run.predict(theta);
  if (!p.output.allFinite()) return std::nullopt;
  const Port port = port_of(run, theta, place);
  const double dt = run.run().dt;
  const Index samples = states.cols(), n = port.system.states();
  if (port.system.B.value.norm() == 0) return std::nullopt;
  VectorXd left = (run.run().channel(run.channels().front()).value - p.output.col(0)).head(samples), counts = VectorXd::Ones(samples);
  for (Index k = 0; k < samples; ++k)
    if (!(run.channel_weight(0)[k] > 0) || !std::isfinite(left[k])) left[k] = std::nan(""), counts[k] = 0;
  const MissingForce force = estimate_force(port.system, dt, left, run.noise(0));
  const MatrixXd moved = port.reads * states.topRows(n);

  // Shifts of stiffness and damping (not of mass: an acceleration that the readings show has the law's force in it), the law's columns.
  const Index first = place == ActsOn::torsion ? 2 : 0;
  std::vector<VectorXd> forces{moved.row(first).transpose(), moved.row(first + 1).transpose()};
  const Index shifts = static_cast<Index>(forces.size());
  for (const Column& c : columns)
    for (const Index coefficient : c.coefficients) {
      VectorXd one = c.parameters;
      for (const Index other : c.coefficients) one[other] = 0;
      const double unit = c.parameters[coefficient] == 0 ? 1 : std::abs(c.parameters[coefficient]);
      one[coefficient] = unit;
      forces.push_back(force_along(forms[c.form].law, one, moved, run.conditions(), dt) / unit);
    }
  MatrixXd all(samples, static_cast<Index>(forces.size()));
  for (std::size_t i = 0; i < forces.size(); ++i) all.col(static_cast<Index>(i)) = forces[i];
  const VectorXd size = all.colwise().norm().cwiseMax(1e-300);
  all = (all * size.cwiseInverse().asDiagonal()).eval();
  if (!all.allFinite()) all = all.unaryExpr([](double v) { return std::isfinite(v) ? v : 0; });

  Said said;
  const Index law_columns = all.cols() - shifts;
  for (const double density : densities) {
    const ForceFilter filter(port.system, dt, density * force.roughness, run.noise(0));
    const MatrixXd e = filter.innovations_of_forces(all, counts);
    const Index initial = filter.states(), nuisances = shifts + initial + 1;
    MatrixXd nuisance(samples, nuisances), rest(samples, law_columns + 1);
    VectorXd offset = VectorXd::Ones(samples);
    for (Index k = 0; k < samples; ++k)
      if (counts[k] == 0) offset[k] = std::nan("");
    nuisance << e.leftCols(shifts), e.rightCols(initial), filter.innovations(offset);
    rest << e.middleCols(shifts, law_columns), filter.innovations(left);
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(nuisance);
    rest.applyOnTheLeft(qr.householderQ().adjoint());
    const auto behind = rest.bottomRows(samples - qr.rank());
    MatrixXd products = behind.transpose() * behind;
    for (Index i = 0; i < law_columns; ++i) {
      products.row(i) *= size[shifts + i];
      products.col(i) *= size[shifts + i];
    }
    said.levels.push_back({products, filter.variance(), counts.sum()});
  }
  return said;
}

struct Regression {
  double deviance = INFINITY;
  VectorXd coefficient;
};

/// On `count` of the columns, over all decays.
Regression regress(const std::vector<std::optional<Said>>& said, std::size_t level, Index first, Index count) {
  MatrixXd products = MatrixXd::Zero(count + 1, count + 1);
  double entropy = 0;
  for (const std::optional<Said>& s : said) {
    if (!s) continue;
    const Said::Level& l = s->levels[level];
    const Index readings = l.products.cols() - 1;
    MatrixXd own(count + 1, count + 1);
    own << l.products.block(first, first, count, count), l.products.block(first, readings, count, 1), l.products.block(readings, first, 1, count), l.products(readings, readings);
    products += own / l.variance;
    entropy += l.samples * std::log(l.variance);
  }
  if (count == 0) return {products(0, 0) + entropy, {}};
  Regression found{0, products.topLeftCorner(count, count).completeOrthogonalDecomposition().solve(products.col(count).head(count))};
  found.deviance = products(count, count) - found.coefficient.dot(products.col(count).head(count)) + entropy;
  return found;
}

}  // namespace

std::vector<Screened> screen(const std::vector<Form>& forms, const BesideUnknownForces& beside) {
  const JointProblem& joint = beside.joint;
  std::vector<Screened> screened;
  for (const Form& form : forms) screened.push_back({form.starts.front(), INFINITY, 0});
  for (const ActsOn place : {ActsOn::normal, ActsOn::torsion}) {
    const std::vector<Column> columns = shapes_of(forms, place);
    if (columns.empty()) continue;
    std::vector<std::optional<Said>> said(joint.runs().size());
    in_parallel(said.size(), [&](std::size_t r) {
      const RunResidual& run = joint.runs()[r];
      if (beside.states[r].size() > 0 && !run.is_aside()) said[r] = ask(run, joint.theta(r), place, forms, columns, beside.states[r]);
    });
    // Without any law.
    double nothing = INFINITY;
    for (std::size_t level = 0; level < densities.size(); ++level) nothing = std::min(nothing, regress(said, level, 0, 0).deviance);
    Index first = 0;
    for (const Column& c : columns) {
      const auto count = static_cast<Index>(c.coefficients.size());
      for (std::size_t level = 0; level < densities.size(); ++level) {
        const Regression found = regress(said, level, first, count);
        const double gain = nothing - found.deviance;
        VectorXd parameters = c.parameters;
        bool allowed = true;
        for (Index i = 0; i < count; ++i) {
          const Index k = c.coefficients[static_cast<std::size_t>(i)];
          const Parameter& p = forms[c.form].law.parameters[static_cast<std::size_t>(k)];
          parameters[k] = found.coefficient[i];
          allowed = allowed && found.coefficient[i] > p.lower && found.coefficient[i] < p.upper;
        }
        if (allowed && gain > screened[c.form].gain) screened[c.form] = {parameters, found.deviance, gain};
      }
      first += count;
    }
  }
  return screened;
}

}  // namespace unrig
