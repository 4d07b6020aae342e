# SPDX-License-Identifier: Apache-2.0
"""The result of a calibration."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np

from . import _axiscal
from ._options import arguments_of, files
from .arrays import Floats, column, is_frame, matrix
from .errors import RefusedError
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
        self._record = record

    @property
    def bias(self) -> Floats:
        return self._record.bias

    @property
    def sensitivity(self) -> Floats:
        return self._record.sensitivity

    @property
    def covariance(self) -> Floats:
        return self._record.covariance

    @property
    def unit(self) -> str:
        return self._record.unit

    @property
    def field_unit(self) -> str:
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
        """When it was computed, UTC."""
        return np.datetime64(self._record.created.rstrip("Z"))

    @property
    def measured(self) -> "Optional[np.datetime64]":
        """When the last reading was taken, UTC; None if no one said."""
        text = self._record.measured
        return np.datetime64(text.rstrip("Z")) if text else None

    @property
    def status(self) -> str:
        return self._record.status

    @property
    def warnings(self) -> List[Tuple[str, str, List[int]]]:
        return self._record.warnings

    @property
    def notes(self) -> List[Tuple[str, str]]:
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
        value, u, expanded, dof, unit = self._record.quantity(name)
        return Quantity(value, u, expanded, expanded / u if u > 0.0 else float("nan"), dof, unit)

    def _readings(self, readings: Any) -> Floats:
        if is_frame(readings):
            names = [str(one) for one in readings.columns]
            axes = self.axes if set(self.axes) <= set(names) else names
            return matrix(readings[axes].to_numpy())
        return matrix(readings, "reading" if np.ndim(readings) == 1 else "readings")

    def apply(self, readings: Any, temperature: Any = None, force: bool = False) -> Any:
        """Reduces readings to the field in the instrument's frame.

        Parameters
        ----------
        readings : array_like, n x m, or DataFrame
            Readings [unit], one row a sample. A DataFrame has a column for each axis.
        temperature : array_like, n, optional
            Output of the temperature sensor; the reference temperature if it is left out.
        force : bool
            Apply a refused calibration too.

        Returns
        -------
        ndarray, n x 3, or DataFrame
            The field's components [field_unit]. Of a DataFrame also the angles. NaN where the
            readings hold NaN. One reading of m numbers gives 3. Of an instrument with fewer than three axes n x m, the component
            along each axis.

        Examples
        --------
        >>> import axiscal, numpy as np
        >>> cal = axiscal.load("cal.json")                     # doctest: +SKIP
        >>> cal.apply(np.array([[0.870, 0.0, 2.360]]))         # doctest: +SKIP
        """
        data = self._readings(readings)
        heat = np.empty((0, 1))
        if temperature is not None:
            heat = column(temperature, len(data), "temperature").astype(np.float64).reshape(-1, 1)
        result: Floats = self._record.apply(data, heat, force)
        if not is_frame(readings):
            return result[0] if np.ndim(readings) == 1 else result
        import pandas

        names = ["field_x", "field_y", "field_z"] if result.shape[1] == 3 else [f"field_{one}" for one in self.axes]
        frame = pandas.DataFrame(result, index=readings.index, columns=names)
        if result.shape[1] == 3 and len(self.axes) >= 3:
            for name, values in self._derived(data, None, force).items():
                frame[name] = values
        return frame

    def _derived(self, data: Floats, up: Optional[Floats], force: bool) -> Dict[str, Floats]:
        names, values = self._record.derived(data, up, force)
        return {name: values[:, index] for index, name in enumerate(names)}

    def angles(self, readings: Any, up: Any = None, force: bool = False) -> Dict[str, Floats]:
        """The angles of the instrument: pitch and roll, or heading.

        Parameters
        ----------
        readings : array_like, n x m, or DataFrame
            Readings [unit].
        up : array_like, n x 3, optional
            Direction up in the instrument's frame, for headings of a tilted magnetometer.

        Returns
        -------
        dict of ndarray, n
            "pitch_deg", "roll_deg", ... [degrees].
        """
        return self._derived(self._readings(readings), None if up is None else matrix(up, "up"), force)

    def summary(self, all: bool = False) -> str:
        """The summary that the command prints."""
        return self._record.summary(all)

    def to_dict(self) -> Dict[str, Any]:
        """The record as its JSON has it."""
        result: Dict[str, Any] = json.loads(self._record.json())
        return result

    @staticmethod
    def from_dict(record: Dict[str, Any]) -> "Calibration":
        """The calibration of a record, as :meth:`to_dict` gives it.

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
        return _from_json(json.dumps(record))

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
        self._record.write(os.fspath(path), force)

    def report(self, path: PathLike, readings: Optional[PathLike] = None, **options: Any) -> None:
        """Writes a report (.html) or a certificate (.pdf).

        Parameters
        ----------
        path : path
            File to write.
        readings : path, optional
            The readings' file, to show their values and times.
        **options
            Options of ``axiscal report``: laboratory, history, noise, ...

        Notes
        -----
        A report without further options is written by this module. Others need the program
        ``axiscal-report``.
        """
        if os.fspath(path).endswith((".html", ".htm")) and readings is None and not options:
            with open(path, "w", encoding="utf-8") as file:
                file.write(self._record.report())
            return
        from .programs import run_program

        with files() as at:
            arguments = ["report", at.of(self)]
            arguments += [] if readings is None else [os.fspath(readings)]
            run_program([*arguments, *arguments_of(options, at), "-o", os.fspath(path)])

    def export(self, format: str, path: Optional[PathLike] = None, **options: Any) -> Union[str, bytes]:
        """The calibration for other software.

        Parameters
        ----------
        format : str
            px4, ardupilot, kalibr, c-header, ros, ...; see :func:`axiscal.export_formats`.
        path : path, optional
            File to write too.
        **options
            Options of ``axiscal export``: lossy, name, numbers, ...

        Returns
        -------
        str or bytes
            The content of the file; bytes if it is no text.
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
        If the file is missing or no record.
    """
    name = os.fspath(path)
    return Calibration(_axiscal.Record.read(name))


def checked(calibration: Calibration, force: bool) -> Calibration:
    """The calibration, unless it was refused."""
    if calibration.status == "refused" and not force:
        warnings_ = calibration.warnings
        raise RefusedError(warnings_[0][1] if warnings_ else "the calibration was refused")
    return calibration


