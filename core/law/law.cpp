#include "core/law/law.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/scan.h"
#include "core/propagate/feedback_force.h"
#include "core/files/near_word.h"
#include "core/files/text_file.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {
namespace {

constexpr std::size_t most_parameters = most_law_parameters;
constexpr std::pair<ActsOn, const char*> place_names[] = {{ActsOn::normal, "normal"}, {ActsOn::torsion, "torsion"}, {ActsOn::lift, "lift"}, {ActsOn::gauge, "gauge"}, {ActsOn::mount, "mount"}};

constexpr double unbounded = 1e30;


/// Names in the order in which they stand in an expression.
void collect_names(const std::string& expression, std::vector<std::string>& names) {
  for (std::size_t i = 0; i < expression.size();) {
    if (is_digit(expression[i]) || expression[i] == '.') {  // the e of 1e3 is no name
      while (i < expression.size() && (is_digit(expression[i]) || is_letter(expression[i]) || expression[i] == '.')) ++i;
    } else if (is_letter(expression[i])) {
      const std::size_t begin = i;
      while (i < expression.size() && (is_letter(expression[i]) || is_digit(expression[i]))) ++i;
      const std::string name = expression.substr(begin, i - begin);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    } else {
      ++i;
    }
  }
}

/// The line of an expression that holds `place`, and a mark below it.
std::string marked(const std::string& text, std::size_t place) {
  place = std::min(place, text.size());
  const std::size_t before = place == 0 ? std::string::npos : text.rfind('\n', place - 1), first = before == std::string::npos ? 0 : before + 1;
  std::size_t last = text.find('\n', place);
  if (last == std::string::npos) last = text.size();
  constexpr std::size_t widest = 60;  // on either side of the place
  const bool cut = place - first > widest;
  const std::size_t from = cut ? place - widest : first, to = std::min(last, place + widest);
  std::string shown = text.substr(from, to - from);
  std::replace(shown.begin(), shown.end(), '\t', ' ');
  return fmt::format("\n    {}{}{}\n    {}^", cut ? "..." : "", shown, to < last ? "..." : "", std::string(place - from + (cut ? 3 : 0), ' '));
}

Expression expression_of(const TomlTable& table, std::string_view key, const std::vector<std::string>& names, const std::vector<Range>& ranges) {
  const std::string text = table.text(key);
  try {
    return Expression(text, names, ranges);
  } catch (const ExpressionError& e) {
    table.fail(key, fmt::format("{}: {}", table.full_name(key), e.what()), e.wanted, e.advice + marked(text, e.place));
  }
}

/// A number, or a number with its unit.
Measure measure_of(const TomlTable& table, std::string_view key) {
  if (!table.has_text(key)) return {table.number(key), "1"};
  return split_quantity(table.text(key), table.place(key), table.full_name(key));
}

/// The SI unit to keep a parameter in: as the file spells it where that is one.
std::string unit_of(const Measure& measure, const InputError::Place& place, const std::string& what) {
  const std::string si = si_unit(measure.unit, place, what);
  const UnitScale scale = unit_scale(measure.unit, si, place, what);
  return scale.factor == 1 && scale.offset == 0 ? measure.unit : si;
}

Parameter read_parameter(const TomlTable& table, const std::string& name) {
  table.allow_only({"start", "lower", "upper"});
  Parameter p;
  p.name = name;
  const Measure start = measure_of(table, "start");
  p.unit = unit_of(start, table.place("start"), table.full_name("start"));
  const auto in_si = [&](std::string_view key) {
    const Measure m = measure_of(table, key);
    return unit_scale(m.unit, p.unit, table.place(key), table.full_name(key))(m.value);
  };
  p.start = in_si("start");
  p.lower = table.has("lower") ? in_si("lower") : -unbounded;
  p.upper = table.has("upper") ? in_si("upper") : unbounded;
  if (!(p.lower < p.upper)) table.fail(table.has("lower") ? "lower" : "upper", fmt::format("{} lies from {:g} to {:g} {}", name, p.lower, p.upper, p.unit), "wanted a lower bound below the upper one");
  if (!(p.start >= p.lower && p.start <= p.upper)) table.fail("start", fmt::format("{} starts at {:g} {}", name, p.start, p.unit), fmt::format("wanted a start from {:g} to {:g} {}", p.lower, p.upper, p.unit));
  p.advice = "Record runs that take the law through more of its range.";
  return p;
}

/// In the order in which `used` names them. What is given must be used; what is used and not given is found by the parser.
std::vector<Parameter> read_parameters(const TomlTable& file, const std::vector<std::string>& used) {
  std::vector<Parameter> parameters;
  if (!file.has("parameters")) return parameters;
  const TomlTable table = file.table("parameters");
  for (const std::string& name : table.keys()) {
    const bool is_name = !name.empty() && is_letter(name.front()) && std::all_of(name.begin(), name.end(), [](char c) { return is_letter(c) || is_digit(c); });
    if (!is_name) table.fail(name, fmt::format("\"{}\" is no name for a parameter", name), "wanted letters, digits and _, a letter first");
    if (std::find(symbol_names.begin(), symbol_names.end(), name) != symbol_names.end()) table.fail(name, fmt::format("the symbol {} stands in [parameters]", name), "wanted another name for a parameter");
    if (Expression::is_function(name)) table.fail(name, fmt::format("the function {} stands in [parameters]", name), "wanted another name for a parameter");
    if (std::find(used.begin(), used.end(), name) == used.end()) {
      const std::string nearest = nearest_word(name, used);
      table.fail(name, fmt::format("the parameter {} is not used", name), "wanted it in `force` or `memory`", nearest.empty() ? "Leave it out." : fmt::format("There is {}.", nearest));
    }
  }
  for (const std::string& name : used)
    if (table.has(name)) parameters.push_back(read_parameter(table.table(name), name));
  if (parameters.size() > most_parameters) file.fail("parameters", fmt::format("{} parameters", parameters.size()), fmt::format("wanted {} at most", most_parameters));
  return parameters;
}

/// The symbol that a key of the table [in] names, one that the law uses.
std::size_t symbol_of(const TomlTable& table, const std::string& name, const char* in, const Law& law) {
  const auto found = std::find(symbol_names.begin(), symbol_names.end(), name);
  if (found == symbol_names.end()) table.fail(name, fmt::format("\"{}\" in [{}] is no symbol", name, in), fmt::format("wanted one of {}", fmt::join(symbol_names, " ")));
  const auto s = static_cast<std::size_t>(found - symbol_names.begin());
  if (!law.uses(static_cast<Symbol>(s))) table.fail(name, fmt::format("{} in [{}], which the law does not use", name, in), "wanted only symbols in `force` and `memory`", "Leave it out.");
  return s;
}

std::array<double, symbol_count> read_scales(const TomlTable& file, const Law& law) {
  std::array<double, symbol_count> scales{};
  scales.fill(1);
  if (!file.has("scales")) return scales;
  const TomlTable table = file.table("scales");
  for (const std::string& name : table.keys()) {
    const std::size_t s = symbol_of(table, name, "scales", law);
    if (static_cast<Symbol>(s) == Symbol::z) table.fail(name, "a scale of the memory", "wanted none: z has no dimension");
    scales[s] = table.positive_quantity(name, symbol_units[s]);
  }
  return scales;
}

LearntOn read_learnt_on(const TomlTable& file, const Law& law) {
  LearntOn learnt_on;
  if (!file.has("learnt_on")) return learnt_on;
  const TomlTable table = file.table("learnt_on");
  for (const std::string& name : table.keys()) {
    const std::size_t s = symbol_of(table, name, "learnt_on", law);
    if (static_cast<Symbol>(s) == Symbol::z) table.fail(name, "a range of the memory", "wanted none: z is where the other symbols take it", "Leave it out.");
    const std::vector<std::string> ends = table.texts(name);
    if (ends.size() != 2) table.fail(name, fmt::format("{} has {} value{}", table.full_name(name), ends.size(), ends.size() == 1 ? "" : "s"), "wanted two, the lowest and the highest", fmt::format("For instance [\"-1 {0}\", \"1 {0}\"].", symbol_units[s]));
    const auto in_si = [&](const std::string& text) { return quantity(text, symbol_units[s], table.place(name), table.full_name(name)); };
    const Range range{in_si(ends[0]), in_si(ends[1])};
    if (!(range.lower <= range.upper)) table.fail(name, fmt::format("{} was learnt from {:g} to {:g} {}", name, range.lower, range.upper, symbol_units[s]), "wanted the lowest value first", "Exchange the two.");
    learnt_on.emplace(static_cast<Symbol>(s), range);
  }
  return learnt_on;
}

void check_memory(const TomlTable& file, const Law& law) {
  if (law.memory && !law.force.uses(Symbol::z)) file.fail("memory", "a memory that the force does not use", "wanted z in `force`", "Leave `memory` out, or put z into `force`.");
  if (!law.memory && law.force.uses(Symbol::z)) file.fail("force", "z in `force`, but no `memory`", "wanted memory = \"...\", the rate z' of z", "");
}

void check_acceleration(const TomlTable& file, const Law& law) {
  if (law.memory && law.memory->uses(Symbol::a)) file.fail("memory", "the acceleration a in `memory`", "wanted a rate of displacements and velocities", "The velocity v is its integral.");
}

/// The law at its start values, with every symbol zero but a stream.
void check_rest(const TomlTable& file, const Law& law) {
  std::array<double, symbol_count> rest{}, in_symbols{};
  rest[index_of(Symbol::U)] = 1;
  std::vector<double> start, in_parameters(law.parameters.size());
  for (const Parameter& p : law.parameters) start.push_back(p.start);
  const auto check = [&](const Expression& e, std::string_view key) {
    bool finite = std::isfinite(e(rest.data(), start.data(), in_symbols.data(), in_parameters.data()));
    for (const double slope : in_symbols) finite = finite && std::isfinite(slope);
    for (const double slope : in_parameters) finite = finite && std::isfinite(slope);
    if (!finite) file.fail(key, fmt::format("`{}` or its slope is not finite where every symbol is 0", key), "wanted a law that holds at rest, where a run begins", "For instance sign(v) in place of v / abs(v).");
  };
  check(law.force, "force");
  if (law.memory) check(*law.memory, "memory");
}

std::string learnt_text(const LearntOn& learnt_on) {
  if (learnt_on.empty()) return "";
  std::string text = "[learnt_on]\n";
  for (const auto& [symbol, range] : learnt_on) {
    const auto s = index_of(symbol);
    text += fmt::format("{0} = [\"{1} {3}\", \"{2} {3}\"]\n", symbol_names[s], range.lower, range.upper, symbol_units[s]);
  }
  return text;
}

/// A value as a law file has it, in the fewest digits that read back as the same number.
std::string quantity(double value, const std::string& unit) { return unit == "1" ? fmt::format("{}", value) : fmt::format("\"{} {}\"", value, unit); }

}  // namespace

