#pragma once
#include <string>
#include <vector>

#include "core/run.h"

namespace unrig {

/// Sixteen hexadecimal digits that tell one recording's readings from another's: FNV-1a (64 bits) of its conditions, its time grid and the names and values of its columns, as they are in memory. Two
/// files with the same readings have the same; it is no protection against intent.
/// Source: G. Fowler, L. C. Noll, K.-P. Vo, D. Eastlake and T. Hansen, The FNV Non-Cryptographic Hash Algorithm (IETF draft), section 2.
std::string fingerprint(const Run& run);

/// The same of texts, in their order.
std::string fingerprint(const std::vector<std::string>& texts);

}  // namespace unrig
