#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the data of the example experiments, and solves them independently of Axiscal.

    solve.py make     writes each folder's run.csv, from a truth and noise of a stated seed
    solve.py solve    writes each folder's answer.json, from its run.csv alone

Only numpy is used. The cube is laid down by the rule of docs/conventions.md, the sun stands where
Meeus, Astronomical Algorithms (2nd ed.), chapter 25, has it, and all that is unknown is found by
Gauss-Newton with numerical derivatives: no formula is shared with the library.
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
    """Up, in a table whose slope is (x, y)."""
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
    """Readings v = b + S f + what else there is, with unknowns besides b and S."""
    axes = ["x", "y", "z"]
    sd = 1e-3
    seed = 1
    extra = 0           # further unknowns of each axis
    shared = 2          # unknowns that all axes share
    bias = np.array([0.02, -0.05, 0.01])
    sensitivity = np.array([[2.50, 0.01, -0.02], [-0.015, 2.45, 0.005], [0.01, -0.01, 2.55]])
    more = np.zeros((3, 0))
    truth = np.array([0.003, -0.002])

    def rows(self):
        return [{"rest": r, "fence": f} for r, f in design(12)]

    def field(self, row, shared):
        """In the sensor."""
        return positioner_from_table(row["rest"], row["fence"]) @ direction(*shared)

    def regressors(self, row, field, S):
        """What multiplies an axis's further unknowns; m x extra."""
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
        """Each axis weighted by its scatter, in rounds; returns theta and its covariance."""
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

    def make(self, folder):
        rows = self.rows()
        r = np.random.default_rng(self.seed)
        theta = np.r_[self.bias, self.sensitivity.ravel(), self.more.ravel(), self.truth]
        v = self.predicted(rows, theta)
        v = v + self.sd * r.standard_normal(v.shape)
        with open(os.path.join(folder, "run.csv"), "w", newline="") as file:
            out = csv.writer(file, lineterminator="\n")
            out.writerow(["run"] + self.columns() + self.axes)
            for i, row in enumerate(rows):
                out.writerow([i + 1] + [row[c] for c in self.columns()]
                             + [f"{x:.6f}" for x in v[i]])

    def read(self, folder):
        with open(os.path.join(folder, "run.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        v = np.array([[float(row[a]) for a in self.axes] for row in rows])
        for i, row in enumerate(rows):
            row["number"] = i
            for key in ("level", "temperature", "fx", "fy", "fz"):
                if key in row:
                    row[key] = float(row[key])
        return rows, v

    def answers(self, folder):
        rows, v = self.read(folder)
        theta, C = self.solve(rows, v)
        return [self.answer(theta, C)]

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
        if float(row["level"]) != 0.0:  # turning, the table meets the mean of the Earth's rate
            earth = earth @ axis * axis
        return positioner_from_table(row["rest"], row["fence"]) @ (
            90.0 * float(row["level"]) * axis + earth)

    def start(self, rows, v):
        theta = super().start(rows, v)
        theta[-1] = 0.5
        return theta


class Sun(Experiment):
    """Three pairs of photodiodes (front less back) under the sun, a reading each two minutes."""
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
        # The table is not quite as stated: the sun's direction at the mean time is turned a little,
        # in the two directions across it, and all others with it.
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
    """An accelerometer at three soak temperatures: bias and scale change with each degree."""
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

    def answers(self, folder):
        rows, v = self.read(folder)
        A = np.array([[1.0, row["fz"]] for row in rows])
        x, rss = np.linalg.lstsq(A, v[:, 0], rcond=None)[:2]
        C = rss[0] / (len(rows) - 2) * np.linalg.inv(A.T @ A)
        return [{"parameters": [
            {"parameter": n, "value": float(x[i]), "u": float(np.sqrt(C[i, i]))}
            for i, n in enumerate(("v.bias", "v.sensitivity.z"))]}]


class Triple(Experiment):
    """Three instruments in one frame, read together: a record for each, and one table."""
    seed = 8
    slots = ["left", "middle", "right"]

    def make(self, folder):
        rows = self.rows()
        r = np.random.default_rng(self.seed)
        all_v = []
        for k in range(3):
            S = self.sensitivity * (1.0 + 0.1 * k) + 0.01 * k * np.roll(np.eye(3), 1, axis=0)
            theta = np.r_[self.bias * (k + 1), S.ravel(), self.truth]
            v = self.predicted(rows, theta)
            all_v.append(v + self.sd * r.standard_normal(v.shape))
        with open(os.path.join(folder, "run.csv"), "w", newline="") as file:
            out = csv.writer(file, lineterminator="\n")
            out.writerow(["run", "rest", "fence"] + [f"{s}.{a}" for s in self.slots for a in "xyz"])
            for i, row in enumerate(rows):
                out.writerow([i + 1, row["rest"], row["fence"]]
                             + [f"{x:.6f}" for v in all_v for x in v[i]])

    def answers(self, folder):
        with open(os.path.join(folder, "run.csv"), newline="") as file:
            rows = list(csv.DictReader(file))
        found = []
        for slot in self.slots:
            v = np.array([[float(row[f"{slot}.{a}"]) for a in "xyz"] for row in rows])
            found.append({"slot": slot, **self.answer(*self.solve(rows, v))})
        return found


EXPERIMENTS = {"turntable": Turntable, "sun": Sun, "temperature": Temperature,
               "triple_frame": Triple, "one_axis": OneAxis, "transfer": Transfer, "drift": Drift}


def main():
    what = sys.argv[1] if len(sys.argv) == 2 else ""
    if what not in ("make", "solve"):
        sys.exit(__doc__)
    for name, kind in EXPERIMENTS.items():
        folder = os.path.join(HERE, name)
        os.makedirs(folder, exist_ok=True)
        if what == "make":
            kind().make(folder)
            continue
        answers = kind().answers(folder)
        with open(os.path.join(folder, "answer.json"), "w") as file:
            json.dump({"by": "solve.py", "records": answers}, file, indent=1)
            file.write("\n")


if __name__ == "__main__":
    main()
