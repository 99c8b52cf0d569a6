#!/bin/sh
# Writes the two motions of the seed beside itself. They are checked in; this is their recipe.
#
#   ideal_step.csv   1 deg from zero, at once, at t = 0 (Eq. 3.18, Figures 4.1 and 4.2): for `unrig simulate --jumps`
#   step.csv         1.3 deg from 2.09 deg (Figures 1.3 and 4.3), beginning at t = 0.1 s. The text gives a ramp at a reduced rate near 0.3;
#                    here it is the smooth step 10 x^3 - 15 x^4 + 6 x^5 over T, whose largest rate 1.875 A/T is 0.3 U/b.
#
# 0.03613 lbm/in^3 and 24 in/s are the seed's water and speed; 0.125 s is one semichord of travel.
set -eu
cd "$(dirname "$0")"

meta_data() {
  printf '# unrig_run = 1\n# name = "%s"\n# kind = "step"\n# medium = "water"\n' "$1"
  printf '# density = "0.03613 lbm/in^3"\n# speed = "24 in/s"\ntime [s],alpha [deg]\n'
}

{
  meta_data "the seed's ideal step of 1 deg"
  awk 'BEGIN { for (k = -1; k <= 2500; ++k) printf "%.4f,%d\n", k * 0.0005, (k >= 0) }'
} > ideal_step.csv

{
  meta_data "the seed's step of 1.3 deg"
  awk 'BEGIN {
    A = 1.3; U_over_b = 8; T = 1.875 * A * atan2(0, -1) / 180 / (0.3 * U_over_b)
    for (k = 0; k <= 3200; ++k) {
      x = (k * 0.0005 - 0.1) / T
      x = x < 0 ? 0 : x > 1 ? 1 : x
      printf "%.4f,%.8f\n", k * 0.0005, 2.09 + A * x * x * x * (10 + x * (6 * x - 15))
    }
  }'
} > step.csv
