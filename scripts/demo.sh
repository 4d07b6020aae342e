#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Installs the missing packages, builds the command and shows the main tasks: it calibrates with 12 readings and
# converts raw readings to angles. With --guided it runs a session of the data collector with a simulated instrument,
# table and user, who sometimes lays the cube wrongly.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/dependencies.sh
. scripts/jobs.sh
# The preset demo compiles soonest, because it does not optimise. The steps below run only the program axiscal. The guided
# session also needs the data collector.
preset=demo
target=axiscal
[ "${1:-}" != --guided ] || { preset=release; target=axiscal_and_programs; }
cmake --preset $preset
cmake --build --preset $preset --target $target
work=build/demo/files
mkdir -p "$work"
axiscal=build/$preset/cli/axiscal

say() { printf '\n\033[1m%s\033[0m\n' "$*"; }
show() { printf '$ %s\n' "${*//build\/$preset\/cli\//}"; "$@"; }

if [ "${1:-}" = --guided ]; then
  say "A guided session: a simulated user lays the cube, sometimes wrongly; readings are taken automatically"
  rm -f $work/guided.*
  show $axiscal acquire --connect 'sim:?speed=20&error=0.2&seed=7' --unattended --plain --name $work/guided
  say "All files are in $work; try: $axiscal acquire --connect 'sim:?error=0.1' --web"
  exit
fi

say "1. The plan: a run sheet in random order, and the expected uncertainties"
show $axiscal plan --seed 7 --noise 2e-4 --sensitivity 2.5 -o $work/sheet.csv --page $work/sheet.html
head -n 4 $work/sheet.csv

say "2. The readings of a realistic run (12 positions, on a table that slopes by 3 and -2 mrad)"
cat examples/run.csv

say "3. The calibration"
show $axiscal calibrate examples/run.csv --instrument accelerometer --field gravity --unit V \
  --serial QA-113 -o $work/cal.json

say "4. How far to turn the three screws of the table to level it"
show $axiscal level $work/cal.json --adjusters "0.1,0;-0.1,0.08;-0.1,-0.08" --thread-pitch 0.0005

say "5. Raw readings become field components, pitch and roll"
printf 'time,x,y,z\n0,0.000,-0.004,2.525\n1,0.870,0.00,2.36\n2,2.512,-0.02,-0.005\n' > $work/log.csv
show $axiscal apply $work/cal.json $work/log.csv -o $work/angles.csv
cut -d, -f1-4,8-12 $work/angles.csv

say "6. A check: a run is simulated from this calibration and calibrated again"
show $axiscal simulate --truth $work/cal.json --replicates 4 --noise 2e-4 --seed 1 -o $work/again.csv
show $axiscal calibrate $work/again.csv --instrument accelerometer --field gravity --unit V \
  -o $work/again.json
say "All files are in $work"
