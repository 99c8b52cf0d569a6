#pragma once
#include <string>
#include <string_view>

#include "core/import/recording.h"

namespace unrig {

/// Reads a TDMS file (National Instruments, versions 1.0 and 2.0; 4712 and 4713 in its lead-ins): contiguous, interleaved and DAQmx raw data, both
/// byte orders, any number of segments, segments that take over the object list of the one before, and a last segment of unknown length.
///
/// Channels are called "group/channel". Scales are applied (tdms_scaling.h); what cannot be scaled is marked raw. Of a chunk that the file's end cuts
/// off, whole rows of interleaved data and whole samples of a single channel are kept, and a warning says so; a cut chunk of several contiguous
/// channels is left out. Text, timestamp and complex channels are left out with a warning.
/// Throws InputError for what is no TDMS, or contradicts itself. Source: NI, "TDMS File Format Internal Structure".
Recording read_tdms(std::string_view bytes, const std::string& file);

}  // namespace unrig
