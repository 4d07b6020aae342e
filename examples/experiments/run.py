#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs experiments and compares their results with the expected ones (docs/experiments.md).

    run.py COMMAND EXPECTED.json [EXPECTED.json ...]

COMMAND is `axiscal`, or another program with the same arguments. Each operation runs in the folder
of EXPECTED.json. {folder} is replaced by a new temporary folder. The program prints one line for each
difference. The exit status is 1 if there is any.
"""
import csv
import json
import os
import subprocess
import sys
import tempfile


def at_pointer(value, pointer):
    for key in pointer.strip("/").split("/"):
        value = value[int(key)] if isinstance(value, list) else value[key]
    return value


def parameter(record, name):
    for one in record["uncertainty"]["parameters"]:
        if one["parameter"] == name:
            return one["value"]
    raise KeyError(name)


def found(expect, output, folder):
    """Returns the result at the place that an expectation states."""
    if "output" in expect:
        return at_pointer(json.loads(output), expect["output"])
    path = expect["file"].replace("{folder}", folder)
    with open(path, newline="") as file:
        if "column" in expect:
            return float(list(csv.DictReader(file))[expect["row"] - 1][expect["column"]])
        content = json.load(file)
    return (parameter(content, expect["parameter"]) if "parameter" in expect
            else at_pointer(content, expect["pointer"]))


def differences(command, path):
    with open(path) as file:
        expected = json.load(file)
    if expected.get("format") != "axiscal-expected" or expected.get("version") != 1:
        return [f"{path}: is not a file of format axiscal-expected, version 1"]
    lines = []
    with tempfile.TemporaryDirectory() as folder:
        for operation in expected["operations"]:
            arguments = [a.replace("{folder}", folder) for a in operation["run"]]
            result = subprocess.run([command] + arguments, capture_output=True, text=True,
                                    cwd=os.path.dirname(os.path.abspath(path)))
            what = f"{path}: {' '.join(operation['run'])}"
            if result.returncode != operation.get("status", 0):
                lines.append(f"{what}: exit status {result.returncode}: {result.stderr.strip()}")
                break
            for expect in operation["expect"]:
                place = expect.get("parameter") or expect.get("pointer") or expect.get(
                    "output") or f"{expect.get('column')} of row {expect.get('row')}"
                try:
                    value = found(expect, result.stdout, folder)
                except (KeyError, IndexError, OSError, ValueError) as error:
                    lines.append(f"{what}: {place}: is missing ({error})")
                    continue
                wanted, tolerance = expect["value"], expect.get("tolerance")
                good = (value == wanted if tolerance is None
                        else isinstance(value, (int, float)) and abs(value - wanted) <= tolerance)
                if not good:
                    lines.append(f"{what}: {place} is {value}, expected {wanted}"
                                 + (f" +- {tolerance:.2g}" if tolerance is not None else ""))
    return lines


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    command = os.path.abspath(sys.argv[1]) if os.path.exists(sys.argv[1]) else sys.argv[1]
    lines = [line for path in sys.argv[2:] for line in differences(command, path)]
    print("\n".join(lines) if lines else f"{len(sys.argv) - 2} files: all results as expected")
    sys.exit(1 if lines else 0)


if __name__ == "__main__":
    main()
