#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""commands.py check|list AXISCAL [PATTERN]: checks that all commands that Axiscal documents or prints can be run.

Documented commands are those in README.md and docs/**/*.md (in code blocks and between backticks), and the examples of
each `axiscal SUBCOMMAND --help`. Printed commands are those that `axiscal log` suggests for a file of each kind, and
those that these commands suggest in turn ("certificate: axiscal report ..", "again: ..").

This script makes small versions of all files that the commands name. Each command runs in a new folder with copies of
these files. A pseudo-terminal replaces a serial port, and a server of this script replaces `tcp://logger:4000`. A
command that waits for its instrument, its browser or more lines passes if it waits without an error message.

A usage pattern contains "..", "|" between spaces, or a word in capitals (FILE, SUBCOMMAND). `list` prints usage
patterns too, but they are not run. PATTERN is a regular expression that chooses commands."""
import contextlib
import glob
import io
import math
import os
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import tty
import zipfile

SOURCE = os.environ.get("AXISCAL_SOURCE_DIR", os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
# scripts/tutorials.py runs the commands in these blocks, so they are left out here.
TUTORIALS = re.compile(r"```console\n.*?```", re.S)
SUBCOMMANDS = set()
G = 9.80665


# ---------------------------------------------------------------- finding the commands

def is_form(command):
    """Whether the text is a usage pattern and not a command to run."""
    words = re.sub(r"'[^']*'|\"[^\"]*\"", "Q", command)
    return ("..." in words or " .. " in words + " " or re.search(r" \| (?!axiscal|tail|head|cut)", words) is not None
            or re.search(r"(?:^|\s|=)[A-Z]{3,}\b(?![.\d])", words) is not None)


def is_name(command):
    """Whether the text only names a subcommand, for example `axiscal level` in a sentence."""
    return len(command.split()) < 3


def joined_lines(lines):
    """Returns the commands of a code block. Lines that end with a backslash are joined with the next line."""
    commands = []
    goes_on = False
    for line in lines:
        line = line.strip()
        if goes_on:
            commands[-1] = commands[-1][:-1].rstrip() + " " + line
        elif re.match(r"(\$ )?(tail [^|]+\| )?axiscal [a-z]+( |$)", line):
            commands.append(line.removeprefix("$ "))
        else:
            continue
        goes_on = commands[-1].endswith("\\")
    return [re.split(r"\s{2,}#|\s#\s", command)[0].strip() for command in commands]


def commands_of_page(path):
    with open(path, encoding="utf-8") as file:
        text = file.read()
    if "/tutorials/" in path:
        text = TUTORIALS.sub("", text)
    found = []
    blocks = re.compile(r"```[a-z]*\n(.*?)```|(?:^|\n)((?:    [^\n]*\n)+)", re.S)
    for match in blocks.finditer(text):
        found += joined_lines((match.group(1) or match.group(2)).splitlines())
    for span in re.findall(r"`([^`]+)`", blocks.sub("\n", text)):
        span = " ".join(span.split())
        if re.match(r"(tail [^|]+\| )?axiscal [a-z]+( |$)", span) and not is_name(span):
            found.append(span)
    return found


def documented(axiscal):
    """Returns (place, command) of all documented commands. Each command occurs once."""
    pages = [os.path.join(SOURCE, "README.md")]
    pages += sorted(glob.glob(os.path.join(SOURCE, "docs", "**", "*.md"), recursive=True))
    all_of_them = []
    for page in pages:
        all_of_them += [(os.path.relpath(page, SOURCE), command) for command in commands_of_page(page)]
    for name in sorted(SUBCOMMANDS):
        text = subprocess.run([axiscal, name, "--help"], capture_output=True, text=True, check=True).stdout
        all_of_them += [(f"axiscal {name} --help", command) for command in joined_lines(text.splitlines())]
    once = {}
    for where, command in all_of_them:
        once.setdefault(command, where)
    return [(where, command) for command, where in once.items()]


def printed_in(text):
    """Returns the commands that a printed text suggests: at the end of a line, after a colon."""
    found = re.findall(r"^[\w ,;()-]*: (axiscal [a-z]+\b.*)$", text, re.M)
    return [command for command in found if command.split()[1] in SUBCOMMANDS]


# ---------------------------------------------------------------- the reader's own files

def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def times(m, v):
    return [dot(row, v) for row in m]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transposed(m):
    return [list(row) for row in zip(*m)]


def turn(axis, angle):
    """Returns the matrix that rotates vectors by `angle` [rad] about the unit vector `axis`."""
    c, s = math.cos(angle), math.sin(angle)
    x, y, z = axis
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]


def axis_angle(m):
    angle = math.acos(max(-1.0, min(1.0, (m[0][0] + m[1][1] + m[2][2] - 1) / 2)))
    if angle < 1e-9:
        return [0.0, 0.0, 1.0], 0.0
    if angle > math.pi - 1e-6:
        k = max(range(3), key=lambda i: m[i][i])
        v = [m[k][j] + (1.0 if j == k else 0.0) for j in range(3)]
    else:
        v = [m[2][1] - m[1][2], m[0][2] - m[2][0], m[1][0] - m[0][1]]
    length = math.sqrt(dot(v, v))
    return [x / length for x in v], angle


FACES = {sign + axis: [(1 if sign == "+" else -1) * float("XYZ"[i] == axis) for i in range(3)]
         for axis in "XYZ" for sign in "+-"}


def of_seat(rest, fence):
    """Returns the rotation from table to body. The face `rest` points down, the face `fence` at the fence."""
    up = [-x for x in FACES[rest]]
    ahead = FACES[fence]
    return transposed([cross(ahead, up), ahead, up])


def any_attitude(rng):
    axis = [rng.gauss(0, 1) for _ in range(3)]
    length = math.sqrt(dot(axis, axis))
    return turn([x / length for x in axis], rng.uniform(0, math.pi))


def imu_samples(attitudes, rng, rest_s=4.0, turn_s=1.5, rate=100.0):
    """time, accelerometer [m/s^2], gyroscope [rad/s], magnetometer [uT] of rests and smooth turns."""
    field = [0.0, 21.0, -43.0]
    samples = []
    now = 0.0

    def take(body, rates):
        nonlocal now
        a = [s * G * v + b + 0.004 * rng.gauss(0, 1)
             for s, v, b in zip((1.004, 0.997, 1.002), times(body, [0, 0, 1]), (0.12, -0.07, 0.2))]
        w = [v + b + 0.001 * rng.gauss(0, 1) for v, b in zip(rates, (0.003, -0.002, 0.001))]
        m = [s * v + b + 0.1 * rng.gauss(0, 1)
             for s, v, b in zip((1.02, 0.98, 1.0), times(body, field), (3.0, -7.0, 12.0))]
        samples.append((now, a, w, m))
        now += 1.0 / rate

    for k, body in enumerate(attitudes):
        for _ in range(int(rest_s * rate)):
            take(body, [0.0, 0.0, 0.0])
        if k + 1 == len(attitudes):
            break
        # The axis of the turn is constant: its coordinates in the body are the same before and after the turn.
        axis, angle = axis_angle(product(attitudes[k + 1], transposed(body)))
        steps = int(turn_s * rate)
        for i in range(steps):
            part = (i + 0.5) / steps
            at = angle * (part - math.sin(2 * math.pi * part) / (2 * math.pi))
            speed = angle / turn_s * (1 - math.cos(2 * math.pi * part))
            # In body coordinates a vector fixed to the table turns by +at, so the body turns by -at.
            take(product(turn(axis, at), body), [-speed * x for x in axis])
    return samples


def text_of(samples, header, columns):
    lines = [header]
    for sample in samples:
        lines.append(",".join(f"{v:.6f}" for v in columns(*sample)))
    return "\n".join(lines) + "\n"


def ulog(samples, instances=2, sensors=("accel", "gyro", "mag")):
    """Returns a PX4 log (ULog format, see docs.px4.io) with `instances` of each sensor's message."""
    def message(kind, data):
        return struct.pack("<HB", len(data), ord(kind)) + data
    out = bytearray(b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0))
    out += message("B", bytes(40))
    fields = "uint64_t timestamp;uint64_t timestamp_sample;uint32_t device_id;float x;float y;float z;"
    for name in sensors:
        out += message("F", f"sensor_{name}:{fields}".encode())
    ids = {}
    for name in sensors:
        for instance in range(instances):
            ids[name, instance] = len(ids)
            out += message("A", struct.pack("<BH", instance, ids[name, instance]) + f"sensor_{name}".encode())
    place = {"accel": 1, "gyro": 2, "mag": 3}
    for sample in samples:
        us = int(sample[0] * 1e6) + 1000
        for (name, instance), number in ids.items():
            v = sample[place[name]]
            if name == "mag":
                v = [x / 100 for x in v]  # gauss
            v = [x * (1 + 0.01 * instance) for x in v]
            out += message("D", struct.pack("<HQQI3f", number, us, us, 1310988 + 8 * instance + number, *v))
    return bytes(out)


