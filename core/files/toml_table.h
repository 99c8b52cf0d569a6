#pragma once
#include <toml++/toml.h>

#include <Eigen/Core>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/files/error.h"

namespace unrig {

/// One table of a TOML file that is read strictly: every key is known, every value has its type and unit, and whatever is wrong is an
/// InputError with file, line, the key's full name, what was found and what is wanted.
///
/// Numbers with a unit come in two forms: one value as text, `chord = "6 in"`, and one value per element as a table,
/// `station.unit = "in"`, `station.values = [..]` (or `.rows = [[..], ..]`), times an optional `.scale`. What an array states of
/// its errors stands beside them (core/rig/stated_errors.h).
class TomlTable {
 public:
  /// Parses `text`, whose first line is line 1 of `file`. `advice` ends the message about text that is no TOML.
  static TomlTable parse(std::string_view text, const std::string& file, const std::string& advice);

  /// Throws for the first key that is not among `keys`.
  void allow_only(std::initializer_list<std::string_view> keys) const;

  /// In alphabetical order.
  std::vector<std::string> keys() const;
  bool has(std::string_view key) const { return table_->contains(key); }
  /// True where the key holds text ("6 in"), one value for all elements.
  bool has_text(std::string_view key) const;
  /// True where the key holds an array: `[[sensor]]`, or a list of inline tables.
  bool has_array(std::string_view key) const;
  /// Where the key stands; where the table begins if the key is absent.
  InputError::Place place(std::string_view key) const;
  /// The key with its tables before it, "normal.mass".
  std::string full_name(std::string_view key) const;
  [[noreturn]] void fail(std::string_view key, const std::string& found, const std::string& wanted, const std::string& advice = "") const;

  std::string text(std::string_view key) const;
  std::string text_or(std::string_view key, const std::string& fallback) const;
  double number(std::string_view key) const;
  double number_or(std::string_view key, double fallback) const;
  bool boolean_or(std::string_view key, bool fallback) const;
  int integer(std::string_view key) const;
  std::vector<int> integers(std::string_view key) const;
  std::vector<std::string> texts(std::string_view key) const;
  /// A list of plain numbers.
  Eigen::VectorXd numbers(std::string_view key) const;
  /// One value with its unit, in SI.
  double quantity(std::string_view key, std::string_view si) const;
  double positive_quantity(std::string_view key, std::string_view si) const;

  TomlTable table(std::string_view key) const;
  /// An array of tables, at least one.
  std::vector<TomlTable> tables(std::string_view key) const;

  /// `key.unit`, `key.values`, `key.scale`: any number of values, in SI.
  Eigen::VectorXd quantities(std::string_view key, std::string_view si) const;
  /// The same for `count` elements. One value as text stands for all elements.
  Eigen::VectorXd quantities(std::string_view key, std::string_view si, Eigen::Index count) const;
  /// `rows` of this table, `count` rows of `count` plain numbers.
  Eigen::MatrixXd square(std::string_view rows, Eigen::Index count) const;

 private:
  TomlTable(std::shared_ptr<const toml::table> table, std::string file, std::string name, int line);
  const toml::node& required(std::string_view key) const;
  const toml::array& array(std::string_view key, const std::string& wanted) const;
  double finite(const toml::node& node, std::string_view key, const std::string& which) const;

  std::shared_ptr<const toml::table> table_;
  std::string file_;
  std::string name_;
  int line_ = 1;
};

}  // namespace unrig
