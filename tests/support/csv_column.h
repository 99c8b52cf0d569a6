#pragma once
#include <stdexcept>
#include <string>

#include "core/files/csv_table.h"
#include "core/files/text_file.h"

namespace unrig::test {

/// A column of a CSV file without metadata, as it stands there.
inline Eigen::VectorXd column_of(const std::string& file, const std::string& name) {
  for (const CsvColumn& c : read_csv(read_text(file), 1, file).columns)
    if (c.name == name) return c.value;
  throw std::invalid_argument(file + " has no column " + name);
}

}  // namespace unrig::test
