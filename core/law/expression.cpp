#include "core/law/expression.h"

#include <algorithm>
#include <cmath>

namespace unrig {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

double sign_of(double x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

/// Ends of an interval's product: 0 times anything is 0.
double product(double a, double b) { return a == 0 || b == 0 ? 0 : a * b; }

Range hull(std::initializer_list<double> ends) {
  for (const double end : ends)
    if (std::isnan(end)) return {};
  return {std::min(ends), std::max(ends)};
}

}  // namespace

Expression::Node Expression::add(Part part) {
  const auto same = std::find_if(nodes_.begin(), nodes_.end(), [&](const Part& other) {
    return other.operation == part.operation && other.left == part.left && other.right == part.right && other.index == part.index && other.number == part.number;
  });
  if (same != nodes_.end()) return static_cast<Node>(same - nodes_.begin());
  nodes_.push_back(part);
  return static_cast<Node>(nodes_.size() - 1);
}

Expression::Node Expression::number(double value) {
  Part part;
  part.number = value;
  part.range = {value, value};
  return add(part);
}

/// By repeated squares.
Expression::Node Expression::whole_power(Node base, unsigned exponent) {
  if (exponent == 0) return number(1);
  if (exponent == 1) return base;
  const Node half = whole_power(base, exponent / 2), square = make(Operation::multiply, half, half);
  return exponent % 2 == 0 ? square : make(Operation::multiply, square, base);
}

/// An operation's value at its operands a and b, and its slope in each.
struct Expression::Local {
  double value = 0, left = 0, right = 0;

