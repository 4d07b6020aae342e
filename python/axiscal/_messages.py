# SPDX-License-Identifier: Apache-2.0
"""Messages of the extension, as Python's warnings and logging take them."""

from __future__ import annotations

import logging
import re
import warnings

from .errors import CalibrationWarning

log = logging.getLogger("axiscal")


def tell(messages: str, warns: bool = True) -> None:
    """Passes on what a subcommand printed. Notes go to the logger ``axiscal``.

    ``warns`` is false if the record holds the warnings too; they are then told once, from there.
    """
    for paragraph in re.split(r"\n(?!\s)", messages.strip()):
        text = re.sub(r"\s*\n\s+", " ", paragraph)
        if text.startswith("note: "):
            log.info("%s", text[len("note: "):])
        elif text.startswith("warning: ") and warns:
            warnings.warn(CalibrationWarning(text[len("warning: "):]), stacklevel=5)
        elif text and warns:
            log.warning("%s", text)
