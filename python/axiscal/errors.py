# SPDX-License-Identifier: Apache-2.0
"""Exceptions and warnings. They have the names of the C++ classes."""

from __future__ import annotations

import re
from typing import List, Sequence, Tuple

__all__ = [
    "CalibrationWarning",
    "DataError",
    "DomainError",
    "Error",
    "OutputError",
    "RankDeficientError",
    "RefusedError",
    "SetupError",
]


def _with_keywords(message: str) -> str:
    """Names options as keywords: ``--field-unit`` becomes ``field_unit``."""
    return re.sub(r"--([a-z][a-z0-9-]*)", lambda m: m.group(1).replace("-", "_"), message)


class Error(Exception):
    """Everything that Axiscal raises."""

    def __init__(self, message: str = "") -> None:
        super().__init__(_with_keywords(message))


class DomainError(Error, ValueError):
    """An argument outside its documented range."""


class SetupError(DomainError):
    """A set-up that is incomplete or contradicts itself."""


class DataError(Error, ValueError):
    """A file that is missing, unreadable or malformed. The message starts with the place."""


class OutputError(Error, OSError):
    """A result that could not be stored."""


class RefusedError(Error, ValueError):
    """The readings do not give a valid result."""


class RankDeficientError(RefusedError):
    """The design does not determine the parameters.

    Attributes
    ----------
    undetermined : list of str
        Names of the parameters that the readings do not determine.
    """

    undetermined: List[str] = []


class CalibrationWarning(UserWarning):
    """A warning of a calibration.

    Attributes
    ----------
    code : str
        The code of the warning, as in the record (docs/messages.md).
    runs : tuple of int
        Numbers of the readings concerned; may be empty.
    """

    def __init__(self, message: str, code: str = "other", runs: Sequence[int] = ()) -> None:
        super().__init__(message)
        self.code = code
        self.runs: Tuple[int, ...] = tuple(runs)
