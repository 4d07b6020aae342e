#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the speed of `axiscal apply` with that of pandas (read_csv, numpy, to_csv) on the same file.

usage: apply_beside_pandas.py PATH/TO/axiscal [ROWS] [ROUNDS]

Both run in turn on two cores. The program checks that both write the same numbers. Then it prints the
median times, their ratio (goal: at least 20) and the command's memory (goal: under 25 MiB). It needs
python3-numpy and python3-pandas.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import pandas as pd

BIAS = np.array([0.012, -0.034, 0.005])
SENSITIVITY = np.array([[2.5, 0.01, -0.02], [0.015, 2.48, 0.03], [-0.01, 0.02, 2.52]])


def make_files(folder, rows):
    rng = np.random.default_rng(1)
    field = rng.normal(size=(rows, 3))
    field /= np.linalg.norm(field, axis=1)[:, None]
    readings = field @ SENSITIVITY.T + BIAS
    with open(f"{folder}/readings.csv", "w", encoding="ascii") as file:
        file.write("t,x,y,z\n")
        for i, row in enumerate(readings):
            file.write("%.3f,%.9g,%.9g,%.9g\n" % (i * 1e-3, *row))
    with open(f"{folder}/record.json", "w", encoding="ascii") as file:
        json.dump({
            "format": "axiscal-calibration", "version": 1,
            "instrument": {"kind": "accelerometer", "axes": ["x", "y", "z"], "unit": "V"},
            "field": {"kind": "gravity", "unit": "g", "magnitude": 1.0},
            "coefficients": {"bias": BIAS.tolist(), "sensitivity": SENSITIVITY.tolist()}}, file)


def by_pandas(folder):
    table = pd.read_csv(f"{folder}/readings.csv")
    readings = table[["x", "y", "z"]].to_numpy()
    f = (readings - BIAS) @ np.linalg.inv(SENSITIVITY).T
    table["field_x"], table["field_y"], table["field_z"] = f.T
    table["residual"] = np.linalg.norm(f, axis=1) - 1.0
    pitch = np.degrees(np.arcsin(np.clip(f[:, 0], -1.0, 1.0)))
    steep = np.abs(pitch) >= 85.0
    table["pitch_deg"] = pitch
    table["roll_deg"] = np.where(steep, np.nan, np.degrees(np.arctan2(f[:, 1], f[:, 2])))
    table["yaw_deg"] = np.where(steep, np.degrees(np.arctan2(f[:, 1], f[:, 0])), np.nan)
    table["flag"] = np.where(np.abs(f[:, 0]) > 1.0, "clamped", "")
    table.to_csv(f"{folder}/pandas.csv", index=False)


def apply_command(command, folder):
    return [command, "apply", f"{folder}/record.json", f"{folder}/readings.csv", "-o",
            f"{folder}/axiscal.csv"]


def by_axiscal(command, folder):
    subprocess.run(apply_command(command, folder), check=True, stderr=subprocess.DEVNULL)


def memory_of_axiscal(command, folder):
    """Returns the largest memory of the command [MiB].

    A small parent process measures it, because a child process starts with the size of its parent.
    """
    script = ("import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, "
              "stderr=subprocess.DEVNULL); "
              "print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)")
    asked = subprocess.run([sys.executable, "-S", "-c", script, *apply_command(command, folder)],
                           check=True, capture_output=True, text=True)
    return int(asked.stdout) / 1024


def largest_difference(folder):
    ours = pd.read_csv(f"{folder}/axiscal.csv")
    theirs = pd.read_csv(f"{folder}/pandas.csv")
    assert list(ours.columns) == list(theirs.columns), "columns differ"
    difference = 0.0
    for name in ours.columns[:-1]:
        a, b = ours[name].to_numpy(float), theirs[name].to_numpy(float)
        assert (np.isnan(a) == np.isnan(b)).all(), f"{name}: the empty cells differ"
        # asin loses digits as 1 / cos(pitch) near 90 degrees, and so does roll before the switch to
        # yaw.
        difference = max(difference, np.nanmax(np.abs(a - b)))
    return difference


def main():
    command = sys.argv[1]
    rows = int(float(sys.argv[2])) if len(sys.argv) > 2 else 1_000_000
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    os.sched_setaffinity(0, set(sorted(os.sched_getaffinity(0))[:2]))
    with tempfile.TemporaryDirectory() as folder:
        make_files(folder, rows)
        by_axiscal(command, folder)
        by_pandas(folder)
        print(f"largest difference between the two outputs: {largest_difference(folder):.1e}")
        times = {"axiscal": [], "pandas": []}
        for _ in range(rounds):
            for name, work in (("axiscal", lambda: by_axiscal(command, folder)),
                               ("pandas", lambda: by_pandas(folder))):
                start = time.perf_counter()
                work()
                times[name].append(time.perf_counter() - start)
        memory = memory_of_axiscal(command, folder)
    for name, seconds in times.items():
        print(f"{name:8} median {statistics.median(seconds):.3f} s "
              f"({min(seconds):.3f} to {max(seconds):.3f}) for {rows} rows")
    ratio = statistics.median(times["pandas"]) / statistics.median(times["axiscal"])
    print(f"ratio {ratio:.1f} (goal 20), memory of axiscal {memory:.1f} MiB (goal below 25)")
    return 0 if ratio >= 20.0 and memory < 25.0 else 1


if __name__ == "__main__":
    sys.exit(main())