std::string to_string(ActsOn place) {
  return std::find_if(std::begin(place_names), std::end(place_names), [&](const auto& one) { return one.first == place; })->second;
}

std::string law_text(const Law& law) {
  std::string text = fmt::format("unrig_law = 1\nname = \"{}\"\nacts_on = \"{}\"\nforce = \"{}\"\n", law.name, to_string(law.acts_on), law.force_text);
  if (law.memory) text += fmt::format("memory = \"{}\"\n", law.memory_text);
  if (!law.parameters.empty()) text += "[parameters]\n";
  for (const Parameter& p : law.parameters) {
    text += fmt::format("{} = {{ start = {}", p.name, quantity(p.start, p.unit));
    if (p.lower > -unbounded) text += ", lower = " + quantity(p.lower, p.unit);
    if (p.upper < unbounded) text += ", upper = " + quantity(p.upper, p.unit);
    text += " }\n";
  }
  std::string scales;
  for (std::size_t s = 0; s < symbol_count; ++s)
    if (law.scales[s] != 1) scales += fmt::format("{} = {}\n", symbol_names[s], quantity(law.scales[s], symbol_units[s]));
  if (!scales.empty()) text += "[scales]\n" + scales;
  return text + learnt_text(law.learnt_on);
}

std::string Law::id() const {
  std::string id = "law:";
  for (const char c : name) {
    const bool plain = is_letter(c) || is_digit(c) || c == ' ' || c == '-' || static_cast<unsigned char>(c) >= 0x80;
    id += plain ? c : '_';  // a point would end it, a bracket or = mean something else where parameters are named
  }
  return id;
}

