#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# worlds.sh AXISCAL [TRIALS] prints the table in docs/accuracy.md of runs with other errors than white noise. Each row is
# one `axiscal study` of an accelerometer with bias and cross-axis terms, noise 1e-4 V, on a table that slopes by about
# 3 mrad. The columns are the coverage of the 95 % intervals of biases, main and cross-axis sensitivities (means over the
# axes), and the ratio of the stated standard uncertainty of the biases to their standard deviation.
set -euo pipefail
axiscal=$1
trials=${2:-1000}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/truth.json" <<'RECORD'
{"format": "axiscal-calibration", "version": 1, "status": "ok",
 "instrument": {"kind": "accelerometer", "axes": ["x", "y", "z"], "unit": "V"},
 "field": {"kind": "gravity", "unit": "g", "magnitude": 1},
 "coefficients": {"bias": [0.0123, -0.0345, 0.0057],
                  "sensitivity": [[1.0123, 0.0101, -0.0201], [0.0152, 0.9801, 0.0301], [-0.0103, 0.0202, 1.0201]]}}
RECORD

cube() { # U: writes a positioner file in which the direction of each face normal has the standard uncertainty U [rad]
  python3 - "$1" >"$folder/cube.json" <<'PYTHON'
import json, sys
u = float(sys.argv[1])
faces = {sign + axis: [int(sign + "1") * (a == axis) for a in "XYZ"] for axis in "XYZ" for sign in "+-"}
covariance = [[0.0] * 18 for _ in range(18)]
for i, normal in enumerate(faces.values()):
    for j in range(3):
        covariance[3 * i + j][3 * i + j] = 0.0 if normal[j] else u * u
print(json.dumps({"format": "axiscal-positioner", "version": 1, "id": "cube", "normal_covariance": covariance,
                  "faces": {name: {"normal": normal} for name, normal in faces.items()}}))
PYTHON
}

row() { # NAME, options of study
  local name=$1
  shift
  coverage "$name" --truth "$folder/truth.json" --method joint --slope-sd 3e-3 --noise 1e-4 "$@"
}

coverage() { # NAME, options of study
  local name=$1
  shift
  "$axiscal" study --trials "$trials" "$@" --json >"$folder/study.json"
  python3 - "$name" "$folder/study.json" <<'PYTHON'
import json, sys
study = json.load(open(sys.argv[2]))
groups = {"bias": [], "main": [], "cross": []}
for one in study["parameters"]:
    axis, *rest = one["parameter"].split(".")
    if rest == ["bias"]:
        groups["bias"].append(one)
    elif rest[:1] == ["sensitivity"]:
        groups["main" if rest[1] == axis else "cross"].append(one)
mean = {name: 100 * sum(one["coverage_95"] for one in all) / len(all) for name, all in groups.items()}
u = sum(one["stated_u"] for one in groups["bias"]) / sum(one["sd"] for one in groups["bias"])
print(f"| {sys.argv[1]} | {mean['bias']:.1f} % | {mean['main']:.1f} % | {mean['cross']:.1f} % | {u:.2f} |", flush=True)
PYTHON
}

alarms() { # NAME, options of study
  local name=$1
  shift
  "$axiscal" study --truth "$folder/truth.json" --method joint --slope-sd 3e-3 --trials "$trials" --alarms "$@" --json |
    python3 -c '
import json, sys
study = json.load(sys.stdin)
shares = {name: 100 * count / study["trials"] for name, count in study.get("warnings", {}).items()}
text = ", ".join(f"{name} {share:.2f} %" for name, share in sorted(shares.items(), key=lambda one: -one[1]))
print(f"| {sys.argv[1]} | {text or chr(45)} |", flush=True)' "$name"
}

echo "| world | bias | main | cross | u / sd of biases |"
echo "| --- | --- | --- | --- | --- |"
for replicates in 1 2 4; do row "white, 12 x $replicates" --replicates $replicates; done
for replicates in 2 4 8; do
  for sd in 1e-4 3e-4; do row "blocks differ by $sd V, 12 x $replicates" --replicates $replicates --world block_sd=$sd; done
