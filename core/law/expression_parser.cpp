#include "core/law/expression.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/near_word.h"
#include "core/files/scan.h"

// How an Expression is read.

namespace unrig {
namespace {


bool any_number(const Range& r) { return std::isinf(r.lower) && std::isinf(r.upper); }

}  // namespace

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
        part.range = symbol == Symbol::U || symbol == Symbol::t ? Range{0, std::numeric_limits<double>::infinity()} : Range{};
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
      const std::string nearest = nearest_word(word, known);
      fail(begin, fmt::format("\"{}\" is no function", word), "wanted one of " + names, nearest.empty() ? "A product is written with *." : fmt::format("Did you mean {}?", nearest));
    }
    std::vector<std::string> all(symbol_names.begin(), symbol_names.end());
    all.insert(all.end(), parameters_.begin(), parameters_.end());
    const std::string nearest = nearest_word(word, all);
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

}  // namespace unrig
