# SPDX-License-Identifier: Apache-2.0
"""Calibrations by arrays, data frames, runs and files give the numbers of the command."""

import copy
import logging
import pickle
import threading
import warnings
from pathlib import Path
from typing import Any, Callable

import numpy as np
import pytest

import axiscal as ax
from conftest import Command, Record, coefficients

pandas = pytest.importorskip("pandas")
masked_greater: Any = np.ma.masked_greater

Change = Callable[[Any], Any]


def test_arrays_give_the_numbers_of_the_command(cal: ax.Calibration, record: Record) -> None:
    assert np.array_equal(coefficients(cal.to_dict()), coefficients(record), equal_nan=True)


@pytest.mark.parametrize("form", ["frame", "run", "path", "fortran", "float_list", "stride"])
def test_each_form_of_readings(form: str, run: ax.Run, cal: ax.Calibration, example: str) -> None:
    options: dict[str, Any] = {"instrument": ax.accelerometer("V"), "field": ax.gravity()}
    labels: dict[str, Any] = {"rest": run.rest, "fence": run.fence}
    wide = np.zeros((len(run), 6))
    wide[:, ::2] = run.readings
    calls: dict[str, Callable[[], ax.Calibration]] = {
        "frame": lambda: ax.calibrate(run.to_dataframe(), **options),
        "run": lambda: ax.calibrate(run, **options),
        "path": lambda: ax.calibrate(example, **options),
        "fortran": lambda: ax.calibrate(np.asfortranarray(run.readings), **labels, **options),
        "float_list": lambda: ax.calibrate(run.readings.tolist(), **labels, **options),
        "stride": lambda: ax.calibrate(wide[:, ::2], **labels, **options),
    }
    other = calls[form]()
    assert np.array_equal(other.bias, cal.bias)
    assert np.array_equal(other.sensitivity, cal.sensitivity)
    assert np.array_equal(other.covariance, cal.covariance)


def test_quantities(cal: ax.Calibration, record: Record) -> None:
    bias = cal["x.bias"]
    assert float(bias) == record["coefficients"]["bias"][0]
    assert bias.unit == "V" and bias.U == pytest.approx(bias.k * bias.u)
    assert str(bias) == "0.01199 +- 0.00026 V"
    with pytest.raises(ax.DomainError, match="x.bias"):
        cal["x.bais"]


