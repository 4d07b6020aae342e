# SPDX-License-Identifier: Apache-2.0
"""From readings to calibrations."""

from __future__ import annotations

import glob
import os
import warnings
from typing import Any, Dict, List, Optional, Sequence, Union

import numpy as np

from . import _axiscal
from ._messages import log
from ._options import arguments_of, csv_of, files, run
from .arrays import (
    Floats,
    Table,
    column,
    finite_matrix,
    is_frame,
    matrix,
    read_table,
    seconds_of,
    table_of,
    unit_of_columns,
    utc,
)
from .calibration import Calibration, PathLike, _from_json, checked
from .errors import CalibrationWarning, DomainError, RefusedError, SetupError
from .setups import Field, Instrument

__all__ = ["Experiment", "Run", "calibrate", "calibrate_imu", "calibrate_units", "fit_magnitude", "read_run"]

# Options that describe the experiment. Calls with these alone need no files.
_OF_EXPERIMENT = frozenset(
    "instrument serial model axes unit convention field also field_unit field_magnitude field_magnitude_u "
    "field_table magnetic_model gravity_model source latitude longitude height date fence_azimuth slope "
    "positioner slot method shape weights leave_out level_by drift seats noise_ratio temperature_order "
    "temperature_reference resolution slope_u direction_u temperature_u reference_u positioner_u "
    "nominal_sensitivity robust squares polar_fit range one_sided".split()
)

# Columns of one number a reading that need no file.
_COLUMNS = ("run", "block", "mount", "level", "temperature", "time", "samples")


class Experiment(Dict[str, Any]):
    """An experiment: what an experiment's JSON holds (docs, Files).

    Examples
    --------
    >>> Experiment(instrument={"kind": "accelerometer", "unit": "V"}, field={"kind": "gravity"})["field"]
    {'kind': 'gravity'}
    """

    def __init__(self, **members: Any) -> None:
        super().__init__({"format": "axiscal-experiment", "version": 1, **members})


class Run:
    """Readings with the poses in which they were taken.

    Attributes
    ----------
    readings : ndarray, n x m
    axes : list of str, m
    columns : dict of ndarray, n
        "rest", "fence" and others that the file has.
    path : str or None
        The file of :func:`read_run`.
    """

    def __init__(
        self, readings: Any, axes: Sequence[str], columns: Dict[str, Any], path: Optional[str] = None
    ) -> None:
        self.readings: Floats = finite_matrix(readings)
        self.axes = list(axes)
        self.columns = dict(columns)
        self.path = path

    @property
    def rest(self) -> Any:
        """The face on the table in each reading; None without labels."""
        return self.columns.get("rest")

    @property
    def fence(self) -> Any:
        """The face at the fence in each reading; None without labels."""
        return self.columns.get("fence")

    def __len__(self) -> int:
        return len(self.readings)

    def table(self) -> Table:
        """All columns by their names."""
        axes = {axis: self.readings[:, k] for k, axis in enumerate(self.axes)}
        return Table({**self.columns, **axes})

    def to_dataframe(self) -> Any:
        """All columns as a pandas DataFrame."""
        return self.table().to_dataframe()


def read_run(path: PathLike, axes: Optional[Sequence[str]] = None) -> Run:
    """Reads a run of readings: CSV with any separator, xlsx, ods, compressed files.

    Parameters
    ----------
    path : path
        File with the columns rest, fence and one for each axis.
    axes : sequence of str, optional
        Columns of the axes; x, y, z, or the other columns of numbers.

    Raises
    ------
    DataError
        If the file is missing or malformed; the message starts with the place.
    """
    name = os.fspath(path)
    table = read_table(name)
    for column_name in ("time", "date"):
        if column_name in table:
            table[column_name] = _as_times(table[column_name])
    readings, names, columns = table_of(table, axes)
    return Run(readings, names, columns, name)


def _as_times(values: Any) -> Any:
    """Dates and times as datetime64, if all of them are ISO 8601; else unchanged."""
    if values.dtype.kind != "U":
        return values if (times := utc(values)) is None else times
    try:
        return np.array([one[:-1] if one.endswith("Z") else one for one in values], dtype="datetime64[us]")
    except ValueError:
        return values


def _tell(calibration: Calibration, force: bool) -> Calibration:
    checked(calibration, force)
    for code, message, runs in calibration.warnings:
        warnings.warn(CalibrationWarning(message, code, runs), stacklevel=3)
    for code, message in calibration.notes:
        log.info("%s: %s", code, message)
    return calibration


def _setup(instrument: Any, field: Any, options: Dict[str, Any]) -> Dict[str, Any]:
    stated: Dict[str, Any] = {}
    for name, value in (("instrument", instrument), ("field", field)):
        if isinstance(value, (Instrument, Field)):
            stated.update(value.options())
        elif value is not None:
            stated[name] = value
    clash = sorted(set(stated) & {name for name, value in options.items() if value is not None})
    if clash:
        raise SetupError(f"{clash[0]}: stated twice, as a keyword and by the instrument or field")
    return {**stated, **options}


