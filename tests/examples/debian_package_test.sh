#!/bin/sh
# debian_package_test.sh BUILD [CHROOT]: makes the Debian package of what BUILD holds, looks into it, and runs the program and the Python package out of it.
# With CHROOT, a folder in which `debootstrap --variant=minbase bookworm CHROOT` made a Debian that has nothing else, and as root: installs it there with apt, and runs it there.
# Status 77 where the tools of Debian are missing.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
build=$1 chroot=${2-}
for tool in cpack dpkg-deb dpkg-shlibdeps; do
  command -v $tool >/dev/null || { echo "skipped: no $tool (Debian: cmake, dpkg, dpkg-dev)"; exit 77; }
done
folder=$build/debian_package
rm -rf "$folder"
mkdir -p "$folder/root"
cpack -G DEB --config "$build/CPackConfig.cmake" -B "$folder" >"$folder/log" 2>&1 || { cat "$folder/log" >&2; exit 1; }
package=$(ls "$folder"/unrig_*.deb)
dpkg-deb --info "$package"
dpkg-deb --extract "$package" "$folder/root"

fails() { echo "$1" >&2; exit 1; }
for needed in libc6 libstdc++6 libfftw3-double3 libudunits2-0 libfmt9 libhdf5-103-1 zlib1g; do
  dpkg-deb --field "$package" Depends | grep -q "$needed" || fails "the package does not depend on $needed"
done
usr=$folder/root/usr
for file in bin/unrig share/man/man1/unrig.1.gz share/doc/unrig/manual/README.md share/doc/unrig/schemas/fit.schema.json share/doc/unrig/copyright share/doc/unrig/changelog.gz share/doc/unrig/null/rig.toml \
  share/bash-completion/completions/unrig share/zsh/site-functions/_unrig share/fish/vendor_completions.d/unrig.fish include/unrig/fit/fit.h; do
  test -s "$usr/$file" || fails "the package lacks usr/$file"
done
find "$usr" -name unrig.pc | grep -q . || fails "the package lacks unrig.pc"
find "$usr" -name unrigConfig.cmake | grep -q . || fails "the package lacks unrigConfig.cmake"
library=$(find "$usr" -name 'libunrig_core.*' | head -n 1)
test -n "$library" || fails "the package lacks the library"
if grep -rlF "$source" "$folder/root" | grep .; then fails "these name the folder that they were built in"; fi

# What Debian's own check finds. The maintainer's address is for whoever hands the package out to give (CPACK_PACKAGE_CONTACT); libraries for one architecture at a time may lie in usr/lib.
if command -v lintian >/dev/null; then
  lintian --allow-root --suppress-tags bogus-mail-host,bogus-mail-host-in-debian-changelog,pkg-config-unavailable-for-cross-compilation --fail-on error,warning "$package" || fails "lintian finds these"
else
  echo "not tried: lintian, which is not there"
fi

# As a user runs it, from the package's files alone.
"$usr/bin/unrig" check --rig "$usr/share/doc/unrig/null/rig.toml" "$usr/share/doc/unrig/null/dry_pluck.csv" >"$folder/checked"
grep -q "what these runs can determine" "$folder/checked"
if find "$build/correct/python/unrig" -name '_unrig*.so' 2>/dev/null | grep -q .; then
  python=$(find "$usr/lib/python3/dist-packages/unrig" -name '_unrig*.so')
  test -n "$python" || fails "the Python module is not where Debian's Python looks"
  if nm -D --defined-only "$python" | grep -v ' PyInit__unrig$' | grep .; then fails "the Python module shows these"; fi
  PYTHONPATH=$usr/lib/python3/dist-packages /usr/bin/python3 -c "import unrig; print('Python package', unrig.__version__, 'with', unrig.read_rig('$usr/share/doc/unrig/null/rig.toml'))"
fi
[ -n "$chroot" ] || exit 0

cp "$package" "$chroot/tmp/"
chroot "$chroot" sh -c 'apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "/tmp/$1"' sh "$(basename "$package")" >"$folder/apt" 2>&1 || { cat "$folder/apt" >&2; exit 1; }
chroot "$chroot" sh -euc '
  cd /tmp
  for file in rig.toml dry_pluck.csv wet_pluck.csv step_a.csv; do cp /usr/share/doc/unrig/null/$file .; done
  unrig --version
  unrig fit --rig rig.toml dry_pluck.csv wet_pluck.csv step_a.csv -o fit.json | head -n 4
  unrig correct --rig rig.toml --fit fit.json step_a.csv -o corrected.csv | head -n 3
  python3 -c "import unrig; print(unrig.fit(\"rig.toml\", [\"dry_pluck.csv\", \"step_a.csv\"]).params[\"normal.stiffness_scale\"])"
  dpkg -V unrig'
