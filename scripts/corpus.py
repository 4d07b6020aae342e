#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the command's output for about 300 simulated calibrations before and after a change of the code.

    scripts/corpus.py make AXISCAL FOLDER [--small]      writes all output to FOLDER; --small: only the cases of CI
    scripts/corpus.py compare BEFORE AFTER               prints the differences; the status is 1 if there are any
    scripts/corpus.py check AXISCAL PACKED               makes the cases of CI and compares them with PACKED

BEFORE may be a packed folder (.tar.xz).

Numbers in JSON must agree to 1e-12 of the largest entry of their array. Numbers of iterative fits must agree to 1e-6
of their standard error, all other numbers to one unit of the last printed digit. Texts must be equal except for times,
checksums and folders. Needs only Python's standard library. If AXISCAL_DATA_DIR is set, its recordings are added.
"""

import concurrent.futures
import io
import json
import math
import os
import re
import subprocess
import sys
import tarfile
import tempfile
import zipfile
from pathlib import Path

SITE = ["--latitude", "48.14", "--longitude", "11.58", "--height", "520", "--date", "2026-06-21"]
SMALL = {
    "simulate.accelerometer.12x1", "simulate.accelerometer.12x3", "simulate.accelerometer.6x2", "simulate.magnetometer.12x3", "simulate.magnetometer.24x1",
    "simulate.optical.24x1", "simulate.temperature1", "calibrate.paired.accelerometer.12x3", "calibrate.joint.accelerometer.12x1",
    "calibrate.known.accelerometer.12x1", "calibrate.joint.magnetometer.12x3", "calibrate.known.optical.24x1",
    "calibrate.magnitude_symmetric.magnetometer", "calibrate.temperature_2_joint", "calibrate.robust_joint", "calibrate.by_block_joint",
    "calibrate.slope_u", "calibrate.mistake_exchanged", "calibrate.mistake_outlier", "calibrate.refused", "calibrate.too_few",
    "budget.joint.accelerometer.12x1", "apply.uncertainty.joint.magnetometer.12x3", "export.c-header.temperature_2_joint", "check.temperature_2_joint",
    "level.accelerometer", "plan.12", "study.joint",
}
ITERATED = ("joint", "magnitude", "temperature", "robust", "polar", "slope_u", "characterize", "mistake", "assembly")


def record(kind, unit, field, field_unit, magnitude, size, axes=3, in_table=None, temperature=None):
    """Returns the record of a true instrument: sensitivities near `size`, cross-axis terms of a few per cent."""
    directions = [[1.02, 0.03, -0.02], [0.01, 0.97, 0.04], [-0.03, 0.02, 1.01], [0.6, 0.55, 0.58], [-0.6, 0.5, 0.62], [0.5, -0.6, 0.6]]
    truth = {
        "format": "axiscal-calibration",
        "version": 1,
        "instrument": {"kind": kind, "axes": list("xyzuvw"[:axes]), "unit": unit},
        "field": {"kind": field, "unit": field_unit, "magnitude": magnitude},
        "coefficients": {
            "bias": [0.01 * size * b for b in (1.0, -0.7, 0.4, 0.2, -0.3, 0.5)[:axes]],
            "sensitivity": [[size * s for s in row] for row in directions[:axes]],
        },
    }
    if in_table:
        truth["field"]["in_table"] = in_table
    return truth


TRUTHS = {
    "accelerometer": (record("accelerometer", "V", "gravity", "g", 1.0, 2.5), 1e-3, []),
    "accelerometer_si": (record("accelerometer", "1", "gravity", "m/s^2", 9.807, 1.0), 3e-3, ["--field-unit", "m/s^2", "--latitude", "48.14", "--height", "520"]),
    "inclinometer": (record("inclinometer", "V", "gravity", "g", 1.0, 5.0, axes=2), 1e-3, []),
    "one_axis": (record("accelerometer", "V", "gravity", "g", 1.0, 2.5, axes=1), 1e-3, []),
    "six_axes": (record("accelerometer", "V", "gravity", "g", 1.0, 2.5, axes=6), 1e-3, []),
    "magnetometer": (record("magnetometer", "nT", "geomagnetic", "nT", 48500.0, 1.0, in_table=[20900.0, -1800.0, -43700.0]), 30.0, SITE),
    "gyroscope": (record("gyroscope", "deg/s", "earth_rotation", "rad/s", 7.292115e-5, 57.29, in_table=[0.0, 4.87e-5, 5.43e-5]), 2e-5, SITE),
    "optical": (record("optical", "1", "light", "1", 1.0, 0.8, in_table=[0.48, 0.36, 0.8]), 1e-3, ["--field-table", "0.48,0.36,0.8"]),
    "generic": (record("generic", "mV", "custom", "1", 1.0, 4.0, in_table=[0.6, 0.0, 0.8]), 2e-3, ["--field-table", "0.6,0,0.8"]),
}
FIELDS = {name: truth[0]["field"]["kind"] for name, truth in TRUTHS.items()}


class Corpus:
    """The cases. Each is a call of the command; its output files, printed text and status are kept."""

    def __init__(self, program, folder):
        self.program = str(Path(program).resolve())
        self.folder = Path(folder)
        self.inputs = self.folder / "inputs"
        self.cases = []
        self.stages = []
        self.inputs.mkdir(parents=True, exist_ok=True)

    def add(self, name, *arguments, output=None):
        """Adds a case. {OUT} in the arguments stands for `output`. File names are relative to the folder."""
        self.cases.append((name, [str(a) for a in arguments], output))

    def end_stage(self):
        """Ends a stage. Cases of later stages may read the output of this stage."""
        self.stages.append(self.cases)
        self.cases = []

    def write(self, name, text):
        (self.inputs / name).write_text(text)
        return f"inputs/{name}"

    def run(self, case):
        name, arguments, output = case
        arguments = [a.replace("{OUT}", output or "") for a in arguments]
        done = subprocess.run([self.program, *arguments], cwd=self.folder, capture_output=True, timeout=600, check=False)
        words = f"$ axiscal {' '.join(arguments)}\nstatus {done.returncode}\n--- stdout\n".encode() + done.stdout + b"--- stderr\n" + done.stderr
        (self.folder / f"{name}.words").write_bytes(words)
        return name, done.returncode

    def make(self, only=None):
        made = 0
        for stage in [*self.stages, self.cases]:
            chosen = [case for case in stage if only is None or case[0] in only]
            with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
                made += len(list(pool.map(self.run, chosen)))
        return made


def fill(corpus):
    add = corpus.add
    for name, (truth, _, _) in TRUTHS.items():
        corpus.write(f"{name}.truth.json", json.dumps(truth))
    runs = {}
    for name, (_, noise, _) in TRUTHS.items():
        for design, replicates in (("12", 1), ("12", 3), ("24", 1), ("6", 2), ("optimal:10", 2)):
            run = f"{name}.{design.replace(':', '')}x{replicates}"
            runs.setdefault(name, []).append(run)
            slope = [] if design == "6" else ["--slope", "0.004,-0.0025"]
            add(f"simulate.{run}", "simulate", "--truth", f"inputs/{name}.truth.json", "--design", design, "--replicates", replicates,
                "--noise", noise, "--seed", 7, *slope, "-o", "{OUT}", output=f"{run}.csv")
    for order in (1, 2):
        add(f"simulate.temperature{order}", "simulate", "--truth", "inputs/accelerometer.truth.json", "--temperatures", "10,25,40",
            "--temperature-sd", "0.2", "--noise", "1e-3", "--seed", order, "-o", "{OUT}", output=f"temperature{order}.csv")
    parts = {
        "coil": ("magnetometer", "nT", ["geomagnetic", [20900.0, -1800.0, -43700.0], False, False], ["induced_magnetic", [0.0, 0.0, 60000.0], True, False], 30.0),
        "turntable": ("gyroscope", "deg/s", ["induced_rotation", [0.0, 0.0, 60.0], True, True], ["earth_rotation", [0.0, 2.8e-3, 3.1e-3], False, False], 1e-4),
    }
    for name, (kind, unit, first, second, noise) in parts.items():
        truth = record(kind, unit, f"{first[0]}+{second[0]}", unit, 1.0, 1.0)
        truth["field"]["parts"] = [{"kind": p[0], "magnitude": math.hypot(*p[1]), "in_table": p[1], "set_by_level": p[2], "turning": p[3]} for p in (first, second)]
        truth["field"]["in_table"] = [a + b for a, b in zip(first[1], second[1])]
        corpus.write(f"{name}.truth.json", json.dumps(truth))
        design = corpus.write(f"{name}.design.csv", "rest,fence,level\n" + "".join(f"{r},{f},{level}\n" for level in (1, -1, 0) for r, f in (
            ("-Z", "+X"), ("-Z", "-X"), ("+Z", "+X"), ("+Z", "-X"), ("-X", "+Y"), ("-X", "-Y"), ("+X", "+Y"), ("+X", "-Y"), ("-Y", "+Z"), ("-Y", "-Z"), ("+Y", "+Z"), ("+Y", "-Z"))))
        add(f"simulate.{name}", "simulate", "--truth", f"inputs/{name}.truth.json", "--design", design, "--noise", noise, "--seed", 5, "-o", "{OUT}", output=f"{name}.csv")
    corpus.end_stage()

    def calibrate(name, kind, run, *options):
        add(f"calibrate.{name}", "calibrate", *run, "--instrument", TRUTHS[kind][0]["instrument"]["kind"], "--axes",
            ",".join(TRUTHS[kind][0]["instrument"]["axes"]), "--field", FIELDS[kind], *TRUTHS[kind][2], *options, "--all", "--force", "-o", "{OUT}",
            output=f"{name}.record.json")

    for kind, names in runs.items():
        for run in names:
            for method in ("paired", "joint", "known"):
                calibrate(f"{method}.{run}", kind, [f"{run}.csv"], "--method", method)
    for kind in ("accelerometer", "magnetometer", "accelerometer_si"):
        for shape in ("symmetric", "triangular"):
            calibrate(f"magnitude_{shape}.{kind}", kind, [f"{kind}.24x1.csv"], "--method", "magnitude", "--shape", shape)
    long = ["accelerometer.12x3.csv"]
    for method in ("paired", "joint", "known"):
        calibrate(f"robust_{method}", "accelerometer", long, "--method", method, "--robust")
        calibrate(f"polar_{method}", "accelerometer", long, "--method", method, "--polar-fit")
        calibrate(f"leave_out_{method}", "accelerometer", long, "--method", method, "--leave-out", "3,17")
        for order in ("0", "1", "2", "auto"):
            calibrate(f"temperature_{order}_{method}", "accelerometer", ["temperature1.csv"], "--method", method, "--temperature-order", order)
    for method in ("paired", "joint"):
        calibrate(f"by_block_{method}", "accelerometer", long, "--method", method, "--level-by", "block")
    calibrate("slope_u", "accelerometer", long, "--method", "known", "--slope", "0.004,-0.0025", "--slope-u", "1e-4")
    calibrate("direction_slope_u", "magnetometer", ["magnetometer.12x3.csv"], "--method", "known", "--fence-azimuth", "10", "--direction-u", "1e-3")
    calibrate("resolution", "accelerometer", long, "--resolution", "0.001", "--temperature-u", "0.1")
    calibrate("unit", "accelerometer", long, "--unit", "V", "--serial", "A-17", "--convention", "frd", "--noise-ratio", "1,1,2")
    add("calibrate.refused", "calibrate", "accelerometer.6x2.csv", "--instrument", "accelerometer", "--field", "gravity", "--method", "known", "--slope", "0.3,0.2", "--all",
        "-o", "{OUT}", output="refused.record.json")
    calibrate("bias", "accelerometer", ["temperature1.csv"], "--method", "bias", "--temperature-order", "1")
    for method in ("joint", "known"):
        add(f"calibrate.coil_{method}", "calibrate", "coil.csv", "--instrument", "magnetometer", "--field", "geomagnetic+induced_magnetic", *SITE,
            "--field-table", "0,0,60000", "--fence-azimuth", "0", "--method", method, "--all", "--force", "-o", "{OUT}", output=f"coil_{method}.record.json")
        add(f"calibrate.turntable_{method}", "calibrate", "turntable.csv", "--instrument", "gyroscope", "--field", "induced_rotation+earth_rotation", *SITE,
            "--field-magnitude", "60", "--fence-azimuth", "0", "--method", method, "--all", "--force", "-o", "{OUT}", output=f"turntable_{method}.record.json")
    calibrate("too_few", "accelerometer", ["accelerometer.6x2.csv"], "--method", "paired", "--leave-out", "1,2,3,4")
    lines = (corpus.folder / "accelerometer.12x3.csv").read_text().splitlines() if (corpus.folder / "accelerometer.12x3.csv").exists() else []
    mistakes = {
        "exchanged": lambda rows: [rows[0], rows[1].rsplit(",", 3)[0] + "," + ",".join(rows[2].split(",")[-3:]), rows[2].rsplit(",", 3)[0] + "," + ",".join(rows[1].split(",")[-3:]), *rows[3:]],
        "outlier": lambda rows: [*rows[:5], rows[5].rsplit(",", 1)[0] + ",9.9", *rows[6:]],
        "half_a_file": lambda rows: rows[:19],
        "no_number": lambda rows: [*rows[:4], rows[4].rsplit(",", 1)[0] + ",abc", *rows[5:]],
        "empty": lambda rows: rows[:1],
    }
    for name, change in mistakes.items():
        if lines:
            path = corpus.write(f"mistake_{name}.csv", "\n".join(change(lines)) + "\n")
            calibrate(f"mistake_{name}", "accelerometer", [path])
            calibrate(f"mistake_{name}_accepted", "accelerometer", [path], "--accept-suggestion")
    corpus.end_stage()

    records = {name: f"{name}.record.json" for name in ("joint.accelerometer.12x1", "paired.accelerometer.12x3", "joint.magnetometer.12x3",
                                                        "joint.gyroscope.12x3", "known.optical.24x1", "joint.six_axes.12x3",
                                                        "temperature_2_joint", "magnitude_symmetric.magnetometer", "known.inclinometer.12x1")}
    formats = "ardupilot betaflight c-header cpp-header csv kalibr matlab numpy px4 ros x-io".split()
    for name, path in records.items():
        for form in formats:
            add(f"export.{form}.{name}", "export", path, "--format", form, "--lossy", "--force", "--reading-factor", "3.9", "-o", "{OUT}", output=f"{name}.{form}.out")
        add(f"budget.{name}", "budget", path, "--json")
        add(f"budget.words.{name}", "budget", path, "--pitch", 30, "--roll", 45)
        add(f"report.{name}", "report", path, "-o", "{OUT}", output=f"{name}.html")
        kind = next((k for k in TRUTHS if f".{k}." in f".{name}."), "accelerometer")
        readings = "temperature1.csv" if name.startswith("temperature") else f"{kind}.12x1.csv"
        for option in ([], ["--uncertainty"], ["--yaw-above", "60"]):
            add(f"apply.{'_'.join(option).strip('-') or 'plain'}.{name}", "apply", path, readings, *option)
        add(f"check.{name}", "check", path, f"{kind}.12x3.csv", "--json")
    add("check.records", "check", "joint.accelerometer.12x1.record.json", "joint.accelerometer.12x3.record.json")
    for kind in ("accelerometer", "inclinometer"):
        add(f"level.{kind}", "level", f"{kind}.12x1.csv", "--instrument", kind, "--axes", ",".join(TRUTHS[kind][0]["instrument"]["axes"]), "--field", "gravity", "--json")
    add("level.turns", "level", "paired.accelerometer.12x3.record.json", "--adjusters", "0,0;0.4,0;0,0.4", "--thread-pitch", "0.001")
    for design in ("6", "12", "24", "optimal:8"):
        add(f"plan.{design.replace(':', '')}", "plan", "--design", design, "--noise", "1e-3", "--seed", 3, "--json", "-o", "{OUT}", output=f"plan.{design.replace(':', '')}.csv")
    add("plan.angle", "plan", "--noise", "1e-4", "--want-angle-deg", "0.005", "--seed", 7)
    for method in ("paired", "joint", "known"):
        add(f"study.{method}", "study", "--truth", "inputs/accelerometer.truth.json", "--noise", "1e-3", "--trials", 60, "--method", method, "--json")
    add("study.regression", "study", "--truth", "inputs/accelerometer.truth.json", "--noise", "1e-3", "--trials", 2000, "--regression-only", "--json")
    add("characterize", "characterize", "--reference", "joint.accelerometer.12x3.record.json=accelerometer.12x3.csv", "--id", "cube", "-o", "{OUT}", output="cube.json")
    add("field", "field", *SITE, "--json")
    add("field.words", "field", *SITE)
    for command in ("", "field", "calibrate", "segment", "noise", "apply", "plan", "simulate", "level", "characterize", "check", "budget", "study", "export", "import", "report"):
        add(f"help.{command or 'axiscal'}", *([command] if command else []), "--help")
    data = os.environ.get("AXISCAL_DATA_DIR")
    for log in sorted(Path(data).rglob("*.csv"))[:20] if data else []:
        add(f"noise.{log.parent.name}.{log.stem}", "noise", log.resolve(), "--json")


# Comparing -----------------------------------------------------------------------------------------------------

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
CHANGING = [(re.compile(p), r) for p, r in (
    (r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(?:\.\d+)?Z", "TIME"),
    (r"\b[0-9a-f]{64}\b", "SHA256"),
    (r"/\S*/(?=[^/\s]+\b)", "FOLDER/"),
)]


def without_changing(text):
    for pattern, name in CHANGING:
        text = pattern.sub(name, text)
    return text


def flat(value, path=""):
    """Yields the leaves of a JSON value as (path, leaf, largest magnitude in its array)."""
    if isinstance(value, dict):
        for key, member in value.items():
            yield from flat(member, f"{path}/{key}")
    elif isinstance(value, list):
        largest = max((abs(n) for n in numbers(value)), default=0.0)
        for i, member in enumerate(value):
            for at, leaf, own in flat(member, f"{path}[{i}]"):
                yield at, leaf, max(own, largest if all_numbers(value) else 0.0)
    else:
        yield path, value, abs(value) if is_number(value) else 0.0


# A standard deviation below this value, of a coefficient near 1, is a rounding error of zero.
ROUNDING = 1e-17


def is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def numbers(value):
    if isinstance(value, list):
        for member in value:
            yield from numbers(member)
    elif is_number(value):
        yield value


def all_numbers(value):
    return all(all_numbers(v) if isinstance(v, list) else is_number(v) or v is None for v in value)


def standard_errors(document):
    """Returns the standard errors of a record's coefficients by the path of the coefficient."""
    errors = document.get("statistics", {}).get("standard_error", {}) if isinstance(document, dict) else {}
    return {at: leaf for at, leaf, _ in flat(errors, "/coefficients") if is_number(leaf)}


