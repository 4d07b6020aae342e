# SPDX-License-Identifier: Apache-2.0
"""Calibrates the runs of the corpus from arrays: each number equals that of the command's record."""

import os
import tarfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import axiscal as ax
from axiscal._options import arguments_of
from conftest import SOURCE, Command, coefficients

KINDS: dict[str, dict[str, Any]] = {
    "accelerometer": {"instrument": "accelerometer", "unit": "V"},
    "magnetometer": {
        "instrument": "magnetometer", "unit": "1", "field": "geomagnetic", "latitude": 48.14, "longitude": 11.58,
        "height": 520, "date": "2026-06-21",
    },
    "temperature": {"instrument": "accelerometer", "unit": "V", "temperature_order": 1},
}  # fmt: skip
FITS: list[dict[str, Any]] = [
    {}, {"method": "joint"}, {"method": "paired"}, {"robust": True}, {"drift": "none"}, {"level_by": "block"},
]  # fmt: skip


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("corpus")
    with tarfile.open(os.path.join(SOURCE, "tests", "data", "corpus.tar.xz")) as packed:
        for member in packed.getmembers():
            if member.name.endswith(".csv") and "/" not in member.name:
                packed.extract(member, folder)
    return folder


def test_corpus(corpus: Path, command: Command, tmp_path: Path) -> None:
    compared = 0
    for path in sorted(corpus.iterdir()):
        kind = next((one for one in KINDS if path.name.startswith(one)), None)
        if kind is None:
            continue
        for fit in FITS:
            options = {**KINDS[kind], **fit}
            output = tmp_path / "cal.json"
            output.unlink(missing_ok=True)
            command("calibrate", path, *arguments_of(options), "--force", "-o", output)
            if not output.exists():
                continue
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                ours = ax.calibrate(ax.read_run(path), force=True, **options)
            theirs = ax.load(output)
            assert np.array_equal(coefficients(ours.to_dict()), coefficients(theirs.to_dict()), equal_nan=True), path
            assert np.array_equal(ours.covariance, theirs.covariance, equal_nan=True)
            compared += 1
    assert compared >= 12