done
for angle in 1e-4 3e-4 1e-3; do row "cube laid with $angle rad, 24" --design 24 --world seat_rad=$angle; done
row "cube laid with 1e-3 rad, 12, --seats fit" --seats fit --world seat_rad=1e-3
for replicates in 2 4 8; do row "mounted anew by 3e-4 rad in each block, 12 x $replicates" --replicates $replicates --world mount_rad=3e-4; done
for world in ar=0.5 ar=0.9 walk_sd=1e-4 drift=1e-3; do
  for replicates in 1 2 4; do row "$world, 12 x $replicates" --replicates $replicates --world $world; done
done
for replicates in 4 8; do row "rounded to 1e-3 V, 12 x $replicates" --replicates $replicates --world round=1e-3; done
row "Student's noise of 3 degrees of freedom, 12 x 2" --replicates 2 --world tails=3
for replicates in 2 3 4; do row "sensitivities differ by 3e-4 between blocks, 12 x $replicates" --replicates $replicates --world gain=3e-4; done
for replicates in 2 4; do row "mounted anew by 3e-4 rad, nobody wrote it down, 12 x $replicates" --replicates $replicates --world remount_rad=3e-4; done
for design in 12 24; do
  row "noise at full field 3 times that across, $design" --design $design --world ends=3
  row "the field's size jitters by 2e-4, $design" --design $design --world jitter=2e-4
  row "cube laid with 3e-4 rad, $design" --design $design --world seat_rad=3e-4
done
for replicates in 1 4; do row "the field's size wanders by 2e-4, 12 x $replicates" --replicates $replicates --world wander=2e-4; done
for world in ar=0 ar=0.8 ar=0.99; do
  coverage "turned by hand, 6,000 samples at 50 Hz, noise 2e-3 V, $world" --truth "$folder/truth.json" --noise 2e-3 \
    --recording free --samples 6000 --rate 50 --world $world
done
sed -e 's/accelerometer/gyroscope/; s/"V"/"rad\/s"/; s/"gravity", "unit": "g"/"induced_rotation", "unit": "rad\/s"/' \
  "$folder/truth.json" >"$folder/gyroscope.json"
for noise in 1e-4 1e-3 5e-3; do
  for seats in 0 3e-4; do
    coverage "gyroscope by turns, 12 seats, 5,400 samples at 100 Hz, noise $noise rad/s, seats $seats rad" \
      --truth "$folder/gyroscope.json" --latitude 40 --noise $noise --recording turns --samples 5400 --world seat_rad=$seats
  done
done
echo
echo "| world | trials with a warning |"
echo "| --- | --- |"
alarms "white, 12" --noise 1e-4
alarms "white, 24" --noise 1e-4 --design 24
alarms "white, 12 x 4" --noise 1e-4 --replicates 4
for tails in 3 5; do
  alarms "Student's noise of $tails degrees of freedom, 12" --noise 1e-4 --world tails=$tails
  alarms "Student's noise of $tails degrees of freedom, 24" --noise 1e-4 --design 24 --world tails=$tails
done
alarms "cube laid with 1e-3 rad, 12" --noise 1e-4 --world seat_rad=1e-3
alarms "noise 1 : 1 : 3, 12" --noise 1e-4,1e-4,3e-4
alarms "K2 of 3 sigma in one axis, 12" --noise 1e-4 --world k2=3e-4:0:0
alarms "K2 of 5 sigma in one axis, 12" --noise 1e-4 --world k2=5e-4:0:0
alarms "K2 of 3 sigma in one axis, 24" --noise 1e-4 --design 24 --world k2=3e-4:0:0
for u in 1e-4 3e-4; do
  cube $u
  for replicates in 1 2 4; do
    alarms "normals drawn as stated, $u rad, 12 x $replicates" --noise 1e-4 --replicates $replicates \
      --positioner "$folder/cube.json" --world stated=1
  done
done
