# SPDX-License-Identifier: Apache-2.0
"""Keywords as options of the command, and subcommands within this process."""

from __future__ import annotations

import contextlib
import datetime
import json
import os
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional

import numpy as np

from . import _axiscal
from ._messages import tell
from .errors import RefusedError


class Output(NamedTuple):
    """What a subcommand wrote."""

    status: int
    data: bytes
    messages: str

    @property
    def text(self) -> str:
        return self.data.decode("utf-8")

    def json(self) -> Any:
        """Its JSON; an error that names the messages if there is none."""
        if not self.data.strip():
            raise RefusedError(self.messages.strip() or "the command printed no result")
        return json.loads(self.data)


def number(value: Any) -> str:
    """A number so that it reads back as the same number."""
    return repr(float(value)) if isinstance(value, (float, np.floating)) else str(int(value))


def option_value(value: Any) -> str:
    """The value of an option as typed in a shell."""
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, (datetime.datetime, datetime.date)):
        return value.isoformat()
    if isinstance(value, np.datetime64):
        return str(value)
    if isinstance(value, Mapping):
        return ",".join(f"{name}={option_value(one)}" for name, one in value.items())
    if isinstance(value, (list, tuple, np.ndarray)):
        return ",".join(option_value(one) for one in value)
    if isinstance(value, (int, float, np.integer, np.floating)):
        return number(value)
    raise TypeError(f"an option cannot be a {type(value).__name__}: {value!r}")


class Files:
    """A folder for the files that a subcommand reads; it exists until the subcommand has ended."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self._count = 0

    def path(self, suffix: str = ".json") -> str:
        self._count += 1
        return os.path.join(self.folder, f"{self._count}{suffix}")

    def of(self, value: Any) -> Any:
        """The path of a record or a mapping that is written there; other values unchanged."""
        record = getattr(value, "_record", None)
        if record is not None:
            path = self.path()
            with open(path, "w", encoding="utf-8") as file:
                file.write(record.json())
            return path
        return value


@contextlib.contextmanager
def files() -> Iterator[Files]:
    import tempfile

    with tempfile.TemporaryDirectory(prefix="axiscal-") as folder:
        yield Files(folder)


def arguments_of(options: Mapping[str, Any], at: Optional[Files] = None) -> List[str]:
    """``{"field_unit": "g", "robust": True}`` becomes ``["--field-unit=g", "--robust"]``."""
    arguments = []
    for name, value in options.items():
        if value is None or value is False:
            continue
        option = "--" + name.rstrip("_").replace("_", "-")
        if value is True:
            arguments.append(option)
            continue
        if at is not None:
            value = at.of(value)
        arguments.append(f"{option}={option_value(value)}")
    return arguments


def run(arguments: List[str], data: str = "", warns: bool = True) -> Output:
    """Runs a subcommand within this process. Notes go to the logger ``axiscal``.

    ``warns`` is false if the record holds the warnings too; they are then told once, from there.
    """
    status, output, messages = _axiscal.run_subcommand(arguments, data)
    tell(messages, warns)
    return Output(status, output, messages)


def run_json(subcommand: str, *files_: str, data: str = "", **options: Any) -> Any:
    """The JSON that a subcommand prints."""
    with files() as at:
        arguments = [subcommand, *[str(at.of(one)) for one in files_], *arguments_of(options, at), "--json"]
        return run(arguments, data).json()


def csv_of(columns: Dict[str, Any]) -> str:
    """Columns of one length as CSV; numbers read back as the same numbers."""
    names = list(columns)
    lines = [",".join(names)]
    for row in zip(*(columns[name] for name in names)):
        lines.append(",".join(one if isinstance(one, str) else "" if one != one else number(one) for one in row))
    return "\n".join(lines) + "\n"
