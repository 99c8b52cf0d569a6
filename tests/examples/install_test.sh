#!/bin/sh
# install_test.sh BUILD: installs what BUILD holds into BUILD/installed, builds the manual's example programs against it, by find_package and by pkg-config, and runs them.
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

# The same by pkg-config, from a place to which the installation was moved.
if command -v pkg-config >/dev/null; then
  rm -rf "$build/moved"
  cp -a "$build/installed" "$build/moved"
  pc=$(find "$build/moved" -name unrig.pc)
  libraries=$(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --variable=libdir unrig)
  c++ -std=c++20 "$source/tests/examples/frequencies.cpp" -o "$build/examples/frequencies_by_pkg_config" $(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --cflags --libs unrig)
  c++ -std=c++20 "$source/tests/examples/corrected_load.cpp" -o "$build/examples/load_by_pkg_config" $(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --cflags --libs unrig)
  # Nothing but what was moved there.
  same() {
    wanted=$("$build/examples/$1" "$campaign/rig.toml" $3) found=$(LD_LIBRARY_PATH=$libraries "$build/examples/$2" "$campaign/rig.toml" $3)
    [ -n "$wanted" ] && [ "$found" = "$wanted" ] || { echo "by pkg-config $1 says '$found', by find_package '$wanted'" >&2; exit 1; }
  }
  same frequencies frequencies_by_pkg_config ""
  same corrected_load load_by_pkg_config "$build/examples/fit.json $campaign/step_a.csv"
  [ "$(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --modversion unrig)" = "$("$build/moved/bin/unrig" --version | cut -d ' ' -f 2)" ]

  # Shared libraries have a version, and show nothing but what the headers declare; the program finds those that lie beside it.
  for library in "$libraries"/libunrig_*.so; do
    [ -e "$library" ] || continue
    name=$(basename "$library") version=$(PKG_CONFIG_PATH=$(dirname "$pc") pkg-config --modversion unrig)
    readelf -d "$library" | grep -q "SONAME.*\[$name.${version%.*}\]" || { echo "$library: SONAME is not $name.${version%.*}" >&2; exit 1; }
    test -f "$library.$version"
    nm -D --defined-only "$library" | awk '{ print $3 }' > "$build/examples/shown"
    grep -q '^_ZN5unrig' "$build/examples/shown"
    if grep -vE '^_Z(N|NK|TIN|TSN|TVN|TTN|GVN|GVZN|ZN)5unrig' "$build/examples/shown"; then echo "$library shows these" >&2; exit 1; fi
    ldd "$build/moved/bin/unrig" | grep -q "$name.${version%.*} => .*/moved/" || { echo "bin/unrig does not find $name beside it" >&2; exit 1; }
    ldd "$build/examples/frequencies_by_pkg_config" | grep -q libunrig_core.so
  done
  rm -rf "$build/moved"
fi

# The manual shows these very programs.
for example in frequencies fit_rig corrected_load; do
  awk '/^int main/,/^}/' "$source/tests/examples/$example.cpp" | while IFS= read -r line; do
    grep -qF -- "$line" "$source/correct/manual/library.md" || { echo "correct/manual/library.md lacks a line of $example.cpp: $line" >&2; exit 1; }
  done
done

# Manual, schemas, manual page and completion come along.
for page in "$source"/correct/manual/*; do
  cmp "$page" "$build/installed/share/doc/unrig/manual/$(basename "$page")"
done
for schema in "$source"/correct/schemas/*; do
  cmp "$schema" "$build/installed/share/doc/unrig/schemas/$(basename "$schema")"
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
