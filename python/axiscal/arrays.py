# SPDX-License-Identifier: Apache-2.0
"""Converts readings to arrays: from lists, arrays and DataFrames."""

from __future__ import annotations

import datetime
import re
from typing import TYPE_CHECKING, Any, Dict, List, Mapping, Optional, Sequence

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

#: Columns of a table of readings that are not axes.
LABELS = (
    "run", "block", "mount", "rest", "fence", "level", "temperature", "time", "samples", "confirm", "surface",
    "serial", "date", "operator", "fx", "fy", "fz", "pitch_deg", "roll_deg", "yaw_deg", "heading_deg",
)  # fmt: skip


def is_frame(value: Any) -> bool:
    """True for a pandas DataFrame, without importing pandas."""
    return hasattr(value, "columns") and hasattr(value, "to_numpy")


def columns_of(table: Any) -> Dict[str, Array]:
    """The columns of a DataFrame or of a mapping, by their names.

    Raises
    ------
    DomainError
        If the columns have different lengths, or two of them one name.
    """
    keys = list(table.columns if is_frame(table) else table)
    columns = {str(key): array_of(table[key], f"column {str(key)!r}") for key in keys}
    if len(columns) != len(keys):
        raise DomainError("two columns of the table have the same name")
    sizes = {one.shape for one in columns.values()}
    if len(sizes) > 1 or any(len(size) != 1 for size in sizes):
        shapes = ", ".join(f"{name}: {one.shape}" for name, one in columns.items())
        raise DomainError(f"the columns of the table must have one length; got {shapes}")
    return columns


def array_of(value: Any, name: str) -> Array:
    """An array.

    Raises
    ------
    DomainError
        If the rows of ``value`` have different lengths.
    """
    try:
        return np.asarray(value)
    except ValueError as error:
        raise DomainError(f"{name}: rows of different lengths") from error


def _floats(value: Any, name: str, expected: str) -> Floats:
    """An array of numbers, as the extension can read it; NaN for masked values."""
    try:
        if isinstance(value, np.ma.MaskedArray):
            mask = np.broadcast_to(np.asarray(value.mask), value.shape)
            value = np.where(mask, np.nan, np.asarray(value.data, dtype=np.float64))
        array = np.asarray(value)
    except ValueError as error:
        raise DomainError(f"{name}: rows of different lengths; expected {expected}") from error
    if array.dtype.kind in "bcMmUS":
        raise DomainError(f"{name}: expected {expected}, not {array.dtype}")
    if array.dtype != np.float64:
        try:
            array = array.astype(np.float64)
        except (TypeError, ValueError) as error:
            raise DomainError(f"{name}: expected {expected}, not {array.dtype}") from error
    return np.ascontiguousarray(array) if min(array.strides, default=0) < 0 else array


def matrix(value: Any, name: str = "readings") -> Floats:
    """An n x m array of numbers; views are not copied.

    Raises
    ------
    DomainError
        If ``value`` has another shape, or contains something other than numbers.
    """
    array = _floats(value, name, "numbers, n x m")
    if array.ndim == 1:
        array = array.reshape(1, -1) if name == "reading" else array.reshape(-1, 1)
    if array.ndim != 2:
        raise DomainError(f"{name}: expected an array of n x m, not of {array.ndim} dimensions")
    return array


def vector(value: Any, name: str) -> Floats:
    """n numbers.

    Raises
    ------
    DomainError
        If ``value`` has another shape, or contains something other than numbers.
    """
    array = _floats(value, name, "numbers")
    if array.ndim != 1:
        raise DomainError(f"{name}: expected n numbers, not an array of {array.ndim} dimensions")
    return array


def finite_matrix(value: Any, name: str = "readings") -> Floats:
    """As :func:`matrix`, but raises DomainError if a value is NaN or infinite."""
    array = matrix(value, name)
    if not np.isfinite(array).all():
        row, column = np.argwhere(~np.isfinite(array))[0]
        raise DomainError(f"{name}: row {row}, column {column} is {array[row, column]}. Leave out such rows")
    return array


def column(value: Any, rows: int, name: str) -> Array:
    """A column with one value per reading.

    Raises
    ------
    DomainError
        If there are not as many values as readings.
    """
    array = array_of(value, name)
    if array.ndim != 1 or len(array) != rows:
        raise DomainError(f"{name}: expected {rows} values (one per reading), not an array of shape {array.shape}")
    return array


def finite_column(values: Any, name: str) -> Floats:
    """Finite numbers, one for each reading.

    Raises
    ------
    DomainError
        If a value is missing or is no number.
    """
    numbers = seconds_of(values) if np.asarray(values).dtype.kind == "M" else vector(values, name)
    if not np.isfinite(numbers).all():
        place = int(np.argmin(np.isfinite(numbers)))
        raise DomainError(f"{name}: the value of reading {place} is {np.asarray(values)[place]}; expected a number")
    return numbers


def whole_column(values: Any, name: str) -> Array:
    """Whole numbers of 32 bits, one for each reading.

    Raises
    ------
    DomainError
        If a value is missing or is no whole number.
    """
    numbers = finite_column(values, name)
    if not ((numbers == np.floor(numbers)) & (np.abs(numbers) < 2**31)).all():
        bad = numbers[(numbers != np.floor(numbers)) | (np.abs(numbers) >= 2**31)][0]
        raise DomainError(f"{name}: expected whole numbers below 2147483648, not {bad:g}")
    return numbers.astype(np.int32)


_UNIT_IN_NAME = re.compile(r"^(.+?)\s*[(\[]([^()\[\]]+)[)\]]$")


