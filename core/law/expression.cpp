#include "core/law/expression.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/scan.h"

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

bool any_number(const Range& r) { return r.lower == -infinite && r.upper == infinite; }

std::size_t letters_apart(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

std::string nearest_name(std::string_view name, const std::vector<std::string>& known) {
  constexpr std::size_t most = 2, longest = 40;
  std::string nearest;
  std::size_t least = std::min(most, name.size() > 1 ? name.size() - 1 : 0) + 1;
  if (name.size() > longest) return nearest;
  for (const std::string& one : known)
    if (const std::size_t apart = one.size() > longest ? least : letters_apart(name, one); apart < least) {
      least = apart;
      nearest = one;
    }
  return nearest;
}

/// Recursive descent: sum = term {+- term}, term = signed {*/ signed}, signed = [+-] signed | power, power = operand [^ signed].
class ExpressionParser {
 public:
  using Operation = Expression::Operation;
  using Node = Expression::Node;

  struct Function {
    std::string_view name;
    Operation operation;
    int arguments;
  };
  static constexpr std::array<Function, 10> functions{{{"abs", Operation::absolute, 1},
                                                       {"sign", Operation::sign, 1},
                                                       {"exp", Operation::exp, 1},
                                                       {"log", Operation::log, 1},
                                                       {"sqrt", Operation::sqrt, 1},
                                                       {"sin", Operation::sin, 1},
                                                       {"cos", Operation::cos, 1},
                                                       {"tanh", Operation::tanh, 1},
                                                       {"min", Operation::minimum, 2},
                                                       {"max", Operation::maximum, 2}}};

  ExpressionParser(Expression& expression, std::string_view text, const std::vector<std::string>& parameters, const std::vector<Range>& ranges)
      : expression_(expression), text_(text), parameters_(parameters), ranges_(ranges) {}

  Node whole() {
    skip_blanks();
    if (at_ == text_.size()) fail(at_, "it is empty", "wanted an expression", "");
    const Node root = sum();
    if (at_ < text_.size()) fail_here("an operator or the end");
    return root;
  }

 private:
  [[noreturn]] void fail(std::size_t place, const std::string& found, const std::string& wanted, const std::string& advice) const { throw ExpressionError(place, found, wanted, advice); }

  [[noreturn]] void fail_here(const std::string& wanted) const {
    if (at_ == text_.size()) fail(at_, "it ends too early", "wanted " + wanted, "");
    const bool power = text_.substr(at_, 2) == "**";
    const auto byte = static_cast<unsigned char>(text_[at_]);
    const std::string shown = byte < 0x80 ? fmt::format("\"{}\"", text_[at_]) : "a character that is no part of an expression";
    fail(at_, "there is " + shown, "wanted " + wanted, power ? "A power is written x^2." : "");
  }

  void skip_blanks() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
  }
  bool take(char c) {
    if (at_ == text_.size() || text_[at_] != c) return false;
    ++at_;
    skip_blanks();
    return true;
  }

  /// Parentheses, signs and powers in each other: a text must not end the stack.
  class Deeper {
   public:
    explicit Deeper(ExpressionParser& parser) : parser_(parser) {
      constexpr int most = 100;
      if (++parser_.depth_ > most) parser_.fail(parser_.at_, fmt::format("it is nested more than {} deep", most), "wanted fewer parentheses, signs or powers in each other", "");
    }
    ~Deeper() { --parser_.depth_; }
    Deeper(const Deeper&) = delete;
    Deeper& operator=(const Deeper&) = delete;

   private:
    ExpressionParser& parser_;
  };

  Node make(Operation operation, Node left, Node right = 0) {
    const Node node = expression_.make(operation, left, right);
    if (expression_.nodes_.size() > Expression::most_nodes) fail(at_, fmt::format("it has more than {} parts", Expression::most_nodes), "wanted a shorter expression", "");
    return node;
  }

  Node sum() {
    const Deeper deeper(*this);
    Node left = term();
    while (at_ < text_.size()) {
      if (take('+')) left = make(Operation::add, left, term());
      else if (take('-')) left = make(Operation::subtract, left, term());
      else break;
    }
    return left;
  }

  Node term() {
    Node left = signed_power();
    while (at_ < text_.size()) {
      if (text_.substr(at_, 2) == "**") fail_here("one of + - * / ^");
      if (take('*')) left = make(Operation::multiply, left, signed_power());
      else if (take('/')) left = make(Operation::divide, left, signed_power());
      else break;
    }
    return left;
  }

  Node signed_power() {
    const Deeper deeper(*this);
    if (take('-')) return make(Operation::negate, signed_power());
    if (take('+')) return signed_power();
    return power();
  }

  Node power() {
    const std::size_t begin = at_;
    const Node base = operand();
    const std::size_t end = at_;
    if (!take('^')) return base;
    const Node exponent = signed_power();  // to the right: x^y^z = x^(y^z)
    const Expression::Part& by = expression_.nodes_[exponent];
    const bool whole = by.operation == Operation::number && by.number == std::floor(by.number);
    if (!whole) refuse_negative(begin, end, base, "a power that is no whole number", "abs({0})^p * sign({0})");
    return make(Operation::power, base, exponent);
  }

  void refuse_negative(std::size_t begin, std::size_t end, Node of, const std::string& what, std::string_view instead) const {
    if (!any_number(expression_.nodes_[of].range)) return;
    std::string_view text = trimmed(text_.substr(begin, end - begin));
    constexpr std::size_t longest = 30;
    fail(begin, fmt::format("{} of \"{}\", which may be negative", what, text.size() > longest ? "..." : text), "wanted it of what cannot be",
         fmt::format("For instance {}.", fmt::format(fmt::runtime(instead), text.size() > longest ? "x" : text)));
  }

  Node operand() {
    if (at_ == text_.size()) fail_here("a number, a name or \"(\"");
    if (take('(')) {
      const Node inside = sum();
      if (!take(')')) fail_here("\")\"");
      return inside;
    }
    if (is_letter(text_[at_])) return name();
    return literal();
  }

  static bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
  static bool is_digit(char c) { return c >= '0' && c <= '9'; }

  Node literal() {
    if (!is_digit(text_[at_]) && text_[at_] != '.') fail_here("a number, a name or \"(\"");
    double value = 0;
    const char *first = text_.data() + at_, *last = text_.data() + text_.size(), *end = read_number(first, last, value);
    if (end == first || !std::isfinite(value)) fail_here("a finite number");
    const std::size_t begin = at_;
    at_ += static_cast<std::size_t>(end - first);
    if (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]) || text_[at_] == '.'))
      fail(at_, fmt::format("\"{}\" stands right behind the number {}", text_[at_], text_.substr(begin, at_ - begin)), "wanted an operator between them", is_letter(text_[at_]) ? "A product is written 2 * x." : "");
    skip_blanks();
    return expression_.number(value);
  }

  Node name() {
    const std::size_t begin = at_;
    while (at_ < text_.size() && (is_letter(text_[at_]) || is_digit(text_[at_]))) ++at_;
    const std::string_view word = text_.substr(begin, at_ - begin);
    skip_blanks();
    for (const Function& function : functions)
      if (function.name == word) return call(function);
    if (at_ < text_.size() && text_[at_] == '(') unknown(begin, word, true);
    for (std::size_t s = 0; s < symbol_count; ++s)
      if (symbol_names[s] == word) {
        Expression::Part part;
        part.operation = Operation::symbol;
        part.index = static_cast<std::uint32_t>(s);
        part.symbols = 1u << s;
        const auto symbol = static_cast<Symbol>(s);
        part.range = symbol == Symbol::U || symbol == Symbol::t ? Range{0, infinite} : Range{};
        return expression_.add(part);
      }
    for (std::size_t k = 0; k < parameters_.size(); ++k)
      if (parameters_[k] == word) {
        Expression::Part part;
        part.operation = Operation::parameter;
        part.index = static_cast<std::uint32_t>(k);
        part.range = k < ranges_.size() ? ranges_[k] : Range{};
        return expression_.add(part);
      }
    unknown(begin, word, false);
  }

  [[noreturn]] void unknown(std::size_t begin, std::string_view word, bool called) const {
    std::vector<std::string> known;
    for (const Function& function : functions) known.emplace_back(function.name);
    const std::string names = fmt::format("{}", fmt::join(known, " "));
    if (called) {
      const std::string nearest = nearest_name(word, known);
      fail(begin, fmt::format("\"{}\" is no function", word), "wanted one of " + names, nearest.empty() ? "A product is written with *." : fmt::format("Did you mean {}?", nearest));
    }
    std::vector<std::string> all(symbol_names.begin(), symbol_names.end());
    all.insert(all.end(), parameters_.begin(), parameters_.end());
    const std::string nearest = nearest_name(word, all);
    fail(begin, fmt::format("\"{}\" is no symbol and does not stand in [parameters]", word), fmt::format("wanted one of the symbols {}, or a parameter", fmt::join(symbol_names, " ")),
         nearest.empty() ? "" : fmt::format("Did you mean {}?", nearest));
  }

  Node call(const Function& function) {
    const std::string usage = fmt::format("{}({})", function.name, function.arguments == 1 ? "..." : "..., ...");
    if (!take('(')) fail_here(fmt::format("\"(\" behind {}: {}", function.name, usage));
    const std::size_t inside = at_;
    const Node left = sum();
    const std::size_t end = at_;
    Node right = 0;
    if (function.arguments == 2) {
      if (!take(',')) fail_here(fmt::format("\",\" and a second argument: {}", usage));
      right = sum();
    }
    if (!take(')')) fail_here(fmt::format("\")\": {}", usage));
    if (function.operation == Operation::sqrt) refuse_negative(inside, end, left, "the square root", "sqrt(abs({0}))");
    if (function.operation == Operation::log) refuse_negative(inside, end, left, "the logarithm", "log(abs({0}))");
    return make(function.operation, left, right);
  }

  Expression& expression_;
  std::string_view text_;
  const std::vector<std::string>& parameters_;
  const std::vector<Range>& ranges_;
  std::size_t at_ = 0;
  int depth_ = 0;
};

Expression::Expression(std::string_view text, const std::vector<std::string>& parameters, const std::vector<Range>& ranges) : parameters_(parameters.size()) {
  root_ = ExpressionParser(*this, text, parameters, ranges).whole();
  compile();
}

bool Expression::is_function(std::string_view name) {
  return std::any_of(ExpressionParser::functions.begin(), ExpressionParser::functions.end(), [&](const auto& f) { return f.name == name; });
}

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

bool Expression::uses_parameter(std::size_t k) const {
  return std::any_of(used_parameters_.begin(), used_parameters_.end(), [&](const Leaf& leaf) { return leaf.index == k; });
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
  if (const double per = per_scale_[static_cast<std::size_t>(symbol)]; per != 1) factor = all.make(Operation::multiply, all.number(per), factor);
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
