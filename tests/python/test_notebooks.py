# SPDX-License-Identifier: Apache-2.0
"""Runs every cell of each notebook in docs/notebooks."""

import glob
import json
import os
from pathlib import Path
from typing import Any

import pytest

from conftest import SOURCE

NOTEBOOKS = sorted(glob.glob(os.path.join(SOURCE, "docs", "notebooks", "*.ipynb")))


def test_there_are_notebooks() -> None:
    assert len(NOTEBOOKS) >= 6


@pytest.mark.parametrize("path", NOTEBOOKS, ids=os.path.basename)
@pytest.mark.filterwarnings("ignore")
def test_notebook_runs(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    for number, cell in enumerate(cells):
        exec(compile("".join(cell["source"]), f"{os.path.basename(path)}:{number}", "exec"), names)
