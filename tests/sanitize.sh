#!/bin/sh
# Every test under AddressSanitizer (with LeakSanitizer) and UBSan; the first finding of either ends the test that met it. The last line is the count.
#
#   sh tests/sanitize.sh                                      the whole suite
#   sh tests/sanitize.sh REGEX                                the tests whose names match, as `ctest -R` takes it: sanitised.core, say
#   UNRIG_SANITIZED_SECONDS=10 sh tests/sanitize.sh           each for ten seconds at most: one that would take longer is counted as skipped
#   UNRIG_SANITIZED_UNTIL=$(date -d 20:00 +%s) sh tests/sanitize.sh   each for as long as all have time until then, as CI does
#
# CMAKE_BUILD_PARALLEL_LEVEL and CTEST_PARALLEL_LEVEL set how many jobs run at once; otherwise as many as there are processors.
set -eu
cd "$(dirname "$0")/.."
UNRIG_SANITIZE=ON sh sample_data/setup.sh
cmake --build build --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"
export CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$(nproc)}"

if [ -n "${UNRIG_SANITIZED_UNTIL-}" ]; then
  # Processor seconds, measured: all tests but the sixty longest take some 150, and what is left is divided among these.
  left=$(((UNRIG_SANITIZED_UNTIL - $(date +%s)) * CTEST_PARALLEL_LEVEL))
  UNRIG_SANITIZED_SECONDS=$(((left - 150) / 60))
  if [ "$UNRIG_SANITIZED_SECONDS" -lt 1 ]; then
    echo "No time is left for the tests under the sanitizers."
    echo "0 passed, 0 failed, 0 skipped"
    exit 0
  fi
  export UNRIG_SANITIZED_SECONDS
  echo "Each test for $UNRIG_SANITIZED_SECONDS s at most."
fi

report=build/sanitised_results.xml
rm -f "$report"
status=0
ctest --test-dir build --output-on-failure --no-tests=error -R "${1-^sanitised\\.}" --output-junit sanitised_results.xml || status=$?
sh tests/count.sh "$report"
exit "$status"
