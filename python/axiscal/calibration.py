# SPDX-License-Identifier: Apache-2.0
"""The result of a calibration."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, Iterator, List, Optional, Tuple, Union

import numpy as np

from . import _axiscal
from ._options import arguments_of, files, plain, positional, write
from ._messages import warn
from .arrays import Array, Floats, array_of, bare_name, columns_of, is_frame, matrix, stacked
from .errors import DataError, DomainError, RefusedError
from .quantity import Quantity

__all__ = ["Calibration", "load"]

PathLike = Union[str, "os.PathLike[str]"]


class Calibration:
    """A calibration: coefficients, uncertainties, findings and provenance.

    Made by :func:`axiscal.calibrate` or :func:`axiscal.load`. It does not change.

    Attributes
    ----------
    bias : ndarray, m
        Bias of each axis [unit].
    sensitivity : ndarray, m x 3
        Sensitivity of each axis along x, y, z [unit / field_unit].
    covariance : ndarray, 4m x 4m
        Covariance of bias and sensitivities, axis by axis, in the order of ``parameters``.
    unit, field_unit : str
        Unit of the readings, and of the field.
    status : str
        "ok", "warning" or "refused".
    warnings : list of (code, message, runs)
    notes : list of (code, message)
    """

    def __init__(self, record: "_axiscal.Record") -> None:
        if not isinstance(record, _axiscal.Record):
            raise DomainError("a Calibration is made by calibrate(), load() or Calibration.from_dict()")
        self._record = record

    @property
    def bias(self) -> Floats:
        """Bias of each axis, m [unit]."""
        return self._record.bias

    @property
    def sensitivity(self) -> Floats:
        """Sensitivity of each axis along x, y, z, m x 3 [unit / field_unit]."""
        return self._record.sensitivity

    @property
    def covariance(self) -> Floats:
        """Covariance of all parameters, in the order of :attr:`parameters`."""
        return self._record.covariance

    @property
    def unit(self) -> str:
        """Unit of the readings."""
        return self._record.unit

    @property
    def field_unit(self) -> str:
        """Unit of the field."""
        return self._record.field_unit

    @property
    def kind(self) -> str:
        """Kind of the instrument, for example "accelerometer"."""
        return self._record.kind

    @property
    def serial(self) -> str:
        """Serial number of the instrument; may be empty."""
        return self._record.serial

    @property
    def axes(self) -> List[str]:
        """Names of the axes, in the order of the readings' columns."""
        return self._record.axes

    @property
    def created(self) -> "np.datetime64":
        """The time at which the calibration was computed, UTC."""
        return np.datetime64(self._record.created.rstrip("Z"))

    @property
    def measured(self) -> "Optional[np.datetime64]":
        """The time of the last reading, UTC; None if it is not known."""
        text = self._record.measured
        return np.datetime64(text.rstrip("Z")) if text else None

    @property
    def status(self) -> str:
        """"ok", "warning" or "refused"."""
        return self._record.status

    @property
    def warnings(self) -> List[Tuple[str, str, List[int]]]:
        """Code, message and runs of each warning."""
        return self._record.warnings

    @property
    def notes(self) -> List[Tuple[str, str]]:
        """Code and message of each note."""
        return self._record.notes

    @property
    def parameters(self) -> List[str]:
        """Names of all parameters: "x.bias", "x.sensitivity.x", ..."""
        return self._record.parameter_names()

    def __getitem__(self, name: str) -> Quantity:
        """A parameter with its uncertainty, for example ``cal["x.bias"]``.

        Raises
        ------
        DomainError
            If there is no such parameter; the message suggests a name.
        """
        if not isinstance(name, str):
            raise DomainError(f"expected the name of a parameter, such as 'x.bias', not {name!r}")
        value, u, expanded, dof, unit = self._record.quantity(name)
        return Quantity(value, u, expanded, expanded / u if u > 0.0 else float("nan"), dof, unit)

    def __contains__(self, name: object) -> bool:
        return name in self.parameters

    def __iter__(self) -> Iterator[str]:
        return iter(self.parameters)

    def _columns(self, readings: Any) -> Optional[Dict[str, Array]]:
        """The columns of a table of readings; None for arrays."""
        columns: Dict[str, Array]
        if is_frame(readings) or isinstance(readings, dict):
            columns = dict(columns_of(readings))
        elif hasattr(readings, "log_columns") or hasattr(readings, "table"):
            columns = dict(readings.log_columns() if hasattr(readings, "log_columns") else readings.table())
        else:
            return None
        missing = [axis for axis in self.axes if axis not in columns]
        if missing:
            raise DomainError(
                f"readings: the column {missing[0]!r} is missing; the axes of the calibration are {', '.join(self.axes)} "
                f"[{self.unit}], and the columns are {', '.join(columns)}; rename the columns, or give an array"
            )
        return columns

    def _data(self, readings: Any, temperature: Any) -> Tuple[Floats, Floats]:
        """Readings, n x m, and temperatures: 0 x 1 (none), n x 1 or n x m."""
        columns = self._columns(readings)
        if columns is None:
            data = matrix(readings, "reading" if array_of(readings, "readings").ndim == 1 else "readings")
        else:
            data = stacked(columns, self.axes)
            if temperature is None and self._record.has_temperature:
                own = [f"{axis}_temperature" for axis in self.axes]
                names = {bare_name(name.strip()).strip().lower(): name for name in columns}
                if set(own) <= set(columns):
                    temperature = stacked(columns, own)
                elif "temperature" in names:
                    temperature = columns[names["temperature"]]
                else:
                    warn("the readings have no column 'temperature': the reference temperature is used")
        heat: Floats = np.empty((0, 1))
        if temperature is not None:
            is_one = array_of(temperature, "temperature").ndim == 0
            heat = matrix(np.full(len(data), temperature) if is_one else temperature, "temperature")
        return data, heat

    def apply(self, readings: Any, temperature: Any = None, force: bool = False) -> Any:
        """Reduces readings to the field in the instrument's frame.

        Parameters
        ----------
        readings : array_like n x m, DataFrame, dict of arrays, Run or Series
            Readings [unit], one row for each sample. A table has a column for each axis.
        temperature : array_like, n or n x m, optional
            Output of the temperature sensor, or of the sensor of each axis. The default is the
            column "temperature" of a table, or the reference temperature.
        force : bool
            Apply a refused calibration too.

        Returns
        -------
        ndarray, n x 3, or DataFrame
            The field's components [field_unit]; NaN for rows that contain NaN. A single reading of
            m numbers gives 3 numbers. An instrument with fewer than three axes gives n x m, the
            component along each axis. A DataFrame gives a DataFrame that also has the angles, and
            the column "flag": "clamped", "extrapolated" (outside the calibrated temperatures) or
            "unreadable" (a reading is NaN).

        Raises
        ------
        DomainError
            If a column is missing, or an argument has the wrong shape.

        Examples
        --------
        >>> import axiscal, numpy as np
        >>> cal = axiscal.load("cal.json")                     # doctest: +SKIP
        >>> cal.apply(np.array([[0.870, 0.0, 2.360]]))         # doctest: +SKIP
        """
        data, heat = self._data(readings, temperature)
        result: Floats = self._record.apply(data, heat, force)
        if not is_frame(readings):
            is_one = self._columns(readings) is None and array_of(readings, "readings").ndim == 1
            return result[0] if is_one else result
        import pandas

        is_whole = len(self.axes) >= 3
        names = ["field_x", "field_y", "field_z"] if is_whole else [f"component_{one}" for one in self.axes]
        frame = pandas.DataFrame(result, index=readings.index, columns=names)
        angles, values, flags = self._record.derived(data, heat, None, force)
        for index, name in enumerate(angles):
            frame[name] = values[:, index]
        words = np.array(["", "clamped", "extrapolated", "clamped extrapolated"])
        frame["flag"] = np.where(np.isfinite(data).all(axis=1), words[flags & 3], "unreadable")
        return frame

    def angles(
        self, readings: Any, up: Any = None, temperature: Any = None, force: bool = False
    ) -> Dict[str, Floats]:
        """The angles of the instrument: pitch and roll, or heading.

        Parameters
        ----------
        readings : array_like n x m, DataFrame, dict of arrays, Run or Series
            Readings [unit].
        up : array_like, n x 3 or 3, optional
            Direction up in the instrument's frame, for headings of a tilted magnetometer.
        temperature : array_like, n or n x m, optional
            As for :meth:`apply`.
        force : bool
            Apply a refused calibration too.

        Returns
        -------
        dict of ndarray, n
            "pitch_deg", "roll_deg", ... [degrees]; "angle_x_deg", ... of an instrument with fewer
            than three axes.

        Raises
        ------
        DomainError
            If an argument has the wrong shape.
        """
        data, heat = self._data(readings, temperature)
        if up is not None:
            up = matrix(np.tile(up, (len(data), 1)) if array_of(up, "up").ndim == 1 else up, "up")
            if up.shape == (len(data), 3) and not np.linalg.norm(up, axis=1).all():
                raise DomainError("up: a row is zero; expected a direction in each row")
        names, values, _ = self._record.derived(data, heat, up, force)
        return {name: values[:, index] for index, name in enumerate(names)}

    def summary(self, all: bool = False) -> str:
        """The summary that the command prints."""
        return self._record.summary(all)

    def to_dict(self) -> Dict[str, Any]:
        """The record as a dict, with the members of its JSON file."""
        result: Dict[str, Any] = json.loads(self._record.json())
        return result

    @staticmethod
    def from_dict(record: Dict[str, Any]) -> "Calibration":
        """The calibration from a dict that :meth:`to_dict` returned.

        Examples
        --------
        >>> truth = Calibration.from_dict({
        ...     "format": "axiscal-calibration", "version": 1,
        ...     "instrument": {"kind": "accelerometer", "serial": "", "axes": ["x", "y", "z"], "unit": "V"},
        ...     "field": {"kind": "gravity", "unit": "g", "magnitude": 1.0, "in_table": [0, 0, 1]},
        ...     "coefficients": {"bias": [0.01, -0.02, 0.03],
        ...                      "sensitivity": [[2.5, 0, 0], [0, 2.5, 0], [0, 0, 2.5]]}})
        >>> truth.unit, truth.field_unit
        ('V', 'g')
        """
        return _from_json(json.dumps(record, default=plain))

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of all parameters: value, u, U, k, dof, unit."""
        import pandas

        rows = {name: vars(self[name]) for name in self.parameters}
        return pandas.DataFrame.from_dict(rows, orient="index")

    def save(self, path: PathLike, force: bool = False) -> None:
        """Writes the record (JSON).

        Raises
        ------
        RefusedError
            If the calibration was refused and ``force`` is false.
        OutputError
            If the file cannot be written.
        """
        self._record.write(positional(path), force)

    def report(self, path: PathLike, readings: Any = None, **options: Any) -> None:
        """Writes a report (.html) or a certificate (.pdf).

        Parameters
        ----------
        path : path
            File to write.
        readings : path, Run or DataFrame, optional
            The readings, to show their values and times.
        **options
            Options of ``axiscal report``: laboratory, history, noise, ...

        Notes
        -----
        This module writes a report without options. Options, readings and certificates need the program
        ``axiscal-report``.
        """
        if os.fspath(path).endswith((".html", ".htm")) and readings is None and not options:
            write(path, self._record.report().encode())
            return
        from .programs import run_program

        with files() as at:
            arguments = ["report", at.of(self)]
            if readings is not None:
                file = at.of(readings)
                if not isinstance(file, (str, os.PathLike)):
                    raise DomainError("readings: expected a path, a Run or a DataFrame")
                arguments.append(positional(file))
            run_program([*arguments, *arguments_of(options, at), "-o", positional(path)])

    def export(self, format: str, path: Optional[PathLike] = None, **options: Any) -> Union[str, bytes]:
        """The calibration for other software.

        Parameters
        ----------
        format : str
            px4, ardupilot, kalibr, c-header, ros, ...; see :func:`axiscal.export_formats`.
        path : path, optional
            File to which the export is also written.
        **options
            Options of ``axiscal export``: lossy, name, numbers, ...

        Returns
        -------
        str or bytes
            The content of the file; bytes if it is not text.
        """
        from .commands import export

        return export([self], format, path, **options)

    def _repr_html_(self) -> str:
        """The report's first screen, for notebooks."""
        page = self._record.report()
        end = page.find('<section id="residuals"')
        page = page[: end if end > 0 else len(page)] + "</body></html>"
        quoted = page.replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe srcdoc="{quoted}" style="width:100%;height:620px;border:0"></iframe>'

    def __repr__(self) -> str:
        name = f" {self.serial}" if self.serial else ""
        return f"<Calibration of {self.kind}{name}: {self.status}>"

    def __str__(self) -> str:
        return self.summary()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Calibration) and self._record.json() == other._record.json()

    def __hash__(self) -> int:
        return hash(self._record.json())

    def __reduce__(self) -> Tuple[Any, ...]:
        return (_from_json, (self._record.json(),))


def _from_json(text: str, path: str = "record") -> Calibration:
    return Calibration(_axiscal.Record.from_json(text, path))


def load(path: PathLike) -> Calibration:
    """Reads a record (JSON).

    Raises
    ------
    DataError
        If the file is missing, or is not a record.
    """
    if path == "-":
        raise DataError("-: give the path of a file")
    return Calibration(_axiscal.Record.read(positional(path)))


def checked(calibration: Calibration, force: bool) -> Calibration:
    """The calibration, unless it was refused."""
    if calibration.status == "refused" and not force:
        warnings_ = calibration.warnings
        raise RefusedError(warnings_[0][1] if warnings_ else "the calibration was refused")
    return calibration


