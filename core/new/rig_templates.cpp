#include "core/new/rig_templates.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/files/error.h"
#include "core/files/near_word.h"

namespace unrig {
namespace {

constexpr const char* tube = R"toml(# A round tube (sting) that is clamped at one end and carries a wing. The numbers are an example and read as they stand.
# Lines that begin with "# ?" ask what only you know. Any unit will do: "mm", "in", "g", "lb", "GPa", "psi". Then: unrig check --rig THIS_FILE
unrig_rig = 1
# ? What do reports call the rig?
name = "aluminium sting"

[section]                            # of the wing
# ? Its chord, and where the pitch axis (the shaft) lies, as a fraction of the chord from the leading edge?
chord = "150 mm"
pitch_axis = 0.25

[normal]                             # bending, along the normal force; elements are counted from 1 at the clamp
modes = "all"                        # or how many the model keeps
# ? Which material? steel: 7850 kg/m^3, 205 GPa; aluminium: 2700 kg/m^3, 70 GPa; brass: 8500 kg/m^3, 100 GPa
density = "2700 kg/m^3"
youngs_modulus = "70 GPa"
# density_std_percent = 1            # one standard deviation, where you know it; what states none is taken as exact

# ? The tube: length from the clamp to the wing, outer diameter, wall? Ten elements or so are enough.
[[normal.section]]
elements = 8                         # elements 1 to 8
length = "800 mm"                    # of the eight together
shape = "tube"                       # or: circular (diameter), box or rectangular (height, width, wall)
outer_diameter = "40 mm"
wall = "3 mm"

# ? The wing: span, mass per length (weigh it), bending and torsional stiffness? If the tube runs on inside of it: its I and J; a wing is stiff, so a guess does little.
[[normal.section]]
elements = 3                         # elements 9 to 11
length = "300 mm"
shape = "other"
mass_per_length = "2.5 kg/m"
inertia_per_length = "4.67 g.m"      # about the pitch axis, kg m^2 per m; of a plate of even mass: m (c^2 / 12 + r^2), r from mid-chord to the axis
second_moment = "2e-7 m^4"           # I, times youngs_modulus above
polar_moment = "4e-7 m^4"            # J, times the shear modulus below

[normal.mass_centre]
# ? How far does each element's mass centre lie aft of the pitch axis? Balance the wing on an edge. Without this table: 0.
unit = "mm"
values = [0, 0, 0, 0, 0, 0, 0, 0, 20, 20, 20]

# [normal.added_mass]                # a sensor, a flange: at which element?
# unit = "g"
# values = [0, 0, 0, 0, 0, 0, 0, 0, 0, 5, 0]

[torsion]                            # twist; lengths and sections are those above
modes = 1                            # torsional modes that the model keeps
shear_modulus = "26 GPa"             # steel: 79 GPa, aluminium: 26 GPa, brass: 37 GPa
rigid_from = 9                       # the wing, from element 9 outward, turns as one

[submerged]
# ? Which elements are in the stream?
elements = [9, 10, 11]

[gauge]
# ? At which element sit the strain gauges, and at which one hung the dead weights of the calibration?
element = 1
calibration_element = 10

# ? Further sensors: which column of your recordings, which kind, at which element? Delete these lines where there is none.
[[sensor]]
column = "acc"
reads = "acceleration"               # or displacement, velocity, twist, twist_rate
element = 10
# gain = "0.01 V.s^2/m"              # of a column in volts
)toml";

constexpr const char* plate = R"toml(# A flat plate that is clamped at one end in a turntable and stands in the stream: foil and spring in one. The numbers are an example and read as they stand.
# Lines that begin with "# ?" ask what only you know. Any unit will do: "mm", "in", "g", "lb", "GPa", "psi". Then: unrig check --rig THIS_FILE
unrig_rig = 1
# ? What do reports call the rig?
name = "aluminium plate"

[section]
# ? The chord, and where the axis of the turntable lies, as a fraction of the chord from the leading edge?
chord = "100 mm"
pitch_axis = 0.5

[normal]                             # bending, along the normal force; elements are counted from 1 at the clamp
modes = "all"                        # or how many the model keeps
# ? Which material? steel: 7850 kg/m^3, 205 GPa; aluminium: 2700 kg/m^3, 70 GPa; acrylic: 1190 kg/m^3, 3.2 GPa
density = "2700 kg/m^3"
youngs_modulus = "70 GPa"
mass_centre = "0 mm"                 # mid-chord lies on the pitch axis

# ? The plate's length from the clamp, its thickness (height) and its width, which is the chord?
[[normal.section]]
elements = 10
length = "500 mm"                    # of the ten together
shape = "rectangular"
height = "6 mm"                      # along the normal force
width = "100 mm"                     # along the chord

# In [normal], clamp_spring = "2e4 N.m/rad" says that the clamp turns; without it the clamp is rigid.

[torsion]
modes = 1                            # torsional modes that the model keeps
shear_modulus = "26 GPa"             # steel: 79 GPa, aluminium: 26 GPa, acrylic: 1.2 GPa
rigid_from = 10                      # the last element: the plate twists along its whole length

[submerged]
# ? Which elements are in the stream?
elements = [2, 3, 4, 5, 6, 7, 8, 9, 10]

[gauge]
# ? At which element sit the strain gauges, and at which one hung the dead weights of the calibration?
element = 1
calibration_element = 10
)toml";