@pytest.mark.parametrize("method", ["joint", "paired", "known"])
def test_methods_are_the_commands(method: str, run: ax.Run, command: Command, example: str, tmp_path: Path) -> None:
    path = tmp_path / "cal.json"
    command("calibrate", example, "--instrument", "accelerometer", "--unit", "V", "--method", method, "-o", path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        cal = ax.calibrate(run, instrument=ax.accelerometer("V"), method=method, force=True)
    theirs = ax.load(path).to_dict() if path.exists() else None
    if theirs is not None:
        assert np.array_equal(coefficients(cal.to_dict()), coefficients(theirs), equal_nan=True)


def test_record_survives(cal: ax.Calibration, tmp_path: Path) -> None:
    cal.save(tmp_path / "cal.json")
    assert ax.load(tmp_path / "cal.json") == cal
    assert pickle.loads(pickle.dumps(cal)) == cal
    assert copy.deepcopy(cal) == cal
    assert cal.to_dataframe().loc["x.bias", "unit"] == "V"


def test_warnings_and_notes(run: ax.Run, caplog: pytest.LogCaptureFixture) -> None:
    swapped = run.readings.copy()
    swapped[[2, 5]] = swapped[[5, 2]]
    with caplog.at_level(logging.INFO, logger="axiscal"):
        with pytest.warns(ax.CalibrationWarning) as caught:
            ax.calibrate(swapped, rest=run.rest, fence=run.fence, instrument=ax.accelerometer("V"), force=True)
    assert all(isinstance(one.message, ax.CalibrationWarning) and one.message.code for one in caught)
    with pytest.raises(ax.RefusedError):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ax.calibrate(swapped, rest=run.rest, fence=run.fence, instrument=ax.accelerometer("V"))
    with caplog.at_level(logging.INFO, logger="axiscal"):
        ax.calibrate(run, instrument=ax.accelerometer("V"))
    assert any("repeatability" in one.getMessage() for one in caplog.records)


BAD: dict[str, tuple[Change, str]] = {
    "shape": (lambda run: {"readings": np.zeros((2, 2, 2))}, "readings: expected an array of n x m"),
    "nan": (lambda run: {"readings": np.full((12, 3), np.nan)}, "readings: row 0, column 0 is nan"),
    "objects": (lambda run: {"readings": np.array([["a", "b", "c"]] * 12, dtype=object)}, "readings: expected numbers"),
    "ragged": (lambda run: {"readings": [[1.0, 2.0, 3.0], [1.0, 2.0]]}, "readings:"),
    "labels": (lambda run: {"readings": run.readings, "rest": run.rest[:5]}, "rest: expected 12 values"),
    "face": (lambda run: {"readings": run.readings, "rest": ["up"] * 12}, "rest: 'up' in reading 1 is not a face"),
    "block": (lambda run: {"readings": run.readings, "block": [1]}, "block: expected 12 values"),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_names_the_argument(case: str, run: ax.Run) -> None:
    change, words = BAD[case]
    arguments: dict[str, Any] = {"rest": run.rest, "fence": run.fence, "instrument": ax.accelerometer("V")}
    arguments.update(change(run))
    with pytest.raises(ax.DomainError, match=words):
        ax.calibrate(arguments.pop("readings"), **arguments)


def test_bad_options_and_files(run: ax.Run, tmp_path: Path) -> None:
    with pytest.raises(ax.SetupError, match="metod"):
        ax.calibrate(run, instrument=ax.accelerometer("V"), metod="joint")
    with pytest.raises(ax.DataError, match="no such file"):
        ax.calibrate(tmp_path / "none.csv", instrument="accelerometer")
    with pytest.raises(ax.DataError):
        ax.load(tmp_path / "none.json")
    with pytest.raises(ax.SetupError, match="twice"):
        ax.calibrate(run, instrument=ax.accelerometer("V"), unit="g")
    assert issubclass(ax.RankDeficientError, ax.RefusedError) and issubclass(ax.DataError, ValueError)


def test_what_the_readings_leave_open(run: ax.Run) -> None:
    flat = [0, 1]
    assert run.rest is not None and run.fence is not None
    with pytest.raises(ax.RefusedError) as caught:
        ax.calibrate(
            run.readings[flat], rest=run.rest[flat], fence=run.fence[flat], instrument=ax.accelerometer("V")
        )
    if isinstance(caught.value, ax.RankDeficientError):
        assert caught.value.undetermined


def test_a_field_and_an_instrument_of_ones_own(run: ax.Run) -> None:
    class Gravity(ax.Field):
        kind = "custom"

        def in_table(self) -> tuple[float, float, float]:
            return (0.0, 0.0, 1.0)

    class Probe(ax.Instrument):
        kind = "generic"

    own = ax.calibrate(run, instrument=Probe(unit="V"), field=Gravity(unit="1"))
    usual = ax.calibrate(run, instrument=ax.accelerometer("V"))
    assert own.bias == pytest.approx(usual.bias, abs=1e-9)


def test_threads(run: ax.Run) -> None:
    results = []

    def work() -> None:
        for _ in range(20):
            results.append(ax.calibrate(run, instrument=ax.accelerometer("V")).bias)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert len(results) == 80 and all(np.array_equal(one, results[0]) for one in results)


def test_tables_of_any_look(run: ax.Run, cal: ax.Calibration, tmp_path: Path) -> None:
    assert run.path is not None
    text = open(run.path, encoding="utf-8").read()
    assert ";" not in text
    german = tmp_path / "messung.csv"
    german.write_text(text.replace(",", ";").replace(".", ","), encoding="utf-8")
    other = ax.read_run(german)
    assert run.rest is not None and other.rest is not None
    assert np.array_equal(other.readings, run.readings) and list(other.rest) == list(run.rest)
    with pytest.raises(ax.DataError, match="no.csv"):
        ax.read_run(tmp_path / "no.csv")
    ragged = tmp_path / "ragged.csv"
    ragged.write_text("rest,fence,x,y,z\n-Z,+X,1,2,3\n-Z,-X,1,2\n")
    with pytest.raises(ax.DataError, match="ragged.csv:3"):
        ax.read_run(ragged)
    serials = tmp_path / "serials.csv"
    serials.write_text("serial,rest,fence,x,y,z\n007,-Z,+X,1,2,3\n")
    assert list(ax.read_run(serials).columns["serial"]) == ["007"]


def test_times_are_dates(run: ax.Run) -> None:
    start = np.datetime64("2026-11-29T10:00:00")
    times = start + np.arange(len(run)) * np.timedelta64(60, "s")
    labels: dict[str, Any] = {"rest": run.rest, "fence": run.fence, "instrument": ax.accelerometer("V")}
    cal = ax.calibrate(run.readings, time=times, **labels)
    assert cal.measured == times[-1]
    assert cal.created.dtype.kind == "M" and cal.created > np.datetime64("2026-01-01")
    assert ax.calibrate(run.readings, **labels).measured is None
    by_text = ax.calibrate(run.readings, time=[str(one) + "Z" for one in times], **labels)
    assert by_text.measured == cal.measured
    assert np.array_equal(by_text.covariance, cal.covariance)


def test_times_of_logs(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,ax,ay,az\n" + "".join(f"2026-11-29T10:00:{i:02d}Z,0,0,{9.8 + i}\n" for i in range(20)))
    series = ax.read_log(log)[0]
    assert series.datetimes[3] == np.datetime64("2026-11-29T10:00:03")
    assert series.to_dataframe().index[0] == pandas.Timestamp("2026-11-29T10:00:00")
    log.write_text("time,ax,ay,az\n" + "".join(f"{i},0,0,{9.8 + i}\n" for i in range(20)))
    assert ax.read_log(log)[0].datetimes is None


def test_quantities_convert(cal: ax.Calibration) -> None:
    uncertainties = pytest.importorskip("uncertainties")
    bias = cal["x.bias"]
    number = bias.to_uncertainties()
    assert isinstance(number, uncertainties.UFloat)
    assert (number.n, number.s) == (bias.value, bias.u)
    pint = pytest.importorskip("pint")
    registry = pint.UnitRegistry()
    slope = cal["x.sensitivity.x"].to_pint(registry)
    assert slope.value.units == registry.Unit("V / standard_gravity")
    assert slope.to("V / (m/s^2)").value.magnitude == pytest.approx(cal["x.sensitivity.x"].value / 9.80665)


@pytest.mark.parametrize("change, said", [
    (lambda x: x + 1j, "complex"),
    (lambda x: x > 0, "bool"),
    (lambda x: x[:, :2], "n x 3, not of n x 2"),
    (lambda x: np.hstack([x, x]), "n x 3, not of n x 6"),
    (lambda x: x[None], "3 dimensions"),
    (lambda x: masked_greater(x, 2.4), "row 0, column 2 is nan"),
    (lambda x: [[1, 2, 3], [1, 2]], "different lengths"),
])  # fmt: skip
def test_readings_that_are_refused(run: ax.Run, change: Change, said: str) -> None:
    with pytest.raises(ax.DomainError, match="readings: .*" + said):
        ax.calibrate(change(run.readings), rest=run.rest, fence=run.fence, instrument=ax.accelerometer("V"))


def test_units_of_columns(run: ax.Run, cal: ax.Calibration) -> None:
    frame = run.to_dataframe()
    named = frame.rename(columns={axis: f"{axis} (V)" for axis in "xyz"})
    assert np.array_equal(ax.calibrate(named, instrument=ax.accelerometer("V")).bias, cal.bias)
    assert ax.calibrate(named, instrument=ax.accelerometer()).unit == "V"
    with pytest.raises(ax.DomainError, match="in V, the instrument in mV"):
        ax.calibrate(named, instrument=ax.accelerometer("mV"))
    mixed = frame.rename(columns={"x": "x (V)", "y": "y (mV)", "z": "z (V)"})
    with pytest.raises(ax.DomainError, match="different units"):
        ax.calibrate(mixed, instrument=ax.accelerometer("V"))
    with pytest.raises(ax.DataError, match="'z' is missing"):
        ax.calibrate(frame.drop(columns="z"), instrument=ax.accelerometer("V"))
