# SPDX-License-Identifier: Apache-2.0
"""Input of every form, and input that is wrong."""

import os
import pathlib
import pickle
from typing import Any, Callable, List

import numpy as np
import pytest

import axiscal as ax
from axiscal._options import run as run_command

SOURCE = pathlib.Path(__file__).resolve().parents[2]
ACCELEROMETER = ax.accelerometer("V")


@pytest.fixture(scope="module")
def warm() -> ax.Calibration:
    """A calibration with temperature terms."""
    rng = np.random.default_rng(5)
    truth = ax.Calibration.from_dict({
        "format": "axiscal-calibration", "version": 1,
        "instrument": {"kind": "accelerometer", "serial": "", "axes": ["x", "y", "z"], "unit": "V"},
        "field": {"kind": "gravity", "unit": "g", "magnitude": 1.0, "in_table": [0, 0, 1]},
        "coefficients": {"bias": [0.01, -0.02, 0.03], "sensitivity": [[2.5, 0, 0], [0, 2.5, 0], [0, 0, 2.5]]}})  # fmt: skip
    table = ax.simulate(truth, noise=1e-4, replicates=3, seed=3)
    heat = np.repeat([15.0, 25.0, 35.0], 12)
    axes = {axis: table[axis] + 1e-3 * (heat - 25.0) + 1e-6 * rng.standard_normal(36) for axis in "xyz"}
    return ax.calibrate({**table, **axes, "temperature": heat}, instrument=ACCELEROMETER, temperature_order=1)


def test_apply_uses_the_temperature_of_a_table(warm: ax.Calibration, tmp_path: pathlib.Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"x": [0.9, 0.9], "y": [0.0, 0.0], "z": [2.3, 2.3], "temperature": [20.0, 60.0]})
    found = warm.apply(frame)
    by_array = warm.apply(frame[["x", "y", "z"]].to_numpy(), temperature=frame.temperature)
    np.testing.assert_array_equal(found[["field_x", "field_y", "field_z"]].to_numpy(), by_array)
    assert found.field_x[0] != found.field_x[1] and found.pitch_deg[0] != found.pitch_deg[1]
    assert list(found.flag) == ["", "extrapolated"]
    angles = warm.angles(frame)
    np.testing.assert_array_equal(angles["pitch_deg"], found.pitch_deg)
    record = tmp_path / "cal.json"
    warm.save(record)
    readings = tmp_path / "log.csv"
    frame.to_csv(readings, index=False)
    text = run_command(["apply", str(record), str(readings)]).text
    rows = [line.split(",") for line in text.splitlines()]
    command = dict(zip(rows[0], zip(*rows[1:])))
    np.testing.assert_allclose(np.array(command["pitch_deg"], float), found.pitch_deg, rtol=1e-12)
    assert list(command["flag"]) == ["", "extrapolated"]


def test_wrong_shapes_of_up(cal: ax.Calibration, run: ax.Run) -> None:
    for up in (np.zeros((1, 3)), np.zeros((12, 2)), run.readings[:5]):
        with pytest.raises(ax.DomainError, match="up: expected an array of 12 x 3"):
            cal.angles(run.readings, up=up)
    with pytest.raises(ax.DomainError, match="temperature: expected 12 values"):
        cal.apply(run.readings, temperature=[20.0, 21.0])


def test_columns_are_never_taken_by_their_position(cal: ax.Calibration) -> None:
    for names in (("az", "ax", "ay"), ("x", "y", "q"), ("x (mV)", "y (mV)", "z (mV)")):
        with pytest.raises(ax.DomainError, match="the column '.' is missing"):
            cal.apply({name: np.zeros(2) for name in names})
    expected = cal.apply(np.array([[0.1, 0.2, 0.3]]))
    columns = {"z": np.array([0.3]), "other": np.array([9.0]), "x": np.array([0.1]), "y": np.array([0.2])}
    np.testing.assert_array_equal(cal.apply(columns), expected)


