#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Compares axiscal.calibrate() in Python with the same call in C++, for the same 12 readings.

usage: calibrate_from_python.py PATH/TO/axiscal_bench FOLDER_OF_THE_MODULE [ROUNDS]

Both run in turn on one core. The program prints the median times and their ratio (goal: at most 1.3).
"""
import json
import os
import statistics
import subprocess
import sys
import time

import numpy as np


def readings():
    rest = ["-Z", "+Z", "-Y", "+Y", "-X", "+X"] * 2
    fence = ["+X", "+X", "+X", "+X", "+Y", "+Y", "-X", "-X", "-X", "-X", "-Y", "-Y"]
    up = np.zeros((12, 3))
    for i, face in enumerate(rest):
        up[i, "XYZ".index(face[1])] = 1.0 if face[0] == "-" else -1.0
    return 2.5 * up + 0.01 + 1e-4 * np.sin(np.arange(36.0).reshape(12, 3) ** 2), rest, fence


def in_cpp(bench):
    command = [bench, "--benchmark_filter=calibrate_as_python_does", "--benchmark_format=json"]
    result = subprocess.run(command, capture_output=True, check=True)
    return json.loads(result.stdout)["benchmarks"][0]["real_time"] * 1e-6


def in_python(calls=2000):
    import axiscal as ax

    x, rest, fence = readings()
    times = []
    for _ in range(calls):
        start = time.perf_counter()
        ax.calibrate(x, rest=rest, fence=fence, instrument=ax.accelerometer("V"), field=ax.gravity())
        times.append(time.perf_counter() - start)
    return 1e3 * statistics.median(times)


def main():
    bench, module = sys.argv[1:3]
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    sys.path.insert(0, module)
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    pairs = [(in_cpp(bench), in_python()) for _ in range(rounds)]
    cpp, python = (statistics.median(one) for one in zip(*pairs))
    print(f"C++ {cpp:.3f} ms, Python {python:.3f} ms, ratio {python / cpp:.2f}")


if __name__ == "__main__":
    main()
