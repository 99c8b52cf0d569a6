#pragma once
#include <string>

#include "correct/batch/batch.h"

namespace unrig {

/// Writes a batch as its name asks: FILE.json for `unrig collect`, the table otherwise; and a page that shows it, where `page` names one. Both or none.
void write_batch(const BatchResult& result, const std::string& output, const std::string& page);

}  // namespace unrig
