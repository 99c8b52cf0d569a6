#pragma once
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/model/aeroelastic_model.h"
#include "core/law/expression.h"

namespace unrig {

/// Where a law acts: force on the first normal mode [N], moment on the first torsional mode [N m], normal force on each strip [N], the gauge's reading, acceleration of the mount [m/s^2].
enum class ActsOn { normal, torsion, lift, gauge, mount };
std::string to_string(ActsOn place);

/// Between which values the symbols lay in the recordings that a law was learnt on, in SI; of a symbol that is not there nothing is known.
using LearntOn = std::map<Symbol, Range>;

/// A law as a user wrote it down (correct/manual/laws.md).
struct Law {
  std::string file;  ///< for messages
  std::string text;  ///< the whole of it
  std::string name;
  ActsOn acts_on = ActsOn::normal;
  std::string force_text, memory_text;
  std::vector<Parameter> parameters;  ///< in SI, in the order in which force and memory name them
  Expression force;                   ///< over the symbols in SI and these parameters
  std::optional<Expression> memory;   ///< z' [1/s]; z is 0 where a run begins
  std::array<double, symbol_count> scales{};
  LearntOn learnt_on;  ///< beyond it the law is a guess (core/law/learnt_range.h); empty: anywhere goes

  /// "law:" and the name, letters, digits, blanks and - as they are.
  std::string id() const;
  /// Whether both are the same formulas of the same parameters, whatever their starts and bounds.
  bool says_the_same_as(const Law& other) const;
  bool uses(Symbol symbol) const { return force.uses(symbol) || (memory && memory->uses(symbol)); }
  /// What kind of physics the symbols make it: memory, inertia, signal, lift, stiffness, friction (a damping that stays bounded) or damping.
  std::string kind() const;
  /// Whether it has no formula of its own: a smooth curve of the state, under the name that the dictionary gives those.
  bool is_curve() const { return name.starts_with("curve"); }
};

/// Reads a law file. Throws InputError for what is no such file; of an expression with its text and a mark below the place:
///
///     unrig_law = 1
///     name = "damping that grows"
///     acts_on = "normal"                       # normal | torsion | lift | gauge | mount
///     force = "-c * abs(v)^p * sign(v)"
///     memory = "..."                           # z', optional
///     [parameters]                             # every name that is no symbol
///     c = { start = "0.1 N", lower = "0 N" }
///     p = { start = 1.5, lower = 0.2, upper = 6 }
///     [scales]                                 # symbols are divided by these
///     v = "0.1 m/s"
///     [learnt_on]                              # where the recordings went that it was learnt on, optional
///     v = ["-0.3 m/s", "0.28 m/s"]
Law read_law(const std::string& path);
/// The same from its text.
Law parse_law(const std::string& text, const std::string& file);
/// A law file of these formulas, parameters, scales and where it was learnt; what parse_law reads from it says the same as `law`.
std::string law_text(const Law& law);

}  // namespace unrig
