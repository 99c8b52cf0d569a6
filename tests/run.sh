#!/bin/sh
# Set-up, build, every test. The last line is the count. The same tests under AddressSanitizer and UBSan: sanitize.sh.
set -eu
cd "$(dirname "$0")/.."
sh sample_data/setup.sh
cmake --build build --parallel "$(nproc)"

report=build/test_results.xml
rm -f "$report"
status=0
ctest --test-dir build --output-on-failure --no-tests=error --parallel "$(nproc)" --output-junit test_results.xml || status=$?
sh tests/count.sh "$report"
exit "$status"
