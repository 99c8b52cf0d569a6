#include "fit/laws/curve_of_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "fit/laws/law_regression.h"
#include "fit/search/screening.h"
#include "fit/search/search_numbers.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr const char* name = "curve of the state";
constexpr double little_force = 0.01;   // of the unknown force that the decays ask for without a law: what needs more beside it is not what is missing
constexpr std::size_t most_terms = 12;  // a law has at most 16 parameters, a formula 200 parts

/// Terms to choose from, over x and v in units of what the runs reach; none that a linear rig has.
std::vector<std::string> all_terms() {
  const std::vector<std::string> of_v{"1", "v", "v * abs(v)", "v^2", "v^3", "tanh(v / 0.03)", "tanh(v / 0.1)", "tanh(v / 0.3)"};
  std::vector<std::string> of_x{"1", "x", "x^2", "x^3", "abs(x)", "x * abs(x)"}, terms;
  for (int tenth = 1; tenth < 10; ++tenth)
    for (const char* power : {"", "^3"}) {
      const std::string above = fmt::format("max(0, x - 0.{}){}", tenth, power), below = fmt::format("max(0, -x - 0.{}){}", tenth, power);
      of_x.push_back(fmt::format("max(0, abs(x) - 0.{}){}", tenth, power));
      of_x.push_back(fmt::format("({} - {})", above, below));
      terms.push_back(above);
    }
  for (const std::string& g : of_x)
    for (const std::string& h : of_v) {
      const bool is_linear = (g == "1" && (h == "1" || h == "v")) || (g == "x" && h == "1");
      if (!is_linear) terms.push_back(g == "1" ? h : h == "1" ? g : g + " * " + h);
    }
  for (int tenth = 1; tenth < 10; ++tenth) {
    terms.push_back(fmt::format("max(0, abs(v) - 0.{})", tenth));
    terms.push_back(fmt::format("(max(0, v - 0.{0}) - max(0, -v - 0.{0}))", tenth));
  }
  return terms;
}

std::vector<Expression> expressions_of(const std::vector<std::string>& terms, const Reach& reach) {
  std::array<double, symbol_count> scales;
  scales.fill(1);
  scales[index_of(Symbol::x)] = reach.x;
  scales[index_of(Symbol::v)] = reach.v;
  std::vector<Expression> all;
  for (const std::string& term : terms) {
    all.emplace_back(term, std::vector<std::string>{});
    all.back().divide_by(scales);
  }
  return all;
}

/// Of the terms, per unit of their coefficients: samples x terms.
MatrixXd forces_along(const std::vector<Expression>& terms, const MatrixXd& states) {
  std::array<double, symbol_count> symbol{}, in_symbols{};
  MatrixXd forces(states.cols(), static_cast<Index>(terms.size()));
  for (Index k = 0; k < states.cols(); ++k) {
    symbol[index_of(Symbol::x)] = states(0, k);
    symbol[index_of(Symbol::v)] = states(1, k);
    for (std::size_t i = 0; i < terms.size(); ++i) forces(k, static_cast<Index>(i)) = -terms[i](symbol.data(), nullptr, in_symbols.data(), nullptr);
  }
  return forces;
}

/// A sum of terms.
struct Sum {
  std::vector<Index> terms;
  VectorXd coefficient;
  double cost = INFINITY;  // -2 ln likelihood and the price of all terms
};

/// Symmetric sweep: the regression on column `i` is done where it was not, and undone where it was (M. A. Efroymson, in Mathematical Methods for Digital Computers (1960), 191).
void sweep(MatrixXd& a, Index i) {
  const double pivot = a(i, i);
  const VectorXd column = a.col(i);
  a -= column * column.transpose() / pivot;
  a.col(i) = column / std::abs(pivot);
  a.row(i) = a.col(i).transpose();
  a(i, i) = -1 / pivot;
}

Sum choose(const LawRegression::Level& level, double price) {
  SelectedColumns selected = select_columns(level.products, price, most_terms);
  const double cost = selected.left + level.entropy + price * static_cast<double>(selected.columns.size());
  return {std::move(selected.columns), std::move(selected.coefficient), cost};
}

Form form_of(const Sum& sum, const std::vector<std::string>& terms, const Reach& reach) {
  Law law;
  law.name = name;
  law.scales.fill(1);
  for (std::size_t k = 0; k < sum.terms.size(); ++k) {
    const std::string coefficient = fmt::format("c{}", k + 1), &term = terms[static_cast<std::size_t>(sum.terms[k])];
    law.force_text += fmt::format("{}{} * {}", k == 0 ? "-" : " - ", coefficient, term);
    law.parameters.push_back({coefficient, "N", sum.coefficient[static_cast<Index>(k)], -1e30, 1e30, false, ""});
    const Expression expression(term, {});
    for (const auto& [symbol, most] : {std::pair{Symbol::x, reach.x}, {Symbol::v, reach.v}})
      if (expression.uses(symbol)) law.scales[index_of(symbol)] = most;
  }
  Form form;
  form.law = parse_law(law_text(law), "the search for a curve");
  Eigen::VectorXd start(static_cast<Index>(form.law.parameters.size()));
  for (Index k = 0; k < start.size(); ++k) start[k] = form.law.parameters[static_cast<std::size_t>(k)].start;
  form.starts = {start};
  return form;
}

