#!/bin/sh
# sh shard_costs.sh UNRIG SOURCES [TIMES]: what shards and kept cases cost on campaigns of a second or more, in seconds of the processor, since other work on the machine must not count.
# 14 campaigns of five runs, every second with quadratic drag hidden: in one call, through seven shards with kept cases, and these found again; TIMES (3) in turn, and of each the least.
set -eu
unrig=$(realpath "$1") sources=$(realpath "$2") times=${3:-3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
trap 'exit 1' HUP INT TERM
cd "$folder"
study() { "$unrig" trial --rig "$sources/sample_data/campaigns/null/rig.toml" --effects quadratic-drag --trials 14 --seed 30 --threads 1 --quiet "$@"; }
cut() { for i in 1 2 3 4 5 6 7; do study --cases cases --shard $i/7 -o part$i.json; done; }
used() {
  times > times.txt
  awk 'NR == 2 { for (i = 1; i <= 2; ++i) { split($i, a, "m"); t += 60 * a[1] + a[2] } printf "%.2f\n", t }' times.txt
}
least() { sort -n "$1" | head -n 1; }
for turn in $(seq "$times"); do
  used > a; study -o one.json; used > b
  rm -rf cases
  cut; "$unrig" collect part?.json -o all.json > /dev/null; used > c
  cut; used > d
  awk "BEGIN { print $(cat b) - $(cat a) }" >> alone
  awk "BEGIN { print $(cat c) - $(cat b) }" >> through_shards
  awk "BEGIN { print $(cat d) - $(cat c) }" >> found
done
awk -v one="$(least alone)" -v cut="$(least through_shards)" -v found="$(least found)" 'BEGIN {
  printf "14 campaigns, %.2f s each: %.2f s in one call, %.2f s through seven shards (%+.1f %%); all found again: %.2f s (%.1f %%)\n", one / 14, one, cut, 100 * (cut / one - 1), found, 100 * found / one }'
