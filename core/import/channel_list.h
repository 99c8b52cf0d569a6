#pragma once
#include <string>

#include "core/import/recording.h"

namespace unrig {

/// The channels of a recording as a table: samples, unit, sampling rate, smallest, largest and mean value, and the standard deviation of the white noise
/// (core/run/motion.h). A rate is the file's, or that of a column of evenly spaced times. Behind them stands what else is to be known of a channel.
std::string channel_list(const Recording& recording);

/// The rate [Hz] of a column of times: its values increase by one step, in a unit of time; 0 where they do not.
double rate_of_times(const RecordedChannel& channel);

}  // namespace unrig
