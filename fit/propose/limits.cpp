#include "fit/propose/limits.h"

#include <fmt/format.h>

#include "core/files/text_file.h"
#include "core/files/toml_table.h"
#include "core/files/units.h"

namespace unrig {
namespace {

constexpr const char* example = "An example: unrig_limits = 1, pluck_load = \"40 N\".";

std::optional<double> positive(const TomlTable& table, std::string_view key, std::string_view si) {
  if (!table.has(key)) return {};
  return table.positive_quantity(key, si);
}

std::array<double, 2> angles(const TomlTable& table) {
  const std::vector<std::string> ends = table.texts("angle");
  if (ends.size() != 2) table.fail("angle", fmt::format("{} angles", ends.size()), "wanted the lowest and the highest, [\"-2 deg\", \"10 deg\"]");
  const auto in_si = [&](std::size_t k) { return quantity(ends[k], "rad", table.place("angle"), table.full_name("angle")); };
  const std::array<double, 2> range{in_si(0), in_si(1)};
  if (!(range[0] < range[1])) table.fail("angle", fmt::format("angles from {} to {}", ends[0], ends[1]), "wanted the lower one first");
  return range;
}

}  // namespace

Limits read_limits(const std::string& path) {
  const TomlTable table = TomlTable::parse(read_text(path), path, example);
  table.allow_only({"unrig_limits", "pluck_load", "angle", "rate", "angle_noise", "force", "speed", "duration", "medium"});
  if (table.integer("unrig_limits") != 1) table.fail("unrig_limits", "an unknown version", "wanted unrig_limits = 1");
  Limits limits;
  limits.file = path;
  limits.pluck_load = positive(table, "pluck_load", "N");
  if (table.has("angle")) {
    limits.angle = angles(table);
    limits.rate = table.positive_quantity("rate", "rad/s");
  } else if (table.has("rate")) {
    table.fail("rate", "a rate without angles", "wanted angle = [\"-2 deg\", \"10 deg\"] beside it");
  }
  limits.angle_noise = positive(table, "angle_noise", "rad");
  limits.force = positive(table, "force", "N");
  limits.speed = positive(table, "speed", "m/s");
  limits.duration = positive(table, "duration", "s");
  if (table.has("medium"))
    for (const TomlTable& medium : table.tables("medium")) {
      medium.allow_only({"name", "density"});
      limits.media.push_back({medium.text("name"), medium.positive_quantity("density", "kg/m^3")});
    }
  if (!limits.pluck_load && !limits.angle && !limits.force) throw InputError({path, 0}, "no run is possible", "wanted one at least of pluck_load, angle with rate, and force", example);
  return limits;
}

}  // namespace unrig