def test_strides(cal: ax.Calibration, run: ax.Run) -> None:
    x = run.readings
    for view in (x[::-1], x[::-1][::-1], np.asfortranarray(x), x[:, ::-1][:, ::-1], x.astype(">f8")):
        np.testing.assert_array_equal(cal.apply(view), cal.apply(np.ascontiguousarray(view).astype(float)))
    assert run.rest is not None and run.fence is not None
    reverse = ax.calibrate(x[::-1], rest=run.rest[::-1], fence=run.fence[::-1], instrument=ACCELEROMETER)
    np.testing.assert_allclose(reverse.bias, cal.bias, rtol=0, atol=1e-4)


BAD_COLUMNS = [
    ("block", [1.0] * 11 + [np.nan], "block: the value of reading 11"),
    ("block", [2.0**40] * 12, "block: expected whole numbers"),
    ("run", np.arange(12) * 1.7 + 1, "run: expected whole numbers"),
    ("block", ["a"] * 12, "block: expected"),
    ("mount", [None] * 12, "mount: "),
    ("temperature", ["warm"] * 12, "temperature: expected"),
    ("temperature", [np.inf] * 12, "temperature: the value of reading 0"),
    ("time", np.array(["2026-01-01"] * 11 + ["NaT"], dtype="datetime64[s]"), "time: the value of reading 11"),
    ("level", [1.0] * 5, "level: expected 12 values"),
]


@pytest.mark.parametrize("name, values, message", BAD_COLUMNS)
def test_bad_columns_are_named(run: ax.Run, name: str, values: Any, message: str) -> None:
    with pytest.raises(ax.DomainError, match=message):
        ax.calibrate(run.readings, rest=run.rest, fence=run.fence, instrument=ACCELEROMETER, **{name: values})


def test_bad_options_are_named(run: ax.Run) -> None:
    def calibrate(**options: Any) -> Any:
        return ax.calibrate(run.readings, rest=run.rest, fence=run.fence, instrument=ACCELEROMETER, **options)

    with pytest.raises(ax.DomainError, match="output: this option writes files"):
        calibrate(output="zzz")
    with pytest.raises(ax.DomainError, match="latitude: a complex"):
        calibrate(latitude=1j)
    with pytest.raises(ax.DomainError, match="instrument: expected"):
        ax.calibrate(run.readings, instrument=3)  # type: ignore[arg-type]
    assert calibrate(robust=np.True_, latitude=np.float64(48.1)).status == "ok"


def test_an_experiment_has_its_own_columns(example: str) -> None:
    experiment = ax.Experiment(instrument=ACCELEROMETER, field=ax.gravity(), observations=example)
    assert ax.calibrate(experiment).unit == "V"
    with pytest.raises(ax.DomainError, match="rest: a file or an experiment has its own columns"):
        ax.calibrate(experiment, rest=["+X"])


def test_allan_refuses_nonsense() -> None:
    y = np.random.default_rng(1).normal(size=1000)
    for rate in (-1.0, 0.0, float("nan"), "x"):
        with pytest.raises(ax.DomainError, match="rate: expected"):
            ax.allan(y, rate)  # type: ignore[arg-type]
    masked: Any = np.ma.MaskedArray(y, mask=y < 0.0)  # type: ignore[no-untyped-call]
    for samples in ([], [1.0, np.nan, 2.0], [[1.0], [1.0, 2.0]], np.zeros((5, 2)), masked):
        with pytest.raises(ax.DomainError, match="y: "):
            ax.allan(samples, 100.0)
    with pytest.raises(ax.DomainError, match="y: expected n numbers"):
        ax.noise_model(np.zeros((100, 2)), 100.0)


def test_slots() -> None:
    path = SOURCE / "examples" / "experiments" / "h_frame.json"
    found = ax.calibrate_slots(path)
    assert len(found) == 2 and all(one.axes for one in found.values())
    with pytest.raises(ax.SetupError, match="calibrate_slots"):
        ax.calibrate(path)


def test_tables_are_recognised_as_files_are() -> None:
    path = SOURCE / "examples" / "experiments" / "own_temperatures.csv"
    by_path = ax.calibrate(path, instrument=ACCELEROMETER, temperature_order=1)
    for form in (ax.read_run(path), ax.read_run(path).table()):
        again = ax.calibrate(form, instrument=ACCELEROMETER, temperature_order=1)
        np.testing.assert_array_equal(again.bias, by_path.bias)


