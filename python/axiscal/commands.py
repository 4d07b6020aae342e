# SPDX-License-Identifier: Apache-2.0
"""Everything else that the command does with data. Options are keywords with underscores."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, Iterable, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _axiscal
from ._options import Output, arguments_of, csv_of, files, option_value, run, run_json
from .arrays import Floats, Table, column, finite_matrix, matrix, table_of_csv, utc
from .calibrating import Run, _setup, log_path
from .calibration import Calibration, PathLike, _from_json
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
        Message, topic or table, and the number of several of one name.
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
        """A column by its name; else as a tuple."""
        if isinstance(key, str):
            return self.time if key == "time" else self.values[:, self.columns.index(key)]
        return tuple.__getitem__(self, key)

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

    Raises
    ------
    DataError
        If the file is missing, empty or of no known format.
    """
    return [Series(**one) for one in _axiscal.read_log(os.fspath(path))]


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
        One row a rest: means, standard deviations, samples, times.
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


def allan(y: Any, rate: float, all_taus: bool = False) -> AllanDeviation:
    """Overlapping Allan deviation of evenly spaced samples.

    Parameters
    ----------
    y : array_like, n
        Samples [unit].
    rate : float
        Samples a second [Hz].
    all_taus : bool
        About ten averaging times a decade instead of octaves.

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
    samples = np.asarray(y)
    if samples.ndim != 1 or samples.dtype.kind not in "fiu":
        raise DomainError(f"y: expected an array of n numbers, not of shape {samples.shape} and type {samples.dtype}")
    return AllanDeviation(**_axiscal.allan(samples, float(rate), all_taus))


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
        and unit; and "coefficients", all of them.

    Examples
    --------
    >>> import numpy as np
    >>> model = noise_model(np.random.default_rng(1).normal(size=10000), 100.0)
    >>> bool(model["N"]["low"] < 0.1 < model["N"]["high"])
    True
    """
    found = noise(matrix(y, "y"), rate=rate, columns="c1", **options)["columns"]["c1"]["coefficients"]
    letters = {"N": "white", "B": "bias_instability", "K": "random_walk"}
    return {**{letter: found[name] for letter, name in letters.items()}, "coefficients": found}


def _readings_text(readings: Any, rest: Any, fence: Any, axes: List[str]) -> str:
    if isinstance(readings, Run):
        return csv_of(readings.table())
    data = finite_matrix(readings)
    columns: Dict[str, Any] = {}
    for name, value in (("rest", rest), ("fence", fence)):
        if value is not None:
            columns[name] = [str(one) for one in column(value, len(data), name)]
    return csv_of({**columns, **{axis: data[:, k] for k, axis in enumerate(axes)}})


def check(calibration: Calibration, other: Any, *, rest: Any = None, fence: Any = None, **options: Any) -> Dict[str, Any]:
    """Tests whether an instrument has drifted since its calibration.

    Parameters
    ----------
    calibration : Calibration
    other : Calibration, Run, array_like n x m, or path
        A later calibration, or fresh readings.
    rest, fence : sequence of str, n, optional
        Poses of the readings; at rest in any pose without them.
    **options
        Options of ``axiscal check``: alpha, limits, ...

    Returns
    -------
    dict
        The JSON of ``axiscal check``: drifted, p_value, ...
    """
    if isinstance(other, (Calibration, str, os.PathLike)):
        return dict(run_json("check", calibration, other, **options))  # type: ignore[arg-type]
    text = _readings_text(other, rest, fence, calibration.axes)
    return dict(run_json("check", calibration, "-", data=text, **options))  # type: ignore[arg-type]


def history(folder: PathLike, **options: Any) -> Any:
    """Trends of the records in a folder, and when a limit will be met."""
    return run_json("check", history=folder, **options)