  Local(Operation operation, double a, double b) {
    switch (operation) {
      case Operation::add: value = a + b, left = right = 1; break;
      case Operation::subtract: value = a - b, left = 1, right = -1; break;
      case Operation::multiply: value = a * b, left = b, right = a; break;
      case Operation::divide: value = a / b, left = 1 / b, right = -value / b; break;
      case Operation::negate: value = -a, left = -1; break;
      case Operation::power:
        value = std::pow(a, b);
        left = a != 0 ? b * value / a : b == 1 ? 1 : 0;
        right = a != 0 ? value * std::log(a) : 0;
        break;
      case Operation::constant_power:
        value = std::pow(a, b);
        left = a != 0 ? b * value / a : 0;
        break;
      case Operation::absolute: value = std::abs(a), left = sign_of(a); break;
      case Operation::sign: value = sign_of(a); break;
      case Operation::exp: value = left = std::exp(a); break;
      case Operation::log: value = std::log(a), left = 1 / a; break;
      case Operation::sqrt: value = std::sqrt(a), left = a != 0 ? 0.5 / value : 0; break;
      case Operation::sin: value = std::sin(a), left = std::cos(a); break;
      case Operation::cos: value = std::cos(a), left = -std::sin(a); break;
      case Operation::tanh: value = std::tanh(a), left = 1 - value * value; break;
      case Operation::minimum:
        left = a < b ? 1 : a > b ? 0 : 0.5;
        right = 1 - left;
        value = a < b ? a : b;
        break;
      case Operation::maximum:
        left = a > b ? 1 : a < b ? 0 : 0.5;
        right = 1 - left;
        value = a > b ? a : b;
        break;
      default: break;
    }
  }
};

Expression::Node Expression::make(Operation operation, Node left, Node right) {
  const auto is = [&](Node node, double value) { return nodes_[node].operation == Operation::number && nodes_[node].number == value; };
  const auto is_number = [&](Node node) { return nodes_[node].operation == Operation::number; };
  const bool binary = operation <= Operation::divide || operation == Operation::power || operation >= Operation::minimum;
  if (is_number(left) && (!binary || is_number(right)))
    if (const double value = Local(operation, nodes_[left].number, nodes_[right].number).value; std::isfinite(value)) return number(value);
  switch (operation) {
    case Operation::add:
      if (is(left, 0)) return right;
      if (is(right, 0)) return left;
      break;
    case Operation::subtract:
      if (is(right, 0)) return left;
      if (is(left, 0)) return make(Operation::negate, right);
      break;
    case Operation::multiply:
      if (is(left, 0) || is(right, 0)) return number(0);
      if (is(left, 1)) return right;
      if (is(right, 1)) return left;
      break;
    case Operation::divide:
      if (is(right, 1)) return left;
      if (is(left, 0) && !is(right, 0)) return left;
      break;
    case Operation::power: {
      if (!is_number(right)) break;
      constexpr double most = 16;  // few enough products
      const double p = nodes_[right].number;
      if (p == std::floor(p) && std::abs(p) <= most) {
        const Node whole = whole_power(left, static_cast<unsigned>(std::abs(p)));
        return p < 0 ? make(Operation::divide, number(1), whole) : whole;
      }
      operation = Operation::constant_power;
      break;
    }
    default: break;
  }
  Part part;
  part.operation = operation;
  part.left = left;
  part.right = right;
  part.symbols = nodes_[left].symbols | (binary ? nodes_[right].symbols : 0);
  part.range = range_of(part);
  return add(part);
}

Range Expression::range_of(const Part& part) const {
  const Range a = nodes_[part.left].range, b = nodes_[part.right].range;
  switch (part.operation) {
    case Operation::add: return {a.lower + b.lower, a.upper + b.upper};
    case Operation::subtract: return {a.lower - b.upper, a.upper - b.lower};
    case Operation::multiply: {
      Range r = hull({product(a.lower, b.lower), product(a.lower, b.upper), product(a.upper, b.lower), product(a.upper, b.upper)});
      if (part.left == part.right) r.lower = std::max(0.0, r.lower);
      return r;
    }
    case Operation::divide: {
      if (b.lower > 0 || b.upper < 0) return hull({product(a.lower, 1 / b.lower), product(a.lower, 1 / b.upper), product(a.upper, 1 / b.lower), product(a.upper, 1 / b.upper)});
      return a.lower >= 0 && b.lower >= 0 ? Range{0, infinite} : Range{};
    }
    case Operation::negate: return {-a.upper, -a.lower};
    case Operation::power:
    case Operation::constant_power: return a.lower >= 0 ? Range{0, infinite} : Range{};
    case Operation::absolute: return {a.lower > 0 ? a.lower : a.upper < 0 ? -a.upper : 0, std::max(std::abs(a.lower), std::abs(a.upper))};
    case Operation::exp: return {std::exp(a.lower), std::exp(a.upper)};
    case Operation::log: return {a.lower > 0 ? std::log(a.lower) : -infinite, a.upper > 0 ? std::log(a.upper) : infinite};
    case Operation::sqrt: return {0, a.upper > 0 ? std::sqrt(a.upper) : infinite};
    case Operation::sign: return {sign_of(a.lower), sign_of(a.upper)};
    case Operation::tanh: return {std::tanh(a.lower), std::tanh(a.upper)};
    case Operation::sin:
    case Operation::cos: return {-1, 1};
    case Operation::minimum: return {std::min(a.lower, b.lower), std::min(a.upper, b.upper)};
    case Operation::maximum: return {std::max(a.lower, b.lower), std::max(a.upper, b.upper)};
    default: return {};
  }
}

void Expression::divide_by(const std::array<double, symbol_count>& scales) {
  for (std::size_t s = 0; s < symbol_count; ++s) per_scale_[s] /= scales[s];
}

Expression Expression::with_root(Node root) const {
  Expression other = *this;
  other.root_ = root;
  other.compile();
  return other;
}

std::optional<Expression::Split> Expression::linear_in(Symbol symbol) const {
  const std::uint32_t bit = 1u << static_cast<unsigned>(symbol);
  Expression all = *this;
  const Node zero = all.number(0), one = all.number(1);
  struct Parts {
    Node rest, factor;
  };
  std::vector<Parts> parts(root_ + 1);
  for (Node node = 0; node <= root_; ++node) {
    const Part part = nodes_[node];
    if ((part.symbols & bit) == 0) {
      parts[node] = {node, zero};
      continue;
    }
    const Parts a = parts[part.left], b = parts[part.right];
    const auto both = [&](Operation operation) { parts[node] = {all.make(operation, a.rest, b.rest), all.make(operation, a.factor, b.factor)}; };
    const bool on_left = (nodes_[part.left].symbols & bit) != 0, on_right = (nodes_[part.right].symbols & bit) != 0;
    const auto nonlinear = [&] { parts[node] = {node, node}; };  // a factor that has the symbol
    switch (part.operation) {
      case Operation::symbol: parts[node] = {zero, one}; break;
      case Operation::add:
      case Operation::subtract: both(part.operation); break;
      case Operation::negate: parts[node] = {all.make(Operation::negate, a.rest), all.make(Operation::negate, a.factor)}; break;
      case Operation::multiply:
        if (on_left && on_right) nonlinear();
        else if (on_left) parts[node] = {all.make(Operation::multiply, a.rest, part.right), all.make(Operation::multiply, a.factor, part.right)};
        else parts[node] = {all.make(Operation::multiply, part.left, b.rest), all.make(Operation::multiply, part.left, b.factor)};
        break;
      case Operation::divide:
        if (on_right) nonlinear();
        else parts[node] = {all.make(Operation::divide, a.rest, part.right), all.make(Operation::divide, a.factor, part.right)};
        break;
      default: nonlinear(); break;
    }
  }
  const Parts found = parts[root_];
  if (((all.nodes_[found.rest].symbols | all.nodes_[found.factor].symbols) & bit) != 0) return std::nullopt;
  // The symbol stood in units of its scale.
  Node factor = found.factor;
  if (const double per = per_scale_[index_of(symbol)]; per != 1) factor = all.make(Operation::multiply, all.number(per), factor);
  return Split{all.with_root(found.rest), all.with_root(factor)};
}

/// Lists what the root needs: leaves, then operations in their order.
void Expression::compile() {
  std::vector<char> needed(nodes_.size(), 0);
  needed[root_] = 1;
  const auto is_operation = [](const Part& part) { return part.operation > Operation::parameter; };
  for (Node node = root_ + 1; node-- > 0;)
    if (needed[node] && is_operation(nodes_[node])) needed[nodes_[node].left] = needed[nodes_[node].right] = 1;
  constants_.clear();
  symbols_.clear();
  used_parameters_.clear();
  steps_.clear();
  std::vector<std::uint16_t> place(nodes_.size(), 0);
  std::uint16_t next = 0;
  for (const Operation leaf : {Operation::number, Operation::symbol, Operation::parameter})
    for (Node node = 0; node <= root_; ++node) {
      const Part& part = nodes_[node];
      if (!needed[node] || part.operation != leaf) continue;
      place[node] = next;
      if (leaf == Operation::number) constants_.push_back(part.number);
      else (leaf == Operation::symbol ? symbols_ : used_parameters_).push_back({next, static_cast<std::uint16_t>(part.index)});
      ++next;
    }
  first_ = next;
  for (Node node = 0; node <= root_; ++node) {
    const Part& part = nodes_[node];
    if (!needed[node] || !is_operation(part)) continue;
    steps_.push_back({part.operation, place[part.left], place[part.right]});
    place[node] = next++;
  }
  result_ = place[root_];
}

double Expression::operator()(const double* symbols, const double* parameters, double* in_symbols, double* in_parameters) const {
  constexpr std::size_t room = 2 * most_nodes + 16;  // linear_in adds a part for each, whole powers some
  double value[room], slope[room], by_left[room], by_right[room];  // slope: of the result in each place
  std::copy(constants_.begin(), constants_.end(), value);
  for (const Leaf& leaf : symbols_) value[leaf.place] = symbols[leaf.index] * per_scale_[leaf.index];
  for (const Leaf& leaf : used_parameters_) value[leaf.place] = parameters[leaf.index];

  std::size_t at = first_;
  for (const Step& step : steps_) {
    const double a = value[step.left], b = value[step.right];
    const Local local(step.operation, a, b);
    value[at] = local.value;
    by_left[at] = local.left;
    by_right[at] = local.right;
    ++at;
  }

  std::fill_n(slope, at, 0.0);
  slope[result_] = 1;
  for (std::size_t k = steps_.size(); k-- > 0;) {
    const std::size_t own = first_ + k;
    const double through = slope[own];
    if (through == 0) continue;
    if (by_left[own] != 0) slope[steps_[k].left] += through * by_left[own];  // 0 times an infinite slope is 0
    if (by_right[own] != 0) slope[steps_[k].right] += through * by_right[own];
  }
  std::fill_n(in_symbols, symbol_count, 0.0);
  std::fill_n(in_parameters, parameters_, 0.0);
  for (const Leaf& leaf : symbols_) in_symbols[leaf.index] = slope[leaf.place] * per_scale_[leaf.index];
  for (const Leaf& leaf : used_parameters_) in_parameters[leaf.index] = slope[leaf.place];
  return value[result_];
}

}  // namespace unrig