bool Law::says_the_same_as(const Law& other) const {
  const auto same = [](const Parameter& a, const Parameter& b) { return a.name == b.name && a.unit == b.unit; };
  return acts_on == other.acts_on && force_text == other.force_text && memory_text == other.memory_text && scales == other.scales &&
         std::equal(parameters.begin(), parameters.end(), other.parameters.begin(), other.parameters.end(), same);
}

std::string Law::kind() const {
  if (acts_on == ActsOn::gauge) return "signal";
  if (memory) return "memory";
  if (acts_on == ActsOn::lift) return "lift";
  if (force.uses(Symbol::a)) return "inertia";
  const bool moves = force.uses(Symbol::v) || force.uses(Symbol::twist_rate), bends = force.uses(Symbol::x) || force.uses(Symbol::twist);
  if (!moves && !bends) return force.uses(Symbol::alpha) || force.uses(Symbol::theta) || force.uses(Symbol::theta_rate) ? "lift" : "signal";
  if (!moves) return "stiffness";
  std::vector<std::string> names;
  std::vector<Range> starts;
  for (const Parameter& p : parameters) {
    names.push_back(p.name);
    starts.push_back({p.start, p.start});
  }
  const Range range = Expression(force_text, names, starts).range();
  return std::isfinite(range.lower) && std::isfinite(range.upper) ? "friction" : "damping";
}

