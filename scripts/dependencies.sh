#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the missing packages for building and testing Axiscal from the distribution (Debian 12 or later,
# Ubuntu 22.04 or later). Uses sudo if it is not run as root.
set -euo pipefail

# One required package per line. Several names in a line are its names in different distributions, in the order in
# which they are tried.
needs=(
  "g++"
  "cmake"
  "ninja-build"
  "pkg-config pkgconf"
  "git"
  "ccache"
  "libeigen3-dev"
  "libgeographiclib-dev libgeographic-dev"
  "nlohmann-json3-dev"
  "libboost-dev"
  "libcli11-dev"
  "libfmt-dev"
  "libmd-dev"
  "libhwy-dev"
  "libarchive-dev"
  "zlib1g-dev"
  "libbz2-dev"
  "liblzma-dev"
  "libminizip-dev"
  "liblz4-dev"
  "libzstd-dev"
  "libsqlite3-dev"
  "libpq-dev"
  "libmatio-dev"
  "libhdf5-dev"
  "libyaml-cpp-dev"
  "libpugixml-dev"
  "libxlsxwriter-dev"
  "libpango1.0-dev"
  "libqpdf-dev"
  "liblcms2-dev"
  "libiio-dev"
  "libmosquitto-dev"
  "libncurses-dev"
  "libssl-dev"
  "libqrencode-dev"
  "libgtest-dev"
  "libgmock-dev"
  "libbenchmark-dev"
)

# Pairs of a command and its package. The package is installed only if the command is not found. clang++ compiles faster
# than g++; node runs the tests of the pages in a browser.
tools=("sbatch slurm-wlm" "clang++ clang" "node nodejs" "npm npm" "chromium chromium" "pdftotext poppler-utils" "ssconvert gnumeric" "debootstrap debootstrap"
  "dpkg-shlibdeps dpkg-dev" "file file" "tmux tmux" "mosquitto_pub mosquitto-clients")

# dependencies.sh --python also installs the packages for the Python package and its tests.
optional=()
if [ "${1:-}" = --python ]; then
  optional=("python3-uncertainties" "python3-pint" "python3-distributed")
  needs+=("pybind11-dev" "python3-dev" "python3-numpy" "python3-pandas" "python3-pytest" "python3-venv")
  tools+=("mypy mypy")
fi

is_installed() {
  [ "$(dpkg-query -W -f '${db:Status-Status}' "$1" 2>/dev/null)" = installed ]
}

if ! command -v dpkg-query >/dev/null || ! command -v apt-get >/dev/null; then
  echo "dependencies.sh: apt-get was not found; install these packages yourself: ${needs[*]}" >&2
  exit 1
fi

# Servers for the tests; their programs are not on everybody's path.
[ -x /usr/sbin/mosquitto ] || needs+=("mosquitto")
compgen -G '/usr/lib/postgresql/*/bin/pg_ctl' >/dev/null || needs+=("postgresql")

missing=()
for need in "${needs[@]}"; do
  found=no
  for package in $need; do
    if is_installed "$package"; then
      found=yes
      break
    fi
  done
  [ "$found" = yes ] || missing+=("$need")
done
wanted=()
for tool in "${tools[@]}"; do
  command -v "${tool% *}" >/dev/null || wanted+=("${tool#* }")
done
for package in "${optional[@]}"; do
  is_installed "$package" || wanted+=("$package")
done
[ $((${#missing[@]} + ${#wanted[@]})) -gt 0 ] || exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "dependencies.sh: run it as root, or install sudo" >&2; exit 1; }
  as_root=(sudo)
fi
export DEBIAN_FRONTEND=noninteractive
"${as_root[@]}" apt-get update -q || [ ${#missing[@]} -eq 0 ]

packages=()
for need in "${missing[@]}"; do
  chosen=
  for package in $need; do
    if apt-cache show "$package" >/dev/null 2>&1; then
      chosen=$package
      break
    fi
  done
  [ -n "$chosen" ] || { echo "dependencies.sh: this distribution has no ${need// / or }" >&2; exit 1; }
  packages+=("$chosen")
done
if [ ${#packages[@]} -gt 0 ]; then
  echo "dependencies.sh: installing ${packages[*]}"
  "${as_root[@]}" apt-get install -y -q --no-install-recommends "${packages[@]}"
fi
# These packages are optional: without them the build takes longer or some tests are skipped.
for package in "${wanted[@]}"; do
  echo "dependencies.sh: installing $package"
  "${as_root[@]}" apt-get install -y -q --no-install-recommends "$package" ||
    echo "dependencies.sh: $package cannot be installed; continuing without it" >&2
done