def _native(readings: Floats, columns: Dict[str, Any], options: Dict[str, Any]) -> Calibration:
    of_run = _axiscal.RunColumns()
    for name, values in columns.items():
        if name in ("rest", "fence"):
            setattr(of_run, name, values.tolist() if values.dtype.kind == "U" else [str(one) for one in values])
        elif name in ("run", "block", "mount"):
            setattr(of_run, name, values.astype(np.int32))
        else:
            numbers = seconds_of(values) if values.dtype.kind == "M" else values.astype(np.float64)
            setattr(of_run, name, numbers)
    return Calibration(_axiscal.calibrate(_axiscal.experiment(arguments_of(options)), readings, of_run))


def _by_command(arguments: List[str], force: bool, data: str = "") -> Calibration:
    with files() as at:
        path = at.path()
        more = ["--force"] if force else []
        done = run(["calibrate", *arguments, *more, "-o", path], data, warns=False)
        if not os.path.exists(path):
            raise RefusedError(done.messages.strip() or "the calibration was refused")
        with open(path, encoding="utf-8") as file:
            return _from_json(file.read())


def calibrate(
    readings: Any,
    *,
    rest: Any = None,
    fence: Any = None,
    instrument: Union[Instrument, str, None] = None,
    field: Union[Field, str, None] = None,
    force: bool = False,
    **options: Any,
) -> Calibration:
    """Calibrates an instrument.

    Parameters
    ----------
    readings : array_like n x m, DataFrame, Run, Experiment or path
        Readings of m axes [unit of the instrument], one row a reading. A DataFrame has columns as
        a file of readings has: rest, fence, and one for each axis.
    rest, fence : sequence of str, n
        The face on the table and the face at the fence in each reading: "+X", "-X", ... "-Z".
    instrument : Instrument or str
        For example ``axiscal.accelerometer("V")``.
    field : Field or str, optional
        For example ``axiscal.gravity()``. The default is the instrument's usual field.
    force : bool
        Return a refused calibration too.
    **options
        run, block, mount, level, temperature, time, samples: one value a reading; and every option
        of ``axiscal calibrate`` with underscores: method, latitude, resolution, robust, limits, ...

    Returns
    -------
    Calibration

    Raises
    ------
    RefusedError
        If the calibration is refused; RankDeficientError if the readings leave parameters open.
    DomainError
        If an array has the wrong shape or holds something else than finite numbers.

    Warns
    -----
    CalibrationWarning
        For each finding that asks for attention. Notes go to the logger "axiscal".

    Examples
    --------
    >>> import axiscal, numpy as np
    >>> rest = ["-Z", "+Z", "-Y", "+Y", "-X", "+X"] * 2
    >>> fence = ["+X", "+X", "+X", "+X", "+Y", "+Y", "-X", "-X", "-X", "-X", "-Y", "-Y"]
    >>> up = {"X": 0, "Y": 1, "Z": 2}
    >>> x = np.zeros((12, 3))
    >>> for i, face in enumerate(rest):
    ...     x[i, up[face[1]]] = 1.0 if face[0] == "-" else -1.0
    >>> x += 1e-5 * np.sin(np.arange(36).reshape(12, 3) ** 2)
    >>> cal = axiscal.calibrate(x, rest=rest, fence=fence, instrument=axiscal.accelerometer("g"))
    >>> np.round(cal.sensitivity, 3)[0]
    array([ 1., -0., -0.])
    """
    options = _setup(instrument, field, options)
    given = {name: options.pop(name) for name in _COLUMNS if options.get(name) is not None}
    given.update({name: value for name, value in (("rest", rest), ("fence", fence)) if value is not None})

    if isinstance(readings, Experiment):
        import json

        with files() as at:
            path = at.path()
            with open(path, "w", encoding="utf-8") as file:
                json.dump(_with_absolute_paths(readings), file)
            return _tell(_by_command([path, *arguments_of(options, at)], force), force)
    if isinstance(readings, (str, os.PathLike)):
        if given:
            raise DomainError(f"{sorted(given)[0]}: a file has its own columns; give the readings as an array")
        with files() as at:
            return _tell(_by_command([os.fspath(readings), *arguments_of(options, at)], force), force)

    columns: Dict[str, Any] = {}
    if isinstance(readings, Run):
        data, columns = readings.readings, dict(readings.columns)
        options.setdefault("axes", readings.axes)
    elif is_frame(readings) or isinstance(readings, dict):
        axes = options.get("axes")
        data, names, columns = table_of(readings, axes.split(",") if isinstance(axes, str) else axes)
        options["axes"], unit = unit_of_columns(names)
        if unit is not None and options.setdefault("unit", unit) not in (unit, "1"):
            raise DomainError(f"readings: the columns are in {unit}, the instrument in {options['unit']}; convert them")
        if unit is not None:
            options["unit"] = unit
    else:
        data = finite_matrix(readings)
        if data.shape[1] != 3 and options.get("axes") is None:
            raise DomainError(f"readings: expected an array of n x 3, not of n x {data.shape[1]}; "
                              "name the axes of another instrument by axes=")  # fmt: skip
    columns = {name: column(value, len(data), name) for name, value in {**columns, **given}.items()}
    is_labelled = "rest" in columns and "fence" in columns
    has_texts = "time" in columns and columns["time"].dtype.kind in "OUS"
    if is_labelled and not has_texts and set(columns) <= {*_COLUMNS, "rest", "fence"} and set(options) <= _OF_EXPERIMENT:
        return _tell(_native(data, columns, options), force)
    axes = options.get("axes") or ["x", "y", "z"]
    axes = axes.split(",") if isinstance(axes, str) else axes
    text = csv_of({**{name: _cells(value) for name, value in columns.items()},
                   **{axis: data[:, k] for k, axis in enumerate(axes)}})  # fmt: skip
    with files() as at:
        return _tell(_by_command(["-", *arguments_of(options, at)], force, text), force)


