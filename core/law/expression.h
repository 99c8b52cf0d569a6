#pragma once
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace unrig {

/// What a law may look at (correct/manual/laws.md), in SI.
enum class Symbol : std::uint8_t { x, v, a, theta, theta_rate, twist, twist_rate, alpha, U, t, z };
constexpr std::size_t symbol_count = 11;
constexpr std::size_t index_of(Symbol symbol) { return static_cast<std::size_t>(symbol); }
constexpr std::array<std::string_view, symbol_count> symbol_names{"x", "v", "a", "theta", "theta_rate", "twist", "twist_rate", "alpha", "U", "t", "z"};
constexpr std::array<const char*, symbol_count> symbol_units{"m", "m/s", "m/s^2", "rad", "rad/s", "rad", "rad/s", "rad", "m/s", "s", "1"};

/// Text that is no expression: what was found, where, what was wanted instead, and what to do about it (may be empty).
struct ExpressionError : std::runtime_error {
  ExpressionError(std::size_t bytes_before, const std::string& found, std::string instead, std::string what_to_do) : std::runtime_error(found), place(bytes_before), wanted(std::move(instead)), advice(std::move(what_to_do)) {}
  std::size_t place;
  std::string wanted, advice;
};

/// Numbers that something can take.
struct Range {
  double lower = -std::numeric_limits<double>::infinity(), upper = std::numeric_limits<double>::infinity();
};

/// A formula over symbols and parameters with its exact first derivatives: + - * / ^, signs, parentheses, numbers, and abs sign exp log sqrt sin cos tanh min max.
///
/// Equal parts are computed once, constants beforehand. The derivatives come by one sweep backwards over the operations (reverse accumulation: A. Griewank and
/// A. Walther, Evaluating Derivatives (2008), chapter 3), whose cost does not grow with how many there are. Nothing is allocated. Where a function has a corner its slope is
/// the mean of both sides: sign(0) = 0 with slope 0, abs'(0) = 0, min and max of two equal values half of each. An infinite slope (sqrt, and x^p with p < 1, at 0) counts
/// as 0, and so does the slope of 0^p in p.
class Expression {
 public:
  static constexpr std::size_t most_nodes = 200;  ///< operations, numbers and names

  Expression() = default;  ///< 0
  /// Every name is a symbol, a function, or one of `parameters`. `ranges`: of these; empty: anything. Throws ExpressionError for anything else, for an expression with more
  /// than most_nodes parts, and for a root, a logarithm or a fractional power of what may be any number, negative ones too.
  Expression(std::string_view text, const std::vector<std::string>& parameters, const std::vector<Range>& ranges = {});

  /// The value where the symbols (as many as there are) and parameters have these values. Writes its derivatives in each symbol and each parameter.
  double operator()(const double* symbols, const double* parameters, double* in_symbols, double* in_parameters) const;

  /// The same formula with every symbol divided by its scale.
  void divide_by(const std::array<double, symbol_count>& scales);

  bool uses(Symbol symbol) const { return (nodes_[root_].symbols >> static_cast<unsigned>(symbol) & 1u) != 0; }
  bool is_zero() const { return nodes_[root_].operation == Operation::number && nodes_[root_].number == 0; }
  /// Whether a name is one of the functions.
  static bool is_function(std::string_view name);
  /// Numbers that it can take, as far as its parts tell one by one.
  Range range() const { return nodes_[root_].range; }

  struct Split;
  /// This formula as rest + factor * symbol, neither of which has the symbol; nothing where it is not linear in it.
  std::optional<Split> linear_in(Symbol symbol) const;

 private:
  friend class ExpressionParser;
  struct Local;
  enum class Operation : std::uint8_t { number, symbol, parameter, add, subtract, multiply, divide, negate, power, constant_power, absolute, sign, exp, log, sqrt, sin, cos, tanh, minimum, maximum };
  using Node = std::uint32_t;
  struct Part {
    Operation operation = Operation::number;
    Node left = 0, right = 0;  // of an operation
    double number = 0;         // of a number
    std::uint32_t index = 0;   // of a symbol or a parameter
    std::uint32_t symbols = 0; // bits: which it depends on
    Range range = {0, 0};
  };
  Node add(Part part);
  Node number(double value);
  Node make(Operation operation, Node left, Node right = 0);
  Node whole_power(Node base, unsigned exponent);
  Range range_of(const Part& part) const;
  void compile();
  Expression with_root(Node root) const;

  std::vector<Part> nodes_{Part{}};  // operands before what they are in
  Node root_ = 0;
  std::size_t parameters_ = 0;
  std::array<double, symbol_count> per_scale_ = filled(1);

  static constexpr std::array<double, symbol_count> filled(double value) {
    std::array<double, symbol_count> all{};
    for (double& one : all) one = value;
    return all;
  }

  // What evaluation runs through: values stand in places; first constants, then symbols and parameters, then each operation's.
  struct Leaf {
    std::uint16_t place, index;
  };
  struct Step {
    Operation operation;
    std::uint16_t left, right;
  };
  std::vector<double> constants_;
  std::vector<Leaf> symbols_, used_parameters_;
  std::vector<Step> steps_;
  std::uint16_t first_ = 0, result_ = 0;
};

struct Expression::Split {
  Expression rest, factor;
};

}  // namespace unrig
