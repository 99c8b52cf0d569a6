#!/bin/sh
# sh shards.sh UNRIG SOURCES [TRIALS KILLS [SHARDS...]]: nulls of one pluck in one call, and through 1, 2, 7 and 64 shards of which processes are killed at random times
# and started again, KILLS times for each number of shards. Ends with 1 where the results are not the same bytes.
# Without TRIALS the short form: 28 nulls, three kills, 1, 2 and 7 shards.
set -eu
unrig=$(realpath "$1") sources=$(realpath "$2")
trials=${3:-28} kills=${4:-3} numbers="1 2 7"
[ $# -lt 3 ] || numbers="1 2 7 64"
[ $# -lt 5 ] || { shift 4; numbers=$*; }
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 1' HUP INT TERM
cd "$folder"
null="$sources/sample_data/campaigns/null"
study() { exec "$unrig" trial --rig "$null/rig.toml" "$null/dry_pluck.csv" --nulls --effects mains-hum --trials "$trials" --seed 30 --threads 1 --quiet "$@"; }
now() { date +%s.%N; }
calculate() { awk "BEGIN { printf \"%.$2f\", $1 }"; }
draw() { od -An -N4 -tu4 /dev/urandom | awk "{ printf \"%.3f\", \$1 / 4294967296 * $1 }"; }  # from 0 to $1

begun=$(now)
(study --shard 1/1 -o one.json)
one=$(calculate "$(now) - $begun" 1)
"$unrig" collect one.json -o all.json > /dev/null
echo "$trials nulls in one call: $one s"
for shards in $numbers; do
  mkdir "of_$shards"
  killed=0 tries=0 begun=$(now)
  shard=1
  while [ $shard -le "$shards" ]; do
    left=$((kills - killed))
    here=$(((left + shards - shard) / (shards - shard + 1)))
    long=$(calculate "$one / $shards / ($here + 1)" 3)  # what one process has left, roughly, so that most are killed before they are done
    while [ $here -gt 0 ]; do
      here=$((here - 1)) tries=$((tries + 1))
      study --cases "of_$shards/cases" --shard $shard/"$shards" -o "of_$shards/part$shard.json" &
      process=$!
      sleep "$(draw "$long")"
      kill -9 $process 2> /dev/null || true
      status=0
      wait $process 2> /dev/null || status=$?
      [ $status -ne 137 ] || killed=$((killed + 1))  # else it was done before
    done
    (study --cases "of_$shards/cases" --shard $shard/"$shards" -o "of_$shards/part$shard.json")
    shard=$((shard + 1))
  done
  "$unrig" collect $(ls "of_$shards"/part*.json | sort -R) -o "of_$shards/all.json" > /dev/null
  cmp all.json "of_$shards/all.json"
  echo "$shards shards, $killed processes killed in $tries tries: the same bytes, $(sha256sum < all.json | cut -c 1-16), $(calculate "$(now) - $begun" 1) s"
done
