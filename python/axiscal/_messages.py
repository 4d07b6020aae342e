# SPDX-License-Identifier: Apache-2.0
"""Converts the messages of the extension to Python warnings and log entries."""

from __future__ import annotations

import logging
import os
import re
import sys
import warnings
from typing import Sequence

from .errors import CalibrationWarning

log = logging.getLogger("axiscal")

_HERE = os.path.dirname(os.path.abspath(__file__))


def warn(message: str, code: str = "other", runs: Sequence[int] = ()) -> None:
    """Warns at the line of the user's code that called this package."""
    level = 1
    frame = sys._getframe(0)
    while frame.f_back is not None and os.path.dirname(os.path.abspath(frame.f_code.co_filename)) == _HERE:
        frame = frame.f_back
        level += 1
    warnings.warn(CalibrationWarning(message, code, runs), stacklevel=level)


def tell(messages: str, warns: bool = True) -> None:
    """Passes on the messages of a subcommand. Notes go to the logger ``axiscal``.

    Set ``warns`` to false if the record also contains the warnings. The caller then issues them from the record.
    """
    for paragraph in re.split(r"\n(?!\s)", messages.strip()):
        text = re.sub(r"\s*\n\s+", " ", paragraph)
        if text.startswith("note: "):
            log.info("%s", text[len("note: "):])
        elif text.startswith("warning: ") and warns:
            warn(text[len("warning: "):])
        elif text.startswith("axiscal: ") and warns:
            warn(text[len("axiscal: "):])
        elif text and warns:
            log.info("%s", text)
