# SPDX-License-Identifier: Apache-2.0
"""Fixtures: the example run, its calibration, and the command that the Python package calls."""

import json
import os
import subprocess

import numpy as np
import pytest

import axiscal as ax
from axiscal.programs import program_path

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


@pytest.fixture(scope="session")
def example():
    return os.path.join(SOURCE, "examples", "run.csv")


@pytest.fixture(scope="session")
def run(example):
    return ax.read_run(example)


@pytest.fixture(scope="session")
def cal(run):
    return ax.calibrate(
        run.readings, rest=run.rest, fence=run.fence, instrument=ax.accelerometer("V"), field=ax.gravity()
    )


@pytest.fixture(scope="session")
def command():
    def call(*arguments, folder="."):
        return subprocess.run(
            [program_path(), *map(str, arguments)], capture_output=True, text=True, cwd=folder, check=False
        )

    return call


@pytest.fixture(scope="session")
def record(command, example, tmp_path_factory):
    path = tmp_path_factory.mktemp("record") / "cal.json"
    done = command("calibrate", example, "--instrument", "accelerometer", "--unit", "V", "-o", path)
    assert done.returncode == 0, done.stderr
    return json.loads(path.read_text())


def numbers_of(value):
    """Returns all numbers of a JSON value, in the order of the document."""
    if isinstance(value, dict):
        return [one for key in value for one in numbers_of(value[key])]
    if isinstance(value, list):
        return [one for item in value for one in numbers_of(item)]
    return [value] if isinstance(value, (int, float)) and not isinstance(value, bool) else []


def coefficients(record):
    return np.array(numbers_of(record["coefficients"]) + numbers_of(record["statistics"]))