def differences_of_json(before, after, iterated):
    errors = standard_errors(before)
    old = {at: (leaf, size) for at, leaf, size in flat(before)}
    new = {at: leaf for at, leaf, _ in flat(after)}
    for at in sorted(old.keys() ^ new.keys()):
        yield f"{at}: only {'before' if at in old else 'after'}"
    for at in old.keys() & new.keys():
        (a, size), b = old[at], new[at]
        if is_number(a) and is_number(b):
            allowed = 1e-6 * errors.get(at, size) if iterated else 1e-12 * size
            if "/covariance[" in at:
                allowed = max(allowed, ROUNDING**2)
            if "/field_size/by_" in at:  # relative uncertainties, which may be zero
                allowed = max(allowed, ROUNDING)
            if not (a == b or abs(a - b) <= allowed or (math.isnan(a) and math.isnan(b))):
                yield f"{at}: {a!r} became {b!r}, {abs(a - b) / max(allowed, 5e-324):.2g} times what is allowed"
        elif (without_changing(a) if isinstance(a, str) else a) != (without_changing(b) if isinstance(b, str) else b):
            yield from differences_of_text(a, b, at) if isinstance(a, str) and isinstance(b, str) else [f"{at}: {a!r} became {b!r}"]


def last_digit(text):
    mantissa, _, exponent = text.lower().partition("e")
    return 10.0 ** ((int(exponent) if exponent else 0) - len(mantissa.partition(".")[2]))


