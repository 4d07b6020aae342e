#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Simulates the readings of the example experiments, and solves them independently of Axiscal.

    solve.py make [NAME ...]     writes NAME.csv, from a known truth and noise of a fixed seed
    solve.py solve [NAME ...]    writes NAME.expected.json, from NAME.csv only

run.py runs the operations of NAME.expected.json and compares the results.

Only numpy is used. The orientations of the cube follow docs/conventions.md. The position of the sun
follows Meeus, Astronomical Algorithms (2nd ed.), chapter 25. Gauss-Newton with numerical derivatives
finds all unknowns, so this program and the library share no formula.
"""
import csv
import datetime
import json
import os
import sys

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
FACES = {s + a: (1 if s == "+" else -1) * np.eye(3)["XYZ".index(a)] for a in "XYZ" for s in "+-"}
START = datetime.datetime(2026, 6, 21, 10, 0, tzinfo=datetime.timezone.utc)


def positioner_from_table(rest, fence):
    """The rotation that takes coordinates in the table to those in the cube."""
    z = -FACES[rest]
    y = FACES[fence]
    return np.column_stack([np.cross(y, z), y, z])


def design(points):
    """12 or 24 design points: for each rest face the fence faces of the next axis, or all four."""
    rows = []
    for axis in "XYZ":
        following = "XYZ"[("XYZ".index(axis) + 1) % 3]
        for sign in "+-":
            for fence in FACES:
                if fence[1] == following or (points == 24 and fence[1] != axis):
                    rows.append((sign + axis, fence))
    return rows


def direction(x, y):
    """The direction up in the frame of a table whose slope is (x, y)."""
    return np.array([x, y, np.sqrt(1.0 - x * x - y * y)])


def sun_in_enu(when, latitude_deg, longitude_deg):
    days = (when - datetime.datetime(2000, 1, 1, 12, tzinfo=datetime.timezone.utc)).total_seconds()
    T = days / 86400.0 / 36525.0
    mean_longitude = 280.46646 + 36000.76983 * T
    anomaly = np.radians(357.52911 + 35999.05029 * T)
    centre = (1.914602 - 0.004817 * T) * np.sin(anomaly) + 0.019993 * np.sin(2 * anomaly)
    node = np.radians(125.04 - 1934.136 * T)
    longitude = np.radians(mean_longitude + centre - 0.00569 - 0.00478 * np.sin(node))
    obliquity = np.radians(23.439291 - 0.0130042 * T + 0.00256 * np.cos(node))
    right_ascension = np.arctan2(np.cos(obliquity) * np.sin(longitude), np.cos(longitude))
    declination = np.arcsin(np.sin(obliquity) * np.sin(longitude))
    sidereal = np.radians(280.46061837 + 360.98564736629 * days / 86400.0)
    hour = sidereal + np.radians(longitude_deg) - right_ascension
    latitude = np.radians(latitude_deg)
    return np.array([
        -np.cos(declination) * np.sin(hour),
        np.sin(declination) * np.cos(latitude)
        - np.cos(declination) * np.cos(hour) * np.sin(latitude),
        np.sin(declination) * np.sin(latitude)
        + np.cos(declination) * np.cos(hour) * np.cos(latitude)])


def table_from_enu(azimuth):
    c, s = np.cos(azimuth), np.sin(azimuth)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])


class Experiment:
    """Readings v = b + S f + further terms, with further unknowns."""
    axes = ["x", "y", "z"]
    sd = 1e-3
    seed = 1
    digits = 6          # decimals in the file
    part_of_u = 0.01    # tolerance of a result, as a fraction of its standard uncertainty
    # The tolerance of a bias from 12 readings or more: Axiscal averages it over models with
    # correlated noise, and plain least squares does not.
    part_of_u_of_bias = 0.7
    status = 0          # exit status of the command
    extra = 0           # further unknowns of each axis
    shared = 2          # unknowns that all axes share
    bias = np.array([0.02, -0.05, 0.01])
    sensitivity = np.array([[2.50, 0.01, -0.02], [-0.015, 2.45, 0.005], [0.01, -0.01, 2.55]])
    more = np.zeros((3, 0))
    truth = np.array([0.003, -0.002])

    def rows(self):
        return [{"rest": r, "fence": f} for r, f in design(12)]

    def field(self, row, shared):
        """The field at a reading, in the frame of the sensor."""
        return positioner_from_table(row["rest"], row["fence"]) @ direction(*shared)

    def regressors(self, row, field, S):
        """The factors of each axis's further unknowns; m x extra."""
        return np.zeros((len(S), 0))

    def predicted(self, rows, theta):
        m = len(self.axes)
        b, S = theta[:m], theta[m:4 * m].reshape(m, 3)
        more = theta[4 * m:(4 + self.extra) * m].reshape(m, self.extra)
        shared = theta[(4 + self.extra) * m:]
        result = []
        for row in rows:
            f = self.field(row, shared)
            result.append(b + S @ f + np.sum(more * self.regressors(row, f, S), axis=1))
        return np.array(result)

    def start(self, rows, v):
        m = len(self.axes)
        shared = np.zeros(self.shared)
        A = np.array([np.r_[1.0, self.field(row, shared)] for row in rows])
        x = np.linalg.lstsq(A, v, rcond=None)[0]
        return np.r_[x[0], x[1:].T.ravel(), np.zeros(m * self.extra), shared]

    def solve(self, rows, v):
        """Fits all unknowns in 40 rounds, with each axis weighted by its scatter in the last round.

        Returns theta and its covariance.
        """
        n, m = v.shape
        theta = self.start(rows, v)
        sd = np.ones(m)
        for _ in range(40):
            e = v - self.predicted(rows, theta)
            J = np.empty((n * m, theta.size))
            for p in range(theta.size):
                h = 1e-6 * max(1.0, abs(theta[p]))
                step = np.zeros(theta.size)
                step[p] = h
                J[:, p] = ((self.predicted(rows, theta + step)
                            - self.predicted(rows, theta - step)) / (2 * h) / sd).ravel()
            change = np.linalg.lstsq(J, (e / sd).ravel(), rcond=None)[0]
            theta = theta + change
            e = v - self.predicted(rows, theta)
            own = 4 + self.extra + self.shared / m
            sd = np.sqrt((e ** 2).sum(axis=0) / (n - own))
        return theta, np.linalg.inv(J.T @ J)

    # ---- files ----

    def columns(self):
        return ["rest", "fence"]

    def readings(self, rows):
        """The readings of the instrument with noise; n x m."""
        r = np.random.default_rng(self.seed)
        theta = np.r_[self.bias, self.sensitivity.ravel(), self.more.ravel(), self.truth]
        v = self.predicted(rows, theta)
        return v + self.sd * r.standard_normal(v.shape)

    def names(self):
        """The names of the columns of the readings."""
        return self.axes

    def make(self, name):
        rows = self.rows()
        v = self.readings(rows)
        with open(os.path.join(HERE, name + ".csv"), "w", newline="") as file:
            out = csv.writer(file, lineterminator="\n")
            out.writerow(["run"] + self.columns() + self.names())
            for i, row in enumerate(rows):
                out.writerow([i + 1] + [row[c] for c in self.columns()]
                             + [f"{x:.{self.digits}f}" for x in v[i]])

    def read(self, name):
        with open(os.path.join(HERE, name + ".csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        v = np.array([[float(row[a]) for a in self.names()] for row in rows])
        for i, row in enumerate(rows):
            row["number"] = i
            for key, text in row.items():
                try:
                    row[key] = float(text)
                except ValueError:
                    pass
        return rows, v

    def answers(self, name):
        rows, v = self.read(name)
        theta, C = self.solve(rows, v)
        return [self.answer(theta, C)]

    def operations(self, name):
        """The operations to run, and their expected results."""
        answers = self.answers(name)
        has_slots = "slot" in answers[0]
        record = "{folder}/cal-{slot}.json" if has_slots else "{folder}/cal.json"
        expect = []
        for answer in answers:
            file = record.replace("{slot}", answer.get("slot", ""))
            expect.append({"file": file, "pointer": "/status", "value": "ok"})
            for one in answer["parameters"]:
                many = one["parameter"].endswith(".bias") and len(self.rows()) >= 12
                part = self.part_of_u_of_bias if many else self.part_of_u
                expect.append({"file": file, "parameter": one["parameter"], "value": one["value"],
                               "tolerance": part * one["u"]})
            expect += [{"file": file, **more} for more in answer.get("more", [])]
        return [{"run": ["calibrate", name + ".json", "-o", record], "status": self.status,
                 "expect": expect}] + self.later(name, answers)

    def later(self, name, answers):
        """Further operations that use the record."""
        return []

    def answer(self, theta, C):
        m = len(self.axes)
        u = np.sqrt(np.diag(C))
        values, names = theta[:4 * m], [f"{a}.bias" for a in self.axes]
        names += [f"{a}.sensitivity.{j}" for a in self.axes for j in "xyz"]
        return {"parameters": [{"parameter": n, "value": float(x), "u": float(s)}
                               for n, x, s in zip(names, values, u[:4 * m])]}


class Turntable(Experiment):
    """A gyroscope on a turntable at -90, 0 and 90 degrees a second, on the turning Earth."""
    sd = 2e-3
    seed = 2
    shared = 4  # the turntable's axis, and the Earth's rate in the table by its two tangents
    bias = np.array([0.3, -0.5, 0.2])
    sensitivity = np.array([[1.02, 0.01, -0.02], [-0.015, 0.99, 0.005], [0.01, -0.01, 1.01]])
    earth = np.degrees(7.292115e-5)
    latitude = np.radians(52.0)
    truth = np.array([0.004, -0.003, 0.0, 0.7])

    def rows(self):
        return [{"rest": r, "fence": f, "level": level} for r, f in design(12)
                for level in (-1, 0, 1)]

    def columns(self):
        return ["rest", "fence", "level"]

    def field(self, row, shared):
        axis = direction(*shared[:2])
        elevation, azimuth = self.latitude + shared[2], shared[3]
        earth = self.earth * np.array([np.cos(elevation) * np.cos(azimuth),
                                       np.cos(elevation) * np.sin(azimuth), np.sin(elevation)])
        if float(row["level"]) != 0.0:  # the Earth's rate across the axis averages to 0 in a turn
            earth = earth @ axis * axis
        return positioner_from_table(row["rest"], row["fence"]) @ (
            90.0 * float(row["level"]) * axis + earth)

    def start(self, rows, v):
        theta = super().start(rows, v)
        theta[-1] = 0.5
        return theta


class Sun(Experiment):
    """Three pairs of photodiodes (front minus back) under the sun, with a reading every two minutes."""
    sd = 1e-3
    seed = 13
    sensitivity = np.array([[0.81, 0.01, -0.02], [-0.015, 0.79, 0.005], [0.01, -0.01, 0.80]])
    azimuth = np.radians(30.0)  # of the fence, as stated

    def rows(self):
        return [{"rest": r, "fence": f,
                 "time": (START + datetime.timedelta(minutes=2 * i)).strftime("%Y-%m-%dT%H:%M:%SZ")}
                for i, (r, f) in enumerate(design(12))]

    def columns(self):
        return ["rest", "fence", "time"]

    def table_vector(self, time):
        when = datetime.datetime.strptime(time, "%Y-%m-%dT%H:%M:%SZ")
        when = when.replace(tzinfo=datetime.timezone.utc)
        return table_from_enu(self.azimuth) @ sun_in_enu(when, 52.0, 8.5)

    def field(self, row, shared):
        # The orientation of the table differs a little from the stated one. The two shared unknowns
        # turn the sun's direction at the mean time about two axes across it. All other directions
        # of
        # the sun are turned in the same way.
        mean = self.table_vector("2026-06-21T10:11:00Z")
        a = np.cross(mean, [0.0, 0.0, 1.0])
        a /= np.linalg.norm(a)
        b = np.cross(mean, a)
        turn = shared[0] * a + shared[1] * b
        angle = np.linalg.norm(turn) + 1e-300
        k = turn / angle
        f = self.table_vector(row["time"])
        f = (f * np.cos(angle) + np.cross(k, f) * np.sin(angle)
             + k * (k @ f) * (1 - np.cos(angle)))
        return positioner_from_table(row["rest"], row["fence"]) @ f


class Temperature(Experiment):
    """An accelerometer at three soak temperatures. Bias and scale depend on the temperature."""
    seed = 4
    extra = 2
    more = np.array([[4e-3, 3e-4], [-3e-3, -2e-4], [2e-3, 4e-4]])
    reference = 25.0

    def rows(self):
        return [{"rest": r, "fence": f, "temperature": t} for t in (5.0, 25.0, 45.0)
                for r, f in design(12)]

    def columns(self):
        return ["rest", "fence", "temperature"]

    def regressors(self, row, field, S):
        d = float(row["temperature"]) - self.reference
        return np.column_stack([np.full(len(S), d), d * (S @ field)])


class Drift(Experiment):
    """An accelerometer that is not warm yet: its biases drift while the readings are taken."""
    seed = 5
    extra = 1
    more = np.array([[0.03], [-0.02], [0.025]])

    def rows(self):
        order = np.random.default_rng(50).permutation(24)
        points = design(24)
        return [{"rest": points[i][0], "fence": points[i][1], "number": n}
                for n, i in enumerate(order)]

    def regressors(self, row, field, S):
        return np.full((len(S), 1), row["number"] / 23.0 - 0.5)


class OneAxis(Experiment):
    """An instrument of one axis in the 12 orientations."""
    seed = 6
    axes = ["v"]
    bias = np.array([0.02])
    sensitivity = np.array([[0.01, -0.02, 2.5]])
    more = np.zeros((1, 0))
    sd = 2e-4

    def start(self, rows, v):
        theta = super().start(rows, v)
        return theta


class Transfer(Experiment):
    """A photodiode before a lamp of known irradiance: slope and offset."""
    seed = 7
    axes = ["v"]
    bias = np.array([0.012])
    sensitivity = np.array([[0.0, 0.0, 0.8]])
    more = np.zeros((1, 0))
    shared = 0
    truth = np.zeros(0)
    sd = 1e-3

    def rows(self):
        return [{"fx": 0, "fy": 0, "fz": z} for z in (0, 0.25, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2)]

    def columns(self):
        return ["fx", "fy", "fz"]

    def field(self, row, shared):
        return np.array([0.0, 0.0, float(row["fz"])])

    def answers(self, name):
        rows, v = self.read(name)
        A = np.array([[1.0, row["fz"]] for row in rows])
        x, rss = np.linalg.lstsq(A, v[:, 0], rcond=None)[:2]
        C = rss[0] / (len(rows) - 2) * np.linalg.inv(A.T @ A)
        return [{"parameters": [
            {"parameter": n, "value": float(x[i]), "u": float(np.sqrt(C[i, i]))}
            for i, n in enumerate(("v.bias", "v.sensitivity.z"))]}]


class Triple(Experiment):
    """Three instruments in one frame, read together on one table: one record for each."""
    seed = 8
    slots = ["left", "middle", "right"]

    def names(self):
        return [f"{slot}.{axis}" for slot in self.slots for axis in "xyz"]

    def truths(self):
        """b and S of each slot, in the frame of the cube."""
        return [(self.bias * (k + 1),
                 self.sensitivity * (1.0 + 0.1 * k) + 0.01 * k * np.roll(np.eye(3), 1, axis=0))
                for k in range(len(self.slots))]

    def readings(self, rows):
        r = np.random.default_rng(self.seed)
        all_v = []
        for b, S in self.truths():
            v = self.predicted(rows, np.r_[b, S.ravel(), self.truth])
            all_v.append(v + self.sd * r.standard_normal(v.shape))
        return np.hstack(all_v)

    def answers(self, name):
        rows, v = self.read(name)
        return [{"slot": slot, **self.answer(*self.solve(rows, v[:, 3 * k:3 * k + 3]))}
                for k, slot in enumerate(self.slots)]


# ---- one experiment for each instrument and field ----

class Paired(Experiment):
    """Averages of opposite positions do not contain the table's tilt. Half the difference measures it."""
    seed = 21

    def solve(self, rows, v):
        faces = list(dict.fromkeys(row["rest"] for row in rows))
        mean = np.array([v[[r["rest"] == f for r in rows]].mean(axis=0) for f in faces])
        slope = np.zeros(2)
        for _ in range(5):
            cosine = direction(*slope)[2]
            A = np.array([np.r_[1.0, -cosine * FACES[f]] for f in faces])
            x, rss = np.linalg.lstsq(A, mean, rcond=None)[:2]
            b, S = x[0], x[1:].T
            tilts = []
            for row, reading in zip(rows, v):
                f = np.linalg.solve(S, reading - b)
                in_table = positioner_from_table(row["rest"], row["fence"]).T @ f
                tilts.append(in_table[:2])
            slope = np.mean(tilts, axis=0)
        C = np.linalg.inv(A.T @ A)
        theta = np.r_[b, S.ravel()]
        # The variances of b (m entries) and of S by rows, in the order of answer().
        u2 = np.concatenate([rss / 2 * C[0, 0], np.concatenate(
            [rss[k] / 2 * np.diag(C)[1:] for k in range(3)])])
        self.slope = slope
        return theta, np.diag(u2)

    def answer(self, theta, C):
        result = super().answer(theta, C)
        result["more"] = [
            {"pointer": "/levelness/mean/" + "xy"[i], "value": float(self.slope[i]),
             "tolerance": 1e-6} for i in range(2)]
        return result

    def later(self, name, answers):
        """Readings in attitudes of known pitch and roll, reduced by the answer's b and S."""
        values = [one["value"] for one in answers[0]["parameters"]]
        b, S = np.array(values[:3]), np.array(values[3:12]).reshape(3, 3)
        rows, expect = [], []
        for i, (pitch, roll) in enumerate([(0, 0), (10, 20), (-35, 170), (60, -95), (-80, 5)]):
            p, r = np.radians(pitch), np.radians(roll)
            f = np.array([np.sin(p), np.cos(p) * np.sin(r), np.cos(p) * np.cos(r)])
            rows.append([f"{x:.9f}" for x in b + S @ f])
            for column, value in (("pitch_deg", pitch), ("roll_deg", roll)):
                expect.append({"file": "{folder}/angles.csv", "row": i + 1, "column": column,
                               "value": value, "tolerance": 2e-5})
        with open(os.path.join(HERE, name + ".readings.csv"), "w") as file:
            file.write("x,y,z\n" + "".join(",".join(row) + "\n" for row in rows))
        return [{"run": ["apply", "{folder}/cal.json", name + ".readings.csv", "-o",
                         "{folder}/angles.csv"], "status": 0, "expect": expect}]


class Joint(Experiment):
    """All 24 points, gravity in m/s^2, readings in counts."""
    seed = 22
    F = 9.80665
    sd = 0.4
    digits = 2
    bias = np.array([12.0, -40.0, 25.0])
    sensitivity = np.array([[166.0, 0.6, -1.1], [-0.9, 163.0, 0.4], [0.7, -0.5, 168.0]])

    def rows(self):
        return [{"rest": r, "fence": f} for r, f in design(24)]

    def field(self, row, shared):
        return self.F * super().field(row, shared)


class Inclinometer(Experiment):
    """Two axes whose readings are sines of angles. No axis measures the third component."""
    seed = 23
    axes = ["x", "y"]
    sd = 2e-5
    digits = 8
    bias = np.array([0.001, -0.002])
    sensitivity = np.array([[1.001, 0.002, -0.001], [-0.003, 0.999, 0.002]])
    more = np.zeros((2, 0))


class Magnetometer(Joint):
    """The Earth's field of known magnitude, whose direction in the table is unknown."""
    seed = 24
    F = 48500.0
    sd = 4.0
    digits = 1
    bias = np.array([120.0, -310.0, 55.0])
    sensitivity = np.array([[1.02, 0.01, -0.02], [-0.015, 0.98, 0.005], [0.01, -0.01, 1.03]])
    truth = np.array([0.05, -0.08])
    rough = np.array([0.0, 18000.0, -45000.0])

    def field(self, row, shared):
        z = self.rough / np.linalg.norm(self.rough)
        x = np.cross([0.0, 1.0, 0.0], z)
        x /= np.linalg.norm(x)
        f = z + shared[0] * x + shared[1] * np.cross(z, x)
        f *= self.F / np.linalg.norm(f)
        return positioner_from_table(row["rest"], row["fence"]) @ f


class Coil(Magnetometer):
    """A coil of 60 uT along the table's normal, with both signs and off, in an unknown field of the Earth."""
    seed = 25
    shared = 5  # the coil's axis, and the Earth's vector
    sd = 0.004
    digits = 4
    bias = np.array([0.12, -0.31, 0.05])
    truth = np.array([0.003, -0.002, 3.0, 18.0, -43.0])

    def rows(self):
        return [{"rest": r, "fence": f, "level": level} for r, f in design(12)
                for level in (-1, 0, 1)]

    def columns(self):
        return ["rest", "fence", "level"]

    def field(self, row, shared):
        f = 60.0 * float(row["level"]) * direction(*shared[:2]) + shared[2:]
        return positioner_from_table(row["rest"], row["fence"]) @ f

    def start(self, rows, v):
        # A linear fit for b and S, with an approximate field of the Earth.
        near = np.array([0.0, 0.0, 2.0, 17.0, -42.0])
        A = np.array([np.r_[1.0, self.field(row, near)] for row in rows])
        x = np.linalg.lstsq(A, v, rcond=None)[0]
        return np.r_[x[0], x[1:].T.ravel(), near]


class Lamp(Experiment):
    """Pairs of photodiodes (front minus back) under a lamp of 2 W/m^2 above the table."""
    seed = 26
    sd = 1e-3
    sensitivity = np.array([[0.81, 0.01, -0.02], [-0.015, 0.79, 0.005], [0.01, -0.01, 0.80]])

    def field(self, row, shared):
        return 2.0 * super().field(row, shared)


class EarthRate(Magnetometer):
    """A gyroscope that measures the Earth's rotation, whose direction in the table is known roughly."""
    seed = 27
    F = 15.041067
    sd = 0.01
    digits = 5
    bias = np.array([0.4, -0.2, 0.1])
    rough = np.array([0.0, 9.26, 11.85])


class Custom(Magnetometer):
    """A field of any kind: a vector in the table, whose direction is known roughly."""
    seed = 28
    F = 2.0
    sd = 2e-4
    digits = 7
    bias = np.array([0.02, -0.05, 0.01])
    rough = np.array([0.6, -0.4, 1.8])


# ---- frames ----

class HFrame(Triple):
    """Two instruments on the web of an H, the second turned by 180 degrees about x."""
    seed = 31
    slots = ["L", "R"]
    mounts = [np.eye(3), np.diag([1.0, -1.0, -1.0])]

    def rows(self):
        return [{"rest": r, "fence": f} for r, f in design(24)]

    def truths(self):
        return [(b, S @ M) for (b, S), M in zip(super().truths(), self.mounts)]

    def answers(self, name):
        rows, v = self.read(name)
        found = []
        for k, slot in enumerate(self.slots):
            theta, C = self.solve(rows, v[:, 3 * k:3 * k + 3])
            # Turns S to the instrument's own frame. The entries of the mounts are 0, 1 and -1, so
            # the variances do not change.
            theta[3:12] = (theta[3:12].reshape(3, 3) @ self.mounts[k].T).ravel()
            found.append({"slot": slot, **self.answer(theta, C)})
        return found


class TwoKinds(Experiment):
    """An accelerometer and a magnetometer in one cube: one run, each in its own field."""
    seed = 32

    def parts(self):
        a, m = Joint(), Magnetometer()
        a.F, a.sd, a.bias, a.sensitivity, a.truth = (
            1.0, 2e-4, np.array([0.02, -0.05, 0.01]), np.eye(3) + 0.01, np.array([0.003, -0.002]))
        m.seed = 133
        return [("A", a), ("M", m)]

    def names(self):
        return [f"{slot}.{axis}" for slot, _ in self.parts() for axis in "xyz"]

    def rows(self):
        return Joint().rows()

    def readings(self, rows):
        return np.hstack([part.readings(rows) for _, part in self.parts()])

    def answers(self, name):
        rows, v = self.read(name)
        return [{"slot": slot, **part.answer(*part.solve(rows, v[:, 3 * k:3 * k + 3]))}
                for k, (slot, part) in enumerate(self.parts())]


# ---- labels, and readings that are not fitted ----

class OwnTemperatures(Temperature):
    """Each axis has its own temperature sensor."""
    seed = 34

    def rows(self):
        r = np.random.default_rng(340)
        return [{**row, **{a + "_temperature": round(row["temperature"] + 0.5 * r.standard_normal(), 3)
                           for a in "xyz"}} for row in super().rows()]

    def columns(self):
        return ["rest", "fence"] + [a + "_temperature" for a in "xyz"]

    def regressors(self, row, field, S):
        d = np.array([float(row[a + "_temperature"]) for a in "xyz"]) - self.reference
        return np.column_stack([d, d * (S @ field)])


class Tumble(Experiment):
    """A dividing head: pitch and roll instead of faces."""
    seed = 35
    shared = 0
    truth = np.zeros(0)

    def rows(self):
        return [{"pitch_deg": p, "roll_deg": r} for p in (-90, -45, 0, 45, 90)
                for r in (0, 90, 180, 270)]

    def columns(self):
        return ["pitch_deg", "roll_deg"]

    def field(self, row, shared):
        p, r = np.radians(float(row["pitch_deg"])), np.radians(float(row["roll_deg"]))
        return np.array([np.sin(p), np.cos(p) * np.sin(r), np.cos(p) * np.cos(r)])


class SixFaces(Experiment):
    """Six faces, twice, without a fence: the table is taken as level."""
    seed = 36
    shared = 0
    truth = np.zeros(0)
    words = {"-Z": "level", "+Z": "upside down", "-X": "nose up", "+X": "nose down",
             "+Y": "left down", "-Y": "right down"}

    def rows(self):
        return [{"rest": self.words[f]} for _ in range(2) for f in FACES]

    def columns(self):
        return ["rest"]

    def field(self, row, shared):
        return -FACES[[f for f, word in self.words.items() if word == row["rest"]][0]]


class Confirmation(Joint):
    """Four readings are kept out of the fit and agree with its predictions."""
    seed = 37
    F = 1.0
    sd = 1e-3
    digits = 6
    bias = Experiment.bias
    sensitivity = Experiment.sensitivity
    status = 0
    shift = 0.0

    def rows(self):
        return [{**row, "confirm": 1 if i % 6 == 5 else 0}
                for i, row in enumerate(super().rows())]

    def columns(self):
        return ["rest", "fence", "confirm"]

    def readings(self, rows):
        v = super().readings(rows)
        for row, reading in zip(rows, v):
            reading += self.shift * row["confirm"]
        return v

    def answers(self, name):
        rows, v = self.read(name)
        kept = np.array([row["confirm"] == 1 for row in rows])
        theta, C = self.solve([r for r, k in zip(rows, kept) if not k], v[~kept])
        answer = self.answer(theta, C)
        errors = v[kept] - self.predicted([r for r, k in zip(rows, kept) if k], theta)
        answer["more"] = [{"pointer": "/confirmation/readings", "value": 4},
                          {"pointer": "/confirmation/passed", "value": self.status == 0}]
        for i, error in enumerate(errors):
            answer["more"] += [{"pointer": f"/confirmation/details/{i}/error/{k}",
                                "value": float(error[k]), "tolerance": 2e-5} for k in range(3)]
        return [answer]


class NotConfirmed(Confirmation):
    """As confirmation, but the instrument was hit before the four readings that are kept out."""
    seed = 38
    status = 1
    shift = 0.01


class WrongFace(Experiment):
    """One label is wrong. Axiscal names the run and stores no record."""
    seed = 39

    def rows(self):
        return [{"rest": r, "fence": f} for r, f in design(24)]

    def make(self, name):
        super().make(name)
        path = os.path.join(HERE, name + ".csv")
        with open(path) as file:
            text = file.read()
        row = next(line for line in text.splitlines() if line.startswith("7,"))
        rest, fence = row.split(",")[1:3]
        wrong = {"+": "-", "-": "+"}[rest[0]] + rest[1]
        with open(path, "w") as file:
            file.write(text.replace(row, row.replace(f"7,{rest},{fence}", f"7,{wrong},{fence}")))

    def operations(self, name):
        return [{"run": ["calibrate", name + ".json", "--json"], "status": 1,
                 "expect": [{"output": "/status", "value": "refused"},
                            {"output": "/warnings/0/code", "value": "wrong_pose"},
                            {"output": "/warnings/0/run", "value": 7}]}]


class Body(Joint):
    """The rotation of a sensor in a model, found by readings in six attitudes of the model."""
    seed = 41
    F = 1.0
    sd = 2e-4
    digits = 7
    bias = Experiment.bias
    sensitivity = Experiment.sensitivity
    attitudes = [(0, 0), (15, 0), (-15, 0), (0, 25), (0, -25), (20, 10)]

    def later(self, name, answers):
        r = np.random.default_rng(410)
        values = [one["value"] for one in answers[0]["parameters"]]
        b, S = np.array(values[:3]), np.array(values[3:12]).reshape(3, 3)
        w = np.array([0.2, -0.1, 0.4])  # rotation from sensor to model, as a rotation vector [rad]
        a = np.linalg.norm(w)
        K = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]]) / a
        R = np.eye(3) + np.sin(a) * K + (1 - np.cos(a)) * K @ K
        rows, ups, seen = [], [], []
        for pitch, roll in self.attitudes:
            p, q = np.radians(pitch), np.radians(roll)
            u = np.array([np.sin(p), np.cos(p) * np.sin(q), np.cos(p) * np.cos(q)])
            v = np.round(b + S @ R.T @ u + self.sd * r.standard_normal(3), 7)
            rows.append([f"{x:.7f}" for x in v] + [str(pitch), str(roll)])
            f = np.linalg.solve(S, v - b)
            ups.append(u)
            seen.append(f / np.linalg.norm(f))
        with open(os.path.join(HERE, name + ".attitudes.csv"), "w") as file:
            file.write("x,y,z,pitch_deg,roll_deg\n" + "".join(",".join(x) + "\n" for x in rows))
        U, _, V = np.linalg.svd(np.array(ups).T @ np.array(seen))
        found = U @ np.diag([1, 1, np.linalg.det(U @ V)]) @ V
        return [{"run": ["calibrate", name + ".attitudes.csv", "--method", "attitude", "--from",
                         "{folder}/cal.json", "-o", "{folder}/body.json"], "status": 0,
                 "expect": [{"file": "{folder}/body.json",
                             "pointer": f"/rotation_model_from_sensor/{i}/{j}",
                             "value": float(found[i, j]), "tolerance": 1e-6}
                            for i in range(3) for j in range(3)]}]


