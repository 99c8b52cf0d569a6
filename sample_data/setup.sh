#!/bin/sh
# The set-up that the demonstration and the tests share: installs what is missing, then configures build/.
# This is the one place that names the Debian packages. With all of them present nothing touches the network.
#
#   sh sample_data/setup.sh               what the build needs
#   sh sample_data/setup.sh --optional    and what only saves time (ccache, clang under the sanitizers), serves comparisons (SciPy), the look of the report (Chromium) or clusters (Open MPI)
set -eu
cd "$(dirname "$0")/.."

packages="cmake g++ make ninja-build pkg-config
  libeigen3-dev libceres-dev libfftw3-dev libudunits2-dev libtomlplusplus-dev nlohmann-json3-dev libcli11-dev libfmt-dev libfast-float-dev libhdf5-dev zlib1g-dev libjs-dygraphs
  libmatio-dev libgtest-dev libgmock-dev libbenchmark-dev"
optional="ccache clang libclang-rt-dev chromium python3-numpy python3-scipy python3-h5py
  pybind11-dev python3-dev python3-xarray python3-pandas python3-netcdf4 python3-matplotlib zsh fish
  python3-jsonschema python3-nbformat python3-nbclient python3-ipykernel dpkg-dev lintian
  libopenmpi-dev openmpi-bin"

case "${1-}" in
  "") ;;
  --optional) packages="$packages $optional" ;;
  *) echo "usage: sh sample_data/setup.sh [--optional]" >&2; exit 2 ;;
esac

if command -v dpkg-query >/dev/null && command -v apt-get >/dev/null; then
  missing=
  for package in $packages; do
    [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing="$missing $package"
  done
  if [ -n "$missing" ]; then
    if [ "$(id -u)" = 0 ]; then
      as_root=
    elif command -v sudo >/dev/null; then
      as_root=sudo
    else
      echo "Packages are missing, and installing them needs root. Run this as root, then start again:" >&2
      echo "  apt-get update && apt-get install -y --no-install-recommends$missing" >&2
      exit 2
    fi
    echo "Installing:$missing"
    $as_root apt-get update || echo "apt-get update had trouble; trying to install all the same." >&2
    # shellcheck disable=SC2086  # a list of words
    $as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
  fi
else
  echo "This is not Debian, so nothing is installed. Needed are: $packages" >&2
fi

# A build directory keeps the generator it was made with, and whether several files of a floor are compiled as one: all of them take half the time so, one that is
# worked on longer (cmake -DCMAKE_UNITY_BUILD=OFF build). UNRIG_WERROR and UNRIG_SANITIZE in the environment reach the build.
first=
[ -f build/CMakeCache.txt ] || first="-G Ninja -DCMAKE_UNITY_BUILD=ON"
# shellcheck disable=SC2086
cmake -S . -B build --log-level=WARNING $first ${UNRIG_WERROR:+-DUNRIG_WERROR="$UNRIG_WERROR"} ${UNRIG_SANITIZE:+-DUNRIG_SANITIZE="$UNRIG_SANITIZE"}
