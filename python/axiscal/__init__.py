# SPDX-License-Identifier: Apache-2.0
"""Calibration of axis-sensitive instruments in 12 orientations.

    import axiscal as ax

    cal = ax.calibrate(x, rest=rest, fence=fence, instrument=ax.accelerometer("V"), field=ax.gravity())
    cal["x.bias"]      # a Quantity: value, u, U, k, dof, unit
    cal.apply(x)       # components of the field, n x 3
    cal.save("cal.json")
"""

from . import _axiscal
from .arrays import Table
from .calibrating import (
    Experiment,
    Run,
    calibrate,
    calibrate_imu,
    calibrate_slots,
    calibrate_units,
    fit_magnitude,
    read_run,
)
from .calibration import Calibration, load
from .commands import (
    AllanDeviation,
    Series,
    allan,
    budget,
    characterize,
    check,
    export,
    export_formats,
    find_rests,
    history,
    import_,
    level,
    noise,
    noise_model,
    plan,
    read_log,
    report,
    simulate,
    site_field,
    study,
)
from .errors import (
    CalibrationWarning,
    DataError,
    DomainError,
    Error,
    OutputError,
    RankDeficientError,
    RefusedError,
    SetupError,
)
from .quantity import Quantity
from .setups import (
    Field,
    Instrument,
    accelerometer,
    custom,
    earth_rotation,
    generic,
    geomagnetic,
    gravity,
    gyroscope,
    inclinometer,
    induced_magnetic,
    induced_rotation,
    light,
    magnetometer,
    optical,
)

__version__: str = _axiscal.version.split()[-1]

__all__ = [
    "AllanDeviation",
    "Calibration",
    "CalibrationWarning",
    "DataError",
    "DomainError",
    "Error",
    "Experiment",
    "Field",
    "Instrument",
    "OutputError",
    "Quantity",
    "RankDeficientError",
    "RefusedError",
    "Run",
    "Series",
    "SetupError",
    "Table",
    "accelerometer",
    "allan",
    "budget",
    "calibrate",
    "calibrate_imu",
    "calibrate_slots",
    "calibrate_units",
    "characterize",
    "check",
    "custom",
    "earth_rotation",
    "export",
    "export_formats",
    "find_rests",
    "fit_magnitude",
    "generic",
    "geomagnetic",
    "gravity",
    "gyroscope",
    "history",
    "import_",
    "inclinometer",
    "induced_magnetic",
    "induced_rotation",
    "level",
    "light",
    "load",
    "magnetometer",
    "noise",
    "noise_model",
    "optical",
    "plan",
    "read_log",
    "read_run",
    "report",
    "simulate",
    "site_field",
    "study",
]
