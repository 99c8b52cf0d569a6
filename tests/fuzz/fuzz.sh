#!/bin/sh
# Builds a fuzzer of a reader with clang's libFuzzer, AddressSanitizer and UBSan, and runs it on its corpus. Not part of the tests; README.md has the results.
#
#   sh tests/fuzz/fuzz.sh run|rig|law|tdms|uff|mat|text [SECONDS]
#
# What it finds lies in build/fuzz as crash-*, timeout-* or oom-*.
set -eu
cd "$(dirname "$0")/../.."
target=${1-}
seconds=${2:-600}
[ -f "tests/fuzz/fuzz_$target.cpp" ] || { echo "usage: sh tests/fuzz/fuzz.sh run|rig|law|tdms|uff|mat|text [SECONDS]" >&2; exit 2; }
mkdir -p "build/fuzz/$target"
# shellcheck disable=SC2046  # lists of words
clang++ -std=c++20 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=undefined -DFMT_SHARED -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 \
  -I. -isystem /usr/include/eigen3 -isystem /usr/include/udunits2 $(cat tests/fuzz/sources.txt) core/rig/gauge_filter.cpp core/numerics/dual_matrix.cpp "tests/fuzz/fuzz_$target.cpp" \
  -lfmt -ltomlplusplus -ludunits2 -lz -o "build/fuzz/fuzz_$target"
export LSAN_OPTIONS=suppressions=tests/known_leaks.txt:print_suppressions=0
exec "build/fuzz/fuzz_$target" -max_total_time="$seconds" -max_len=16384 -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
  -artifact_prefix=build/fuzz/ "build/fuzz/$target" "tests/fuzz/corpus/$target"
