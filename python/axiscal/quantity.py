# SPDX-License-Identifier: Apache-2.0
"""A number with its uncertainty."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

from . import _axiscal

__all__ = ["Quantity"]


@dataclass(frozen=True)
class Quantity:
    """One number of a result with its uncertainty.

    Attributes
    ----------
    value : float
        The estimate [unit].
    u : float
        Combined standard uncertainty [unit]; nan if it is unknown.
    U : float
        Expanded uncertainty, half the width of the 95 % interval [unit]; nan if it is unknown.
    k : float
        Coverage factor, U / u.
    dof : float
        Effective degrees of freedom.
    unit : str
        Unit of value, u and U.

    Examples
    --------
    >>> bias = Quantity(0.01196, 0.00011, 0.00027, 2.45, 6.0, "V")
    >>> float(bias)
    0.01196
    >>> print(bias)
    0.01196 +- 0.00027 V
    """

    value: float
    u: float
    U: float
    k: float
    dof: float
    unit: str

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        value, expanded = _axiscal.rounded(self.value, self.U)
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        return f"{value} +- {expanded}{unit}" if math.isfinite(self.U) else f"{value}{unit}"

    def to_uncertainties(self) -> Any:
        """The value as ``uncertainties.ufloat`` with its standard uncertainty."""
        from uncertainties import ufloat

        return ufloat(self.value, self.u)

    def to_pint(self, registry: Any = None) -> Any:
        """The value as a ``pint`` measurement.

        Parameters
        ----------
        registry : pint.UnitRegistry, optional
            Registry of the unit. The default is a new registry.
        """
        if registry is None:
            import pint

            registry = pint.UnitRegistry()
        unit = re.sub(r"\bg\b", "standard_gravity", self.unit)  # pint's g is the gram
        return registry.Quantity(self.value, unit).plus_minus(self.u)
