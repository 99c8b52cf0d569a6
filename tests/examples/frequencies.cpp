#include <cstdio>

#include "core/rig/structure.h"

// frequencies RIG: below 100 Hz, in air and in still water.
int main(int, char** argv) {
  const unrig::Rig rig = unrig::read_rig(argv[1]);
  for (const double density : {1.2, 998.2}) {
    std::printf("%6.1f kg/m^3:", density);
    for (const double hertz : unrig::coupled_frequencies(rig, unrig::make_basis(rig, 100, density), density)) std::printf(" %.3f", hertz);
    std::printf(" Hz\n");
  }
}