constexpr const char* drawing = R"toml(# A rig from its drawing: a shaft of several cross-sections, weighed parts, and numbers that say how well they are known. The numbers are an example.
# Lines that begin with "# ?" ask what only you know. Any unit will do: "mm", "in", "g", "lb", "GPa", "psi". Then: unrig check --rig THIS_FILE
unrig_rig = 1
# ? What do reports call the rig?
name = "rig from its drawing"

[section]                            # of the airfoil
# ? Its chord, and where the pitch axis lies, as a fraction of the chord from the leading edge?
chord = "150 mm"
chord_std = "0.3 mm"                 # one standard deviation; what states none is taken as exact
pitch_axis = 0.25

[normal]                             # bending, along the normal force; elements are counted from 1 at the clamp
modes = "all"                        # or how many the model keeps
# ? Young's modulus of each element: of one material "205 GPa", of several a list as for the masses below?
youngs_modulus = "205 GPa"

# ? The cross-sections from the clamp outward, and the length of each: circular (diameter), tube (outer_diameter, wall), rectangular (height, width), box (height, width, wall),
# ? other (second_moment, polar_moment)? Height is along the normal force, width along the chord.
[[normal.section]]                   # element 1: the flange
length = "60 mm"
shape = "circular"
diameter = "50 mm"
[[normal.section]]                   # elements 2 and 3: the load cell, where the strain gauges sit
elements = 2
length = "80 mm"                     # of the two together
shape = "rectangular"
height = "12 mm"
width = "40 mm"
[[normal.section]]                   # elements 4 and 5: a box
elements = 2
length = "240 mm"
shape = "box"
height = "30 mm"
width = "40 mm"
wall = "3 mm"
[[normal.section]]                   # elements 6 to 8: the airfoil
elements = 3
length = "420 mm"
shape = "other"
second_moment = "40000 mm^4"
polar_moment = "60000 mm^4"          # torsion constant J

[normal.mass]
# ? The mass of each element, weighed? Not weighed: delete this table and give `density = "7850 kg/m^3"` above the sections.
unit = "kg"
values = [0.93, 0.16, 0.16, 0.37, 0.37, 0.35, 0.35, 0.35]
std_percent = 0.5                    # of each, independent
[normal.mass_centre]
# ? How far does each mass centre lie aft of the pitch axis? Without this table: 0.
unit = "mm"
values = [0, 0, 0, 0, 0, 18, 18, 18]
std = "1 mm"

[torsion]                            # twist; lengths and sections are those above
modes = 1
shear_modulus = "79 GPa"
rigid_from = 6                       # the airfoil, from element 6 outward, turns as one
# ? The moment of inertia of each torsional element about the pitch axis? The last one has that of all outboard.
inertia.unit = "g.m^2"
inertia.values = [0.3, 0.03, 0.03, 0.1, 0.1, 2.4]
inertia.std_percent = 3

[submerged]
# ? Which elements are in the stream?
elements = [6, 7, 8]

[gauge]
# ? At which element sit the strain gauges, at which one hung the dead weights, and how well is the calibration known?
element = 2
calibration_element = 7
calibration_uncertainty = 0.005      # one standard deviation, as a fraction of the reading
# lowpass = { order = 2, cutoff = "100 Hz", damping_ratio = 0.7 }   # an amplifier's filter, where there is one
)toml";

