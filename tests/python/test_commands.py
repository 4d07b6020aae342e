# SPDX-License-Identifier: Apache-2.0
"""Tests the functions for the other commands: plan, simulate, check, export, read_log and others."""

import json
import os
import warnings
from pathlib import Path

import numpy as np
import pytest

import axiscal as ax
from conftest import SOURCE

pandas = pytest.importorskip("pandas")


def test_plan_simulate_calibrate_check(cal: ax.Calibration) -> None:
    forecast = ax.plan(noise=1e-4, sensitivity=2.5)
    assert len(forecast["sheet"]["rest"]) == 12
    fresh = ax.simulate(cal, noise=1e-4, seed=3)
    again = ax.calibrate(fresh, instrument=ax.accelerometer("V"))
    assert again.bias == pytest.approx(cal.bias, abs=1e-3)
    for other in (again, ax.Run(np.column_stack([fresh[a] for a in "xyz"]), "xyz",
                                {"rest": fresh["rest"], "fence": fresh["fence"]})):  # fmt: skip
        assert "p_value" in json.dumps(ax.check(cal, other))


def test_study_budget_level(cal: ax.Calibration) -> None:
    assert ax.study(cal, noise=1e-4, trials=20)
    assert ax.budget(cal, pitch=30, roll=45)
    assert ax.level(cal, adjusters="0.1,0;-0.1,0.08;-0.1,-0.08")
    assert ax.site_field(latitude=48.1, longitude=11.5)


def test_exports(cal: ax.Calibration, tmp_path: Path) -> None:
    names = [one["name"] for one in ax.export_formats()]
    assert {"px4", "c-header", "kalibr"} <= set(names)
    header = cal.export("c-header", tmp_path / "cal.h")
    assert "axiscal" in header and (tmp_path / "cal.h").read_text() == header
    assert cal.export("px4", lossy=True, reading_factor=3.92)
    with pytest.raises(ax.Error):
        cal.export("none")


def test_reports(cal: ax.Calibration, tmp_path: Path) -> None:
    cal.report(tmp_path / "cal.html")
    assert "Calibrated" in (tmp_path / "cal.html").read_text()
    html = cal._repr_html_()
    assert html.startswith("<iframe") and "Coefficients" in html and len(html) < 400_000


def test_logs(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    n = 6000
    frame = pandas.DataFrame(
        {"time": np.arange(n) / 100.0, "x": rng.normal(size=n), "y": rng.normal(size=n), "z": 1 + rng.normal(size=n)}
    )
    frame.to_csv(tmp_path / "log.csv", index=False)
    series = ax.read_log(tmp_path / "log.csv")
    found = next(one for one in series if "x" in one.columns)
    assert np.array_equal(found["x"], frame["x"]) and len(found.to_dataframe()) == n
    noise = ax.noise(frame[["x", "y", "z"]], rate=100.0, columns="x,y,z")
    assert noise
    with pytest.raises(ax.DataError):
        ax.read_log(tmp_path / "none.csv")


DATA = os.environ.get("AXISCAL_DATA_DIR", os.path.join(os.path.dirname(SOURCE), "shared", "data"))


@pytest.mark.skipif(not os.path.isdir(DATA), reason="no recordings (AXISCAL_DATA_DIR)")
def test_recordings_of_each_format() -> None:
    shapes = {}
    for folder in ("log_matlab73", "log_matlab5", "log_ulog", "log_rosbag2", "log_phyphox", "log_dataflash"):
        path = next(
            os.path.join(DATA, folder, name) for name in sorted(os.listdir(os.path.join(DATA, folder))) if name != "SOURCE.md"
        )
        try:
            series = ax.read_log(path)
        except ax.RefusedError as error:
            assert "axiscal-hdf5" in str(error)  # the build has no HDF5
            continue
        assert series and all(len(one.time) == len(one.values) for one in series)
        shapes[folder] = len(series)
    assert len(shapes) >= 5


def test_allan_is_the_formula() -> None:
    rng = np.random.default_rng(2)
    y = rng.normal(size=5000)
    curve = ax.allan(y, 10.0)
    for tau, deviation in zip(curve.tau, curve.deviation):
        m = round(tau * 10.0)
        x = np.concatenate([[0.0], np.cumsum(y - y.mean())]) / 10.0
        second = x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]
        assert deviation == pytest.approx(np.sqrt(np.mean(second**2) / (2 * tau**2)), rel=1e-9)
    with pytest.raises(ax.DomainError):
        ax.allan([[1.0]], 1.0)


def test_imu_log_and_rests(cal: ax.Calibration, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    leaned = np.eye(3)[[1, 2, 0]] * 0.6 + 0.8 * np.eye(3)
    faces = np.vstack([np.eye(3), -np.eye(3), leaned, -leaned])
    rows = []
    for up in faces:
        rows.append(np.tile(9.81 * up, (400, 1)) + 0.02 * rng.normal(size=(400, 3)))
        rows.append(9.81 * up + 3.0 * rng.normal(size=(100, 3)))
    data = np.vstack(rows)
    rests = ax.find_rests(data, columns="x,y,z", rate=100.0)
    assert len(rests["x"]) >= 11 and len(rests.to_dataframe()) == len(rests["x"])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = ax.fit_magnitude(np.column_stack([rests[a] for a in "xyz"]), instrument=ax.accelerometer("m/s^2"),
                                 field=ax.gravity(unit="m/s^2", magnitude=9.81), force=True)  # fmt: skip
    assert found.bias == pytest.approx(np.zeros(3), abs=0.05)


def test_recipes_parse() -> None:
    tomllib = pytest.importorskip("tomllib")
    for name in ("python/pyproject.toml", "packaging/wheel/cibuildwheel.toml"):
        with open(os.path.join(SOURCE, name), "rb") as file:
            assert tomllib.load(file)
    with open(os.path.join(SOURCE, "packaging", "conda", "meta.yaml"), encoding="utf-8") as file:
        text = file.read()
    assert text.count("{{") == text.count("}}") == 2
    yaml = pytest.importorskip("yaml")
    assert yaml.safe_load(text.replace("{{ PYTHON }}", "python").replace("{{ compiler('cxx') }}", "gxx"))["package"]
