#include "core/rig/fingerprint.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace unrig {
namespace {

class Fnv1a {
 public:
  void add(unsigned char byte) { state_ = (state_ ^ byte) * 0x100000001b3u; }
  void add(std::string_view text) {
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

template <class Reads>
std::string fingerprint_of(const Run& run, const Reads& reads) {
  Fnv1a hash;
  for (const double x : {run.density, run.speed, run.start, run.dt}) hash.add(x);
  for (const Channel& channel : run.channels) {
    if (!reads(channel)) continue;
    hash.add(channel.name);
    for (const double x : channel.value) hash.add(x);
  }
  return fmt::format("{:016x}", hash.value());
}

/// The numbers of one part of a rig.
class Part {
 public:
  Part& add(double x) {
    hash_.add(fmt::format("{:.12g}", x + 0.0));  // no negative zero
    return *this;
  }
  Part& add(std::string_view text) {
    hash_.add(text);
    return *this;
  }
  template <class Numbers>
  Part& all(const Numbers& numbers) {
    add(static_cast<double>(numbers.size()));
    for (const auto x : numbers) add(static_cast<double>(x));
    return *this;
  }
  Part& all(const Eigen::MatrixXd& numbers) { return all(numbers.reshaped()); }
  std::uint64_t value() const { return hash_.value(); }

 private:
  Fnv1a hash_;
};

constexpr std::array part_names{"structure", "section", "normal", "torsion", "submerged", "gauge", "sensors", "modal", "modes"};

Part structure_of(const Rig& rig) {
  Part part;
  part.add(static_cast<double>(rig.modal.size())).add(static_cast<double>(rig.normal.inertia.size())).add(static_cast<double>(rig.torsion.inertia.size()));
  part.add(rig.rigid_from).add(rig.gauge_element).add(rig.calibration_element);
  return part.all(rig.submerged);
}

Part gauge_of(const Rig& rig) {
  Part part;
  for (const GaugeFilter& filter : rig.gauge_filters) part.all(filter.F.value).all(filter.g.value).all(filter.h).add(filter.direct);
  return part;
}

Part sensors_of(const Rig& rig) {
  Part part;
  for (const Sensor& s : rig.sensors) {
    part.add(s.column).add(static_cast<double>(s.reads)).add(s.element).add(s.gain).add(s.unit);
    if (s.reads == SensorKind::load) part.add(s.row.per_force).add(s.row.per_bending_moment).add(s.row.per_torque);
  }
  for (const ModalMode& mode : rig.modal)
    if (!mode.sensor_shape.empty()) part.all(mode.sensor_shape);
  return part;
}

Part modal_of(const Rig& rig) {
  Part part;
  for (const ModalMode& m : rig.modal) part.add(m.mass).add(m.frequency).add(m.damping_ratio).add(m.gauge_gain).add(m.gauge_unit);
  return part;
}

/// In the order of `part_names`.
std::array<Part, part_names.size()> parts_of(const Rig& rig) {
  return {structure_of(rig),
          Part().add(rig.chord).add(rig.pitch_axis),
          Part().all(rig.station).all(rig.mass_centre).all(rig.normal.inertia).all(rig.normal.flexibility),
          Part().all(rig.torsion.inertia).all(rig.torsion.flexibility),
          Part().add(rig.strip_length),
          gauge_of(rig),
          sensors_of(rig),
          modal_of(rig),
          Part().add(rig.normal.modes).add(rig.torsion.modes)};
}

constexpr std::size_t whole_digits = 16, part_digits = 4;

}  // namespace

std::string fingerprint(std::string_view text) {
  Fnv1a hash;
  for (const char c : text) hash.add(static_cast<unsigned char>(c));
  return fmt::format("{:016x}", hash.value());
}

std::string fingerprint(const Run& run) {
  return fingerprint_of(run, [](const Channel&) { return true; });
}

std::string fingerprint(const Run& run, const Rig& rig) {
  const std::vector<std::string_view> meant = columns_with_a_meaning();
  return fingerprint_of(run, [&](const Channel& channel) {
    return std::find(meant.begin(), meant.end(), channel.name) != meant.end() ||
           std::any_of(rig.sensors.begin(), rig.sensors.end(), [&](const Sensor& s) { return s.column == channel.name; });
  });
}

std::string fingerprint(const Rig& rig) {
  Fnv1a whole;
  std::string parts;
  for (const Part& part : parts_of(rig)) {
    const std::string digits = fmt::format("{:016x}", part.value());
    whole.add(digits);
    parts += "." + digits.substr(0, part_digits);
  }
  return fmt::format("{:016x}", whole.value()) + parts;
}

std::vector<std::string> parts_that_differ(const std::string& a, const std::string& b) {
  std::vector<std::string> parts;
  if (a == b) return parts;
  constexpr std::size_t length = whole_digits + part_names.size() * (part_digits + 1);
  if (a.size() != length || b.size() != length) return {"numbers"};  // another version counts other parts
  for (std::size_t i = 0; i < part_names.size(); ++i) {
    const std::size_t first = whole_digits + i * (part_digits + 1) + 1;
    if (a.compare(first, part_digits, b, first, part_digits) != 0) parts.emplace_back(part_names[i]);
  }
  return parts.empty() ? std::vector<std::string>{"numbers"} : parts;
}

}  // namespace unrig