def bare_name(name: str) -> str:
    """The name of a column without its unit: "x" for "x (V)"."""
    found = _UNIT_IN_NAME.match(name)
    return found.group(1) if found else name


def unit_of(names: Sequence[str]) -> Optional[str]:
    """The unit in the names of the axes' columns, such as "x (V)"; None if no name has one.

    Raises
    ------
    DomainError
        If the columns have different units.
    """
    units = {found.group(2).strip() for found in map(_UNIT_IN_NAME.match, names) if found}
    if len(units) > 1:
        raise DomainError(f"readings: the columns {', '.join(names)} have different units; convert them to one unit")
    return units.pop() if units else None


def axes_of(columns: Mapping[str, Array], axes: Optional[Sequence[str]] = None) -> List[str]:
    """The columns of the axes: x, y, z, or else the columns of numbers that are no labels."""
    if axes is not None:
        missing = [axis for axis in axes if axis not in columns]
        if missing:
            raise DomainError(f"readings: the column {missing[0]!r} is missing; the columns are {', '.join(columns)}")
        return list(axes)
    if {"x", "y", "z"} <= set(columns):
        return ["x", "y", "z"]
    return [name for name, one in columns.items() if name not in LABELS and one.dtype.kind in "fiu"]


def stacked(columns: Mapping[str, Array], axes: Sequence[str]) -> Floats:
    """Some columns as an n x m array.

    Raises
    ------
    DomainError
        If a column contains something other than numbers.
    """
    return np.column_stack([vector(columns[axis], f"column {axis!r}") for axis in axes])


def utc(seconds: Any) -> Any:
    """Converts seconds since 1970 to datetime64[us].

    Returns None if the times are before the year 2000: they then count from the start of a recording.
    """
    times = np.asarray(seconds, dtype=np.float64)
    if not np.isfinite(times).any() or not np.nanmin(times) >= 946684800.0:
        return None
    return np.round(times * 1e6).astype("datetime64[us]")


def seconds_of(times: Any) -> Floats:
    """datetime64 as seconds since 1970; NaN for NaT."""
    array = np.asarray(times).astype("datetime64[us]")
    since: Floats = array.astype(np.int64) / 1e6
    return np.where(np.isnat(array), np.nan, since)


def times_of(values: Array) -> Array:
    """Objects that are dates as datetime64[us] in UTC; other values unchanged.

    A date without a time zone is in UTC, as datetime64 is.
    """
    if values.dtype.kind != "O" or not all(hasattr(one, "timestamp") or one is None for one in values):
        return values
    return np.array([_utc_of(one) for one in values], dtype="datetime64[us]")


def _utc_of(date: Any) -> np.datetime64:
    if date is None or date != date:  # NaT
        return np.datetime64("NaT")
    if date.tzinfo is not None:
        date = date.astimezone(datetime.timezone.utc).replace(tzinfo=None)
    return np.datetime64(date, "us")


def same(one: Any, other: Any) -> bool:
    """True if two values or arrays are equal; NaN equals NaN."""
    if isinstance(one, np.ndarray) or isinstance(other, np.ndarray):
        one, other = np.asarray(one), np.asarray(other)
        numbers = one.dtype.kind in "fc" and other.dtype.kind in "fc"
        return bool(np.array_equal(one, other, equal_nan=numbers))
    return bool(one == other)


class Table(Dict[str, Array]):
    """Columns of a table by their names."""

    def to_dataframe(self) -> Any:
        """The table as a pandas DataFrame."""
        import pandas

        return pandas.DataFrame(dict(self))

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, dict)
            and list(self) == list(other)
            and all(same(self[name], other[name]) for name in self)
        )

    def __ne__(self, other: object) -> bool:
        return not self == other


def read_table(path: str, text: Optional[str] = None) -> Table:
    """Reads a table in any layout, from the file or from ``text``.

    Columns of numbers are arrays of float, with NaN for empty cells. Other columns are arrays of str.
    """
    columns, messages = _axiscal.read_table(path, text)
    tell(messages)
    return Table({name: values if isinstance(values, np.ndarray) else np.array(values, dtype=str)
                  for name, values in columns.items()})  # fmt: skip


def table_of_csv(text: str) -> Table:
    """The columns of CSV that a subcommand printed."""
    return read_table("-", text)


def _cell(value: Any) -> str:
    if value is None or type(value).__name__ in ("NAType", "NaTType") or value != value:
        return ""
    text = str(value)
    return '"' + text.replace('"', '""') + '"' if any(one in text for one in ',"\n\r') else text


def number(value: Any) -> str:
    """The shortest text of a number that reads back as the same number."""
    if not isinstance(value, (float, np.floating)):
        return str(int(value))
    text = repr(float(value))
    return text[:-2] if text.endswith(".0") else text


def csv_of(columns: Mapping[str, Any]) -> str:
    """Columns of one length as CSV; numbers read back as the same numbers."""
    cells: List[List[str]] = []
    for name, values in columns.items():
        array = times_of(np.asarray(values))
        if array.dtype.kind == "f":
            texts = ["" if one != one else number(one) for one in array.tolist()]
        elif array.dtype.kind in "iub":
            whole: Any = array.tolist()
            texts = [str(int(one)) for one in whole]
        elif array.dtype.kind == "M":
            texts = ["" if np.isnat(one) else str(one) for one in array]
        else:
            texts = [_cell(one) for one in array.tolist()]
        cells.append([_cell(name), *texts])
    return "\n".join(",".join(row) for row in zip(*cells)) + "\n"
