#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "core/rig/rig.h"
#include "core/run/run.h"

namespace unrig {

/// Sixteen hexadecimal digits that tell one text from another: FNV-1a of 64 bits. It is no protection against intent.
/// Source: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake and T. Hansen, The FNV Non-Cryptographic Hash Algorithm (IETF draft), section 2.
std::string fingerprint(std::string_view text);

/// The same of a recording: its conditions, its time grid, and the names and values of all of its columns, as they are in memory.
/// Two files with the same readings have the same.
std::string fingerprint(const Run& run);

/// The same of what is read of it with this rig: columns with a meaning, and those that the rig's sensors name. It is that of all columns where no others are there.
std::string fingerprint(const Run& run, const Rig& rig);

/// What tells one rig from another: sixteen digits of all numbers that enter its model, then four of each of its parts, with points between.
/// Numbers count to twelve digits, so that the same in other units is the same. Names, comments, stated uncertainties and laws (which a fit names as effects) do not count.
std::string fingerprint(const Rig& rig);

/// The parts in which two rigs' fingerprints differ, as they are called in the rig file; empty where they are the same.
/// "structure": the kind of rig, its elements or modes and where things sit, without which parameters cannot mean the same.
std::vector<std::string> parts_that_differ(const std::string& a, const std::string& b);

}  // namespace unrig
