#!/bin/sh
# Prints the table "The seed, number by number" of README.md beside this file. Needs a build: sh tests/run.sh, or cmake --build build --target test_verification.
set -eu
cd "$(dirname "$0")/../.."
"${BUILD:-build}/tests/test_verification" --gtest_also_run_disabled_tests --gtest_filter=SeedTable.DISABLED_Print --gtest_brief=1 | grep '^|'
