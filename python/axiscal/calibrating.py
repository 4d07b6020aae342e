# SPDX-License-Identifier: Apache-2.0
"""Calibrates instruments from readings."""

from __future__ import annotations

import datetime
import functools
import glob
import json
import os
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from . import _axiscal
from ._messages import log, warn
from ._options import Files, arguments_of, files, plain, positional, run
from .arrays import (
    Array,
    Floats,
    Table,
    array_of,
    axes_of,
    bare_name,
    column,
    columns_of,
    csv_of,
    finite_column,
    finite_matrix,
    is_frame,
    matrix,
    read_table,
    stacked,
    times_of,
    unit_of,
    utc,
    vector,
    whole_column,
)
from .calibration import Calibration, PathLike, _from_json, checked
from .errors import DomainError, RefusedError, SetupError
from .setups import Field, Instrument

__all__ = [
    "Experiment", "Run", "calibrate", "calibrate_imu", "calibrate_slots", "calibrate_units", "fit_magnitude", "read_run",
]  # fmt: skip

# Options that describe the experiment. A call with only these options writes no temporary files.
_OF_EXPERIMENT = frozenset(
    "instrument serial model axes unit convention field also field_unit field_magnitude field_magnitude_u "
    "field_table magnetic_model gravity_model source latitude longitude height date fence_azimuth slope "
    "positioner slot method shape weights leave_out level_by drift seats noise_ratio temperature_order "
    "temperature_reference resolution slope_u direction_u temperature_u reference_u positioner_u "
    "nominal_sensitivity robust squares polar_fit range one_sided".split()
)

# Those of them whose value may be the name of a file.
_WITH_FILES = frozenset("field_table magnetic_model gravity_model source positioner".split())

# Columns with one number per reading. They are passed without temporary files.
_COLUMNS = ("run", "block", "mount", "level", "temperature", "time", "samples")

_LABELS = frozenset(("rest", "fence"))
_NATIVE_COLUMNS = frozenset((*_COLUMNS, *_LABELS))

# Further columns of a table that are keywords of calibrate() too.
_KEYWORDS = (*_COLUMNS, "confirm", "fx", "fy", "fz")


class Experiment(Dict[str, Any]):
    """An experiment: the members of an experiment's JSON file (docs, Files).

    Instruments, fields, arrays and paths are accepted as members.

    Examples
    --------
    >>> Experiment(instrument={"kind": "accelerometer", "unit": "V"}, field={"kind": "gravity"})["field"]
    {'kind': 'gravity'}
    """

    def __init__(self, **members: Any) -> None:
        super().__init__({"format": "axiscal-experiment", "version": 1, **members})

    def document(self) -> Dict[str, Any]:
        """The experiment for a file in any folder: the paths that it names are absolute."""
        result: Dict[str, Any] = dict(self)
        for name in ("observations", "positioner", "limits"):
            value = result.get(name)
            if isinstance(value, (str, os.PathLike)):
                result[name] = os.path.abspath(value)
            elif isinstance(value, list):
                result[name] = [os.path.abspath(one) if isinstance(one, (str, os.PathLike)) else one for one in value]
        return result


