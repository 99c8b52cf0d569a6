#include "fit/laws/screen.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>

#include "fit/laws/law_regression.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
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

/// What every column is per unit of its coefficients, the others of a formula with several at nought.
MatrixXd forces_along(const std::vector<Form>& forms, const std::vector<Column>& columns, const MatrixXd& states, const Conditions& conditions, double dt) {
  std::vector<VectorXd> forces;
  for (const Column& c : columns)
    for (const Index coefficient : c.coefficients) {
      VectorXd one = c.parameters;
      for (const Index other : c.coefficients) one[other] = 0;
      const double unit = c.parameters[coefficient] == 0 ? 1 : std::abs(c.parameters[coefficient]);
      one[coefficient] = unit;
      forces.push_back(force_along(forms[c.form].law, one, states, conditions, dt) / unit);
    }
  MatrixXd all(states.cols(), static_cast<Index>(forces.size()));
  for (std::size_t i = 0; i < forces.size(); ++i) all.col(static_cast<Index>(i)) = forces[i];
  return all;
}

struct Regression {
  double deviance = INFINITY;
  VectorXd coefficient;
};

/// On `count` of the columns.
Regression regress(const LawRegression::Level& level, Index first, Index count) {
  const Index readings = level.products.cols() - 1;
  const auto own = level.products.block(first, first, count, count);
  const auto with_readings = level.products.col(readings).segment(first, count);
  Regression found{0, own.completeOrthogonalDecomposition().solve(with_readings)};
  found.deviance = level.deviance() - found.coefficient.dot(with_readings);
  return found;
}

}  // namespace

std::vector<Screened> screen(const std::vector<Form>& forms, const BesideUnknownForces& beside) {
  std::vector<Screened> screened;
  for (const Form& form : forms) screened.push_back({form.starts.front(), INFINITY, 0});
  for (const ActsOn place : {ActsOn::normal, ActsOn::torsion}) {
    const std::vector<Column> columns = shapes_of(forms, place);
    if (columns.empty()) continue;
    const LawRegression regression(place, beside, [&](const MatrixXd& states, const Conditions& conditions, double dt) { return forces_along(forms, columns, states, conditions, dt); });
    const double nothing = regression.deviance();
    Index first = 0;
    for (const Column& c : columns) {
      const auto count = static_cast<Index>(c.coefficients.size());
      for (const LawRegression::Level& level : regression.levels()) {
        const Regression found = regress(level, first, count);
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
