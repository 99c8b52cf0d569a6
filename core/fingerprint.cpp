#include "core/fingerprint.h"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace unrig {
namespace {

class Fnv1a {
 public:
  void add(unsigned char byte) { state_ = (state_ ^ byte) * 0x100000001b3u; }
  void add(const std::string& text) {
    for (const char c : text) add(static_cast<unsigned char>(c));
    add(static_cast<unsigned char>(0));
  }
  void add(double x) {
    const double one_of_its_kind = std::isnan(x) ? std::numeric_limits<double>::quiet_NaN() : x;  // a missing sample, however it came to be
    auto bits = std::bit_cast<std::uint64_t>(one_of_its_kind);
    for (int i = 0; i < 8; ++i, bits >>= 8) add(static_cast<unsigned char>(bits & 0xff));
  }
  std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0xcbf29ce484222325u;
};

}  // namespace

std::string fingerprint(const Run& run) {
  Fnv1a hash;
  for (const double x : {run.density, run.speed, run.start, run.dt}) hash.add(x);
  for (const Channel& channel : run.channels) {
    hash.add(channel.name);
    for (const double x : channel.value) hash.add(x);
  }
  return fmt::format("{:016x}", hash.value());
}

std::string fingerprint(const std::vector<std::string>& texts) {
  Fnv1a hash;
  for (const std::string& text : texts) hash.add(text);
  return fmt::format("{:016x}", hash.value());
}

}  // namespace unrig
