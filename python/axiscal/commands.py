# SPDX-License-Identifier: Apache-2.0
"""The other subcommands as functions. Options are keywords with underscores."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _axiscal
from ._options import Files, Output, arguments_of, files, option_value, positional, run, run_json, write
from .arrays import Array, Floats, Table, same, table_of_csv, utc, vector
from .calibrating import Experiment, _given, _input, _setup, log_path
from .calibration import Calibration, PathLike, _from_json, load
from .errors import DomainError

__all__ = [
    "Series", "allan", "budget", "characterize", "check", "export", "export_formats", "find_rests", "history",
    "import_", "level", "noise", "noise_model", "plan", "read_log", "report", "simulate", "site_field", "study",
]  # fmt: skip


class Series(NamedTuple):
    """Numbers with common sample times: one sensor of a log.

    Attributes
    ----------
    name, instance : str, int
        Name of the message, topic or table; instance counts series with the same name.
    kind : str
        accelerometer, gyroscope, magnetometer, temperature or other.
    unit : str
        Unit of the values; empty if it is unknown.
    columns : list of str, m
    time : ndarray, n
        [s] by the file's clock; NaN without times.
    values : ndarray, n x m
    format : str
        Format of the file.
    """

    name: str
    instance: int
    kind: str
    unit: str
    columns: List[str]
    time: Floats
    values: Floats
    format: str

    def __getitem__(self, key: Any) -> Any:
        """A column by its name, or an element of the tuple by its index."""
        if not isinstance(key, str):
            return tuple.__getitem__(self, key)
        columns = self.log_columns()
        if key not in columns:
            raise DomainError(f"the series has no column {key!r}; its columns are {', '.join(columns)}")
        return columns[key]

    def log_columns(self) -> Dict[str, Array]:
        """A dict of arrays: the times, if they are known, and the columns."""
        columns: Dict[str, Array] = {} if np.isnan(self.time).all() else {"time": self.time}
        columns.update({name: self.values[:, k] for k, name in enumerate(self.columns)})
        return columns

    def to_dict(self) -> Dict[str, Array]:
        """A dict of arrays: the times, if they are known, and the columns."""
        return self.log_columns()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Series) and all(same(one, two) for one, two in zip(self, other))

    def __ne__(self, other: object) -> bool:
        return not self == other

    @property
    def datetimes(self) -> Any:
        """The times as datetime64[us], UTC; None if the file's clock does not count from 1970."""
        return utc(self.time)

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with the times as its index: dates in UTC if they are known."""
        import pandas

        times = self.time if self.datetimes is None else self.datetimes
        return pandas.DataFrame(self.values, index=pandas.Index(times, name="time"), columns=self.columns)


def read_log(path: PathLike) -> List[Series]:
    """Reads all series of a log of any format: tables, flight logs, bags, phones.

    Parameters
    ----------
    path : path
        The log.

    Returns
    -------
    list of Series

    Raises
    ------
    DataError
        If the file is missing or empty, or its format is unknown.
    """
    return [Series(**one) for one in _axiscal.read_log(positional(path))]


def find_rests(log_file: Any, **options: Any) -> Table:
    """Finds the rests of a log.

    Parameters
    ----------
    log_file : path, DataFrame, dict or array
        A log of any format, or its samples.
    **options
        Options of ``axiscal segment``: columns, rate, window, ...

    Returns
    -------
    Table
        One row per rest: means, standard deviations, samples, times.
    """
    with files() as at:
        return table_of_csv(run(["segment", log_path(log_file, at), *arguments_of(options, at)]).text)


class AllanDeviation(NamedTuple):
    """An Allan deviation curve: arrays of one length."""

    tau: Floats
    deviation: Floats
    low: Floats
    high: Floats
    terms: Floats

    def __eq__(self, other: object) -> bool:
        return isinstance(other, AllanDeviation) and all(same(one, two) for one, two in zip(self, other))

    def __ne__(self, other: object) -> bool:
        return not self == other


def allan(y: Any, rate: float, all_taus: bool = False) -> AllanDeviation:
    """Overlapping Allan deviation of evenly spaced samples.

    Parameters
    ----------
    y : array_like, n
        Samples [unit].
    rate : float
        Samples a second [Hz].
    all_taus : bool
        Use about ten averaging times per decade instead of octaves.

    Returns
    -------
    AllanDeviation
        tau [s], deviation [unit], and the 68.3 % interval low, high.

    Examples
    --------
    >>> import numpy as np
    >>> curve = allan(np.random.default_rng(1).normal(size=10000), 100.0)
    >>> bool(abs(curve.deviation[0] - 1.0) < 0.05)
    True
    """
    samples = vector(y, "y")
    if len(samples) < 3 or not np.isfinite(samples).all():
        raise DomainError(f"y: expected at least three finite numbers; got {len(samples)} values, "
                          f"{int(np.isfinite(samples).sum())} of them finite")  # fmt: skip
    return AllanDeviation(**_axiscal.allan(samples, _rate(rate), all_taus))


def _rate(rate: Any) -> float:
    try:
        number = float(rate)
    except (TypeError, ValueError) as error:
        raise DomainError(f"rate: expected a number [Hz], not {rate!r}") from error
    if not (np.isfinite(number) and number > 0.0):
        raise DomainError(f"rate: expected a positive number [Hz], not {rate!r}")
    return number


def noise(log_file: Any, **options: Any) -> Dict[str, Any]:
    """Allan deviation and noise coefficients N, B, K of a log at rest, with their intervals.

    Parameters
    ----------
    log_file : path, DataFrame, dict or array n x m
        A log at rest. An array needs ``rate``.
    **options
        Options of ``axiscal noise``: columns, rate, tau, from_, to, unit, ...
    """
    with files() as at:
        result: Dict[str, Any] = run(["noise", log_path(log_file, at), *arguments_of(options, at), "--json"]).json()
        return result


def noise_model(y: Any, rate: float, **options: Any) -> Dict[str, Any]:
    """The noise coefficients of one sensor: N, B, K with their 95 % intervals.

    Parameters
    ----------
    y : array_like, n
        Samples at rest [unit].
    rate : float
        Samples a second [Hz].

    Returns
    -------
    dict
        "N" (white noise), "B" (bias instability), "K" (random walk), each with value, low, high
        and unit. "coefficients" contains all coefficients.

    Examples
    --------
    >>> import numpy as np
    >>> model = noise_model(np.random.default_rng(1).normal(size=10000), 100.0)
    >>> bool(model["N"]["low"] < 0.1 < model["N"]["high"])
    True
    """
    if "columns" in options:
        raise DomainError("columns: noise_model() has one sensor; use noise() for a table")
    samples = vector(y, "y").reshape(-1, 1)
    found = noise(samples, rate=_rate(rate), columns="c1", **options)["columns"]["c1"]["coefficients"]
    letters = {"N": "white", "B": "bias_instability", "K": "random_walk"}
    return {**{letter: found[name] for letter, name in letters.items()}, "coefficients": found}


def check(
    calibration: Union[Calibration, PathLike], other: Any, *, rest: Any = None, fence: Any = None, **options: Any
) -> Dict[str, Any]:
    """Tests whether an instrument has drifted since its calibration.

    Parameters
    ----------
    calibration : Calibration or path
    other : Calibration, Run, DataFrame, dict of arrays, array_like n x m, or path
        A later calibration, or new readings.
    rest, fence : sequence of str, n, optional
        Poses of the readings. Without them, the readings are at rest in any pose.
    **options
        Options of ``axiscal check``: alpha, limits, ...

    Returns
    -------
    dict
        The JSON of ``axiscal check``: drifted, p_value, ...
    """
    if isinstance(other, (Calibration, str, os.PathLike)):
        return dict(run_json("check", _document(calibration), _document(other), **options))
    cal = calibration if isinstance(calibration, Calibration) else load(calibration)
    with files() as at:
        path = _new_readings(other, rest, fence, cal.axes, options, at)
        return dict(run(["check", str(at.of(cal)), path, *arguments_of(options, at), "--json"]).json())


def _document(value: Any) -> Any:
    return positional(value) if isinstance(value, (str, bytes, os.PathLike)) else value


def _new_readings(
    readings: Any, rest: Any, fence: Any, axes: Optional[List[str]], options: Dict[str, Any], at: Files
) -> str:
    """The path of a file with readings of any form, for a subcommand."""
    if isinstance(readings, Experiment):
        raise DomainError("readings: expected a table or an array, not an Experiment")
    is_array = not hasattr(readings, "table") and not hasattr(readings, "columns") and not isinstance(readings, dict)
    setup = {"axes": axes} if is_array and axes is not None else {}
    return _input(readings, _given(rest, fence, options), setup).file(at)


def history(records: Union[PathLike, Iterable[Union[Calibration, PathLike]]], **options: Any) -> Any:
    """Trends of the records of an instrument, and when a limit will be met.

    Parameters
    ----------
    records : path or iterable of Calibration or path
        A folder of records, a store, or the records.
    **options
        Options of ``axiscal check --history``: limits, ...

    Returns
    -------
    dict
        The JSON of ``axiscal check --history``.
    """
    if isinstance(records, (str, os.PathLike)):
        return run_json("check", history=positional(records), **options)
    with files() as at:
        folder = os.path.join(at.folder, "records")
        os.mkdir(folder)
        try:
            many = list(records)
        except TypeError as error:
            raise DomainError(f"records: expected a folder, a store or several calibrations, not {records!r}") from error
        for number, one in enumerate(many):
            record = one if isinstance(one, Calibration) else load(one)
            record.save(os.path.join(folder, f"{number:06d}.json"), force=True)
        done = run(["check", f"--history={folder}", *arguments_of(options, at), "--json"])
        return done._replace(data=done.data.replace((folder + os.sep).encode(), b"")).json()


def characterize(references: Iterable[Tuple[Any, Any]], *, id: str, **options: Any) -> Dict[str, Any]:
    """Measures a cube with calibrated instruments.

    Parameters
    ----------
    references : iterable of (Calibration or path, path, Run or DataFrame)
        Record of an instrument, and its readings in the cube.
    id : str
        Name of the cube.
    **options
        Options of ``axiscal characterize``.

    Returns
    -------
    dict
        The positioner (JSON).
    """
    with files() as at:
        path = at.path()
        arguments = ["characterize", f"--id={id}", "-o", path, *arguments_of(options, at)]
        for pair in references:
            if not isinstance(pair, (tuple, list)) or len(pair) != 2:
                raise DomainError(f"references: expected pairs of a record and readings, not {pair!r}")
            record, readings = pair
            arguments += ["--reference", f"{option_value(at.of(record))}={option_value(at.of(readings))}"]
        run(arguments)
        with open(path, encoding="utf-8") as file:
            cube: Dict[str, Any] = json.load(file)
            return cube


def _experiment(experiment: Any) -> List[Any]:
    if experiment is None:
        return []
    if not isinstance(experiment, (Experiment, str, os.PathLike)):
        raise DomainError(f"experiment: expected an Experiment or a path, not {experiment!r}")
    return [_document(experiment)]


def plan(experiment: Any = None, **options: Any) -> Dict[str, Any]:
    """A run sheet, and a forecast of the uncertainties.

    Parameters
    ----------
    experiment : Experiment or path, optional
        Instrument, field, cube and method.
    **options
        Options of ``axiscal plan``: design, replicates, seed, noise, sensitivity, ...

    Returns
    -------
    dict
        The forecast (JSON), with "sheet": a Table of the poses in their order.
    """
    with files() as at:
        path = at.path(".csv")
        names = [str(at.of(one)) for one in _experiment(experiment)]
        arguments = ["plan", *names, *arguments_of(options, at), "--json", "-o", path]
        forecast: Dict[str, Any] = run(arguments).json()
        with open(path, encoding="utf-8") as file:
            forecast["sheet"] = table_of_csv(file.read())
        return forecast


def simulate(truth: Calibration, **options: Any) -> Table:
    """Readings of a known instrument.

    Parameters
    ----------
    truth : Calibration
        The true instrument and field.
    **options
        Options of ``axiscal simulate``: noise, slope, replicates, seed, world, ...

    Returns
    -------
    Table
        The readings, with the columns of a file of readings.
    """
    with files() as at:
        return table_of_csv(run(["simulate", *arguments_of({"truth": truth, **options}, at)]).text)


def study(
    truth: Any = None, experiment: Any = None, *, merge: Optional[Iterable[PathLike]] = None, **options: Any
) -> Dict[str, Any]:
    """Simulates and calibrates many runs.

    Parameters
    ----------
    truth : Calibration or path
        The true instrument and field.
    experiment : Experiment or path, optional
        How each run is calibrated.
    merge : iterable of path, optional
        Results of parts of a study, which are merged instead.
    **options
        Options of ``axiscal study``: trials, noise, world, ...

    Returns
    -------
    dict
        Bias, scatter, stated uncertainty and coverage of each parameter (JSON).
    """
    if merge is not None:
        if isinstance(merge, (str, os.PathLike)) or not (merge := list(merge)):
            raise DomainError("merge: expected a list of paths")
        return dict(run(["study", "--merge", *[positional(one) for one in merge], "--json"]).json())
    return dict(run_json("study", *_experiment(experiment), truth=truth, **options))


def budget(calibration: Union[Calibration, PathLike], **options: Any) -> Dict[str, Any]:
    """The uncertainties of a record by their sources, and of a reading in an attitude.

    Parameters
    ----------
    calibration : Calibration or path
    **options
        Options of ``axiscal budget``: pitch, roll, resolution, ...

    Returns
    -------
    dict
        The JSON of ``axiscal budget``.
    """
    return dict(run_json("budget", _document(calibration), **options))


def level(source: Any, *, rest: Any = None, fence: Any = None, **options: Any) -> Dict[str, Any]:
    """The turns of the adjusters that level the table.

    Parameters
    ----------
    source : Calibration, path, Run, DataFrame, dict of arrays or array_like n x 3
        A record, or 12 readings.
    rest, fence : sequence of str, n, optional
        Poses of the readings of an array.
    **options
        Options of ``axiscal level``: thread_pitch, instrument, ...; adjusters: positions [(x, y), ...] [m].

    Returns
    -------
    dict
        The JSON of ``axiscal level``.
    """
    setup = _setup(options.pop("instrument", None), options.pop("field", None), options)
    if isinstance(source, (Calibration, str, os.PathLike)):
        return dict(run_json("level", _document(source), **setup))
    with files() as at:
        path = _new_readings(source, rest, fence, None, setup, at)
        return dict(run(["level", path, *arguments_of(setup, at), "--json"]).json())


def site_field(**options: Any) -> Dict[str, Any]:
    """Gravity, geomagnetic field, Earth's rotation and sun at a site.

    Parameters
    ----------
    **options
        latitude, longitude, height, date, only, ...

    Returns
    -------
    dict
        The JSON of ``axiscal field``.
    """
    return dict(run_json("field", **options))


def export_formats() -> List[Dict[str, Any]]:
    """The formats of :func:`export`: name, description, formula, text."""
    return list(run_json("export", list=True))


def export(
    calibrations: Any, format: str, path: Optional[PathLike] = None, **options: Any
) -> Union[str, bytes]:
    """Calibrations for other software.

    Parameters
    ----------
    calibrations : Calibration, path, several of them, or the dict of :func:`calibrate_imu`
        One sensor. kalibr needs accelerometer and gyroscope; px4, ardupilot and iio take all sensors of a vehicle.
    format : str
        One of :func:`export_formats`.
    path : path, optional
        File to which the export is also written.

    Returns
    -------
    str or bytes
    """
    if isinstance(calibrations, dict):  # of calibrate_imu()
        calibrations = list(calibrations.values())
    single = isinstance(calibrations, (Calibration, str, os.PathLike))
    many = [_document(one) for one in ([calibrations] if single else list(calibrations))]
    with files() as at:
        records = [option_value(at.of(one)) for one in many]
        done: Output = run(["export", *records, f"--format={format}", *arguments_of(options, at)])
    if path is not None:
        write(path, done.data)
    try:
        return done.text
    except UnicodeDecodeError:
        return done.data


def import_(path: PathLike, format: str, **options: Any) -> Calibration:
    """A calibration of other software.

    Parameters
    ----------
    path : path
        The file of the other software.
    format : str
        px4, ardupilot, kalibr or imucal.
    **options
        Options of ``axiscal import``: kind, unit, ...

    Returns
    -------
    Calibration
        Coefficients without uncertainties.
    """
    return _from_json(run(["import", positional(path), f"--format={format}", *arguments_of(options)]).text)


def report(
    calibration: Union[Calibration, PathLike], path: PathLike, readings: Any = None, **options: Any
) -> None:
    """Writes a report (.html) or a certificate (.pdf); as :meth:`Calibration.report`.

    Parameters
    ----------
    calibration : Calibration or path
    path : path
        File to write.
    readings : path, Run or DataFrame, optional
        The readings, to show their values and times.
    **options
        Options of ``axiscal report``: laboratory, history, noise, ...
    """
    (calibration if isinstance(calibration, Calibration) else load(calibration)).report(path, readings, **options)
