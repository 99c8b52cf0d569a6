#!/bin/sh
# sh mpirun.sh UNRIG SOURCES: one study by two ranks of Open MPI, each its own shard: the same bytes as from one call.
# Without mpirun (Debian: openmpi-bin), or where it cannot start anything, it says so and ends with 77.
set -eu
unrig=$(realpath "$1") sources=$(realpath "$2")
skip() { echo "skipped: $1"; exit 77; }
command -v mpirun > /dev/null || skip "no mpirun (Debian: openmpi-bin)"
mpirun --version 2> /dev/null | grep -q "Open MPI" || skip "mpirun is not that of Open MPI"
OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
export OMPI_ALLOW_RUN_AS_ROOT OMPI_ALLOW_RUN_AS_ROOT_CONFIRM
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
mpirun --oversubscribe -n 2 true > start.log 2>&1 || { cat start.log; skip "mpirun starts nothing here"; }
null="$sources/sample_data/campaigns/null"
UNRIG=$unrig RIG=$null/rig.toml PLUCK=$null/dry_pluck.csv mpirun --oversubscribe -n 2 sh -c \
  '"$UNRIG" trial --rig "$RIG" "$PLUCK" --nulls --effects mains-hum --trials 20 --threads 1 -o part$OMPI_COMM_WORLD_RANK.json' > mpi.log 2>&1 || { cat mpi.log; exit 1; }
"$unrig" collect part0.json part1.json -o mpi.json > /dev/null
"$unrig" trial --rig "$null/rig.toml" "$null/dry_pluck.csv" --nulls --effects mains-hum --trials 20 --shard 1/1 -o one.json > /dev/null 2>&1
"$unrig" collect one.json -o all.json > /dev/null
cmp mpi.json all.json
echo "two ranks of Open MPI and one call: the same bytes"
