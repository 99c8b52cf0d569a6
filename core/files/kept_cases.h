#pragma once
#include <optional>
#include <string>

namespace unrig {

/// A folder with one file per case of a long study, each written whole: a call that was ended goes on where it stopped, and processes may share it.
class KeptCases {
 public:
  /// An empty `folder` keeps nothing. Throws InputError where the folder cannot be made.
  explicit KeptCases(const std::string& folder);
  /// What was kept under this name; none where there is nothing.
  std::optional<std::string> find(const std::string& name) const;
  void keep(const std::string& name, const std::string& text) const;
  /// Where that is, or is going to be.
  std::string path(const std::string& name) const;

 private:
  std::string folder_;
};

}  // namespace unrig
