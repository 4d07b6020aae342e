# SPDX-License-Identifier: Apache-2.0
"""Runs the programs of Axiscal, for tasks that are not in this module."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import List

from .errors import DataError, Error, OutputError, RefusedError, SetupError

__all__ = ["program_path", "run_program"]


def program_path() -> str:
    """The path of the command ``axiscal``.

    It is taken from the environment variable AXISCAL, from the build of this module, or from PATH.

    Raises
    ------
    Error
        If the command is not found.
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
        If it fails: of the class that its exit status stands for, with its message.
    """
    done = subprocess.run([program_path(), *arguments], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        # The exit statuses of docs/messages.md.
        kinds = {1: RefusedError, 2: SetupError, 3: DataError, 4: OutputError}
        message = done.stderr.strip().removeprefix("axiscal: ").split("\n\n")[0]
        raise kinds.get(done.returncode, Error)(message or f"{arguments[0]}: exit status {done.returncode}")
    return done.stdout
