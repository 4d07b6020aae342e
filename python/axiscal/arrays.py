# SPDX-License-Identifier: Apache-2.0
"""Readings as users have them: arrays, lists, DataFrames."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from . import _axiscal
from ._messages import tell
from .errors import DomainError

if TYPE_CHECKING:  # numpy.typing takes 10 ms to import
    import numpy.typing as npt

    Floats = npt.NDArray[np.float64]
    Array = npt.NDArray[Any]
else:
    Floats = Array = Any

#: Columns of a table of readings that are no axes.
LABELS = (
    "run", "block", "mount", "rest", "fence", "level", "temperature", "time", "samples", "confirm", "surface",
    "serial", "date", "operator", "fx", "fy", "fz", "pitch_deg", "roll_deg", "yaw_deg", "heading_deg",
)  # fmt: skip


def is_frame(value: Any) -> bool:
    """True for a pandas DataFrame, without importing pandas."""
    return hasattr(value, "columns") and hasattr(value, "to_numpy")


def matrix(value: Any, name: str = "readings") -> Floats:
    """An n x m array of numbers; views are not copied.

    Raises
    ------
    DomainError
        If ``value`` has another shape, or holds something else than finite numbers.
    """
    try:
        if isinstance(value, np.ma.MaskedArray):
            mask = np.broadcast_to(np.asarray(value.mask), value.shape)
            value = np.where(mask, np.nan, np.asarray(value.data, dtype=np.float64))
        array = np.asarray(value)
    except ValueError as error:
        raise DomainError(f"{name}: rows of different lengths; expected an array of n x m numbers") from error
    if array.dtype.kind in "bcMm":
        raise DomainError(f"{name}: expected numbers, not {array.dtype}")
    if array.dtype.kind not in "fiu":
        try:
            array = array.astype(np.float64)
        except (TypeError, ValueError) as error:
            raise DomainError(f"{name}: expected numbers, not {array.dtype}") from error
    if array.ndim == 1:
        array = array.reshape(1, -1) if name == "reading" else array.reshape(-1, 1)
    if array.ndim != 2:
        raise DomainError(f"{name}: expected an array of n x m, not of {array.ndim} dimensions")
    return array if array.dtype == np.float64 else array.astype(np.float64)


def finite_matrix(value: Any, name: str = "readings") -> Floats:
    """As :func:`matrix`; NaN and infinity are refused with their place."""
    array = matrix(value, name)
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise DomainError(f"{name}: row {row}, column {column} is {array[row, column]}; leave such rows out")
    return array


def column(value: Any, rows: int, name: str) -> Array:
    """One value a reading.

    Raises
    ------
    DomainError
        If there are not as many values as readings.
    """
    array = np.asarray(value)
    if array.ndim != 1 or len(array) != rows:
        raise DomainError(f"{name}: expected {rows} values, one a reading; got shape {array.shape}")
    return array


_UNIT_IN_NAME = re.compile(r"^(.+?)\s*[(\[]([^()\[\]]+)[)\]]$")


def unit_of_columns(names: Sequence[str]) -> Tuple[List[str], Optional[str]]:
    """Names such as "x (V)" without their unit, and the unit; None if the names state no unit.

    Raises
    ------
    DomainError
        If the columns have different units.
    """
    found = [_UNIT_IN_NAME.match(name) for name in names]
    units = {one.group(2).strip() if one else None for one in found}
    if len(units) > 1:
        raise DomainError(f"readings: the columns {', '.join(names)} have different units; convert them to one unit")
    return [one.group(1) if one else name for one, name in zip(found, names)], units.pop() if units else None


def table_of(frame: Any, axes: Optional[Sequence[str]]) -> Tuple[Floats, List[str], Dict[str, Array]]:
    """Readings, names of the axes and further columns of a DataFrame or a mapping of columns."""
    names = [str(one) for one in (frame.columns if is_frame(frame) else frame)]
    columns = {name: np.asarray(frame[key]) for name, key in zip(names, frame.columns if is_frame(frame) else frame)}
    if axes is None:
        others = [name for name in names if name not in LABELS]
        axes = ["x", "y", "z"] if {"x", "y", "z"} & set(names) else others
    missing = [axis for axis in axes if axis not in columns]
    if missing:
        raise DomainError(f"readings: the column {missing[0]!r} is missing; the columns are {', '.join(names)}")
    data = finite_matrix(np.column_stack([columns[axis] for axis in axes]))
    return data, list(axes), {name: one for name, one in columns.items() if name in LABELS}


def utc(seconds: Any) -> Any:
    """Seconds since 1970 as datetime64[us]; None if they count from another start.

    Times before the year 2000 count from the start of a recording.
    """
    times = np.asarray(seconds, dtype=np.float64)
    if not times.size or not np.nanmin(times, initial=np.inf) >= 946684800.0:
        return None
    return np.round(times * 1e6).astype("datetime64[us]")


def seconds_of(times: Any) -> Floats:
    """datetime64 as seconds since 1970."""
    since: Floats = np.asarray(times).astype("datetime64[us]").astype(np.int64) / 1e6
    return since


class Table(Dict[str, Array]):
    """Columns of a table by their names."""

    def to_dataframe(self) -> Any:
        """The table as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(dict(self))


def read_table(path: str, text: Optional[str] = None) -> Table:
    """The columns of a table of any look, of the file or of ``text``.

    Columns of numbers are arrays of float, NaN if a cell is empty; others are arrays of str.
    """
    columns, messages = _axiscal.read_table(path, text)
    tell(messages)
    return Table({name: values if isinstance(values, np.ndarray) else np.array(values, dtype=str)
                  for name, values in columns.items()})  # fmt: skip


def table_of_csv(text: str) -> Table:
    """The columns of CSV that a subcommand printed."""
    return read_table("-", text)
