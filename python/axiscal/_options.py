# SPDX-License-Identifier: Apache-2.0
"""Converts keywords to options of the command, and runs subcommands within this process."""

from __future__ import annotations

import contextlib
import datetime
import decimal
import json
import os
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional

import numpy as np

from . import _axiscal
from ._messages import tell
from .arrays import columns_of, csv_of, is_frame, number
from .errors import DataError, DomainError, Error, OutputError, RefusedError

#: Options whose value is a file of JSON. A mapping is written to such a file.
_JSON_FILES = frozenset("limits positioner laboratory noise noise_log from_ from world kind history".split())

#: Options that would write files or print help. The functions return their results.
_OF_THE_COMMAND = frozenset("output o json help help_all h table print quiet jobs".split())


class Output(NamedTuple):
    """The exit status, output and messages of a subcommand."""

    status: int
    data: bytes
    messages: str

    @property
    def text(self) -> str:
        return self.data.decode("utf-8")

    def json(self) -> Any:
        """The output as JSON. Raises RefusedError with the messages if the output is empty."""
        if not self.data.strip():
            raise RefusedError(self.messages.strip() or "the command printed no result")
        return json.loads(self.data)


def option_value(value: Any, name: str = "option") -> str:
    """The value of an option as typed in a shell.

    Raises
    ------
    DomainError
        If an option cannot have a value of this type.
    """
    if isinstance(value, np.ndarray):
        return option_value(value.tolist(), name)
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, (datetime.datetime, datetime.date)):
        return value.isoformat()
    if isinstance(value, (np.datetime64, decimal.Decimal)):
        return str(value)
    if isinstance(value, Mapping):
        return ",".join(f"{key}={option_value(one, name)}" for key, one in value.items())
    if isinstance(value, (list, tuple)):
        of_lists = any(isinstance(one, (list, tuple, np.ndarray)) for one in value)
        return (";" if of_lists else ",").join(option_value(one, name) for one in value)
    if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool):
        return number(value)
    raise DomainError(f"{name}: a {type(value).__name__} cannot be the value of an option: {value!r}")


def plain(value: Any) -> Any:
    """A value as JSON can hold it: instruments, fields and numpy's types as mappings, lists, numbers."""
    members = getattr(value, "members", None)
    if members is not None:
        return members()
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise DomainError(f"a {type(value).__name__} cannot be a member of an experiment: {value!r}")


class Files:
    """A folder for the files that a subcommand reads; it exists until the subcommand has ended."""

    def __init__(self, folder: str) -> None:
        self.folder = folder
        self._count = 0

    def path(self, suffix: str = ".json") -> str:
        self._count += 1
        return os.path.join(self.folder, f"{self._count}{suffix}")

    def text(self, text: str, suffix: str = ".json", name: str = "") -> str:
        """The path of a file with this text."""
        path = os.path.join(self.folder, name) if name else self.path(suffix)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        return path

    def of(self, value: Any) -> Any:
        """The path of a file with the value: of a record, an experiment, a run or a table; other
        values unchanged."""
        if is_frame(value):
            return self.text(csv_of(columns_of(value)), ".csv")
        record = getattr(value, "_record", None)
        if record is not None:
            return self.text(record.json())
        document = getattr(value, "document", None)
        if document is not None:
            return self.text(json.dumps(document(), default=plain))
        table = getattr(value, "table", None)
        if table is not None:
            return self.text(csv_of(table()), ".csv")
        if isinstance(value, dict) and value and hasattr(next(iter(value.values())), "dtype"):
            return self.text(csv_of(columns_of(value)), ".csv")
        return value


@contextlib.contextmanager
def files() -> Iterator[Files]:
    import tempfile

    with tempfile.TemporaryDirectory(prefix="axiscal-") as folder:
        try:
            yield Files(folder)
        except Error as error:  # the user did not name these files
            error.args = tuple(str(one).replace(folder + os.sep, "") for one in error.args)
            raise


def positional(value: Any) -> str:
    """A path as an argument; it is never taken for an option or for standard input."""
    if not isinstance(value, (str, bytes, os.PathLike)):
        raise DomainError(f"expected a path, not {value!r:.80}")
    path: str = os.fsdecode(os.fspath(value))
    if "\0" in path:
        raise DomainError(f"a path cannot contain a NUL character: {path!a}")
    try:
        path.encode("utf-8")
    except UnicodeEncodeError as error:
        raise DataError(f"{path!a}: the name of the file is not UTF-8; rename the file") from error
    return os.path.join(".", path) if path.startswith("-") else path


def expanded(options: Mapping[str, Any]) -> Dict[str, Any]:
    """The options, with those that an instrument or a field stands for."""
    result: Dict[str, Any] = {}
    for name, value in options.items():
        own = getattr(value, "options", None)
        result.update(own() if callable(own) and name in ("instrument", "field") else {name: value})
    return result


def arguments_of(options: Mapping[str, Any], at: Optional[Files] = None) -> List[str]:
    """``{"field_unit": "g", "robust": True}`` becomes ``["--field-unit=g", "--robust"]``.

    Raises
    ------
    DomainError
        If an option has no meaning in Python, or a value of the wrong type.
    """
    arguments = []
    for name, value in expanded(options).items():
        if value is None or value is False or (isinstance(value, np.bool_) and not value):
            continue
        if name.rstrip("_") in _OF_THE_COMMAND:
            raise DomainError(f"{name}: this option writes files or prints text; the function returns its result")
        option = "--" + name.rstrip("_").replace("_", "-")
        if isinstance(value, (bool, np.bool_)):
            arguments.append(option)
            continue
        if at is not None:
            value = at.of(value)
            if isinstance(value, Mapping) and name in _JSON_FILES and (name != "world" or "format" in value):
                value = at.text(json.dumps(value, default=plain))
        arguments.append(f"{option}={option_value(value, name)}")
    return arguments


def run(arguments: List[str], warns: bool = True) -> Output:
    """Runs a subcommand within this process. Notes go to the logger ``axiscal``.

    Set ``warns`` to false if the record also contains the warnings. The caller then issues them from the record.
    """
    status, output, messages = _axiscal.run_subcommand(arguments)
    tell(messages, warns)
    return Output(status, output, messages)


def run_json(subcommand: str, *files_: Any, **options: Any) -> Any:
    """The JSON that a subcommand prints."""
    with files() as at:
        names = [str(at.of(one)) for one in files_]
        return run([subcommand, *names, *arguments_of(options, at), "--json"]).json()


def write(path: Any, content: bytes) -> None:
    """Writes a file.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    try:
        with open(path, "wb") as file:
            file.write(content)
    except OSError as error:
        raise OutputError(f"{os.fspath(path)}: cannot be written: {error.strerror}") from error
