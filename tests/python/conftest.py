# SPDX-License-Identifier: Apache-2.0
"""Fixtures: the example run, its calibration, and the command that the Python package calls."""

import json
import os
import subprocess
from typing import Any, Callable, Union

import numpy as np
import numpy.typing as npt
import pytest

import axiscal as ax
from axiscal.programs import program_path

SOURCE = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))

Command = Callable[..., "subprocess.CompletedProcess[str]"]  # arguments of axiscal; its status and output
Record = dict[str, Any]  # the JSON of a record


@pytest.fixture(scope="session")
def example() -> str:
    return os.path.join(SOURCE, "examples", "run.csv")


@pytest.fixture(scope="session")
def run(example: str) -> ax.Run:
    return ax.read_run(example)


@pytest.fixture(scope="session")
def cal(run: ax.Run) -> ax.Calibration:
    return ax.calibrate(
        run.readings, rest=run.rest, fence=run.fence, instrument=ax.accelerometer("V"), field=ax.gravity()
    )


@pytest.fixture(scope="session")
def command() -> Command:
    def call(*arguments: Any, folder: str = ".") -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [program_path(), *map(str, arguments)], capture_output=True, text=True, cwd=folder, check=False
        )

    return call


@pytest.fixture(scope="session")
def record(command: Command, example: str, tmp_path_factory: pytest.TempPathFactory) -> Record:
    path = tmp_path_factory.mktemp("record") / "cal.json"
    done = command("calibrate", example, "--instrument", "accelerometer", "--unit", "V", "-o", path)
    assert done.returncode == 0, done.stderr
    result: Record = json.loads(path.read_text())
    return result


def numbers_of(value: Any) -> list[Union[int, float]]:
    """Returns all numbers of a JSON value, in the order of the document."""
    if isinstance(value, dict):
        return [one for key in value for one in numbers_of(value[key])]
    if isinstance(value, list):
        return [one for item in value for one in numbers_of(item)]
    return [value] if isinstance(value, (int, float)) and not isinstance(value, bool) else []


def coefficients(record: Record) -> npt.NDArray[Any]:
    return np.array(numbers_of(record["coefficients"]) + numbers_of(record["statistics"]))