def characterize(references: Iterable[Tuple[Any, PathLike]], *, id: str, **options: Any) -> Dict[str, Any]:
    """Measures a cube with calibrated instruments.

    Parameters
    ----------
    references : iterable of (Calibration or path, path)
        Record of an instrument, and the file of its readings in the cube.
    id : str
        Name of the cube.

    Returns
    -------
    dict
        The positioner (JSON).
    """
    with files() as at:
        path = at.path()
        arguments = ["characterize", f"--id={id}", "-o", path, *arguments_of(options, at)]
        for record, readings in references:
            arguments += ["--reference", f"{option_value(at.of(record))}={os.fspath(readings)}"]
        run(arguments)
        with open(path, encoding="utf-8") as file:
            cube: Dict[str, Any] = json.load(file)
            return cube


def plan(**options: Any) -> Dict[str, Any]:
    """A run sheet, and a forecast of the uncertainties.

    Parameters
    ----------
    **options
        Options of ``axiscal plan``: design, replicates, seed, noise, sensitivity, ...

    Returns
    -------
    dict
        The forecast (JSON), with "sheet": a Table of the poses in their order.
    """
    with files() as at:
        path = at.path(".csv")
        forecast: Dict[str, Any] = run(["plan", *arguments_of(options, at), "--json", "-o", path]).json()
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
    """
    with files() as at:
        return table_of_csv(run(["simulate", *arguments_of({"truth": truth, **options}, at)]).text)


def study(truth: Calibration, **options: Any) -> Dict[str, Any]:
    """Simulates and calibrates many runs: bias, scatter, stated uncertainty, coverage."""
    return dict(run_json("study", truth=truth, **options))


def budget(calibration: Calibration, **options: Any) -> Dict[str, Any]:
    """The uncertainties of a record by their sources, and of a reading in an attitude."""
    return dict(run_json("budget", calibration, **options))  # type: ignore[arg-type]


def level(source: Any, **options: Any) -> Dict[str, Any]:
    """The turns of the adjusters that level the table.

    Parameters
    ----------
    source : Calibration or path
        A record, or a file of 12 readings.
    **options
        Options of ``axiscal level``: adjusters, thread_pitch, instrument, ...
    """
    setup = _setup(options.pop("instrument", None), options.pop("field", None), options)
    return dict(run_json("level", source, **setup))


def site_field(**options: Any) -> Dict[str, Any]:
    """Gravity, geomagnetic field, Earth's rotation and sun at a site.

    Parameters
    ----------
    **options
        latitude, longitude, height, date, only, ...
    """
    return dict(run_json("field", **options))


def export_formats() -> List[Dict[str, Any]]:
    """The formats of :func:`export`: name, description, formula, text."""
    return list(run_json("export", list=True))


def export(
    calibrations: Union[Calibration, Iterable[Calibration]], format: str, path: Optional[PathLike] = None, **options: Any
) -> Union[str, bytes]:
    """Calibrations for other software.

    Parameters
    ----------
    calibrations : Calibration or several
        One sensor; for kalibr accelerometer and gyroscope; for px4, ardupilot and iio all sensors.
    format : str
        One of :func:`export_formats`.
    path : path, optional
        File to write too.

    Returns
    -------
    str or bytes
    """
    many = [calibrations] if isinstance(calibrations, Calibration) else list(calibrations)
    with files() as at:
        records = [option_value(at.of(one)) for one in many]
        done: Output = run(["export", *records, f"--format={format}", *arguments_of(options, at)])
    if path is not None:
        with open(path, "wb") as file:
            file.write(done.data)
    try:
        return done.text
    except UnicodeDecodeError:
        return done.data


def import_(path: PathLike, format: str, **options: Any) -> Calibration:
    """A calibration of other software: px4, ardupilot, kalibr or imucal."""
    return _from_json(run(["import", os.fspath(path), f"--format={format}", *arguments_of(options)]).text)


def report(calibration: Calibration, path: PathLike, readings: Optional[PathLike] = None, **options: Any) -> None:
    """Writes a report (.html) or a certificate (.pdf); as :meth:`Calibration.report`."""
    calibration.report(path, readings, **options)
