#!/bin/sh
# Every test under AddressSanitizer (with LeakSanitizer) and UBSan; the first finding of either ends the test that met it. CI does the same with all but the longest
# (sanitised.cmake has the list).
#
#   sh tests/sanitize.sh            the whole suite
#   sh tests/sanitize.sh REGEX      the tests whose names match, as `ctest -R` takes it: sanitised.core, say
#
# CMAKE_BUILD_PARALLEL_LEVEL and CTEST_PARALLEL_LEVEL set how many jobs run at once; otherwise as many as there are processors.
set -eu
cd "$(dirname "$0")/.."
UNRIG_SANITIZE=ALL sh sample_data/setup.sh
cmake --build build --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}"
CTEST_PARALLEL_LEVEL="${CTEST_PARALLEL_LEVEL:-$(nproc)}" exec ctest --test-dir build --output-on-failure --no-tests=error -R "${1-^sanitised\\.}"
