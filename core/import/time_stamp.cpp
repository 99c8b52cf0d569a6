#include "core/import/time_stamp.h"

#include <algorithm>
#include <chrono>

namespace unrig {
namespace {

constexpr std::int64_t day = 86400;

/// Takes what it understands off the front of a text; where something is amiss `failed` says so.
struct Scanner {
  std::string_view text;
  bool failed = false;

  bool takes(std::string_view any_of) {
    const bool there = !text.empty() && any_of.find(text.front()) != std::string_view::npos;
    if (there) text.remove_prefix(1);
    return there;
  }
  void expect(std::string_view any_of) { failed = !takes(any_of) || failed; }

  int digits(std::size_t count, int most) {
    int value = 0;
    for (std::size_t i = 0; i < count && i < text.size(); ++i) value = text[i] >= '0' && text[i] <= '9' ? 10 * value + (text[i] - '0') : most + 1;
    failed = failed || text.size() < count || value > most;
    text.remove_prefix(std::min(count, text.size()));
    return failed ? 0 : value;
  }

  double fraction() {
    double value = 0, unit = 1;
    const std::size_t before = text.size();
    for (; !text.empty() && text.front() >= '0' && text.front() <= '9'; text.remove_prefix(1)) value += (text.front() - '0') * (unit /= 10);
    failed = failed || text.size() == before;
    return value;
  }
};

/// Days since 1970 of "2026-11-23".
std::int64_t date(Scanner& scan) {
  const int year = scan.digits(4, 9999);
  scan.expect("-");
  const int month = scan.digits(2, 12);
  scan.expect("-");
  const int of_month = scan.digits(2, 31);
  const std::chrono::year_month_day read{std::chrono::year(year), std::chrono::month(static_cast<unsigned>(month)), std::chrono::day(static_cast<unsigned>(of_month))};
  scan.failed = scan.failed || !read.ok();
  return scan.failed ? 0 : std::chrono::sys_days(read).time_since_epoch().count();
}

/// Seconds that "Z" or "+01:00" is ahead of UTC.
int offset(Scanner& scan) {
  if (scan.takes("Z") || scan.text.empty()) return 0;
  const int sign = scan.text.front() == '-' ? -1 : 1;
  scan.expect("+-");
  const int hours = scan.digits(2, 23);
  scan.takes(":");
  return sign * 60 * (60 * hours + scan.digits(2, 59));
}

}  // namespace

std::optional<TimeStamp> read_time_stamp(std::string_view text) {
  Scanner scan{text};
  TimeStamp stamp;
  stamp.dated = text.size() > 4 && text[4] == '-';
  if (stamp.dated) {
    stamp.second = day * date(scan);
    scan.expect("T ");
  }
  const int hours = scan.digits(2, 23);
  scan.expect(":");
  const int minutes = scan.digits(2, 59);
  scan.expect(":");
  stamp.second += 60 * (60 * hours + minutes) + scan.digits(2, 60);  // 60: a leap second
  if (scan.takes(".,")) stamp.fraction = scan.fraction();
  if (stamp.dated) stamp.second -= offset(scan);
  if (scan.failed || !scan.text.empty()) return std::nullopt;
  return stamp;
}

std::optional<double> SecondsSinceTheFirst::operator()(const TimeStamp& stamp) {
  if (!first_) first_ = stamp, last_ = stamp.second;
  if (stamp.dated != first_->dated) return std::nullopt;
  if (!stamp.dated && stamp.second < last_ - day / 2) ++days_;
  last_ = stamp.second;
  return static_cast<double>(stamp.second + day * days_ - first_->second) + (stamp.fraction - first_->fraction);
}

}  // namespace unrig
