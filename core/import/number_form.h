#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace unrig {

/// How numbers are written in a text table.
struct NumberForm {
  char decimal = '.';                ///< or ','
  char thousands = '\0';             ///< what sets off groups of three digits before the decimal sign; 0: nothing does
  std::vector<std::string> missing;  ///< cells that mean a missing sample, as empty ones do
};

/// The number in a cell; nothing where there is none, where it has the other decimal sign, or a sign for thousands that does not set off three digits.
std::optional<double> cell_number(std::string_view cell, const NumberForm& form);

/// Why a cell holds no number, and what the mapping can say about it.
struct NoNumber {
  std::string why, advice;
};
NoNumber why_no_number(std::string_view cell, const NumberForm& form);

/// Finds the decimal sign that a table's cells show. "0,5" shows a comma, "0.5" a point; "1,107" and "1.107" may be 1107 as well, and show nothing.
class DecimalSign {
 public:
  void see(std::string_view cell);
  bool is_point() const { return point_; }
  bool is_comma() const { return comma_ && !point_; }

 private:
  bool point_ = false, comma_ = false;
};

}  // namespace unrig