def test_functions_take_data(cal: ax.Calibration, run: ax.Run, tmp_path: pathlib.Path) -> None:
    assert run.rest is not None and run.fence is not None
    table = ax.simulate(cal, noise=1e-4, seed=9)
    assert not ax.check(cal, table)["drifted"]
    record = tmp_path / "cal.json"
    cal.save(record)
    assert not ax.check(record, np.column_stack([table[one] for one in "xyz"]), rest=table["rest"],
                        fence=table["fence"])["drifted"]  # fmt: skip
    adjusters = [(0.1, 0.0), (-0.1, 0.08), (-0.1, -0.08)]
    of_record = ax.level(cal, adjusters=adjusters, thread_pitch=0.0005)
    for source in (run, run.table()):
        assert ax.level(source, adjusters=adjusters, thread_pitch=0.0005, instrument=ACCELEROMETER).keys() == of_record.keys()
    np.testing.assert_array_equal(cal.apply(run), cal.apply(run.readings))
    assert "probe" in str(ax.export(record, "c-header", name="probe"))
    with pytest.raises(ax.OutputError, match="cannot be written"):
        cal.export("c-header", "/no/such/folder/cal.h")
    assert ax.history([cal, cal])
    experiment = ax.Experiment(instrument=ACCELEROMETER, field=ax.gravity())
    assert len(ax.plan(experiment, seed=1)["sheet"]["rest"]) == 12


def test_equality_and_pickle(cal: ax.Calibration, run: ax.Run, example: str) -> None:
    assert ax.gravity() == ax.gravity() and ax.accelerometer("V") == ACCELEROMETER != ax.accelerometer("g")
    assert pickle.loads(pickle.dumps(run)) == run == ax.read_run(example)
    assert run.table() == run.table() and run.table() != {}
    assert "x.bias" in cal and "x.bais" not in cal and next(iter(cal)) == "x.bias"
    with pytest.raises(ax.DomainError, match="expected the name of a parameter"):
        cal[3]  # type: ignore[index]


def test_a_field_for_each_reading(run: ax.Run, cal: ax.Calibration) -> None:
    """The class gives the field in the instrument's frame at each reading."""
    fields = cal.apply(run.readings)

    class Measured(ax.Field):
        kind = "custom"

        def in_table(self) -> Any:
            return fields

    found = ax.calibrate(run.readings, instrument=ax.generic("V"), field=Measured(unit="g"))
    np.testing.assert_allclose(found.sensitivity, cal.sensitivity, atol=1e-6)


def test_log_forms(tmp_path: pathlib.Path) -> None:
    pandas = pytest.importorskip("pandas")
    rng = np.random.default_rng(1)
    time = np.arange(4000) / 100.0
    moving = ((time % 10.0) > 7.0)[:, None]
    x = rng.normal(scale=1e-3, size=(4000, 3)) + [0.0, 0.0, 1.0] + moving * rng.normal(size=(4000, 3))
    columns = {"time": time, "x": x[:, 0], "y": x[:, 1], "z": x[:, 2]}
    expected = ax.find_rests(columns)
    frame = pandas.DataFrame(columns)
    by_index = frame.set_index("time")
    zoned = frame.assign(time=pandas.to_datetime(frame.time + 1.8e9, unit="s", utc=True))
    table = np.empty(len(time), dtype=[(name, np.float64) for name in columns])
    for name, one in columns.items():
        table[name] = one
    np.save(tmp_path / "log.npy", table)
    series = ax.read_log(tmp_path / "log.npy")[0]
    for form in (frame, by_index, zoned, series):
        assert len(ax.find_rests(form)["x"]) == len(expected["x"]) > 1
    assert set(series.to_dict()) >= {"x", "y", "z"}
    with pytest.raises(ax.DomainError, match="no column 'nope'"):
        series["nope"]
    with pytest.raises(ax.DataError, match="its columns are y, z"):
        ax.find_rests({"x": np.array(["a", "b"]), "y": np.zeros(2), "z": np.zeros(2)})
    words = frame.assign(frame_id="imu", time=frame.time.map(lambda t: f"2026-01-01T00:00:{t:09.6f}"))
    words = words[words.time.str.len() == 26].rename(columns={"x": "x"})
    units = frame.assign(**{"temp (\u00b0C)": 20.0})
    assert len(ax.find_rests(units, columns="x,y,z")["x"]) == len(expected["x"])
    assert len(ax.find_rests(words)["x"]) > 0
    with pytest.raises(ax.DomainError, match="the log is empty"):
        ax.find_rests({})
    assert not os.path.exists("zzz")


