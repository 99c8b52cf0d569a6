#include "correct/corrected_files.h"

#include <gtest/gtest.h>

#include "core/files/csv_table.h"

namespace unrig {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(CorrectedFiles, KeepTimeAndDistanceApartInLongRecords) {
  // The last rows of two million samples: 1.6e4 semichords in steps of 0.008.
  constexpr Index rows = 4;
  CorrectResult r;
  r.start = 1999.99;
  r.dt = 0.001;
  r.semichords_per_second = 8;
  r.force_per_coefficient = 1;
  r.gauge = r.unexplained = VectorXd::Zero(rows);
  for (CorrectedLoad* load : {&r.normal_force, &r.circulatory}) {
    load->value = load->std = load->half_weight = load->twice_weight = VectorXd::Ones(rows);
    load->by_source = MatrixXd::Ones(rows, sources);
  }
  const CsvTable table = read_csv(to_csv(r), 1, "corrected.csv");
  for (const CsvColumn& column : table.columns) {
    if (column.name != "time" && column.name != "semichords") continue;
    const double step = column.name == "time" ? r.dt : r.dt * r.semichords_per_second;
    for (Index k = 1; k < rows; ++k) EXPECT_NEAR(column.value[k] - column.value[k - 1], step, 0.02 * step) << column.name;
  }
}

}  // namespace
}  // namespace unrig
