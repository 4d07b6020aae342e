# SPDX-License-Identifier: Apache-2.0
"""The programs of Axiscal, for what this module does not hold."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import List

from .errors import Error

__all__ = ["program_path", "run_program"]


def program_path() -> str:
    """The command ``axiscal``: of AXISCAL, of the build that this module is in, or of PATH.

    Raises
    ------
    Error
        If there is none.
    """
    here = os.path.dirname(os.path.abspath(__file__))
    build = os.path.join(os.path.dirname(os.path.dirname(here)), "cli", "axiscal")
    for path in (os.environ.get("AXISCAL", ""), build, shutil.which("axiscal") or ""):
        if path and os.access(path, os.X_OK):
            return path
    raise Error("the command 'axiscal' is missing; install the packages axiscal and axiscal-report")


def run_program(arguments: List[str]) -> str:
    """Runs the command. Returns its output.

    Raises
    ------
    Error
        If it fails; with its message.
    """
    done = subprocess.run([program_path(), *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise Error(done.stderr.strip() or f"axiscal {arguments[0]}: exit status {done.returncode}")
    return done.stdout