def test_units_in_the_header_are_never_lost(cal: ax.Calibration, run: ax.Run) -> None:
    frame = run.to_dataframe()
    millivolts = frame.rename(columns={axis: f"{axis} (mV)" for axis in "xyz"})
    for axis in "xyz":
        millivolts[f"{axis} (mV)"] *= 1e3
    assert not ax.check(cal, millivolts)["drifted"]
    assert ax.check(cal, frame.rename(columns={axis: f"{axis} (mV)" for axis in "xyz"}))["drifted"]
    others = frame.assign(**{"humidity (%)": 50.0, "Temperature (degC)": 20.0})
    np.testing.assert_array_equal(ax.calibrate(others, instrument=ACCELEROMETER).bias, cal.bias)


def test_a_column_temperature_of_any_spelling(warm: ax.Calibration) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame({"x": [0.9], "y": [0.0], "z": [2.3], "temperature": [35.0]})
    expected = warm.apply(frame).field_x[0]
    for name in ("temperature (degC)", "Temperature", " temperature "):
        assert warm.apply(frame.rename(columns={"temperature": name})).field_x[0] == expected
    with pytest.warns(ax.CalibrationWarning, match="reference temperature is used"):
        assert warm.apply(frame.drop(columns="temperature")).field_x[0] != expected
    assert list(warm.apply(frame.assign(x=np.nan)).flag) == ["unreadable"]


def test_dates_without_a_zone_are_utc(run: ax.Run, monkeypatch: pytest.MonkeyPatch) -> None:
    import datetime
    import time

    monkeypatch.setenv("TZ", "America/New_York")
    time.tzset()
    times = [datetime.datetime(2024, 1, 1, 12, 0) + datetime.timedelta(minutes=one) for one in range(12)]
    found = [
        ax.calibrate(run.readings, rest=run.rest, fence=run.fence, instrument=ACCELEROMETER, time=one).measured
        for one in (times, np.array(times, "datetime64[us]"))
    ]
    monkeypatch.delenv("TZ")
    time.tzset()
    assert found[0] == found[1] == np.datetime64("2024-01-01T12:11")


def test_two_axes(run: ax.Run) -> None:
    pytest.importorskip("pandas")
    frame = run.to_dataframe()[["rest", "fence", "x", "y"]]
    two = ax.calibrate(frame, instrument=ACCELEROMETER, axes=["x", "y"])
    found = two.apply(frame)
    assert list(found) == ["component_x", "component_y", "angle_x_deg", "angle_y_deg", "flag"]
    assert set(two.angles(frame)) == {"angle_x_deg", "angle_y_deg"}


def test_wrong_types_are_named(cal: ax.Calibration, run: ax.Run) -> None:
    calls: List[Callable[[], Any]] = [
        lambda: ax.load(None),  # type: ignore[arg-type]
        lambda: ax.history(3),  # type: ignore[arg-type]
        lambda: ax.calibrate_imu([]),
        lambda: ax.study(merge="a.json"),
        lambda: ax.check(cal, ax.Experiment()),
        lambda: ax.Calibration(3),  # type: ignore[arg-type]
        lambda: cal.apply([[1.0, 2.0, 3.0], [1.0, 2.0]]),
        lambda: ax.report(cal, "r.html", run.readings),
        lambda: ax.calibrate(run, instrument=ACCELEROMETER, axes=3),
        lambda: ax.calibrate(run.readings, rest=[["a"], ["b", "c"]], fence=run.fence, instrument=ACCELEROMETER),
    ]
    for call in calls:
        with pytest.raises(ax.Error):
            call()
    with pytest.raises(ax.Error, match="serial"):
        ax.calibrate_units(run, instrument=ACCELEROMETER)
