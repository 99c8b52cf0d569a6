#!/bin/sh
# sh mpirun.sh UNRIG SOURCES: one study and one batch by two ranks of Open MPI, each its own part, also where a rank is killed and all is started again: the same bytes as from one call.
# A program that is built with MPI must have handed out its cases; one without it has shards.
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
ranks() { mpirun --oversubscribe -n 2 "$@" > mpi.log 2>&1; }
ranks true || { cat mpi.log; skip "mpirun starts nothing here"; }
UNRIG=$unrig RIG=$sources/sample_data/campaigns/null/rig.toml PLUCK=$sources/sample_data/campaigns/null/dry_pluck.csv
export UNRIG RIG PLUCK
study='trial --rig "$RIG" "$PLUCK" --nulls --effects mains-hum --threads 1 --quiet'
trial() { eval "\"\$UNRIG\" $study \"\$@\""; }
trial --trials 60 --shard 1/1 -o one.json
"$unrig" collect one.json -o all.json > /dev/null

# Every second campaign is there: of the rest the first rank takes some, which would all be the second's if they were shards.
trial --trials 60 --cases cases --shard 1/2 -o kept.json
ranks sh -c '"$UNRIG" '"$study"' --trials 60 --cases cases -o part$OMPI_COMM_WORLD_RANK.json' || { cat mpi.log; exit 1; }
"$unrig" collect part0.json part1.json -o mpi.json > /dev/null
cmp mpi.json all.json
if ldd "$unrig" | grep -q libmpi; then
  grep -q '"trial": [0-9]*[13579],' part0.json || { echo "the first rank did no campaign but its own" >&2; exit 1; }
  how="which were handed out"
else
  how="each its shard: this program is built without MPI"
fi

# A rank is killed in the middle: the job ends, and goes on where it was.
if ranks sh -c '[ $OMPI_COMM_WORLD_RANK = 0 ] || { sleep 0.3; kill -9 $$; } & exec "$UNRIG" '"$study"' --trials 5000 --cases killed -o part$OMPI_COMM_WORLD_RANK.json'; then echo "the job went on without its second rank" >&2; exit 1; fi
rm -f part?.json
ranks sh -c '"$UNRIG" '"$study"' --trials 60 --cases killed -o part$OMPI_COMM_WORLD_RANK.json' || { cat mpi.log; exit 1; }
"$unrig" collect part?.json -o killed.json > /dev/null
cmp killed.json all.json

mkdir runs
for campaign in null drag; do ln -s "$sources/sample_data/campaigns/$campaign" runs; done
cat > campaigns.toml << 'TOML'
unrig_batch = 1
commands = ["check", "fit"]
[[campaign]]
folder = "runs/*"
rig = "rig.toml"
runs = ["*_pluck.csv"]
TOML
"$unrig" batch campaigns.toml -o one.csv --cases elsewhere > /dev/null 2>&1 || [ $? = 1 ]  # drag is in no fit
ranks sh -c '"$UNRIG" batch campaigns.toml --threads 1 -o batch$OMPI_COMM_WORLD_RANK.json' || [ $? = 1 ]
"$unrig" collect batch0.json batch1.json -o table.csv > /dev/null
cmp table.csv one.csv
echo "campaigns of a trial and of a batch by two ranks of Open MPI, $how, and by one call: the same bytes"
