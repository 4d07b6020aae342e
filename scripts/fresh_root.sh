#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs the README's two commands on a fresh Debian: fresh_root.sh SUITE [COMPILER ...]
# SUITE is the name of a release (bookworm, trixie). Each COMPILER (default: clang++ and g++) builds in a separate
# checkout, and its warnings are errors. The root file system stays in AXISCAL_ROOTS (/var/tmp/axiscal-roots), so that
# a second run does not install everything again. Delete the folder to install again. Needs root and debootstrap.
set -euo pipefail
cd "$(dirname "$0")/.."

suite=${1:?usage: fresh_root.sh SUITE [COMPILER ...]}
shift
compilers=("$@")
[ ${#compilers[@]} -gt 0 ] || compilers=(clang++ g++)
[ "$(id -u)" -eq 0 ] || { echo "fresh_root.sh: run it as root: debootstrap and chroot need it" >&2; exit 1; }
command -v debootstrap >/dev/null || { echo "fresh_root.sh: install debootstrap" >&2; exit 1; }

root=${AXISCAL_ROOTS:-/var/tmp/axiscal-roots}/$suite
if [ ! -e "$root/.complete" ]; then
  rm -rf "$root"
  mkdir -p "$root"
  debootstrap --variant=minbase --include=ca-certificates "$suite" "$root"
  touch "$root/.complete"
fi
# Copies this machine's settings for DNS, certificates and npm.
for file in /etc/resolv.conf /etc/ssl/certs/ca-certificates.crt /root/.npmrc; do
  [ ! -e "$file" ] || install -D -m 644 "$file" "$root$file"
done

for compiler in "${compilers[@]}"; do
  checkout=/work/$compiler
  rm -rf "$root$checkout"
  mkdir -p "$root/work"
  git clone -q --no-hardlinks . "$root$checkout"
  echo "fresh_root.sh: $suite, $compiler"
  # The mounts are removed when this process ends. CXX is set because demo.sh would otherwise use clang++, which
  # dependencies.sh installs.
  unshare --mount --pid --fork bash -euc '
    mount --rbind /dev "$1/dev"
    mount -t proc proc "$1/proc"
    exec chroot "$1" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LANG=C.UTF-8 TERM=dumb CI=true CXX="$3" \
      bash -euc "cd $2; scripts/demo.sh >demo.txt 2>&1 || { tail -n 50 demo.txt; exit 1; }
                 ! grep -n warning: demo.txt; scripts/test.sh"
  ' fresh_root "$root" "$checkout" "$compiler"
done
