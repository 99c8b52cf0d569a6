#include "core/rig/drawn_sections.h"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>
#include <stdexcept>

#include "core/rig/beam_flexibility.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr const char* shapes = "wanted \"circular\", \"tube\", \"rectangular\", \"box\" or \"other\"";

/// Keys that a section has whatever its shape, then those of its shape.
void allow(const TomlTable& table, SectionsOf of, std::initializer_list<std::string_view> of_shape) {
  for (const std::string& key : table.keys()) {
    const bool known = key == "shape" || key == "elements" || (of == SectionsOf::normal && key == "length") || std::find(of_shape.begin(), of_shape.end(), key) != of_shape.end();
    if (known) continue;
    std::string wanted = "wanted one of: shape, elements";
    if (of == SectionsOf::normal) wanted += ", length";
    for (const std::string_view one : of_shape) wanted += fmt::format(", {}", one);
    table.fail(key, fmt::format("the key \"{}\" is unknown for the shape \"{}\"", table.full_name(key), table.text("shape")), wanted);
  }
}

CrossSection rectangle(const TomlTable& table, SectionsOf of) {
  if (of == SectionsOf::torsion && table.has("a")) {  // in any order: torsion does not ask which is which
    allow(table, of, {"a", "b"});
    CrossSection section;
    section.torsion_constant = rectangular_torsion_constant(table.positive_quantity("a", "m"), table.positive_quantity("b", "m"));
    return section;
  }
  allow(table, of, {"height", "width"});
  return rectangular_section(table.positive_quantity("height", "m"), table.positive_quantity("width", "m"));
}

CrossSection other(const TomlTable& table, SectionsOf of) {
  CrossSection section;
  section.torsion_constant = table.positive_quantity("polar_moment", "m^4");
  if (of == SectionsOf::torsion) {
    allow(table, of, {"polar_moment"});
    return section;
  }
  allow(table, of, {"second_moment", "polar_moment", "mass_per_length", "inertia_per_length"});
  section.second_moment = table.positive_quantity("second_moment", "m^4");
  return section;
}

CrossSection read_section(const TomlTable& table, SectionsOf of) {
  const std::string shape = table.text("shape");
  const auto length = [&](const char* key) { return table.positive_quantity(key, "m"); };
  try {
    if (shape == "circular") {
      allow(table, of, {"diameter"});
      return circular_section(length("diameter"));
    }
    if (shape == "tube") {
      allow(table, of, {"outer_diameter", "wall"});
      return tube_section(length("outer_diameter"), length("wall"));
    }
    if (shape == "rectangular") return rectangle(table, of);
    if (shape == "box") {
      allow(table, of, {"height", "width", "wall"});
      return box_section(length("height"), length("width"), length("wall"));
    }
    if (shape == "other") return other(table, of);
  } catch (const std::invalid_argument& error) {
    table.fail("wall", fmt::format("{}: {}", table.full_name("wall"), error.what()), "wanted a wall of less than half the outer dimension");
  }
  table.fail("shape", fmt::format("{} is \"{}\"", table.full_name("shape"), shape), shapes);
}

/// For how many elements a table of a list stands.
Index count_of(const TomlTable& table) {
  if (!table.has("elements")) return 1;
  const int count = table.integer("elements");
  if (count < 1) table.fail("elements", fmt::format("{} is {}", table.full_name("elements"), count), "wanted one element at least");
  return count;
}

double not_negative(const TomlTable& table, const char* key, const char* si) {
  if (!table.has(key)) return 0;
  const double value = table.quantity(key, si);
  if (!(value >= 0)) table.fail(key, fmt::format("{} is {} {}", table.full_name(key), value, si), "wanted zero or more");
  return value;
}

}  // namespace

VectorXd DrawnSections::second_moments() const {
  VectorXd values(elements());
  for (Index k = 0; k < values.size(); ++k) values[k] = section[static_cast<std::size_t>(k)].second_moment;
  return values;
}

VectorXd DrawnSections::torsion_constants() const {
  VectorXd values(elements());
  for (Index k = 0; k < values.size(); ++k) values[k] = section[static_cast<std::size_t>(k)].torsion_constant;
  return values;
}

DrawnSections read_sections(const TomlTable& chain, SectionsOf of, Index elements) {
  const bool list = chain.has_array("section");
  const std::vector<TomlTable> tables = list ? chain.tables("section") : std::vector{chain.table("section")};
  Index count = 0;
  for (const TomlTable& table : tables) count += list || table.has("elements") || elements == 0 ? count_of(table) : elements;
  if (elements > 0 && count != elements) {
    chain.fail("section", fmt::format("{} is for {} element{}", chain.full_name("section"), count, count == 1 ? "" : "s"), fmt::format("wanted sections for {}, in all", elements),
               "A section with `elements = 8` stands for eight.");
  }
  DrawnSections all;
  all.mass_per_length = VectorXd::Zero(count);
  all.inertia_per_length = VectorXd::Zero(count);
  const bool with_length = tables.front().has("length");
  if (with_length) all.length.resize(count);
  for (const TomlTable& table : tables) {
    const CrossSection section = read_section(table, of);
    const Index first = all.elements(), many = tables.size() == 1 ? count : count_of(table);
    all.section.insert(all.section.end(), static_cast<std::size_t>(many), section);
    all.mass_per_length.segment(first, many).setConstant(not_negative(table, "mass_per_length", "kg/m"));
    all.inertia_per_length.segment(first, many).setConstant(not_negative(table, "inertia_per_length", "kg.m"));
    if (table.has("length") != with_length) table.fail("length", fmt::format("{} is {}, that of the first section is {}", table.full_name("length"), with_length ? "missing" : "given", with_length ? "given" : "missing"), "wanted a length in every section, or in none");
    if (with_length) all.length.segment(first, many).setConstant(table.positive_quantity("length", "m") / static_cast<double>(many));
  }
  return all;
}

}  // namespace unrig
