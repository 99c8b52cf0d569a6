#pragma once
#include <memory>
#include <string>

#include "core/rig/givens.h"
#include "core/files/toml_table.h"

namespace unrig {

/// What a rig file states of the uncertainty of its numbers; null where it states nothing.
///
///     [normal]
///     mass.std_percent = 1.0           # one standard deviation: of each entry, independent
///     mass.common_std_percent = 0.5    # that all entries share, beside it
///     station.std = "1.5 mm"           # the same for each entry
///     mass_centre.std_values = [..]    # one per entry, in the unit and scale of the array
///     youngs_modulus_std_percent = 2   # of one value that stands for all elements
///     [section]
///     chord_std = "0.5 mm"             # or chord_std_percent = 0.5
///
/// `rig` is what was read from `file`. A number whose standard deviation is 0, and a percentage of 0, state nothing.
/// Throws InputError (file, line, key) for two statements of one error, negative ones, wrong units, and lists of another length.
std::shared_ptr<const Givens> stated_errors(const TomlTable& file, const Rig& rig);

/// What a run's head states of `speed`, `density`, `calibration`, `force_calibration` (`speed_std` or `speed_std_percent`, and `speed_error = "common"` or `"own"`) and of the clock
/// (`clock_std_percent`, `clock_error`). Common errors are the default. Throws as above.
std::shared_ptr<const Givens> stated_errors_of_run(const TomlTable& head, const Run& run);

}  // namespace unrig