Law parse_law(const std::string& text, const std::string& file) {
  const TomlTable table = TomlTable::parse(text, file, "A law file is described in the manual, laws.md.");
  if (!table.has("unrig_law") || table.integer("unrig_law") != 1) table.fail("unrig_law", "no unrig_law = 1", "wanted a law file of version 1", "Begin the file with unrig_law = 1.");
  table.allow_only({"unrig_law", "name", "acts_on", "force", "memory", "parameters", "scales", "learnt_on"});
  Law law;
  law.file = file;
  law.text = text;
  law.name = table.text("name");
  if (law.name.find_first_not_of(" \t") == std::string::npos || law.name.find_first_of("\r\n") != std::string::npos || law.name.size() > 100)
    table.fail("name", "a name that is empty, long or of several lines", "wanted up to 100 letters in one line");
  const std::string acts_on = table.text("acts_on");
  const auto place = std::find_if(std::begin(place_names), std::end(place_names), [&](const auto& one) { return one.second == acts_on; });
  if (place == std::end(place_names)) table.fail("acts_on", fmt::format("acts_on is \"{}\"", acts_on), "wanted one of normal, torsion, lift, gauge, mount");
  law.acts_on = place->first;
  law.force_text = table.text("force");
  law.memory_text = table.text_or("memory", "");

  std::vector<std::string> used, names;
  collect_names(law.force_text, used);
  collect_names(law.memory_text, used);
  // Expressions first: an unknown name is more telling than the parameter that it leaves without use.
  if (table.has("parameters")) names = table.table("parameters").keys();
  std::vector<Range> ranges(names.size(), Range{0, std::numeric_limits<double>::infinity()});
  expression_of(table, "force", names, ranges);
  if (table.has("memory")) expression_of(table, "memory", names, ranges);
  law.parameters = read_parameters(table, used);
  names.clear();
  ranges.clear();
  for (const Parameter& p : law.parameters) {
    names.push_back(p.name);
    ranges.push_back({p.lower, p.upper});
  }
  law.force = expression_of(table, "force", names, ranges);
  if (table.has("memory")) law.memory = expression_of(table, "memory", names, ranges);
  check_memory(table, law);
  check_acceleration(table, law);
  bool looks = false;
  for (std::size_t s = 0; s < symbol_count; ++s) looks = looks || law.force.uses(static_cast<Symbol>(s));
  if (!looks) table.fail("force", "a force that is always the same", "wanted one that depends on a symbol", "A constant load is part of the steady load, which is fitted anyhow.");
  law.scales = read_scales(table, law);
  law.learnt_on = read_learnt_on(table, law);
  law.force.divide_by(law.scales);
  if (law.memory) law.memory->divide_by(law.scales);
  check_rest(table, law);
  return law;
}

Law read_law(const std::string& path) { return parse_law(read_text(path), path); }

}  // namespace unrig
