#pragma once
#include <string>
#include <vector>

#include "core/files/text_file.h"
#include "correct/correct.h"
#include "fit/fit.h"
#include "tests/support/csv_column.h"
#include "tests/support/sample_data.h"
#include "tests/support/temporary_directory.h"

namespace unrig::test {

inline Rig null_rig() { return read_rig(null_campaign("rig.toml")); }

/// What `unrig fit` finds in the five runs, read back from its file; once per process.
inline const FittedRig& null_fit() {
  static const FittedRig fitted = [] {
    FitProblem problem;
    problem.rig = null_rig();
    for (const std::string run : {"dry_pluck", "wet_pluck", "step_a", "step_b", "step_c"}) problem.runs.push_back(read_run(null_campaign(run + ".csv")));
    const TemporaryDirectory directory;
    return read_fit(directory.file("fit.json", to_json(fit(problem))));
  }();
  return fitted;
}

struct WrittenParameter {
  std::string name;
  double value, std_error;
};

/// The fit of a campaign's five runs with this effect, its values written down because it takes seconds to minutes; without correlations.
inline FittedRig written_fit(const std::string& effect, const std::vector<WrittenParameter>& parameters) {
  FittedRig fit;
  fit.file = effect + ".json";
  fit.effects = {effect};
  for (const WrittenParameter& written : parameters) {
    FittedParameter& p = fit.parameters.emplace_back();
    p.name = written.name;
    p.value = written.value;
    p.std_error = written.std_error;
  }
  const auto count = static_cast<Eigen::Index>(parameters.size());
  fit.correlation = Eigen::MatrixXd::Identity(count, count);
  fit.runs = {"step_a.csv", "step_b.csv", "step_c.csv"};
  return fit;
}

inline CorrectProblem null_problem(const std::string& run) { return {null_rig(), null_fit(), read_run(null_campaign(run + ".csv")), 0}; }

}  // namespace unrig::test