IMU_DEFINITION = """std_msgs/Header header
geometry_msgs/Quaternion orientation
float64[9] orientation_covariance
geometry_msgs/Vector3 angular_velocity
float64[9] angular_velocity_covariance
geometry_msgs/Vector3 linear_acceleration
float64[9] linear_acceleration_covariance
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""


def imu_message(number, sample):
    now = 1700000000.0 + sample[0]
    head = struct.pack("<III", number, int(now), int((now % 1) * 1e9)) + struct.pack("<I", 3) + b"imu"
    zeros = [0.0] * 9
    return head + struct.pack("<37d", 0, 0, 0, 1, *zeros, *sample[2], *zeros, *sample[1], *zeros)


def rosbag(samples):
    def fields(**values):
        out = b""
        for name, value in values.items():
            out += struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
        return out

    def record(head, data):
        return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data
    connection = record(fields(op=b"\x07", conn=struct.pack("<I", 0), topic=b"/imu"),
                        fields(topic=b"/imu", type=b"sensor_msgs/Imu", md5sum=b"6a62c6daae103f4ff57a132d6f95cec2",
                               message_definition=IMU_DEFINITION.encode()))
    body = bytearray(connection)
    for number, sample in enumerate(samples):
        now = 1700000000.0 + sample[0]
        body += record(fields(op=b"\x02", conn=struct.pack("<I", 0),
                              time=struct.pack("<II", int(now), int((now % 1) * 1e9))), imu_message(number, sample))
    head = fields(op=b"\x03", index_pos=struct.pack("<Q", 0), conn_count=struct.pack("<I", 1),
                  chunk_count=struct.pack("<I", 1))
    bag = b"#ROSBAG V2.0\n" + record(head, b" " * (4096 - len(head) - 8))
    return bag + record(fields(op=b"\x05", compression=b"none", size=struct.pack("<I", len(body))), body)


def mcap(samples):
    def text(value):
        return struct.pack("<I", len(value)) + value

    def record(op, data):
        return struct.pack("<BQ", op, len(data)) + data
    magic = b"\x89MCAP0\r\n"
    out = bytearray(magic + record(1, text(b"ros1") + text(b"")))
    out += record(3, struct.pack("<H", 1) + text(b"sensor_msgs/Imu") + text(b"ros1msg") + text(IMU_DEFINITION.encode()))
    out += record(4, struct.pack("<HH", 0, 1) + text(b"/imu") + text(b"ros1") + struct.pack("<I", 0))
    for number, sample in enumerate(samples):
        ns = 1700000000000000000 + int(sample[0] * 1e9)
        out += record(5, struct.pack("<HIQQ", 0, number, ns, ns) + imu_message(number, sample))
    return bytes(out + record(15, struct.pack("<I", 0)) + record(2, struct.pack("<QQI", 0, 0, 0)) + magic)


def xlsx(rows):
    def cell(value):
        try:
            return f"<c><v>{float(value)!r}</v></c>"
        except ValueError:
            return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
    sheet = "".join("<row>" + "".join(map(cell, row)) + "</row>" for row in rows)
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    types = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    files = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types">'
        '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{types}.sheet.main+xml"/>'
        f'<Override PartName="/xl/worksheets/sheet1.xml" ContentType="{types}.worksheet+xml"/></Types>',
        "_rels/.rels": f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
        f'Type="{office}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>'
        '<sheet name="run" sheetId="1" r:id="r1"/></sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{package}/relationships"><Relationship Id="r1" '
        f'Type="{office}/worksheet" Target="worksheets/sheet1.xml"/></Relationships>',
        "xl/worksheets/sheet1.xml": f'<worksheet xmlns="{main}"><sheetData>{sheet}</sheetData></worksheet>'}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        for name, content in files.items():
            file.writestr(name, '<?xml version="1.0" encoding="UTF-8"?>' + content)
    return packed.getvalue()


def zipped(files):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as file:
        for name, content in files.items():
            file.writestr(name, content)
    return packed.getvalue()


class Desk:
    """A folder with all files that the documented commands name."""

    def __init__(self, axiscal, folder):
        self.axiscal, self.folder = axiscal, folder
        self.failed = []
        os.makedirs(folder)
        self.write_raw()
        self.derive()

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())

    def make(self, command):
        done = shell(command, self.folder, self.axiscal)
        if done.status not in (0, 1):
            self.failed.append(f"{command}: {done.status}: {done.err}")

    def write_raw(self):
        rng = random.Random(7)
        for name in ("run.csv",):
            shutil.copy(os.path.join(SOURCE, "examples", name), self.path(name))
        os.symlink(os.path.join(SOURCE, "examples"), self.path("examples"))
        experiments = os.path.join(SOURCE, "examples", "experiments")
        for name, of in (("magnetometer.csv", "own/magnetometer.csv"), ("lamp.csv", "own/lamp.csv"),
                         ("body.csv", "own/body.csv"), ("body.attitudes.csv", "attitudes.csv")):
            os.makedirs(self.path("own"), exist_ok=True)
            shutil.copy(os.path.join(experiments, name), self.path(of))
        with open(self.path("own/magnetometer.csv"), encoding="utf-8") as file:  # in nT
            rows = [line.split(",") for line in file.read().splitlines()]
        axes = [rows[0].index(axis) for axis in "xyz"]
        self.write("own/magnetometer_uT.csv", "\n".join(
            ",".join(f"{float(cell) / 1000:.6f}" if number and i in axes else cell for i, cell in enumerate(row))
            for number, row in enumerate(rows)) + "\n")
        # A compass turned through all directions [uT].
        turned = [(0.02 * i, [0] * 3, [0] * 3,
                   [s * v + b + 0.1 * rng.gauss(0, 1) for s, v, b in
                    zip((1.02, 0.98, 1.0), times(any_attitude(rng), [0, 21.0, -43.0]), (3.0, -7.0, 12.0))])
                  for i in range(600)]
        self.write("mag.csv", text_of(turned, "mx,my,mz", lambda t, a, w, m: m))
        self.turned = turned
        # Recordings of boards and phones that are laid down by hand.
        by_hand = imu_samples([any_attitude(rng) for _ in range(16)], rng)
        self.write("own/imu.csv", text_of(by_hand, "time,ax,ay,az,gx,gy,gz,mx,my,mz",
                                          lambda t, a, w, m: [t, *a, *w, *m]))
        self.write("flight.ulg", ulog(by_hand))
        self.write("log.ulg", ulog(by_hand))
        self.write("robot.bag", rosbag(by_hand))
        self.write("bag.mcap", mcap(by_hand))
        faces = [of_seat(rest, "+X" if rest[1] != "X" else "+Y") for rest in ("-Z", "+Z", "-X", "+X", "-Y", "+Y")]
        laid = imu_samples(faces, rng, rest_s=5.0)
        phyphox = text_of(laid, '"Time (s)","Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)"',
                          lambda t, a, w, m: [t, *a])
        self.write("phyphox.zip", zipped({"Raw Data.csv": phyphox}))
        self.write("phone.zip", zipped({"Raw Data.csv": phyphox}))
        self.write("phone.csv", text_of(laid, "time,x,y,z", lambda t, a, w, m: [t, *a]))
        for face, (rest, fence) in {"x_up": ("-X", "+Y"), "x_down": ("+X", "+Y"), "y_up": ("-Y", "+Z"),
                                    "y_down": ("+Y", "+Z"), "z_up": ("-Z", "+X"), "z_down": ("+Z", "+X")}.items():
            self.write(face + ".csv", text_of(imu_samples([of_seat(rest, fence)], rng), "ax,ay,az", lambda t, a, w, m: a))
        # Recordings at rest.
        still = imu_samples([turn([0.0, 0.0, 1.0], 0.0)], rng, rest_s=120.0)
        self.still = still
        self.write("rest.csv", text_of(still, "time,ax (m/s^2),ay (m/s^2),az (m/s^2),gx (rad/s),gy (rad/s),gz (rad/s)",
                                       lambda t, a, w, m: [t, *a, *w]))
        self.write("rest.ulg", ulog(still, instances=1))
        self.write("rest.bag", rosbag(still))
        # A log of the instrument that run.csv calibrates.
        self.write("own/log.csv", "time,x,y,z\n" + "".join(
            f"{i},{2.5 * math.sin(a):.6f},0.01,{2.5 * math.cos(a):.6f}\n" for i, a in enumerate(
                0.02 * j for j in range(40))))
        # Readings of the accelerometer whose calibration is in drone.params (read by `axiscal import`).
        self.write("own/drone.csv", "rest,fence,x,y,z\n" + "".join(
            f"{rest},{fence}," + ",".join(
                f"{s * G * v + b:.4f}" for s, v, b in zip((1.004, 0.997, 1.002), times(of_seat(rest, fence), [0, 0, 1]),
                                                         (0.12, -0.07, 0.2))) + "\n"
            for rest in FACES for fence in [face for face in FACES if face[1] != rest[1]][:2]))
        with open(self.path("run.csv"), encoding="utf-8") as file:
            self.write("sheet.xlsx", xlsx([line.split(",") for line in file.read().splitlines()]))

    def derive(self):
        make = self.make
        make("axiscal calibrate run.csv --instrument accelerometer --unit V --serial QA-113 -o cal.json")
        for name in ("a", "b"):
            make(f"axiscal simulate --truth cal.json --noise 1e-5 --replicates 2 --seed {ord(name)} -o {name}.csv")
            make(f"axiscal calibrate {name}.csv --instrument accelerometer --unit V --serial {name} -o {name}.json")
        for n in (1, 2, 3):
            make(f"axiscal simulate --truth cal.json --noise 1e-4 --seed {n} -o A{n}.csv")
        make("axiscal simulate --truth cal.json --noise 1e-4 --seed 5 -o today.csv")
        with open(self.path("today.csv"), encoding="utf-8") as file:
            self.write("three.csv", "".join(file.readlines()[:4]))
        for n, name in enumerate(("old", "new")):
            make(f"axiscal simulate --truth cal.json --noise 1e-4 --seed {n + 11} -o own/{name}.csv")
            make(f"axiscal calibrate own/{name}.csv --instrument accelerometer --unit V --serial QA-113 -o {name}.json")
            os.makedirs(self.path("records"), exist_ok=True)
            with contextlib.suppress(OSError):
                shutil.copy(self.path(name + ".json"), self.path(f"records/{name}.json"))
        make("axiscal store add records/ --store lab.db")
        make("axiscal calibrate run.csv --instrument accelerometer --unit V --serial QA-113 --calibrated 2026-01-15 "
             "--store lab.db")
        with open(self.path("run.csv"), encoding="utf-8") as file:
            columns, *readings = [line for line in file.read().splitlines() if line and not line.startswith("#")]
        self.write("units.csv", f"serial,{columns}\n" + "".join(f"u{n},{row}\n" for n in range(3) for row in readings))
        make("axiscal template laboratory -o lab.json")
        make("axiscal template limits -o limits.json")
        make("axiscal template experiment -o experiment.json")
        make("axiscal template positioner -o table.json")
        make("axiscal plan --seed 7 -o sheet.csv")
        rng = random.Random(8)
        with open(self.path("sheet.csv"), encoding="utf-8") as file:
            rows = [line.strip().split(",") for line in file if not line.startswith("#")]
        head = rows[0]
        seats = [(row[head.index("rest")], row[head.index("fence")]) for row in rows[1:]]
        cube = imu_samples([of_seat(*seat) for seat in seats], rng, rest_s=6.0)
        self.cube = cube
        self.write("log.csv", text_of(cube, "time,ax,ay,az,gx,gy,gz", lambda t, a, w, m: [t, *a, *w]))
        make("axiscal calibrate mag.csv --axes mx,my,mz --instrument magnetometer --field geomagnetic "
             "--field-magnitude 48 --field-unit uT --method magnitude --unit uT -o mag.json")
        make("axiscal noise rest.csv --json -o noise.json")
        make("axiscal calibrate --imu log.ulg -o 'imu-{slot}-{instance}.json'")
        make("axiscal calibrate --imu log.csv --unit m/s^2 --gyroscope-unit rad/s --cube -o 'own/{slot}.json'")
        for of, name in (("accelerometer", "acc.json"), ("gyroscope", "gyro.json")):
            with contextlib.suppress(OSError):
                shutil.copy(self.path(f"own/{of}.json"), self.path(name))
        make("axiscal export imu-*.json --format px4 --lossy -o drone.params")
        make("axiscal export imu-*.json --format ardupilot --lossy -o apm.param")
        make("axiscal export acc.json gyro.json --format kalibr -o imu.yaml")
        for part in (1, 2):
            make(f"axiscal study --truth cal.json --noise 1e-4 --trials 20 --shard {part}/2 -o part{part}.json")
        with open(self.path("run.csv"), encoding="utf-8") as file:
            header, *rows = [line for line in file.read().splitlines() if line and not line.startswith("#")]
        with open(self.path("fleet.csv"), "w", encoding="utf-8") as file:
            file.write(f"serial,{header}\n")
            file.writelines(f"u{unit},{row}\n" for unit in range(6) for row in rows)
        stream = "axiscal calibrate fleet.csv --stream --instrument accelerometer --unit V"
        for part in (1, 2):
            make(f"{stream} --shard {part}/2 -o part{part}.jsonl --table part{part}.csv")
            make(f"{stream} --shard {part}/2 -o part{part}.jsonl.zst")
        for part in (1, 2, 3, 4):
            make(f"{stream} --shard {part}/4 -o {part}.jsonl")
        for name in ("accelerometer", "magnetometer"):
            with contextlib.suppress(OSError):
                shutil.copy(self.path(f"imu-{name}-0.json"), self.path(f"{name}.json"))
                shutil.copy(self.path(f"imu-{name}-0.json"), self.path(f"imu-{name}.json"))
        shutil.copy(self.path("a.json"), self.path("board.json"))
        make("axiscal calibrate --imu phyphox.zip -o 'phone-{slot}.json'")
        make("axiscal characterize --reference a.json=a.csv --id cube-07 -o cube.json")
        make("axiscal calibrate own/body.csv --instrument accelerometer --unit V --method joint -o own/body-cal.json")
        make("axiscal calibrate attitudes.csv --method attitude --from own/body-cal.json -o body.json")

    def for_command(self, command, folder):
        """Copies the folder and replaces files whose names have another meaning in this command."""
        shutil.copytree(self.folder, folder, symlinks=True)

        def replace(name, by):
            shutil.copy(os.path.join(folder, "own", by), os.path.join(folder, name))
        if re.search(r"axiscal apply \w+.json \w+.json", command):
            replace("log.csv", "imu.csv")
        elif re.search(r"axiscal apply", command):
            replace("log.csv", "log.csv")
        if "--instrument magnetometer" in command and "run.csv" in command:
            replace("run.csv", "magnetometer_uT.csv" if "--unit uT" in command else "magnetometer.csv")
        if "import drone.params" in command:
            replace("run.csv", "drone.csv")
        if "--instrument optical" in command:
            replace("run.csv", "lamp.csv")
        if "--method attitude" in command or "--body" in command:
            replace("cal.json", "body-cal.json")
        journal = re.search(r"--resume (\S+)\.journal", command)
        if journal:
            shell(f"axiscal acquire --connect 'sim:?speed=max' --plain --name {journal.group(1)}", folder, self.axiscal,
                  "quit\n")


# ---------------------------------------------------------------- simulated instruments

class Wire:
    """A source of lines: a pseudo-terminal, or a TCP server on the loopback interface."""

    def __init__(self, line):
        self.line, self.stopped = line, threading.Event()
        self.threads = []

    def run(self, send):
        i = 0
        with contextlib.suppress(OSError):
            while not self.stopped.wait(0.02):
                send(self.line(i).encode())
                i += 1

    def start(self, target, *arguments):
        thread = threading.Thread(target=target, args=arguments, daemon=True)
        thread.start()
        self.threads.append(thread)

    def terminal(self):
        ours, theirs = os.openpty()
        tty.setraw(theirs)
        os.set_blocking(ours, False)

        def send(data):
            with contextlib.suppress(BlockingIOError):
                os.write(ours, data)
        self.start(self.run, send)
        return os.ttyname(theirs)

    def server(self):
        listener = socket.create_server(("127.0.0.1", 0))

        def serve():
            with contextlib.suppress(OSError):
                while not self.stopped.is_set():
                    connection, _ = listener.accept()
                    self.start(self.run, connection.sendall)
        self.start(serve)
        return listener.getsockname()[1]


def wired(command, desk):
    """Returns the command with addresses of simulated instruments, and these instruments."""
    if "magnetometer" in command:
        def line(i):
            return ",".join(f"{v:.3f}" for v in desk.turned[i % len(desk.turned)][3]) + "\r\n"
    else:
        rng = random.Random(3)

        def line(i):
            return f"{0.01 + 1e-4 * rng.gauss(0, 1):.5f},{0.01 + 1e-4 * rng.gauss(0, 1):.5f},2.5200\r\n"
    wires = []

    def port(_):
        wires.append(Wire(line))
        return "serial:" + wires[-1].terminal()

    def logger(_):
        wires.append(Wire(lambda i: ("x,y,z\r\n" if i == 0 else "") + line(i)))
        return f"tcp://127.0.0.1:{wires[-1].server()}"
    command = re.sub(r"serial:/dev/tty(?:ACM|USB)\d", port, command)
    return re.sub(r"tcp://logger:4000", logger, command), wires


# ---------------------------------------------------------------- running

class Done:
    def __init__(self, status, out, err):
        self.status, self.out, self.err = status, out, err


def shell(command, folder, axiscal, stdin="", waits=None):
    """Runs a command. If `waits` [s] is given, a command still running after it is ended and its status is None."""
    environment = {**os.environ, "PATH": os.path.dirname(os.path.abspath(axiscal)) + ":" + os.environ["PATH"],
                   "NO_COLOR": "1", "COLUMNS": "400"}
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        started = subprocess.Popen(["bash", "-o", "pipefail", "-c", command], cwd=folder, env=environment,
                                   stdin=subprocess.PIPE, stdout=out, stderr=err, start_new_session=True)
        with contextlib.suppress(BrokenPipeError):
            started.stdin.write(stdin.encode())
            started.stdin.flush()
            if waits is None:
                started.stdin.close()
        try:
            status = started.wait(waits or 150)
        except subprocess.TimeoutExpired:
            status = None if waits else 124
            os.killpg(started.pid, signal.SIGTERM)
            try:
                started.wait(5)
            except subprocess.TimeoutExpired:
                os.killpg(started.pid, signal.SIGKILL)
                started.wait()
        with contextlib.suppress(OSError):
            started.stdin.close()
        out.seek(0)
        err.seek(0)
        return Done(status, out.read().decode(errors="replace"), err.read().decode(errors="replace"))


def waits_for_ever(command):
    live = re.search(r"axiscal acquire\b", command) and not re.search(r"--(list|check|unattended)\b", command)
    return 4.0 if live or re.search(r"tail [^|]*-f", command) else None


def run_one(command, folder, desk):
    """Returns the fault of a command (an empty text if it passed) and its output."""
    typed, wires = wired(command, desk)
    done = shell(typed, folder, desk.axiscal, waits=waits_for_ever(command))
    for wire in wires:
        wire.stopped.set()
    printed = done.out + done.err
    if done.status is None:
        complaint = re.search(r"^(axiscal: |.*Traceback).*$", done.err, re.M)
        why = f"complains: {complaint.group()}" if complaint else ""
        if not why and not printed.strip():
            why = "printed no output before it was ended"
        return why, printed
    # Status 1 of `axiscal check` with "drifted", "outside" or "limit" in its output is a result, not a failure.
    is_answer = done.status == 1 and " check " in command.replace("--check", "check") and re.search(
        r"drifted|outside|limit", done.out)
    if done.status != 0 and not is_answer:
        return f"status {done.status}: " + " ".join((done.err or done.out).split())[-300:], printed
    return "", printed


# Returns the files for `axiscal log` by name. The content is None if the Desk contains the file. The commands that
# `axiscal log` suggests are run in the same folder.
def logs_of(desk):
    rng = random.Random(9)
    moving = [(t, [x + 3.0 * rng.gauss(0, 1) for x in a], w, m) for t, a, w, m in desk.still[:3000]]
    hands = [times(any_attitude(rng), [0, 0, G]) for _ in range(60)]
    return {
        "log.csv": None, "mag.csv": None, "phone.csv": None, "phyphox.zip": None, "flight.ulg": None,
        "robot.bag": None, "bag.mcap": None, "rest.csv": None, "rest.ulg": None, "rest.bag": None, "run.csv": None,
        "sheet.xlsx": None,
        "my compass.csv": text_of(desk.turned, "time,mag x,mag y,mag z", lambda t, a, w, m: [t, *m]),
        "units.csv": text_of(desk.turned, "mx (uT),my (uT),mz (uT)", lambda t, a, w, m: m),
        "compass.ulg": ulog(desk.turned, instances=1, sensors=("mag",)),
        "gyro.csv": text_of(desk.still[:3000], "time,gx,gy,gz", lambda t, a, w, m: [t, *w]),
        "gyro_no_times.csv": text_of(desk.still[:3000], "gx,gy,gz", lambda t, a, w, m: w),
        "acc_no_times.csv": text_of(desk.cube, "ax,ay,az", lambda t, a, w, m: a),
        "hands.csv": "ax,ay,az\n" + "".join(",".join(f"{v:.5f}" for v in row) + "\n" for row in hands),
        "moving.csv": text_of(moving, "time,ax,ay,az", lambda t, a, w, m: [t, *a]),
        "unknown.csv": text_of(desk.turned[:60], "sx,sy,sz", lambda t, a, w, m: m),
        "unknown two.csv": text_of(desk.turned[:60], "t,north east (q),b;c", lambda t, a, w, m: [t, *m[:2]]),
        "labelled.csv": "rest,fence,ax,ay,az\n" + "".join(
            f"{r},{f}," + ",".join(f"{v:.4f}" for v in times(of_seat(r, f), [0, 0, G])) + "\n"
            for r, f in (("-Z", "+X"), ("-Z", "-X"), ("+Z", "+X"), ("+Z", "-X"), ("-X", "+Y"), ("-X", "-Y"),
                         ("+X", "+Y"), ("+X", "-Y"), ("-Y", "+Z"), ("-Y", "-Z"), ("+Y", "+Z"), ("+Y", "-Z"))),
        "labelled_mag.csv": "rest,fence,mx,my,mz\n" + "".join(
            f"{r},{f}," + ",".join(f"{v + 0.1:.4f}" for v in times(of_seat(r, f), [0, 21.0, -43.0])) + "\n"
            for r, f in (("-Z", "+X"), ("-Z", "-X"), ("+Z", "+X"), ("+Z", "-X"), ("-X", "+Y"), ("-X", "-Y"),
                         ("+X", "+Y"), ("+X", "-Y"), ("-Y", "+Z"), ("-Y", "-Z"), ("+Y", "+Z"), ("+Y", "-Z"))),
    }


def main():
    mode, axiscal, *pattern = sys.argv[1:]
    axiscal = os.path.abspath(axiscal)
    chosen = re.compile(pattern[0] if pattern else "")
    help_text = subprocess.run([axiscal, "--help"], capture_output=True, text=True, check=True).stdout
    SUBCOMMANDS.update(re.findall(r"^  ([a-z]+) {2,}\S", help_text, re.M))
    assert "calibrate" in SUBCOMMANDS and len(SUBCOMMANDS) >= 18, SUBCOMMANDS
    commands = documented(axiscal)
    if mode == "list":
        for where, command in commands:
            print(f"{'form   ' if is_form(command) else 'command'}  {where}: {command}")
        return 0
    wrong, count = [], 0
    with tempfile.TemporaryDirectory() as scratch:
        desk = Desk(axiscal, os.path.join(scratch, "desk"))
        wrong += [("the files for it", command) for command in desk.failed]
        seen = set()

        def attempt(where, command, folder, depth):
            nonlocal count
            if command in seen:
                return
            seen.add(command)
            count += 1
            begin = time.time()
            why, printed = run_one(command, folder, desk)
            if os.environ.get("VERBOSE"):
                print(f"{'FAIL' if why else 'ok  '} {time.time() - begin:5.1f} s  {where}: {command}", flush=True)
            if why:
                wrong.append((where, f"{command}\n      {why}"))
            for more in printed_in(printed) if depth < 2 else []:
                attempt(f"printed by `{command}`", more, folder, depth + 1)

        for number, (where, command) in enumerate(commands):
            if not is_form(command) and chosen.search(command):
                folder = os.path.join(scratch, str(number))
                desk.for_command(command, folder)
                attempt(where, command, folder, 0)
                shutil.rmtree(folder, ignore_errors=True)
        for number, (name, content) in enumerate(logs_of(desk).items()):
            if not chosen.search(f"axiscal log {name}"):
                continue
            folder = os.path.join(scratch, f"log{number}")
            shutil.copytree(desk.folder, folder, symlinks=True)
            if content is not None:
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(content if isinstance(content, bytes) else content.encode())
            said = shell(f"axiscal log '{name}'", folder, axiscal)
            next_ones = printed_in(said.out)
            # `log` suggests no command for "unknown two.csv", because options cannot take its column names.
            if said.status != 0 or (not next_ones and name not in ("moving.csv", "unknown two.csv")):
                wrong.append((f"axiscal log '{name}'", "suggests no command: " + " ".join(said.out.split())[-200:]))
            last = (said.out.strip().splitlines() or [""])[-1]
            if re.search(r"--[a-z-]+ [A-Z](,|[A-Z])|\b(LOG|FILE)\b", last):
                wrong.append((f"axiscal log '{name}'", "prints a command with a placeholder: " + last))
            for command in next_ones:
                attempt(f"printed by `axiscal log '{name}'`", command, folder, 1)
            shutil.rmtree(folder, ignore_errors=True)
    for where, what in wrong:
        print(f"{where}\n    {what}\n")
    print(f"{count} commands were run; {len(wrong)} failed")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
