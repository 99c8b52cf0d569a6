#!/bin/sh
# Set-up, build, every test. The last line is the count.
# With UNRIG_SANITIZE=ON in the environment, as CI has it, all but the longest run a second time under AddressSanitizer and UBSan, as sanitised.*; sanitize.sh runs these too.
set -eu
cd "$(dirname "$0")/.."
sh sample_data/setup.sh
cmake --build build --parallel "$(nproc)"

report=build/test_results.xml
rm -f "$report"
status=0
ctest --test-dir build --output-on-failure --no-tests=error --parallel "$(nproc)" --output-junit test_results.xml || status=$?

# The first line of the report that starts with this attribute is the whole suite's.
count() { sed -n "/^[[:space:]]*$1=\"\([0-9]*\)\".*/{s//\1/p;q}" "$report"; }
total=$(count tests) failed=$(count failures) skipped=$(($(count skipped) + $(count disabled)))
echo "$((total - failed - skipped)) passed, $failed failed, $skipped skipped"
exit "$status"
