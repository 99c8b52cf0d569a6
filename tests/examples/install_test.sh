#!/bin/sh
# install_test.sh BUILD: installs what BUILD holds into BUILD/installed, builds the manual's example programs against it, and runs them.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
build=$1
campaign=$source/sample_data/campaigns/null
rm -rf "$build/installed"
cmake --install "$build" --prefix "$build/installed" >/dev/null
cmake -S "$source/tests/examples" -B "$build/examples" -DCMAKE_BUILD_TYPE=Debug -DCMAKE_PREFIX_PATH="$build/installed" >/dev/null
cmake --build "$build/examples"
"$build/examples/frequencies" "$campaign/rig.toml"
"$build/examples/fit_rig" "$campaign/rig.toml" "$build/examples/fit.json" "$campaign/dry_pluck.csv" "$campaign/wet_pluck.csv" "$campaign/step_a.csv"
"$build/examples/corrected_load" "$campaign/rig.toml" "$build/examples/fit.json" "$campaign/step_a.csv"

# The manual shows these very programs.
for example in frequencies fit_rig corrected_load; do
  awk '/^int main/,/^}/' "$source/tests/examples/$example.cpp" | while IFS= read -r line; do
    grep -qF -- "$line" "$source/correct/manual/library.md" || { echo "correct/manual/library.md lacks a line of $example.cpp: $line" >&2; exit 1; }
  done
done

# Manual, manual page and completion come along.
for page in "$source"/correct/manual/*; do
  cmp "$page" "$build/installed/share/doc/unrig/manual/$(basename "$page")"
done
test -s "$build/installed/share/man/man1/unrig.1"
for command in $("$build/installed/bin/unrig" --help | sed -n 's/^  \([a-z][a-z-]*\) .*/\1/p'); do
  grep -q "^.SH unrig $(echo "$command" | sed 's/-/\\\\-/g')$" "$build/installed/share/man/man1/unrig.1" || { echo "the manual lacks $command" >&2; exit 1; }
done
if command -v bash >/dev/null; then
  found=$(bash -c '. "$1/share/bash-completion/completions/unrig"; COMP_WORDS=("$1/bin/unrig" fit --r) COMP_CWORD=2; _unrig; echo "${COMPREPLY[*]}"' bash "$build/installed")
  [ "$found" = --rig ] || { echo "completion of --r gives '$found'" >&2; exit 1; }
  found=$(bash -c '. "$1/share/bash-completion/completions/unrig"; COMP_WORDS=("$1/bin/unrig" fit --effect tank) COMP_CWORD=3; _unrig; echo "${COMPREPLY[*]}"' bash "$build/installed")
  [ "$found" = tank-wave ] || { echo "completion of --effect tank gives '$found'" >&2; exit 1; }
  found=$(bash -c '. "$1/share/bash-completion/completions/unrig"; COMP_WORDS=("$1/bin/unrig" trial --effects tank-wave,mains) COMP_CWORD=3; _unrig; echo "${COMPREPLY[*]}"' bash "$build/installed")
  [ "$found" = tank-wave,mains-hum ] || { echo "completion of --effects tank-wave,mains gives '$found'" >&2; exit 1; }
fi
