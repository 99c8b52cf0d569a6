#!/bin/sh
# Every test under AddressSanitizer (with LeakSanitizer) and UBSan; the first finding of either ends the test that met it. The last line is the count.
#
#   sh tests/sanitize.sh                                      the whole suite
#   sh tests/sanitize.sh REGEX                                the tests whose names match, as `ctest -R` takes it: sanitised.core, say
#   UNRIG_SANITIZED_UNTIL=$(date -d 20:00 +%s) sh tests/sanitize.sh   until then: what is not done by then is counted as skipped, as in CI
#
# CMAKE_BUILD_PARALLEL_LEVEL and CTEST_PARALLEL_LEVEL set how many jobs run at once; otherwise as many as there are processors.
set -eu
cd "$(dirname "$0")/.."
UNRIG_SANITIZE=ON sh sample_data/setup.sh
cmake --build build --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"
export CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$(nproc)}"

report=build/sanitised_results.xml
rm -f "$report"
status=0
ctest --test-dir build --output-on-failure --no-tests=error -R "${1-^sanitised\\.}" --output-junit sanitised_results.xml || status=$?
sh tests/count.sh "$report"
exit "$status"