def differences_of_text(before, after, where):
    old, new = without_changing(before).splitlines(), without_changing(after).splitlines()
    if len(old) != len(new):
        yield f"{where}: {len(old)} lines became {len(new)}"
    for number, (a, b) in enumerate(zip(old, new), 1):
        if a == b:
            continue
        if NUMBER.sub("#", a) != NUMBER.sub("#", b):
            yield f"{where}:{number}: '{a[:120]}' became '{b[:120]}'"
            continue
        for x, y in zip(NUMBER.findall(a), NUMBER.findall(b)):
            allowed = max(1.01 * last_digit(x), 1.01 * last_digit(y), 1e-12 * abs(float(x)))
            if abs(float(x) - float(y)) > (allowed if len(x) < 12 else 1e-9 * abs(float(x)) + 1e-15):
                yield f"{where}:{number}: {x} became {y}"


def parsed(text):
    try:
        return json.loads(text)
    except ValueError:
        return None


def differences(before, after, name):
    if before.startswith(b"PK") and after.startswith(b"PK"):
        members = [{m: packed.read(m) for m in packed.namelist()} for packed in (zipfile.ZipFile(io.BytesIO(x)) for x in (before, after))]
        for member in sorted(members[0].keys() | members[1].keys()):
            yield from differences(members[0].get(member, b""), members[1].get(member, b""), f"{name}/{member}")
        return
    try:
        old, new = before.decode(), after.decode()
    except UnicodeDecodeError:
        # Binary files contain texts with one, two or four bytes per character.
        if len({without_changing(x.replace(b"\0", b"").decode("latin-1")) for x in (before, after)}) > 1:
            yield f"{name}: {len(before)} bytes differ"
        return
    iterated = any(word in name for word in ITERATED)
    if name.endswith(".words"):
        # The printed output may be JSON.
        parts = [re.split(r"^--- std(?:out|err)\n", text, flags=re.M) for text in (old, new)]
        pairs = zip(*parts) if len(parts[0]) == len(parts[1]) else [(old, new)]
    else:
        pairs = [(old, new)]
    for a, b in pairs:
        documents = parsed(a), parsed(b)
        if isinstance(documents[0], (dict, list)) and documents[1] is not None:
            yield from (f"{name}{d}" for d in differences_of_json(*documents, iterated))
        else:
            yield from differences_of_text(a, b, name)


