#!/bin/sh
# sh snakemake.sh UNRIG SOURCES: sample_data/cluster/Snakefile on two campaigns: the same table as from one call.
# Without Snakemake (Debian: snakemake), or where it cannot start anything, it says so and ends with 77.
set -eu
unrig=$(realpath "$1") sources=$(realpath "$2")
skip() { echo "skipped: $1"; exit 77; }
command -v snakemake > /dev/null || skip "no snakemake (Debian: snakemake)"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
HOME=$folder XDG_CACHE_HOME=$folder/cache
export HOME XDG_CACHE_HOME
snakemake --version > version.log 2>&1 || { cat version.log; skip "snakemake does not start here"; }
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
snakemake --snakefile "$sources/sample_data/cluster/Snakefile" --cores 2 --config campaigns=campaigns.toml shards=3 unrig="$unrig" > snakemake.log 2>&1 || { cat snakemake.log; exit 1; }
cmp one.csv table.csv
[ -s table.html ]
echo "three shards by Snakemake and one call: the same table"
