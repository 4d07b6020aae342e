# SPDX-License-Identifier: Apache-2.0
"""A laboratory's day in Python: calibrate, judge, reduce, export. Run it in the folder examples."""

from __future__ import annotations

import tempfile

import numpy as np

import axiscal as ax


def main() -> None:
    run = ax.read_run("run.csv")
    cal = ax.calibrate(run, instrument=ax.accelerometer("V", serial="QA-113"), field=ax.gravity())
    print(cal.summary())

    bias: ax.Quantity = cal["x.bias"]
    print(f"bias of x {bias}")

    fields = cal.apply(run.readings)
    lengths = np.linalg.norm(fields, axis=1)
    print(f"the field's length agrees within {1e6 * abs(lengths - 1.0).max():.0f} ppm")

    with tempfile.TemporaryDirectory() as folder:
        cal.save(f"{folder}/QA-113.json")
        cal.report(f"{folder}/QA-113.html")
        header = cal.export("c-header", name="probe")
        print(str(header).splitlines()[0])


if __name__ == "__main__":
    main()