/// With the form at work as it starts, the states that the decays ask for, and the parameters that go with them.
BesideUnknownForces along(const FitProblem& problem, const Trial& base, const Form& form, BesideUnknownForces beside) {
  FitProblem with = problem;
  const std::string id = form.law.id();
  with.rig.laws = base.arrival.joint.model().rig().laws;
  std::erase_if(with.rig.laws, [&](const auto& law) { return std::find(base.effects.begin(), base.effects.end(), law->id) == base.effects.end(); });
  with.rig.laws.push_back(as_effect(form));
  std::vector<std::string> set = base.effects;
  set.push_back(id);
  const Arrival arrival = transferred(with, base.arrival, std::make_shared<const AeroelasticModel>(model_of(with.rig, with.runs, with.circulation, set)));
  JointProblem joint = arrival.joint;
  for (Unknown* u : unknowns_of(joint, id)) u->value = form.starts.front()[joint.parameter(*u).place];
  constexpr int levels = 4;  // of trust in the law: to within 7 % of the force that is missed without it
  const BesideUnknownForces with_it = beside_unknown_forces(joint, levels);
  for (Unknown& u : beside.joint.unknowns())
    for (const Unknown& known : with_it.joint.unknowns())
      if (known.run == u.run && with_it.joint.parameter(known).name == beside.joint.parameter(u).name) u.value = known.value;
  for (std::size_t r = 0; r < beside.states.size(); ++r)
    if (beside.states[r].size() > 0) beside.states[r] = with_it.states[r].topRows(beside.states[r].rows());
  return beside;
}

}  // namespace

SelectedColumns select_columns(const MatrixXd& products, double price, std::size_t most) {
  constexpr double dependent = 1e-7;  // share of a column that those chosen leave of it
  const Index count = products.rows() - 1;
  VectorXd scale = products.diagonal().cwiseMax(1e-300).cwiseSqrt();
  scale[count] = 1;
  MatrixXd a = scale.cwiseInverse().asDiagonal() * products * scale.cwiseInverse().asDiagonal();
  SelectedColumns selected;
  const auto worth = [&](Index i) { return a(i, count) * a(i, count) / std::abs(a(i, i)); };
  double cost = INFINITY;
  while (selected.columns.size() < most) {
    Index next = -1;
    for (Index i = 0; i < count; ++i)
      if (a(i, i) > dependent && worth(i) > (next < 0 ? price : worth(next))) next = i;
    if (next < 0) break;
    sweep(a, next);
    selected.columns.push_back(next);
    const auto least = [&] { return std::min_element(selected.columns.begin(), selected.columns.end(), [&](Index i, Index k) { return worth(i) < worth(k); }); };
    for (auto idle = least(); worth(*idle) < price; idle = least()) {
      sweep(a, *idle);
      selected.columns.erase(idle);
    }
    const double now = a(count, count) + price * static_cast<double>(selected.columns.size());
    if (!(now < cost)) break;  // rounding goes in circles
    cost = now;
  }
  selected.coefficient.resize(static_cast<Index>(selected.columns.size()));
  for (std::size_t k = 0; k < selected.columns.size(); ++k) selected.coefficient[static_cast<Index>(k)] = a(selected.columns[k], count) / scale[selected.columns[k]];
  selected.left = a(count, count);
  return selected;
}

std::optional<CurveOfState> curve_of_state(const FitProblem& problem, const Trial& base, const BesideUnknownForces& beside, double least) {
  Reach reach = reach_of(beside);
  const bool is_at_work = std::find(base.effects.begin(), base.effects.end(), std::string("law:") + name) != base.effects.end();
  if (is_at_work || !(reach.x > 0 && reach.v > 0 && reach.force > 0)) return std::nullopt;
  reach.x = rounded(reach.x), reach.v = rounded(reach.v);
  const std::vector<std::string> terms = all_terms();
  const std::vector<Expression> expressions = expressions_of(terms, reach);
  std::optional<CurveOfState> best;
  BesideUnknownForces now = beside;
  double nothing = 0;
  std::vector<Index> before;
  bool explains = false;  // along its own states, with a hundredth of the unknown force, better than such a force does alone
  constexpr int most_rounds = 4;
  for (int round = 0; round < most_rounds; ++round) {
    const LawRegression regression(ActsOn::normal, now, [&](const MatrixXd& states, const Conditions&, double) { return forces_along(expressions, states); });
    if (regression.levels().empty()) break;
    const double price = std::log(regression.samples()) + 2 * std::log(static_cast<double>(terms.size()));
    Sum sum;
    double least_beside_little = INFINITY;
    for (const LawRegression::Level& level : regression.levels()) {
      Sum here = choose(level, price);
      if (level.density <= little_force) least_beside_little = std::min(least_beside_little, here.cost);
      if (here.cost < sum.cost) sum = std::move(here);
    }
    if (round == 0) nothing = regression.deviance();
    const double evidence = nothing - sum.cost;
    explains = least_beside_little < nothing;
    if (sum.terms.empty() || (!best && evidence < least) || sum.terms == before) break;
    Form form = form_of(sum, terms, reach);
    if (!best || evidence > best->evidence) best = CurveOfState{form, evidence, now};
    if (round + 1 == most_rounds) break;
    before = std::move(sum.terms);
    now = along(problem, base, form, now);
  }
  return explains ? best : std::nullopt;
}

}  // namespace unrig
