#!/bin/sh
# other_libraries_test.sh BUILD CCACHE CMAKE_OPTION...: builds the project with these options into BUILD-other, of objects that ccache has from BUILD, and does there what install_test.sh
# does. Status 77 where there is no ccache.
set -eu
build=$1 ccache=$2
shift 2
case $ccache in "" | *NOTFOUND) echo "skipped: without ccache all would be compiled once more"; exit 77 ;; esac
source=$(cd "$(dirname "$0")/../.." && pwd)
cmake -S "$source" -B "$build-other" --log-level=WARNING "$@"
cmake --build "$build-other" --parallel "$(nproc)" >"$build-other/log" 2>&1 || { tail -n 30 "$build-other/log" >&2; exit 1; }
sh "$source/tests/examples/install_test.sh" "$build-other"