def _with_absolute_paths(experiment: Experiment) -> Dict[str, Any]:
    """The files that an experiment names, so that it may lie in another folder."""
    result: Dict[str, Any] = dict(experiment)
    for name in ("observations", "positioner", "limits"):
        value = result.get(name)
        if isinstance(value, (str, os.PathLike)):
            result[name] = os.path.abspath(value)
        elif isinstance(value, list):
            result[name] = [os.path.abspath(one) if isinstance(one, (str, os.PathLike)) else one for one in value]
    return result


def _cells(value: Any) -> List[Any]:
    array = np.asarray(value)
    return [str(one) for one in array] if array.dtype.kind in "MOUS" else list(array)


def fit_magnitude(readings: Any, **options: Any) -> Calibration:
    """Calibrates by the magnitude of the field alone: the instrument was turned by hand.

    Parameters
    ----------
    readings : array_like n x m, DataFrame or path
        Readings in many directions [unit].
    **options
        As :func:`calibrate`, without ``method``.
    """
    return calibrate(readings, method="magnitude", **options)


def _records(arguments: List[str], name: str, force: bool) -> Dict[str, Calibration]:
    with files() as at:
        output = os.path.join(at.folder, name)
        arguments = [*arguments, "--force"] if force else arguments
        messages = run(["calibrate", *arguments, "-o", output], warns=False).messages
        found = {}
        for path in sorted(glob.glob(os.path.join(at.folder, "record-*.json"))):
            with open(path, encoding="utf-8") as file:
                key = os.path.basename(path)[len("record-"): -len(".json")]
                found[key] = _tell(_from_json(file.read(), path), force)
        if not found:
            raise RefusedError(messages.strip() or "the calibration was refused")
        return found


def calibrate_imu(
    log_file: Any, *, force: bool = False, **options: Any
) -> Dict[str, Calibration]:
    """Calibrates the sensors of an IMU from a raw log of rests and turns.

    Parameters
    ----------
    log_file : path, DataFrame or dict of arrays
        A log of any format; or columns time, ax, ay, az, gx, gy, gz, ...
    **options
        Options of ``axiscal calibrate --imu``: cube, only, rate, latitude, ...

    Returns
    -------
    dict of Calibration
        By the sensor: "accelerometer", "gyroscope", "magnetometer".
    """
    with files() as at:
        path = log_path(log_file, at)
        return _records(["--imu", path, *arguments_of(options, at)], "record-{slot}.json", force)


def calibrate_units(path: PathLike, *, force: bool = False, **options: Any) -> List[Calibration]:
    """Calibrates each unit of a file with the column ``serial``.

    Parameters
    ----------
    path : path
        Readings of many units, one after another.
    **options
        As :func:`calibrate`.

    Returns
    -------
    list of Calibration
        One a unit, in the order of their serial numbers.
    """
    setup = _setup(options.pop("instrument", None), options.pop("field", None), options)
    with files() as at:
        arguments = [os.fspath(path), *arguments_of(setup, at)]
        return list(_records(arguments, "record-{serial}.json", force).values())


def log_path(value: Any, at: Any) -> str:
    """The path of a log; columns are written to a file that the readers take without text."""
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    if is_frame(value) or isinstance(value, dict):
        names = [str(one) for one in (value.columns if is_frame(value) else value)]
        arrays = [np.asarray(value[name]) for name in names]
    else:
        data = matrix(value, "samples")
        names = ["x", "y", "z"] if data.shape[1] == 3 else [f"c{k + 1}" for k in range(data.shape[1])]
        arrays = [data[:, k] for k in range(data.shape[1])]
    table = np.empty(len(arrays[0]), dtype=[(name, np.float64) for name in names])
    for name, one in zip(names, arrays):
        if one.dtype.kind == "M":
            one = (one - one[0]) / np.timedelta64(1, "s")
        table[name] = column(one, len(table), name)
    path: str = at.path(".npy")
    np.save(path, table)
    return path
