#!/bin/sh
# Builds a fuzzer of a reader with clang's libFuzzer, AddressSanitizer and UBSan, and runs it on its corpus. Not part of the tests; README.md has the results.
#
#   sh tests/fuzz/fuzz.sh run|rig|tdms|uff|mat [SECONDS]
#
# What it finds lies in build/fuzz as crash-*, timeout-* or oom-*.
set -eu
cd "$(dirname "$0")/../.."
target=$1
seconds=${2:-600}
mkdir -p "build/fuzz/$target"
sources="core/error.cpp core/text_file.cpp"
tables="core/toml_table.cpp core/units.cpp"
libraries="-lfmt"
case "$target" in
  run) sources="$sources $tables core/run.cpp core/csv_table.cpp core/time_grid.cpp" libraries="-lfmt -ltomlplusplus -ludunits2" ;;
  rig) sources="$sources $tables core/rig.cpp core/rig_chain.cpp core/flexibility.cpp core/beam_flexibility.cpp" libraries="-lfmt -ltomlplusplus -ludunits2" ;;
  tdms) sources="$sources core/import/tdms.cpp core/import/tdms_scaling.cpp core/import/bridge.cpp" ;;
  uff) sources="$sources core/import/uff.cpp" ;;
  mat) sources="$sources core/import/mat.cpp" libraries="-lfmt -lmatio" ;;
  *) echo "usage: sh tests/fuzz/fuzz.sh run|rig|tdms|uff|mat [SECONDS]" >&2; exit 2 ;;
esac
# shellcheck disable=SC2086  # lists of words
clang++ -std=c++20 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=undefined -DFMT_SHARED -DTOML_HEADER_ONLY=0 -DTOML_SHARED_LIB=1 \
  -I. -isystem /usr/include/eigen3 -isystem /usr/include/udunits2 $sources "tests/fuzz/fuzz_$target.cpp" $libraries -o "build/fuzz/fuzz_$target"
exec "build/fuzz/fuzz_$target" -max_total_time="$seconds" -max_len=16384 -timeout=10 -rss_limit_mb=2048 -print_final_stats=1 \
  -artifact_prefix=build/fuzz/ "build/fuzz/$target" "tests/fuzz/corpus/$target"