constexpr const char* modes = R"toml(# A rig that is known only as modes, from a modal test or a calculation. The numbers are an example and read as they stand.
# Lines that begin with "# ?" ask what only you know. Then: unrig check --rig THIS_FILE
# Such a rig has no angle of attack: its runs are "pluck", "forced" (column force) or "moved" (column mount_acceleration).
unrig_rig = 1
# ? What do reports call the rig?
name = "balance by its modes"

# ? For each mode: modal mass for a force where the hammer or the load acts, frequency in vacuum (air will do), damping ratio, and what the gauge reads per metre of modal
# ? displacement? The gauge reads the sum of gauge_gain times q, in the unit of its column: with one mode and a gauge that was calibrated with dead weights where the
# ? force acts, the gain is the mode's stiffness m (2 pi f)^2. The gains' signs are those of the mode's shape at the gauge.
[[modal]]
mass = "2.1 kg"
frequency = "18.3 Hz"
damping_ratio = 0.006                # fraction of critical damping; without it 0.01, and a fit finds it
gauge_gain = "27800 N/m"
[[modal]]
mass = "1.4 kg"
frequency = "64 Hz"
damping_ratio = 0.01
gauge_gain = "50000 N/m"
)toml";

constexpr const char* impact_test = R"toml(# A rig from an impact test: modes with what the test left uncertain, a gauge and an accelerometer. The numbers are an example and read as they stand.
# Lines that begin with "# ?" ask what only you know. Then: unrig check --rig THIS_FILE
# From a hammer record (`unrig new run --kind forced` shows its form) a fit finds mass, stiffness and damping of each mode, with standard errors:
#     unrig fit --rig THIS_FILE hammer.csv -o fit.json
# The numbers here are where it starts, so the peaks of the record's spectrum are enough for a first try.
unrig_rig = 1
# ? What do reports call the rig?
name = "balance from an impact test"

# ? Which further column does the record have, and what does it measure? Delete these lines, and sensor_shape below, where there is only the gauge.
[[sensor]]
column = "acc"
reads = "acceleration"               # or displacement, velocity, twist, twist_rate
# gain = "0.0102 V.s^2/m"            # of a column in volts: 100 mV per g

# ? For each peak of the spectrum: modal mass for a blow where the hammer struck, frequency, damping ratio (half the width of the peak at 0.707 of its height, over its frequency)?
[[modal]]
mass = "2.1 kg"
mass_std_percent = 5                 # one standard deviation; it counts where the runs do not determine the number
frequency = "18.3 Hz"
frequency_std = "0.05 Hz"
damping_ratio = 0.006
damping_ratio_std = 0.001
gauge_gain = "27800 N/m"             # reading of the gauge per metre of modal displacement
sensor_shape = [1.0]                 # motion of each sensor per unit of modal displacement: 1 where the accelerometer sits at the blow
[[modal]]
mass = "1.4 kg"
mass_std_percent = 5
frequency = "64 Hz"
frequency_std = "0.2 Hz"
damping_ratio = 0.01
damping_ratio_std = 0.002
gauge_gain = "50000 N/m"
sensor_shape = [1.0]
)toml";

}  // namespace

const std::vector<RigTemplate>& rig_templates() {
  static const std::vector<RigTemplate> all{{"tube", "a tube (sting) that carries a wing, from diameters and density", tube, false},
                                            {"plate", "a flat plate clamped at one end, from its dimensions", plate, false},
                                            {"drawing", "a shaft of several sections with weighed parts, and what is uncertain", drawing, false},
                                            {"modes", "masses, frequencies and damping ratios of modes", modes, true},
                                            {"impact-test", "modes of an impact test, with their uncertainty and an accelerometer", impact_test, true}};
  return all;
}

const RigTemplate& rig_template(const std::string& name) {
  std::vector<std::string> names;
  for (const RigTemplate& one : rig_templates()) {
    if (one.name == name) return one;
    names.emplace_back(one.name);
  }
  const std::string meant = nearest_word(name, names);
  throw InputError({"--from", 0}, fmt::format("there is no template \"{}\"", name), fmt::format("wanted one of: {}", fmt::join(names, ", ")), meant.empty() ? "" : "Did you mean " + meant + "?");
}

}  // namespace unrig
