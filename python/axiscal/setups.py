# SPDX-License-Identifier: Apache-2.0
"""Instruments and fields, and the options of ``axiscal calibrate`` that describe them."""

from __future__ import annotations

from typing import Any, Dict, Optional, Sequence

from .errors import SetupError

__all__ = [
    "Field",
    "Instrument",
    "accelerometer",
    "custom",
    "earth_rotation",
    "generic",
    "geomagnetic",
    "gravity",
    "gyroscope",
    "inclinometer",
    "induced_magnetic",
    "induced_rotation",
    "light",
    "magnetometer",
    "optical",
]


class Instrument:
    """The instrument that is calibrated.

    Parameters
    ----------
    kind : str
        accelerometer, inclinometer, magnetometer, gyroscope, optical or generic.
    unit : str
        Unit of the readings.
    **options
        Further options of the instrument: serial, model, axes, range, one_sided, resolution, ...

    Notes
    -----
    An instrument of your own is a subclass that sets ``kind`` to the path of a file
    ``axiscal-kind`` (JSON), or overrides :meth:`options`.
    """

    kind: str = "generic"

    def __init__(self, kind: Optional[str] = None, unit: str = "1", **options: Any) -> None:
        if kind is not None:
            self.kind = kind
        self.unit = unit
        self.more = dict(options)

    def options(self) -> Dict[str, Any]:
        """The options of ``axiscal calibrate`` for this instrument."""
        return {"instrument": self.kind, "unit": self.unit, **self.more}

    def members(self) -> Dict[str, Any]:
        """The members of an experiment's ``instrument`` (JSON)."""
        options = self.options()
        return {"kind": options.pop("instrument"), **options}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Instrument) and self.options() == other.options()

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Instrument({self.kind!r}, {self.unit!r})"


class Field:
    """The reference field.

    Parameters
    ----------
    kind : str
        gravity, geomagnetic, earth_rotation, induced_rotation, induced_magnetic, light or custom.
    unit, magnitude, magnitude_u, vector
        Unit, magnitude, its standard uncertainty, and the field in the table's frame.
    **options
        Further options of the field: latitude, longitude, height, date, ...

    Notes
    -----
    A field of your own is a subclass that overrides :meth:`in_table`. If its result is n x 3, it is
    the field in the instrument's frame at each of n readings.

    Examples
    --------
    >>> class Coil(Field):
    ...     def in_table(self):
    ...         return (0.0, 0.0, 50.0)
    >>> Coil("custom", unit="uT").options()["field_table"]
    (0.0, 0.0, 50.0)
    """

    kind: str = "custom"

    def __init__(
        self,
        kind: Optional[str] = None,
        unit: Optional[str] = None,
        magnitude: Optional[float] = None,
        magnitude_u: Optional[float] = None,
        vector: Optional[Sequence[float]] = None,
        **options: Any,
    ) -> None:
        if kind is not None:
            self.kind = kind
        self.unit = unit
        self.magnitude = magnitude
        self.magnitude_u = magnitude_u
        self.vector = vector
        self.more = dict(options)

    def in_table(self) -> Any:
        """The field in the table's frame, 3 numbers [unit]; None if the kind computes it."""
        return self.vector

    def options(self) -> Dict[str, Any]:
        """The options of ``axiscal calibrate`` for this field."""
        stated = {
            "field": self.kind,
            "field_unit": self.unit,
            "field_magnitude": self.magnitude,
            "field_magnitude_u": self.magnitude_u,
            "field_table": self.in_table(),
            **self.more,
        }
        return {name: value for name, value in stated.items() if value is not None}

    def members(self) -> Dict[str, Any]:
        """The members of an experiment's ``field`` (JSON)."""
        names = {"field": "kind", "field_unit": "unit", "field_magnitude": "magnitude",
                 "field_magnitude_u": "magnitude_u", "field_table": "in_table"}  # fmt: skip
        options = self.options()
        others = sorted(set(options) - set(names))
        if others:
            raise SetupError(f"{others[0]}: give it as a member of the experiment, for example site={{...}}")
        return {names[name]: value for name, value in options.items()}

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Field) and str(self.options()) == str(other.options())

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"Field({self.kind!r})"


def accelerometer(unit: str = "1", **options: Any) -> Instrument:
    """An accelerometer whose readings are in ``unit``."""
    return Instrument("accelerometer", unit, **options)


def inclinometer(unit: str = "1", **options: Any) -> Instrument:
    """An inclinometer whose readings are in ``unit``."""
    return Instrument("inclinometer", unit, **options)


def magnetometer(unit: str = "1", **options: Any) -> Instrument:
    """A magnetometer whose readings are in ``unit``."""
    return Instrument("magnetometer", unit, **options)


def gyroscope(unit: str = "1", **options: Any) -> Instrument:
    """A gyroscope whose readings are in ``unit``."""
    return Instrument("gyroscope", unit, **options)


def optical(unit: str = "1", **options: Any) -> Instrument:
    """A light or sun sensor whose readings are in ``unit``."""
    return Instrument("optical", unit, **options)


def generic(unit: str = "1", **options: Any) -> Instrument:
    """Any other instrument whose response is linear in the components of a field."""
    return Instrument("generic", unit, **options)


def gravity(**options: Any) -> Field:
    """Gravity, 1 g, or in m/s^2 with ``unit="m/s^2"`` and a ``latitude``."""
    return Field("gravity", **options)


def geomagnetic(**options: Any) -> Field:
    """The geomagnetic field: by latitude, longitude and date, or by its magnitude."""
    return Field("geomagnetic", **options)


def earth_rotation(**options: Any) -> Field:
    """Earth's rotation at a latitude."""
    return Field("earth_rotation", **options)


def induced_rotation(**options: Any) -> Field:
    """The rotation of a rate table."""
    return Field("induced_rotation", **options)


def induced_magnetic(**options: Any) -> Field:
    """The field of a coil."""
    return Field("induced_magnetic", **options)


def light(**options: Any) -> Field:
    """The direction to a lamp, or to the sun."""
    return Field("light", **options)


def custom(vector: Optional[Sequence[float]] = None, unit: str = "1", **options: Any) -> Field:
    """A field that is stated as a vector in the table's frame [unit]."""
    return Field("custom", unit=unit, vector=vector, **options)
