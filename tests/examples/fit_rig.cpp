#include <cstdio>

#include "core/files/text_file.h"
#include "fit/fit.h"
#include "fit/fit_files.h"

// fit_rig RIG RESULT RUN...: what `unrig fit` does.
int main(int count, char** argv) {
  unrig::FitProblem problem;
  problem.rig = unrig::read_rig(argv[1]);
  for (int i = 3; i < count; ++i) problem.runs.push_back(unrig::read_run(argv[i]));
  const unrig::FitResult result = unrig::fit(problem);
  for (const unrig::FittedParameter& p : result.parameters) std::printf("%s = %.6g +- %.2g %s\n", p.name.c_str(), p.value, p.std_error, p.unit.c_str());
  unrig::write_text(argv[2], unrig::to_json(result));
}
