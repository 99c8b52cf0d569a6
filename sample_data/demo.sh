#!/bin/sh
# The demonstration: set-up, build, then the recordings of one rig become rig parameters, an apparent mass and a corrected load.
# The results go to build/demo.
set -eu
cd "$(dirname "$0")/.."
sh sample_data/setup.sh
cmake --build build --target unrig --parallel "$(nproc)"

campaign=sample_data/campaigns/null
results=build/demo
rm -rf "$results"
mkdir -p "$results"

# Says what it does, then does it.
run() {
  printf '\n$ %s\n' "$*"
  "$@"
}

run build/unrig fit --rig $campaign/rig.toml \
  $campaign/dry_pluck.csv $campaign/wet_pluck.csv $campaign/step_a.csv $campaign/step_b.csv $campaign/step_c.csv -o $results/fit.json
run build/unrig apparent-mass --rig $campaign/rig.toml --dry $campaign/dry_pluck.csv --wet $campaign/wet_pluck.csv -o $results/apparent.json
run build/unrig correct --rig $campaign/rig.toml --fit $results/fit.json $campaign/step_a.csv \
  -o $results/step_a_corrected.csv --indicial $results/step_a_indicial.csv
run build/unrig report $results/fit.json $results/apparent.json $results/step_a_corrected.csv $results/step_a_indicial.csv -o $results/report.html

cat <<TEXT

The results are in $results:
  fit.json               the rig: stiffness, damping, apparent mass, lift slope of each run, with standard errors
  apparent.json          the apparent mass from the two free decays alone
  step_a_corrected.csv   the load that a rigid rig would have felt in step_a, with a standard deviation at each sample
  step_a_indicial.csv    the normalised step response
  report.html            all of it to look at, in any browser, without a network
The recordings are simulated, so the right answers are known: sample_data/campaigns/KEY.json, entry "null".
TEXT