def compare(before, after):
    before, after = Path(before), Path(after)
    if before.is_file():
        with tempfile.TemporaryDirectory() as folder, tarfile.open(before) as packed:
            packed.extractall(folder)
            return compare(folder, after)
    names = [sorted(p.relative_to(folder).as_posix() for p in folder.rglob("*") if p.is_file()) for folder in (before, after)]
    found = [f"{name}: only {'before' if name in names[0] else 'after'}" for name in sorted(set(names[0]) ^ set(names[1]))]
    for name in sorted(set(names[0]) & set(names[1])):
        old, new = (before / name).read_bytes(), (after / name).read_bytes()
        if old != new:
            found += differences(old, new, name)
    for line in found[:200]:
        print(line)
    if len(found) > 200:
        print(f"... and {len(found) - 200} more")
    print(f"corpus.py: {len(names[0])} files, {len(found)} differences")
    return 1 if found or not names[0] else 0


def make(program, folder, only):
    # First makes the simulated runs, because fill() reads one of them to make the cases with mistakes.
    first = Corpus(program, folder)
    fill(first)
    first.stages = first.stages[:1]
    first.cases = []
    first.make(only)
    corpus = Corpus(program, folder)
    fill(corpus)
    print(f"corpus.py: {corpus.make(only)} calls")


def main(arguments):
    if arguments[:1] == ["compare"] and len(arguments) == 3:
        return compare(*arguments[1:])
    if arguments[:1] == ["make"] and len(arguments) in (3, 4) and arguments[3:] in ([], ["--small"]):
        make(arguments[1], arguments[2], SMALL if arguments[3:] else None)
        return 0
    if arguments[:1] == ["check"] and len(arguments) == 3:
        with tempfile.TemporaryDirectory() as folder:
            make(arguments[1], folder, SMALL)
            return compare(arguments[2], folder)
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
