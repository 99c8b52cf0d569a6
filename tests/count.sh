#!/bin/sh
# sh tests/count.sh REPORT: the line "N passed, M failed, K skipped" of a report that `ctest --output-junit` wrote.
set -eu
# The first line of the report that starts with this attribute is the whole suite's.
count() { sed -n "/^[[:space:]]*$1=\"\([0-9]*\)\".*/{s//\1/p;q}" "$report"; }
report=$1
total=$(count tests) failed=$(count failures) skipped=$(($(count skipped) + $(count disabled)))
echo "$((total - failed - skipped)) passed, $failed failed, $skipped skipped"
