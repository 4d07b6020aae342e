# SPDX-License-Identifier: Apache-2.0
"""A fleet in files, calibrated by two processes of Dask."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import axiscal as ax

distributed = pytest.importorskip("distributed")
bag = pytest.importorskip("dask.bag")


def write_units(run: ax.Run, path: str, first: int, rng: np.random.Generator) -> None:
    assert run.rest is not None and run.fence is not None
    with open(path, "w", encoding="utf-8") as file:
        file.write("serial,rest,fence,x,y,z\n")
        for unit in range(first, first + 3):
            noise = rng.normal(scale=1e-4, size=run.readings.shape)
            readings: Any = run.readings + noise
            for rest, fence, reading in zip(run.rest, run.fence, readings):
                file.write(f"S{unit:03d},{rest},{fence}," + ",".join(f"{one:.6f}" for one in reading) + "\n")


def test_units_of_many_files(run: ax.Run, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    paths = [str(tmp_path / f"units{k}.csv") for k in range(4)]
    for k, path in enumerate(paths):
        write_units(run, path, 3 * k, rng)
    options: dict[str, Any] = {"instrument": ax.accelerometer("V")}
    here = [one for path in paths for one in ax.calibrate_units(path, **options)]
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster:
        with distributed.Client(cluster):
            there = bag.from_sequence(paths).map(ax.calibrate_units, **options).flatten().compute()
    assert [one.serial for one in there] == [f"S{unit:03d}" for unit in range(12)]
    for one, other in zip(here, there):
        assert np.array_equal(one.bias, other.bias)
        assert np.array_equal(one.covariance, other.covariance)
