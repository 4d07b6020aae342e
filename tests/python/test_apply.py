# SPDX-License-Identifier: Apache-2.0
"""Tests the conversion of readings: shapes and types of arrays, and memory."""

import csv
import io
import resource
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import axiscal as ax
from conftest import Command

pandas = pytest.importorskip("pandas")

Change = Callable[[Any], Any]


def test_components_solve_the_response(cal: ax.Calibration) -> None:
    rng = np.random.default_rng(3)
    for shape in [(1, 3), (7, 3), (20000, 3)]:
        field = rng.normal(size=shape)
        readings = cal.bias + field @ cal.sensitivity.T
        assert cal.apply(readings) == pytest.approx(field, abs=1e-12)


@pytest.mark.parametrize("change", [
    np.asfortranarray,
    lambda x: x.astype(np.float32),
    lambda x: np.repeat(x, 2, axis=0)[::2],
    lambda x: x.tolist(),
    lambda x: x[::-1][::-1],
])  # fmt: skip
def test_any_layout(cal: ax.Calibration, run: ax.Run, change: Change) -> None:
    tolerance = 1e-6 if getattr(change(run.readings), "dtype", None) == np.float32 else 1e-14
    assert cal.apply(change(run.readings)) == pytest.approx(cal.apply(run.readings), abs=tolerance)


def test_frames_and_the_command(
    cal: ax.Calibration, run: ax.Run, command: Command, example: str, tmp_path: Path
) -> None:
    cal.save(tmp_path / "cal.json")
    done = command("apply", tmp_path / "cal.json", example)
    rows = list(csv.DictReader(io.StringIO(done.stdout)))
    frame = cal.apply(run.to_dataframe())
    for name in ("field_x", "field_y", "field_z", "pitch_deg", "roll_deg"):
        assert frame[name].to_numpy() == pytest.approx(
            [float(row[name] or "nan") for row in rows], abs=1e-12, nan_ok=True
        )
    angles = cal.angles(run.readings)
    assert np.array_equal(angles["pitch_deg"], frame["pitch_deg"])


def test_bad_readings(cal: ax.Calibration) -> None:
    with pytest.raises(ax.DomainError, match="n x 3"):
        cal.apply(np.zeros((4, 2)))
    with pytest.raises(ax.DomainError, match="readings"):
        cal.apply([["a", "b", "c"]])
    assert np.isnan(cal.apply(np.array([[np.nan, 0.0, 1.0]]))).any()


def resident_mb() -> float:
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 2**20


def test_memory_stays(cal: ax.Calibration) -> None:
    data = np.broadcast_to(cal.bias, (10_000_000, 3)).copy()  # 240 MB
    cal.apply(data)
    before = resident_mb()
    for _ in range(4):
        assert len(cal.apply(data)) == len(data)
    assert resident_mb() - before < 40.0


def test_round_trips() -> None:
    rng = np.random.default_rng(7)
    template = None
    for _ in range(50):
        bias = rng.normal(size=3)
        sensitivity = np.eye(3) + 0.2 * rng.normal(size=(3, 3))
        design = ax.plan(seed=int(rng.integers(1000)))["sheet"]
        rest, fence = design["rest"], design["fence"]
        axis = {"X": 0, "Y": 1, "Z": 2}
        up = np.zeros((len(rest), 3))
        for i, face in enumerate(rest):
            up[i, axis[face[1]]] = 1.0 if face[0] == "-" else -1.0
        readings = bias + up @ sensitivity.T + 1e-7 * rng.normal(size=up.shape)
        cal = ax.calibrate(readings, rest=rest, fence=fence, instrument=ax.generic("V"), field=ax.gravity(), force=True)
        assert cal.bias == pytest.approx(bias, abs=1e-5)
        assert cal.sensitivity == pytest.approx(sensitivity, abs=1e-5)
        template = cal
    assert template is not None
