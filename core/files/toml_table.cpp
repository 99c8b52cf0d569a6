#include "core/files/toml_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>

#include "core/files/text_kind.h"
#include "core/files/units.h"

namespace unrig {
namespace {

constexpr const char* quantity_example = "Write number and unit as text, for instance \"6 in\".";

int line_of(const toml::source_region& source) { return static_cast<int>(source.begin.line); }

/// A value as it may stand in a message.
std::string shown(const toml::node& node) {
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  std::ostringstream text;
  node.visit([&text](const auto& value) { text << value; });
  std::string cut = text.str();
  if (cut.size() > 60) cut = cut.substr(0, 57) + "...";
  return cut;
}

}  // namespace

TomlTable::TomlTable(std::shared_ptr<const toml::table> table, std::string file, std::string name, int line)
    : table_(std::move(table)), file_(std::move(file)), name_(std::move(name)), line_(line) {}

TomlTable TomlTable::parse(std::string_view text, const std::string& file, const std::string& advice) {
  require_utf8(text, file, 1);
  std::string converted;
  if (ends_lines_with_returns(text)) text = converted = with_line_feeds(text);
  try {
    return {std::make_shared<const toml::table>(toml::parse(text)), file, "", 1};
  } catch (const toml::parse_error& error) {
    throw InputError({file, line_of(error.source())}, std::string(error.description()), "wanted TOML, `key = value`", advice);
  }
}

InputError::Place TomlTable::place(std::string_view key) const {
  const auto found = table_->find(key);
  return {file_, found == table_->end() ? line_ : line_of(found->first.source())};
}

std::string TomlTable::full_name(std::string_view key) const { return name_.empty() ? std::string(key) : fmt::format("{}.{}", name_, key); }

void TomlTable::fail(std::string_view key, const std::string& found, const std::string& wanted, const std::string& advice) const {
  throw InputError(place(key), found, wanted, advice);
}

void TomlTable::allow_only(std::initializer_list<std::string_view> keys) const {
  for (const auto& [key, value] : *table_) {
    if (std::find(keys.begin(), keys.end(), key.str()) != keys.end()) continue;
    fail(key.str(), fmt::format("the key \"{}\" is unknown", full_name(key.str())),
         fmt::format("wanted one of: {}", fmt::join(keys, ", ")));
  }
}

std::vector<std::string> TomlTable::keys() const {
  std::vector<std::string> all;
  for (const auto& [key, value] : *table_) all.emplace_back(key.str());
  return all;
}

bool TomlTable::has_text(std::string_view key) const {
  const toml::node* node = table_->get(key);
  return node && node->is_string();
}

bool TomlTable::has_array(std::string_view key) const {
  const toml::node* node = table_->get(key);
  return node && node->is_array();
}

const toml::node& TomlTable::required(std::string_view key) const {
  const toml::node* node = table_->get(key);
  if (!node) {
    const std::string where = name_.empty() ? "the file" : fmt::format("[{}]", name_);
    fail(key, fmt::format("{} lacks the key \"{}\"", where, full_name(key)), "wanted this key, which has no default");
  }
  return *node;
}

std::string TomlTable::text(std::string_view key) const {
  const toml::node& node = required(key);
  if (const auto* text = node.as_string()) return text->get();
  fail(key, fmt::format("{} is {}", full_name(key), shown(node)), "wanted text in double quotes");
}

std::string TomlTable::text_or(std::string_view key, const std::string& fallback) const { return has(key) ? text(key) : fallback; }

double TomlTable::finite(const toml::node& node, std::string_view key, const std::string& which) const {
  const auto value = node.is_number() ? node.value<double>() : std::nullopt;
  if (value && std::isfinite(*value)) return *value;
  throw InputError({file_, line_of(node.source())}, fmt::format("{}{} is {}", full_name(key), which, shown(node)),
                   "wanted a finite number without quotes", "");
}

double TomlTable::number(std::string_view key) const { return finite(required(key), key, ""); }

double TomlTable::number_or(std::string_view key, double fallback) const { return has(key) ? number(key) : fallback; }

bool TomlTable::boolean_or(std::string_view key, bool fallback) const {
  if (!has(key)) return fallback;
  const auto* value = required(key).as_boolean();
  if (!value) fail(key, fmt::format("{} is {}", full_name(key), shown(required(key))), "wanted true or false");
  return value->get();
}

int TomlTable::integer(std::string_view key) const {
  const toml::node& node = required(key);
  const auto value = node.is_integer() ? node.value<int>() : std::nullopt;
  if (!value) fail(key, fmt::format("{} is {}", full_name(key), shown(node)), "wanted a whole number");
  return *value;
}

std::vector<int> TomlTable::integers(std::string_view key) const {
  std::vector<int> values;
  for (const toml::node& node : array(key, "wanted a list of whole numbers")) {
    const auto value = node.is_integer() ? node.value<int>() : std::nullopt;
    if (!value) fail(key, fmt::format("{}[{}] is {}", full_name(key), values.size() + 1, shown(node)), "wanted a whole number");
    values.push_back(*value);
  }
  return values;
}

std::vector<std::string> TomlTable::texts(std::string_view key) const {
  std::vector<std::string> values;
  for (const toml::node& node : array(key, "wanted a list of texts in double quotes")) {
    const auto* text = node.as_string();
    if (!text) fail(key, fmt::format("{}[{}] is {}", full_name(key), values.size() + 1, shown(node)), "wanted text in double quotes");
    values.push_back(text->get());
  }
  return values;
}

Eigen::VectorXd TomlTable::numbers(std::string_view key) const {
  const toml::array& list = array(key, "wanted a list of numbers");
  Eigen::VectorXd values(static_cast<Eigen::Index>(list.size()));
  for (Eigen::Index k = 0; k < values.size(); ++k) values[k] = finite(list[static_cast<std::size_t>(k)], key, fmt::format("[{}]", k + 1));
  return values;
}

double TomlTable::quantity(std::string_view key, std::string_view si) const {
  const toml::node& node = required(key);
  if (const auto* text = node.as_string()) return unrig::quantity(text->get(), si, place(key), full_name(key));
  fail(key, fmt::format("{} = {} has no unit", full_name(key), shown(node)), fmt::format("wanted a quantity that converts to {}", si),
       quantity_example);
}

double TomlTable::positive_quantity(std::string_view key, std::string_view si) const {
  const double value = quantity(key, si);
  if (!(value > 0)) fail(key, fmt::format("{} is {} {}", full_name(key), value, si), "wanted a value above zero");
  return value;
}

TomlTable TomlTable::table(std::string_view key) const {
  const toml::node& node = required(key);
  const toml::table* found = node.as_table();
  if (!found) fail(key, fmt::format("{} is {}", full_name(key), shown(node)), fmt::format("wanted the table [{}]", full_name(key)));
  return {{table_, found}, file_, full_name(key), place(key).line};
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) const {
  const std::string wanted = fmt::format("wanted [[{}]], one table each", full_name(key));
  std::vector<TomlTable> found;
  for (const toml::node& node : array(key, wanted)) {
    const toml::table* one = node.as_table();
    if (!one) fail(key, fmt::format("{} is {}", full_name(key), shown(node)), wanted);
    found.push_back({{table_, one}, file_, fmt::format("{}[{}]", full_name(key), found.size() + 1), line_of(node.source())});
  }
  if (found.empty()) fail(key, fmt::format("{} is empty", full_name(key)), wanted);
  return found;
}

const toml::array& TomlTable::array(std::string_view key, const std::string& wanted) const {
  const toml::node& node = required(key);
  if (const toml::array* found = node.as_array()) return *found;
  fail(key, fmt::format("{} is {}", full_name(key), shown(node)), wanted);
}

Eigen::VectorXd TomlTable::quantities(std::string_view key, std::string_view si) const {
  const toml::node& node = required(key);
  if (!node.is_table()) {
    fail(key, fmt::format("{} = {} has no unit", full_name(key), shown(node)),
         fmt::format("wanted {0}.unit, which converts to {1}, and {0}.values", full_name(key), si));
  }
  const TomlTable measured = table(key);
  measured.allow_only({"unit", "values", "scale", "std", "std_percent", "std_values", "common_std_percent"});
  const UnitScale scale = unit_scale(measured.text("unit"), si, measured.place("unit"), measured.full_name("unit"));
  const double factor = measured.number_or("scale", 1);
  return (factor * measured.numbers("values")).unaryExpr(scale);
}

Eigen::VectorXd TomlTable::quantities(std::string_view key, std::string_view si, Eigen::Index count) const {
  if (has_text(key)) return Eigen::VectorXd::Constant(count, quantity(key, si));
  const Eigen::VectorXd values = quantities(key, si);
  if (values.size() != count) {
    const TomlTable measured = table(key);
    measured.fail("values", fmt::format("{} has {} values", measured.full_name("values"), values.size()),
                  fmt::format("wanted {}, one per element", count));
  }
  return values;
}

Eigen::MatrixXd TomlTable::square(std::string_view rows, Eigen::Index count) const {
  const toml::array& list = array(rows, "wanted a list of rows");
  const auto sized = [&](const toml::node& node, std::size_t found, const std::string& what) {
    if (static_cast<Eigen::Index>(found) == count) return;
    throw InputError({file_, line_of(node.source())}, fmt::format("{} has {}", what, found),
                     fmt::format("wanted {}, one per element", count), "");
  };
  sized(list, list.size(), full_name(rows) + " (number of rows)");
  Eigen::MatrixXd matrix(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const toml::node& row = list[static_cast<std::size_t>(i)];
    const std::string name = fmt::format("{}[{}]", full_name(rows), i + 1);
    if (!row.is_array()) {
      throw InputError({file_, line_of(row.source())}, fmt::format("{} is {}", name, shown(row)), "wanted a row, a list of numbers", "");
    }
    const toml::array& cells = *row.as_array();
    sized(row, cells.size(), name + " (numbers in the row)");
    for (Eigen::Index j = 0; j < count; ++j) {
      matrix(i, j) = finite(cells[static_cast<std::size_t>(j)], rows, fmt::format("[{}][{}]", i + 1, j + 1));
    }
  }
  return matrix;
}

}  // namespace unrig
