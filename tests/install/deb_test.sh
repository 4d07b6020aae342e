#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# deb_test.sh BUILD_DIR: makes the Debian packages, checks them by lintian and runs their content. They are installed
# in a clean root if debootstrap works (as root, with the distribution's mirror). Otherwise they are unpacked and run
# with the system's own libraries. The exit status is 77 if cpack, dpkg-deb, dpkg-shlibdeps or file is not installed.
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
for package in axiscal axiscal-report axiscal-store libaxiscal-dev; do
  deb=$(ls "$scratch"/packed/"$package"_*.deb)
  dpkg-deb --info "$deb" | grep -E "Package|Version|Depends|Recommends"
  dpkg-deb --contents "$deb" >"$scratch/contents.$package"
done
# holds PACKAGE FILE...: fails if the package does not contain each file.
holds() {
  local package=$1 file
  shift
  for file in "$@"; do
    grep -q "\./$file" "$scratch/contents.$package" || { echo "the package $package lacks $file"; exit 1; }
  done
}
holds axiscal usr/bin/axiscal usr/libexec/axiscal/axiscal-exchange usr/share/man/man1/axiscal.1.gz \
  usr/share/bash-completion/completions/axiscal usr/share/doc/axiscal/copyright usr/share/doc/axiscal/changelog.gz \
  usr/share/doc/axiscal/THIRD-PARTY-NOTICES.gz
holds axiscal-report usr/libexec/axiscal/axiscal-report
holds axiscal-store usr/libexec/axiscal/axiscal-store
holds libaxiscal-dev "usr/lib/[^ ]*/pkgconfig/axiscal.pc" usr/include/axiscal/axiscal.hpp
! grep -qE "\.(a|hpp)$" "$scratch/contents.axiscal" || { echo "the package axiscal contains the library"; exit 1; }
# The package of the command depends on none of these large libraries.
depends=$(dpkg-deb --field "$(ls "$scratch"/packed/axiscal_*.deb)" Depends)
for heavy in pango cairo qpdf hdf5 matio mosquitto iio ncurses pq; do
  ! grep -q "lib$heavy" <<<"$depends" || { echo "the package axiscal depends on $heavy"; exit 1; }
done
if command -v lintian >/dev/null; then
  lintian --fail-on error --suppress-tags dir-or-file-in-opt "$scratch"/packed/*.deb
else
  echo "no lintian: the packages are not checked by it"
fi

# Makes a calibration, a report and a certificate from readings that the command simulates.
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
axiscal report cal.json -o certificate.pdf && grep -q "%PDF" certificate.pdf
axiscal store add cal.json --store lab.db && axiscal store verify --store lab.db
axiscal report --fleet lab.db -o fleet.html && grep -q "</html>" fleet.html
axiscal export cal.json --format xlsx -o coefficients.xlsx && test -s coefficients.xlsx
axiscal --version --verbose
if [ -d /usr/lib/python3/dist-packages/axiscal ]; then
  python3 -c "import axiscal as ax; cal = ax.calibrate('run.csv', instrument=ax.accelerometer('V')); print(cal['x.bias'])"
fi
TRY

suite=$(. /etc/os-release && echo "${VERSION_CODENAME:-}")
mirror=$(cat /etc/apt/sources.list /etc/apt/sources.list.d/*.list /etc/apt/sources.list.d/*.sources 2>/dev/null |
  grep -v '^ *#' | grep -oE 'https?://[^ ]*(debian|ubuntu)[^ ]*' | grep -v security | head -1 || true)
if [ "$(id -u)" -eq 0 ] && command -v debootstrap >/dev/null && [ -n "$suite" ] && [ -n "$mirror" ] &&
  debootstrap --variant=minbase "$suite" "$root" "$mirror" >"$scratch/debootstrap.log" 2>&1; then
  cp "$scratch"/packed/*.deb "$scratch/try.sh" "$root/tmp/"
  mount -t proc proc "$root/proc" 2>/dev/null || true
  chroot "$root" sh -c "apt-get update -qq && apt-get install -y -qq --no-install-recommends /tmp/*.deb" \
    >"$scratch/install.log" 2>&1 || { tail -20 "$scratch/install.log"; exit 1; }
  chroot "$root" sh /tmp/try.sh
  echo "installed and run in a clean $suite"
else
  for deb in "$scratch"/packed/*.deb; do dpkg-deb -x "$deb" "$scratch/unpacked"; done
  sed -i "s#cd /tmp#cd $scratch#" "$scratch/try.sh"
  PATH="$scratch/unpacked/usr/bin:$PATH" sh "$scratch/try.sh"
  echo "unpacked and run here: no clean root could be made"
fi
