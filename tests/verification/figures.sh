#!/bin/sh
# The seed's Figures 4.1a, 4.1b and 4.2, and the open question of its section 4.2.3: simulated runs as CSV, and pictures of them.
#
#   sh tests/verification/figures.sh              into build/figures; needs build/unrig
#   sh tests/verification/figures.sh DIRECTORY    into another one, such as tests/verification/figures for the pictures of README.md beside this file
#
# UNRIG and PYTHON name other programs than build/unrig and python3. The pictures need Matplotlib and NumPy (Debian: python3-matplotlib).
set -eu
cd "$(dirname "$0")/../.."
out=${1:-build/figures}
csv=build/figures
unrig=${UNRIG:-build/unrig}
seed=sample_data/seed
mkdir -p "$out" "$csv"

undamped="--set normal.damping_ratio=0 --set torsion.damping_ratio=0"
# shellcheck disable=SC2086  # $undamped is several words
{
  "$unrig" simulate --rig $seed/rig.toml --run $seed/ideal_step.csv --jumps --wagner seed $undamped -o $csv/ideal_one_mode.csv
  "$unrig" simulate --rig $seed/rig.toml --run $seed/ideal_step.csv --jumps --wagner jones --modes 5 $undamped -o $csv/ideal_five_modes.csv
}
for modes in 1 2 17; do
  "$unrig" simulate --rig $seed/rig_from_drawings.toml --run $seed/step.csv --modes $modes -o $csv/step_$modes.csv
done
"${PYTHON:-python3}" tests/verification/figures.py $csv "$out"