class Run:
    """Readings with the poses in which they were taken.

    Attributes
    ----------
    readings : ndarray, n x m
    axes : list of str, m
    columns : dict of ndarray, n
        All other columns: "rest", "fence", "temperature", ...
    path : str or None
        The file of :func:`read_run`.
    """

    def __init__(
        self, readings: Any, axes: Sequence[str], columns: Dict[str, Any], path: Optional[str] = None
    ) -> None:
        self.readings: Floats = matrix(readings)
        self.axes = list(axes)
        self.columns = {name: column(one, len(self.readings), name) for name, one in columns.items()}
        self.path = path
        self._stated_axes: Optional[List[str]] = None
        if len(self.axes) != self.readings.shape[1]:
            raise DomainError(f"axes: {len(self.axes)} names for {self.readings.shape[1]} columns of readings")

    @property
    def rest(self) -> Optional[Array]:
        """The face on the table in each reading; None without labels."""
        return self.columns.get("rest")

    @property
    def fence(self) -> Optional[Array]:
        """The face at the fence in each reading; None without labels."""
        return self.columns.get("fence")

    def __len__(self) -> int:
        return len(self.readings)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Run) and self.axes == other.axes and self.table() == other.table()

    __hash__ = None  # type: ignore[assignment]

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
        Columns of the axes; by default x, y, z, or the other columns of numbers.

    Returns
    -------
    Run

    Raises
    ------
    DataError
        If the file is missing or malformed; the message starts with the place.
    """
    name = os.fspath(path)
    axes = None if axes is None else _names(axes)
    table = read_table(positional(name))
    for column_name in ("time", "date"):
        if column_name in table:
            table[column_name] = _as_times(table[column_name])
    names = axes_of(table, axes)
    result = Run(stacked(table, names) if names else np.empty((len(next(iter(table.values()), [])), 0)), names,
                 {one: values for one, values in table.items() if one not in names}, name)  # fmt: skip
    result._stated_axes = None if axes is None else names
    return result


def _as_times(values: Any) -> Any:
    """Dates and times as datetime64, if all of them are ISO 8601; else unchanged."""
    if values.dtype.kind != "U":
        return values if (times := utc(values)) is None else times
    try:
        dates = [datetime.datetime.fromisoformat(one[:-1] + "+00:00" if one.endswith("Z") else one) for one in values]
    except ValueError:
        return values
    return times_of(np.array([*dates, None], dtype=object)[:-1])


def _tell(calibration: Calibration, force: bool) -> Calibration:
    checked(calibration, force)
    for code, message, runs in calibration.warnings:
        warn(message, code, runs)
    for code, message in calibration.notes:
        log.info("%s: %s", code, message)
    return calibration


def _setup(instrument: Any, field: Any, options: Dict[str, Any]) -> Dict[str, Any]:
    stated: Dict[str, Any] = {}
    for name, value in (("instrument", instrument), ("field", field)):
        if isinstance(value, (Instrument, Field)):
            stated.update(value.options())
        elif isinstance(value, (str, os.PathLike)):
            stated[name] = value
        elif value is not None:
            raise DomainError(f"{name}: expected {name.capitalize()} or str, not {value!r}")
    for name, value in options.items():
        if value is not None and name in stated:
            raise SetupError(f"{name}: given twice, as a keyword and by the instrument or field")
    return {**stated, **options}


class _Input(NamedTuple):
    """The readings of a call: as a file or a text for the command, or as arrays."""

    path: str  # of a file, or the name of a file with `text`
    options: Dict[str, Any]
    text: str = ""
    readings: Optional[Floats] = None  # arrays, if the call needs no text
    columns: Dict[str, Any] = {}
    header: Dict[str, str] = {}  # the columns of the axes, if their names have units

    def file(self, at: Files) -> str:
        """The path of a file with the readings. The command looks ahead in a file, but not in a pipe."""
        text = self.text
        if self.readings is not None:
            axes = self.options.get("axes") or ["x", "y", "z"]
            names = [self.header.get(axis, axis) for axis in axes]
            text = csv_of({**self.columns, **{name: self.readings[:, k] for k, name in enumerate(names)}})
        return at.text(text, name=self.path) if text else self.path

    def arguments(self, at: Files) -> List[str]:
        return [self.file(at), *arguments_of(self.options, at)]


def _names(axes: Any) -> List[str]:
    if isinstance(axes, str):
        return [one.strip() for one in axes.split(",")]
    try:
        return [str(one) for one in axes]
    except TypeError as error:
        raise DomainError(f"axes: expected the names of the columns, not {axes!r}") from error


def _labels(values: Any) -> Any:
    return [str(one) for one in values.tolist()]


def _input(readings: Any, given: Dict[str, Any], options: Dict[str, Any]) -> _Input:
    """What the command or the extension needs for readings of any form.

    Parameters
    ----------
    given : dict
        Columns that were given as keywords, such as rest and fence.
    """
    options = dict(options)
    axes = None if options.get("axes") is None else _names(options["axes"])
    if axes is not None:
        options["axes"] = axes
    own_columns = isinstance(readings, (Experiment, str, bytes, os.PathLike))
    if own_columns and given:
        raise DomainError(f"{sorted(given)[0]}: a file or an experiment has its own columns; give the readings as an array")
    if isinstance(readings, Experiment):
        return _Input("experiment.json", options, json.dumps(readings.document(), default=plain))
    if own_columns:
        return _Input(positional(readings), options)
    # The field in each reading, from a field of the user's own.
    table_field = options.get("field_table")
    if table_field is not None and not isinstance(table_field, str) and array_of(table_field, "field").ndim == 2:
        field = finite_matrix(options.pop("field_table"), "field")
        if field.shape[1] != 3:
            raise DomainError(f"field: expected an array of n x 3, not of n x {field.shape[1]}")
        given = {**given, **{f"f{one}": field[:, k] for k, one in enumerate("xyz")}}
    data: Optional[Floats] = None
    columns: Dict[str, Any]
    header: Dict[str, str] = {}  # the columns of the axes, as a table names them
    if isinstance(readings, Run) or is_frame(readings) or isinstance(readings, dict):
        run_ = readings if isinstance(readings, Run) else None
        columns = dict(run_.table() if run_ is not None else columns_of(readings))
        names = axes or (run_._stated_axes if run_ is not None else None)
        bare = {bare_name(name): name for name in columns}
        axes = names or (["x", "y", "z"] if {"x", "y", "z"} <= set(bare) else None)
        if names is not None:
            options["axes"] = list(names)
        if axes is not None and set(axes) <= set(bare):
            unit = unit_of([bare[axis] for axis in axes])
            stated = options.get("unit")
            if unit is not None and stated not in (None, unit, "1"):
                raise DomainError(f"readings: the columns are in {unit}, the instrument in {stated}; convert them")
            if unit is not None and stated == "1":
                del options["unit"]  # the command takes it from the header
            others = {name: one for name, one in columns.items() if bare_name(name) not in axes}
            found = stacked({axis: columns[bare[axis]] for axis in axes}, axes)
            numbers = [one for one in others.values() if one.dtype.kind in "fM"]
            # Rows with missing values are left to the command.
            if np.isfinite(found).all() and not any((one != one).any() for one in numbers):
                data, columns = found, others
                header = {axis: bare[axis] for axis in axes}
    else:
        data = finite_matrix(readings)
        if data.shape[1] != 3 and axes is None:
            raise DomainError(f"readings: expected an array of n x 3, not of n x {data.shape[1]}; "
                              "for an instrument with other axes, give their names with axes=")  # fmt: skip
        columns = {}
        axes = axes or ["x", "y", "z"]
        if len(axes) != data.shape[1]:
            raise DomainError(f"readings: expected an array of n x {len(axes)}, not of n x {data.shape[1]}: "
                              f"the axes are {', '.join(axes)}")  # fmt: skip
    rows = len(data) if data is not None else len(next(iter(columns.values()), []))
    columns.update(given)
    columns = {name: times_of(column(one, rows, name)) for name, one in columns.items()}
    is_native = (
        data is not None
        and _LABELS <= columns.keys() <= _NATIVE_COLUMNS
        and options.keys() <= _OF_EXPERIMENT
        and not ("time" in columns and columns["time"].dtype.kind in "OUS")
    )
    if is_native:
        if (unit := unit_of(list(header.values()))) is not None:
            options["unit"] = unit
        return _Input("readings.csv", options, readings=data, columns=columns, header=header)
    for name in columns:
        if name in ("run", "block", "mount", "confirm") and columns[name].dtype.kind == "f" and name in given:
            whole_column(columns[name], name)
        elif name in ("time", "level", "samples", "fx", "fy", "fz") and columns[name].dtype.kind in "fM":
            finite_column(columns[name], name)
    if data is not None and axes is not None:
        columns.update({header.get(axis, axis): data[:, k] for k, axis in enumerate(axes)})
    return _Input("readings.csv", options, csv_of(columns))


def _native(readings: Floats, columns: Dict[str, Any], options: Dict[str, Any]) -> Calibration:
    of_run = _axiscal.RunColumns()
    for name, values in columns.items():
        if name in ("rest", "fence"):
            setattr(of_run, name, _labels(values))
        elif name in ("run", "block", "mount"):
            setattr(of_run, name, whole_column(values, name))
        else:
            setattr(of_run, name, finite_column(values, name))
    arguments = tuple(arguments_of(options))
    # A file that an option names may have changed since the last call.
    of_files = options.keys() & _WITH_FILES or str(options.get("instrument")).endswith(".json")
    made = _axiscal.experiment(arguments) if of_files else _experiment(arguments)
    return Calibration(_axiscal.calibrate(made, readings, of_run))


@functools.lru_cache(maxsize=64)
def _experiment(arguments: Tuple[str, ...]) -> "_axiscal.Experiment":
    """The experiment of some options. It is kept, because a series of calls usually has the same options."""
    return _axiscal.experiment(arguments)


def _record(path: str, at: Files) -> Calibration:
    """The record in a file, without the folder of the files that the user did not name."""
    with open(path, encoding="utf-8") as file:
        return _from_json(file.read().replace(at.folder + os.sep, ""))


def _by_command(arguments: List[str], force: bool, at: Files) -> Calibration:
    path = at.path()
    more = ["--force"] if force else []
    try:
        done = run(["calibrate", *arguments, *more, "-o", path], warns=False)
    except SetupError as error:
        if "{slot}" in str(error) or "{serial}" in str(error):
            raise SetupError("the readings are of several instruments: calibrate_slots() calibrates the instruments "
                             "of one cube, calibrate_units() the units of a file") from error  # fmt: skip
        raise
    if not os.path.exists(path):
        raise RefusedError(done.messages.strip() or "the calibration was refused")
    return _record(path, at)


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
    readings : array_like n x m, DataFrame, dict of arrays, Run, Experiment or path
        Readings of m axes [unit of the instrument], one row for each reading. A table has the
        columns of a file of readings: rest, fence, and one for each axis.
    rest, fence : sequence of str, n
        The face on the table and the face at the fence in each reading: "+X", "-X", ... "-Z".
    instrument : Instrument or str
        For example ``axiscal.accelerometer("V")``.
    field : Field or str, optional
        For example ``axiscal.gravity()``. The default is the instrument's usual field.
    force : bool
        Return a refused calibration too.
    **options
        run, block, mount, level, temperature, time, samples, confirm, fx, fy, fz: one value for
        each reading; and every option of ``axiscal calibrate`` with underscores: method, latitude,
        resolution, robust, limits, ...

    Returns
    -------
    Calibration

    Raises
    ------
    RefusedError
        If the calibration is refused; RankDeficientError if the readings do not determine all
        parameters.
    DomainError
        If an argument has the wrong shape or type; the message names the argument.

    Warns
    -----
    CalibrationWarning
        For each finding that needs attention. Notes go to the logger "axiscal".

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
    given = _given(rest, fence, options)
    made = _input(readings, given, options)
    if made.readings is not None:
        return _tell(_native(made.readings, made.columns, made.options), force)
    with files() as at:
        return _tell(_by_command(made.arguments(at), force, at), force)


def _given(rest: Any, fence: Any, options: Dict[str, Any]) -> Dict[str, Any]:
    """Takes the columns out of the keywords of a call."""
    given = {name: options.pop(name) for name in _KEYWORDS if options.get(name) is not None} if options else {}
    if rest is not None:
        given["rest"] = rest
    if fence is not None:
        given["fence"] = fence
    return given


def fit_magnitude(readings: Any, **options: Any) -> Calibration:
    """Calibrates an instrument that was turned by hand, from the magnitude of the field.

    Parameters
    ----------
    readings : array_like n x m, DataFrame or path
        Readings in many directions [unit].
    **options
        As :func:`calibrate`, without ``method``.

    Returns
    -------
    Calibration

    Raises
    ------
    RefusedError
        If the readings do not determine the parameters.
    """
    if options.pop("method", "magnitude") != "magnitude":
        raise DomainError("method: fit_magnitude() has the method 'magnitude'; use calibrate() for others")
    return calibrate(readings, method="magnitude", **options)


def _records(arguments: List[str], name: str, force: bool, at: Files) -> Dict[str, Calibration]:
    output = os.path.join(at.folder, name)
    arguments = [*arguments, "--force"] if force else arguments
    messages = run(["calibrate", *arguments, "-o", output], warns=False).messages
    found = {}
    for path in sorted(glob.glob(os.path.join(at.folder, "record-*.json"))):
        key = os.path.basename(path)[len("record-"): -len(".json")]
        found[key] = _tell(_record(path, at), force)
    if not found:
        raise RefusedError(messages.strip() or "the calibration was refused")
    return found


def calibrate_slots(readings: Any, *, rest: Any = None, fence: Any = None, force: bool = False, **options: Any
                    ) -> Dict[str, Calibration]:  # fmt: skip
    """Calibrates the instruments of one cube together: an assembly with several slots.

    Parameters
    ----------
    readings : DataFrame, dict of arrays, Run, Experiment or path
        A table with the columns rest, fence, and one for each axis of each slot: "a.x", "a.y", ...
    rest, fence : sequence of str, n
        The faces, if the table lacks these columns.
    force : bool
        Return refused calibrations too.
    **options
        As :func:`calibrate`; and assembly, ...

    Returns
    -------
    dict of Calibration
        By the names of the slots.

    Raises
    ------
    RefusedError
        If all calibrations are refused.
    """
    setup = _setup(options.pop("instrument", None), options.pop("field", None), options)
    made = _input(readings, _given(rest, fence, setup), setup)
    with files() as at:
        return _records(made.arguments(at), "record-{slot}.json", force, at)


def calibrate_imu(log_file: Any, *, force: bool = False, **options: Any) -> Dict[str, Calibration]:
    """Calibrates the sensors of an IMU from a raw log of rests and turns.

    Parameters
    ----------
    log_file : path, list of paths, DataFrame, Series or dict of arrays
        A log of any format, or several logs; or columns time, ax, ay, az, gx, gy, gz, ...
    force : bool
        Return refused calibrations too.
    **options
        Options of ``axiscal calibrate --imu``: cube, only, rate, latitude, ...

    Returns
    -------
    dict of Calibration
        By the sensor: "accelerometer", "gyroscope", "magnetometer".

    Raises
    ------
    RefusedError
        If all calibrations are refused.
    """
    several = isinstance(log_file, (list, tuple)) and all(isinstance(one, (str, os.PathLike)) for one in log_file)
    if several and not log_file:
        raise DomainError("log_file: the list of logs is empty")
    with files() as at:
        paths = [log_path(one, at) for one in (log_file if several else [log_file])]
        return _records(["--imu", *paths, *arguments_of(options, at)], "record-{slot}.json", force, at)


def calibrate_units(readings: Any, *, force: bool = False, **options: Any) -> List[Calibration]:
    """Calibrates each unit of a table with the column ``serial``.

    Parameters
    ----------
    readings : path, DataFrame, dict of arrays or Run
        Readings of many units, one after another.
    force : bool
        Return refused calibrations too.
    **options
        As :func:`calibrate`.

    Returns
    -------
    list of Calibration
        One for each unit, in the order of their serial numbers.

    Raises
    ------
    RefusedError
        If all calibrations are refused.
    """
    setup = _setup(options.pop("instrument", None), options.pop("field", None), options)
    made = _input(readings, _given(None, None, setup), setup)
    with files() as at:
        return list(_records(made.arguments(at), "record-{serial}.json", force, at).values())


def _numbers_of(columns: Dict[str, Any]) -> Dict[str, Any]:
    """The columns of a log without those of words, such as names of frames. Times of text are read."""
    found = {}
    for name, values in columns.items():
        values = times_of(values)
        is_text = values.dtype.kind in "US" or (values.dtype.kind == "O" and any(isinstance(one, str) for one in values))
        if is_text:
            values = _as_times(values.astype(str))
        if values.dtype.kind in "US":
            log.info("column %r is not used: it holds words", name)
        else:
            found[name] = values
    return found


def log_path(value: Any, at: Any) -> str:
    """The path of a log. Columns are written to a file that the readers take without text."""
    if isinstance(value, (str, bytes, os.PathLike)):
        return positional(value)
    table = getattr(value, "log_columns", None)
    columns: Dict[str, Any]
    if table is not None:
        columns = table()
    elif is_frame(value) or isinstance(value, dict):
        columns = dict(columns_of(value))
        index = getattr(value, "index", None)
        is_time = getattr(index, "name", None) == "time" or getattr(getattr(index, "dtype", None), "kind", "") == "M"
        if "time" not in columns and index is not None and is_time:
            columns = {"time": np.asarray(index), **columns}
        columns = _numbers_of(columns)
    else:
        data = matrix(value, "samples")
        names = ["x", "y", "z"] if data.shape[1] == 3 else [f"c{k + 1}" for k in range(data.shape[1])]
        columns = {name: data[:, k] for k, name in enumerate(names)}
    if not columns or not len(next(iter(columns.values()))):
        raise DomainError("the log is empty")
    # The files of numpy have names of ASCII.
    plain_names = {name: name.replace("\u00b5", "u").replace("\u03bc", "u").replace("\u00b0", "deg") for name in columns}
    plain_names = {name: one.encode("ascii", "replace").decode() or "unnamed" for name, one in plain_names.items()}
    if len(set(plain_names.values())) < len(columns):
        raise DomainError(f"two columns of the log have the same name: {', '.join(columns)}")
    rows = len(next(iter(columns.values())))
    table_ = np.empty(rows, dtype=[(name, np.float64) for name in plain_names.values()])
    for name, one in columns.items():
        one = times_of(array_of(one, f"column {name!r}"))
        if one.dtype.kind == "M":
            one = (one - one[0]) / np.timedelta64(1, "s")
        elif one.dtype.kind == "m":
            one = one / np.timedelta64(1, "s")
        table_[plain_names[name]] = vector(one, f"column {name!r}")
    path: str = at.path(".npy")
    np.save(path, table_)
    return path
