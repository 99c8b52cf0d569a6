#pragma once
#include "core/rig/rig.h"
#include "core/files/toml_table.h"

namespace unrig {

/// What [gauge] says of the channel behind the bridge: its calibration's uncertainty, and one filter after the other, low-pass, measured response, delay.
///
/// A delay is an all-pass of order six for each 10 ms of it: its phase is right to 1e-3 rad up to 94 Hz. A measured response counts relative to its gain at the lowest measured
/// frequency, since the dead weights of the calibration hung behind the same amplifier; phase lag is negative. Where the nearest filter misses it by more than
/// 1 %, a warning says so.
void take_gauge_channel(const TomlTable& gauge, Rig& rig);

}  // namespace unrig
