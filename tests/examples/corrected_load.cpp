#include <cstdio>

#include "correct/correct.h"

// corrected_load RIG FIT RUN: the load of a rigid rig at the end of the record.
int main(int, char** argv) {
  const unrig::CorrectResult result = unrig::correct({unrig::read_rig(argv[1]), unrig::read_fit(argv[2]), unrig::read_run(argv[3]), 0});
  const Eigen::Index last = result.normal_force.value.size() - 1;
  std::printf("%.4f +- %.4f N\n", result.normal_force.value[last], result.normal_force.std[last]);
}
