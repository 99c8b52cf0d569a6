#!/bin/sh
# Every test under AddressSanitizer (with LeakSanitizer) and UBSan; the first finding of either ends the test that met it. The last line is the count.
#
#   sh tests/sanitize.sh                       the whole suite, hours
#   sh tests/sanitize.sh REGEX                 the tests whose names match, as `ctest -R` takes it: sanitised.core, say
#   UNRIG_SANITIZE=ON sh tests/sanitize.sh     all but the longest (sanitised.cmake has the list), as CI does where there is time
#   UNRIG_SANITIZE=CORE sh tests/sanitize.sh   those of core and of the readers of files
#
# CMAKE_BUILD_PARALLEL_LEVEL and CTEST_PARALLEL_LEVEL set how many jobs run at once; otherwise as many as there are processors.
set -eu
cd "$(dirname "$0")/.."
UNRIG_SANITIZE="${UNRIG_SANITIZE:-ALL}" sh sample_data/setup.sh
cmake --build build --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"

report=build/sanitised_results.xml
rm -f "$report"
status=0
CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$(nproc)}" ctest --test-dir build --output-on-failure --no-tests=error -R "${1-^sanitised\\.}" --output-junit sanitised_results.xml || status=$?
sh tests/count.sh "$report"
exit "$status"