EXPERIMENTS = {
    "accelerometer": Paired, "accelerometer_si": Joint, "inclinometer": Inclinometer,
    "magnetometer": Magnetometer, "coil": Coil, "gyroscope": EarthRate, "turntable": Turntable,
    "lamp": Lamp, "sun": Sun, "transfer": Transfer, "custom_field": Custom, "one_axis": OneAxis,
    "triple_frame": Triple, "h_frame": HFrame, "two_kinds": TwoKinds,
    "temperature": Temperature, "own_temperatures": OwnTemperatures, "drift": Drift,
    "tumble": Tumble, "six_faces": SixFaces, "confirmation": Confirmation,
    "not_confirmed": NotConfirmed, "wrong_face": WrongFace, "body": Body}


def main():
    what = sys.argv[1] if len(sys.argv) > 1 else ""
    if what not in ("make", "solve"):
        sys.exit(__doc__)
    for name in sys.argv[2:] or EXPERIMENTS:
        kind = EXPERIMENTS[name]
        if what == "make":
            kind().make(name)
            continue
        expected = {"format": "axiscal-expected", "version": 1, "by": "solve.py",
                    "about": kind.__doc__.strip(), "operations": kind().operations(name)}
        with open(os.path.join(HERE, name + ".expected.json"), "w") as file:
            json.dump(expected, file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    main()
