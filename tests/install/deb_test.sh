#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# deb_test.sh BUILD_DIR: makes the .deb and runs what it holds. In a clean root where debootstrap works
# (as root, with the distribution's mirror), else unpacked beside the system's own libraries. Exit status
# 77 where there is no cpack, dpkg-shlibdeps or file.
set -euo pipefail
build=$(realpath "$1")
for tool in cpack dpkg-deb dpkg-shlibdeps file; do
  command -v "$tool" >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
scratch=$(mktemp -d)
root="$scratch/root"
cleanup() {
  mountpoint -q "$root/proc" && umount "$root/proc"
  rm -rf "$scratch"
}
trap cleanup EXIT

cpack --config "$build/CPackConfig.cmake" -G DEB -B "$scratch/packed" >"$scratch/cpack.log" 2>&1 ||
  { cat "$scratch/cpack.log"; exit 1; }
deb=$(ls "$scratch"/packed/*.deb)
dpkg-deb --info "$deb" | grep -E "Package|Version|Depends"
dpkg-deb --contents "$deb" >"$scratch/contents"
for file in usr/bin/axiscal "usr/lib.*axiscal/axiscal-read" usr/share/man/man1/axiscal.1 usr/share/bash-completion/completions/axiscal; do
  grep -q "\./$file" "$scratch/contents" || { echo "the package lacks $file"; exit 1; }
done

# What is run: a whole calibration from readings that it makes itself.
cat >"$scratch/try.sh" <<'TRY'
set -e
cd /tmp
cat >truth.json <<'TRUTH'
{"format":"axiscal-calibration","version":1,
"instrument":{"kind":"accelerometer","serial":"s1","axes":["x","y","z"],"unit":"V"},
"field":{"kind":"gravity","unit":"g","magnitude":1.0,"in_table":[0,0,1]},
"coefficients":{"bias":[0.01,-0.02,0.03],"sensitivity":[[1,0.02,-0.01],[0.015,0.98,0.02],[-0.02,0.01,1.03]]}}
TRUTH
axiscal simulate --truth truth.json --noise 1e-4 -o run.csv
axiscal calibrate run.csv --instrument accelerometer --field gravity --unit V -o cal.json >/dev/null
axiscal export cal.json --format c-header | grep -q axiscal_accelerometer_inverse
axiscal report cal.json run.csv -o report.html && grep -q "</html>" report.html
axiscal export cal.json --format xlsx -o coefficients.xlsx && test -s coefficients.xlsx
axiscal --version
TRY

suite=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources 2>/dev/null |
  grep -v '^ *#' | grep -oE 'https?://[^ ]*(debian|ubuntu)[^ ]*' | grep -v security | head -1 || true)
if [ "$(id -u)" -eq 0 ] && command -v debootstrap >/dev/null && [ -n "$suite" ] && [ -n "$mirror" ] &&
  debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$scratch/debootstrap.log" 2>&1; then
  cp "$deb" "$scratch/try.sh" "$root/tmp/"
  mount -t proc proc "$root/proc" 2>/dev/null || true
  chroot "$root" sh -c "apt-get update -qq && apt-get install -y -qq --no-install-recommends /tmp/*.deb" \
    >"$scratch/install.log" 2>&1 || { tail -20 "$scratch/install.log"; exit 1; }
  chroot "$root" sh /tmp/try.sh
  echo "installed and run in a clean $suite"
else
  dpkg-deb -x "$deb" "$scratch/unpacked"
  sed -i "s#cd /tmp#cd $scratch#" "$scratch/try.sh"
  PATH="$scratch/unpacked/usr/bin:$PATH" sh "$scratch/try.sh"
  echo "unpacked and run here: no clean root could be made"
fi
