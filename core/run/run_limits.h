#pragma once
#include <string>

#include "core/run/run.h"

namespace unrig {

class TomlTable;
struct CsvColumn;
struct CsvTable;
struct UnitScale;

// What no instrument reads and no fluid is: such numbers are slips, and their squares would overflow or vanish in double precision.
// Each of these throws InputError with the place, what was found, and what is wanted.

/// Density up to 22 590 kg/m^3, that of osmium, the densest element (CRC Handbook of Chemistry and Physics); speed up to that of light.
void check_conditions(const TomlTable& meta, const Run& run);

/// Times within 4.4e17 s, the age of the universe (Planck Collaboration 2018).
void check_times(const CsvTable& table, const CsvColumn& time, const UnitScale& seconds);

/// Steps from 1e-12 s (the fastest oscilloscopes take a sample every 4e-12 s) to a year.
void check_step(const CsvTable& table, double dt);

/// Readings up to 3.4e38 and, where they change, with a range of 1.2e-38 at least, in SI: what single precision holds (IEEE 754), in which converters hand them on.
void check_readings(const CsvTable& table, const CsvColumn& column, const UnitScale& scale, const std::string& unit);

/// What drives a run of its kind must change in it, or nothing can be found out by it: the angle of a step, the force of a forced run, the motion of a moved mount. Samples
/// of weight 0 do not count. For fits and corrections: simulated, a shaft at rest is as good as any.
void check_what_drives(const Run& run);

/// So must a reading that answers to the rig.
void check_reading_changes(const Run& run, const std::string& column);

}  // namespace unrig
