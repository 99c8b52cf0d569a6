#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace unrig {

/// A moment as ISO 8601 writes it: 2026-11-23T12:00:00.000, also with a blank for the T, with Z or an offset such as +01:00 behind it, or the clock alone, 12:00:00.000.
struct TimeStamp {
  bool dated = false;
  std::int64_t second = 0;  ///< of the day; with a date, since 1970
  double fraction = 0;      ///< of a second; its sign may be a point or a comma
};

std::optional<TimeStamp> read_time_stamp(std::string_view text);

/// Seconds since the first time stamp. Clocks without a date go on behind midnight.
class SecondsSinceTheFirst {
 public:
  /// Nothing where one stamp has a date and another has none.
  std::optional<double> operator()(const TimeStamp& stamp);

 private:
  std::optional<TimeStamp> first_;
  std::int64_t last_ = 0, days_ = 0;
};

}  // namespace unrig
