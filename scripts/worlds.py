#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Calibrates runs that are simulated by numpy, independently of the library.

worlds.py AXISCAL [-n UNITS] [--seed N] [--list] [WORLD ...]

A world is a set of errors of the simulated runs. For each world it prints the share of stated 95 % intervals of biases,
main and cross-axis terms that contain the true value, the ratio of their median width to +-1.96 true standard
deviations, and the share of runs with each warning and note. For worlds named "later" it prints the share of new
readings that `check` calls drifted, and the share of expanded uncertainties U that contain the true field. Poses, noise
and mistakes are programmed from docs/method.md, without code of the library. Needs numpy.
"""
import argparse
import collections
import json
import os
import subprocess
import sys
import tempfile

import numpy as np

FACES = {"+X": (1, 0, 0), "-X": (-1, 0, 0), "+Y": (0, 1, 0), "-Y": (0, -1, 0), "+Z": (0, 0, 1), "-Z": (0, 0, -1)}
STANDARD_12 = [("-Z", "+X"), ("-Z", "-X"), ("+Z", "+X"), ("+Z", "-X"), ("-Y", "+Z"), ("-Y", "-Z"),
               ("+Y", "+Z"), ("+Y", "-Z"), ("-X", "+Y"), ("-X", "-Y"), ("+X", "+Y"), ("+X", "-Y")]
ALL_24 = [(rest, fence) for rest in FACES for fence in FACES if rest[1] != fence[1]]
SIGMA = 1e-4  # noise of a reading, in the field's size


def to_cube(rest, fence):
    """Returns R, whose rows are the table's axes in cube coordinates. R.T maps table to cube coordinates."""
    z = -np.array(FACES[rest], float)
    y = np.array(FACES[fence], float)
    return np.stack([np.cross(y, z), y, z])


def turn(w):
    angle = np.linalg.norm(w)
    if angle == 0:
        return np.eye(3)
    k = w / angle
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def ar(rng, rho, shape):
    """Returns AR(1) noise of standard deviation 1 with lag-one correlation rho along the first dimension."""
    e = rng.normal(size=shape)
    for i in range(1, len(e)):
        e[i] = rho * e[i - 1] + np.sqrt(1 - rho**2) * e[i]
    return e


class Run:
    """The run of one simulated unit. The sizes of the errors are in units of SIGMA."""

    def __init__(self, rng, blocks=1, points=STANDARD_12, repeats=1, fixed=False, gain=0, gain_axis=0, mount=0, seat=0,
                 jitter=0, wander=0, wander_rho=0.9, at_field=1, at_axis=None, block=0, ar_=0, tails=0, step=0, extra=0, periodic=0, period=4.0,
                 soak_b=0, soak_s=0, square=0, soaks=0, each=1, laying=0, pose=0):
        S = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
        b = 0.02 * rng.normal(size=3)
        slope = 3e-3 * rng.normal(size=2)
        f_table = np.array([*slope, np.sqrt(1 - slope @ slope)])
        rows, fields, block_of = [], [], []
        blocks = soaks or blocks
        for j in range(blocks + (1 if extra else 0)):
            plan = [p for _ in range(repeats) for p in points]
            if not fixed:
                plan = [plan[i] for i in rng.permutation(len(plan))]
            for p in plan if j < blocks else plan[:extra]:
                rows += [p] * each  # readings of one laying
                block_of += [j] * each
        n = len(rows)
        block_of = np.array(block_of)
        B = block_of.max() + 1
        gains = np.ones((B, 3)) + SIGMA * (gain * rng.normal(size=(B, 1)) * np.ones(3) if gain_axis == 3 else
                                           gain * rng.normal(size=(B, 3)) * (np.ones(3) if not gain_axis else np.eye(3)[gain_axis - 1]))
        mounts = [turn(SIGMA * mount * rng.normal(size=3)) for _ in range(B)]
        shifts = SIGMA * block * rng.normal(size=(B, 3))
        size = 1 + SIGMA * (jitter * rng.normal(size=n) + wander * ar(rng, wander_rho, n))
        noise = ar(rng, ar_, (n, 3))
        if tails:
            noise = rng.standard_t(tails, size=(n, 3)) * np.sqrt((tails - 2) / tails)
        # Soaks at temperatures from -1 to 1. Bias and scale change linearly; their sizes are the values at 1, in SIGMA.
        self.temperature = np.linspace(-1, 1, soaks)[block_of] if soaks else None
        if soaks:
            u = np.linspace(-1, 1, soaks)[:, None]
            shifts += SIGMA * (30 * rng.normal(size=3) * u + square * u**2 + soak_b * rng.normal(size=(soaks, 3)))
            gains = gains + SIGMA * (20 * rng.normal(size=3) * u + soak_s * rng.normal(size=(soaks, 3)))
        v = np.empty((n, 3))
        of_pose = {p: SIGMA * pose * rng.normal(size=3) for p in points}
        for i, (rest, fence) in enumerate(rows):
            if i % each == 0:
                seated = turn(SIGMA * seat * rng.normal(size=3)) @ f_table
                of_laying = SIGMA * laying * rng.normal(size=3)
            f = mounts[block_of[i]] @ (to_cube(rest, fence).T @ seated) * size[i]
            scale = np.where(np.abs(f) > 0.7, at_field, 1.0)
            if at_axis is not None:
                scale[[k for k in range(3) if k != at_axis]] = 1.0
            v[i] = b + shifts[block_of[i]] + gains[block_of[i]] * (S @ f) + SIGMA * scale * noise[i] + of_laying + of_pose[rest, fence]
            v[i] += SIGMA * periodic * np.sqrt(2) * np.sin(2 * np.pi * i / period + np.array([0, 2, 4]))
        if step:
            q = step * SIGMA
            v = np.round(v / q) * q
        self.b, self.S = b + (shifts[0] if extra else 0), S
        self.rows, self.v, self.block = rows, v, block_of + 1


def on_table(method="joint", options=(), **what):
    return dict(kind="table", method=method, options=list(options), what=what)


WORLDS = {}
for n, name in ((dict(), "12"), (dict(points=ALL_24), "24"), (dict(repeats=4), "48"), (dict(blocks=2), "12x2"), (dict(blocks=4), "12x4")):
    WORLDS["white " + name] = on_table(**n)
for g in (1, 3, 10):
    for B in (2, 3, 4):
        WORLDS[f"gain {g} x{B}"] = on_table(blocks=B, gain=g)
WORLDS["gain 3 of x x4"] = on_table(blocks=4, gain=3, gain_axis=1)
WORLDS["gain 3 of all x4"] = on_table(blocks=4, gain=3, gain_axis=3)
for t in (1, 3):
    for B in (2, 4):
        WORLDS[f"mount {t} x{B}"] = on_table(blocks=B, mount=t)
for n, name in ((dict(), "12"), (dict(points=ALL_24), "24")):
    WORLDS["1 g x2 " + name] = on_table(at_field=2, **n)
    WORLDS["1 g x3 " + name] = on_table(at_field=3, **n)
    WORLDS["1 g x3 of x " + name] = on_table(at_field=3, at_axis=0, **n)
    WORLDS["jitter 2 " + name] = on_table(jitter=2, **n)
    WORLDS["seats 1 " + name] = on_table(seat=1, **n)
    WORLDS["seats 3 " + name] = on_table(seat=3, **n)
    WORLDS["wander 2 " + name] = on_table(wander=2, **n)
WORLDS["wander 2 48"] = on_table(wander=2, repeats=4)
WORLDS["wander 2 12x4"] = on_table(wander=2, blocks=4)
for q in (2, 5, 10):
    WORLDS[f"step {q} paired 12"] = on_table(method="paired", step=q)
    WORLDS[f"step {q} paired 24"] = on_table(method="paired", step=q, points=ALL_24)
for s in (0, 1, 3):
    WORLDS[f"blocks {s} 12+3"] = on_table(block=s, extra=3)
WORLDS["periodic 3 fixed"] = on_table(periodic=3, fixed=True, period=12.0)
WORLDS["periodic 3 fixed 12x4"] = on_table(periodic=3, fixed=True, blocks=4, period=7.3)
for t in (3, 5):
    for n, name in ((dict(), "12"), (dict(points=ALL_24), "24"), (dict(blocks=4), "12x4")):
        WORLDS[f"t{t} {name}"] = on_table(tails=t, **n)
WORLDS["seats 10 12"] = on_table(seat=10)
for s, B in ((1, 4), (5, 4), (1, 8), (5, 8)):
    WORLDS[f"pose {s} 12x{B}"] = on_table(pose=s, blocks=B)
for s in (1, 3):
    WORLDS[f"laying {s} of 5 rows 24"] = on_table(laying=s, each=5, points=ALL_24)
for n, name in ((dict(), "12"), (dict(points=ALL_24), "24")):
    WORLDS[f"seats 1 of 5 rows {name}"] = on_table(seat=1, each=5, **n)
    WORLDS[f"seats 5 of 10 rows {name}"] = on_table(seat=5, each=10, **n)
WORLDS["ar .5 12x4"] = on_table(blocks=4, ar_=0.5)
WORLDS["ar .8 12x4"] = on_table(blocks=4, ar_=0.8)
for name, what in (("", {}), (" b 2", dict(soak_b=2)), (" S 2", dict(soak_s=4)), (" square 1.6", dict(square=1.6))):
    WORLDS[f"soaks 5{name}"] = on_table(soaks=5, options=["--temperature-order", "1", "--temperature-reference", "0"], **what)


def directions(rng, n, speed=0.3):
    """Returns n unit vectors: the directions of the field for an instrument that is turned by hand."""
    out = np.empty((n, 3))
    R = turn(rng.normal(size=3) * 3)
    w = rng.normal(size=3)
    for i in range(n):
        w = 0.95 * w + np.sqrt(1 - 0.95**2) * rng.normal(size=3)
        R = R @ turn(speed * w)
        out[i] = R[2]
    return out


class Cloud:
    """A recording of an instrument that is turned by hand, with |f| = 1 and symmetric S."""

    def __init__(self, rng, n=150, rho=0.0, noise=1e-3, k2=0.0, sessions=1, session_sd=0.0, hand=False):
        A = 0.05 * rng.normal(size=(3, 3))
        self.S = np.eye(3) + 0.5 * (A + A.T)
        self.b = 0.1 * rng.normal(size=3)
        v, block = [], []
        for s in range(sessions):
            u = rng.normal(size=(n, 3))
            u /= np.linalg.norm(u, axis=1)[:, None]
            if hand:
                u = directions(rng, n)
            k = rng.normal(size=3)
            r = u @ self.S.T + self.b + noise * session_sd * rng.normal(size=3)
            r += k2 * u**2 * np.sign(k)
            v.append(r + noise * ar(rng, rho, (n, 3)))
            block += [s + 1] * n
        self.v, self.block, self.rows = np.vstack(v), np.array(block), None


def in_hand(**what):
    return dict(kind="cloud", method="magnitude", options=["--field-magnitude", "1"], what=what)


for n in (30, 60, 150):
    for r in (0, .5, .8, .9):
        WORLDS[f"hand {n} ar {r}"] = in_hand(n=n, rho=r)
WORLDS["hand 400 ar .99"] = in_hand(n=400, rho=.99)
WORLDS["hand 1500 ar .995"] = in_hand(n=1500, rho=.995)
WORLDS["hand 400 turned ar .99"] = in_hand(n=400, rho=.99, hand=True)
for n in (60, 150, 1000):
    for k2 in (3e-3, 1e-2):
        WORLDS[f"hand {n} k2 {k2}"] = in_hand(n=n, k2=k2)
for B in (2, 4, 8):
    for s in (0, 4):
        WORLDS[f"sessions {B} of {s}"] = in_hand(n=60, sessions=B, session_sd=s)


class Rests:
    """Mean readings of a gyroscope in the rests of one log, with its biases."""

    def __init__(self, rng, n=30, rho=0.0, drift=0.0):
        self.b = 0.01 * rng.normal(size=3)
        self.S = np.eye(3)
        t = np.linspace(-0.5, 0.5, n)[:, None]
        self.v = self.b + 1e-4 * (ar(rng, rho, (n, 3)) + drift * t * np.ones(3))
        self.rows, self.block = None, np.ones(n, int)


for n in (15, 30, 60):
    for r, d in ((0, 0), (.6, 0), (.9, 0), (0, 5)):
        WORLDS[f"rests {n} ar {r} drift {d}"] = dict(kind="rests", method="bias", options=["--field", "earth_rotation"], what=dict(n=n, rho=r, drift=d))

class Later:
    """A calibrated run of several blocks and later readings, to check drift and stated uncertainties."""

    def __init__(self, rng, blocks=4, block=1.0, gain=0.0, moved=0.0):
        self.run = Run(rng, blocks=blocks, block=block, gain=gain)
        self.b, self.S = self.run.b, self.run.S
        shift = SIGMA * block * rng.normal(size=3) + SIGMA * moved
        gains = 1 + SIGMA * gain * rng.normal(size=3)
        slope = 3e-3 * rng.normal(size=2)
        f_table = np.array([*slope, np.sqrt(1 - slope @ slope)])

        def read(f):
            return self.b + shift + gains * (self.S @ f) + SIGMA * rng.normal(size=3)

        self.points = [STANDARD_12[i] for i in rng.permutation(12)]
        self.new = [read(to_cube(*p).T @ f_table) for p in self.points]
        poses = rng.normal(size=(6, 3))
        poses /= np.linalg.norm(poses, axis=1)[:, None]
        self.rest = [read(u) for u in poses for _ in range(3)]
        self.fields = rng.normal(size=(3, 3))
        self.fields /= np.linalg.norm(self.fields, axis=1)[:, None]
        self.used = [read(f) for f in self.fields]


for B in (2, 3, 4, 8):
    for b, g in ((0, 0), (1, 0), (3, 0), (0, 3)):
        WORLDS[f"later {B} blocks {b} gain {g}"] = dict(kind="later", method="joint", options=[], what=dict(blocks=B, block=b, gain=g))
WORLDS["later 4 blocks 1 moved 5"] = dict(kind="later", method="joint", options=[], what=dict(blocks=4, block=1, moved=5))


def judge_later(axiscal, world, units, seed, folder):
    """Returns a text: the share of units that `check` calls drifted, and the share of U that contain the field."""
    rng = np.random.default_rng(seed)
    at = lambda name: os.path.join(folder, name)
    number = lambda v: ",".join(repr(float(x)) for x in v)
    drifted = rest = held = total = 0
    for unit in range(units):
        one = Later(rng, **world["what"])
        for name, rows, v, block in (("old", one.run.rows, one.run.v, one.run.block), ("new", one.points, one.new, [1] * 12)):
            with open(at(name + ".csv"), "w") as file:
                file.write("run,block,rest,fence,x,y,z\n")
                for i, (p, values) in enumerate(zip(rows, v)):
                    file.write(f"{i + 1},{block[i]},{p[0]},{p[1]},{number(values)}\n")
            subprocess.run([axiscal, "calibrate", at(name + ".csv"), "--instrument", "accelerometer", "--method", "joint", "-o", at(name + ".json")],
                           capture_output=True)
        for name, v in (("rest", one.rest), ("used", one.used)):
            with open(at(name + ".csv"), "w") as file:
                file.write("x,y,z\n" + "".join(number(values) + "\n" for values in v))
        check = lambda other: json.loads(subprocess.run([axiscal, "check", at("old.json"), at(other), "--json"], capture_output=True, text=True).stdout)
        drifted += check("new.json")["drifted"]
        rest += check("rest.csv")["drifted"]
        out = subprocess.run([axiscal, "apply", at("old.json"), at("used.csv"), "--expanded"], capture_output=True, text=True).stdout.splitlines()
        head = out[0].split(",")
        for f, line in zip(one.fields, out[1:]):
            cells = dict(zip(head, line.split(",")))
            for k, axis in enumerate("xyz"):
                total += 1
                held += abs(float(cells[f"field_{axis}"]) - f[k]) <= float(cells[f"U_field_{axis}"])
    return f"  drifted {100 * drifted / units:.1f} % (a new run), {100 * rest / units:.1f} % (at rest); U contains the true field in {100 * held / total:.1f} % of readings"


MAKERS = {"table": Run, "cloud": Cloud, "rests": Rests}
INSTRUMENT = {"table": "accelerometer", "cloud": "accelerometer", "rests": "gyroscope"}


def simulate(axiscal, world, units, seed, folder):
    rng = np.random.default_rng(seed)
    runs = []
    path = os.path.join(folder, "runs.csv")
    with open(path, "w") as file:
        soaks = world["what"].get("soaks", 0)
        head = "serial,run,block," + ("temperature," if soaks else "") + ("rest,fence," if world["kind"] == "table" else "")
        file.write(head + "x,y,z\n")
        for unit in range(units):
            run = MAKERS[world["kind"]](rng, **world["what"])
            runs.append(run)
            for i, v in enumerate(run.v):
                pose = ",".join(run.rows[i]) + "," if run.rows else ""
                warm = f"{run.temperature[i]}," if soaks else ""
                file.write(f"U{unit},{i + 1},{run.block[i]},{warm}{pose}" + ",".join(repr(float(x)) for x in v) + "\n")
    command = [axiscal, "calibrate", path, "--instrument", INSTRUMENT[world["kind"]], "--method", world["method"],
               *world["options"], "-o", os.path.join(folder, "{serial}.json")]
    done = subprocess.run(command, capture_output=True, text=True)
    results = []
    for unit, run in enumerate(runs):
        record = os.path.join(folder, f"U{unit}.json")
        if os.path.exists(record):
            results.append((run, json.load(open(record))))
            os.remove(record)
    if not results:
        print(done.stderr[-600:])
    return results


def judge(results):
    rows = collections.defaultdict(list)
    notes, warnings = collections.Counter(), collections.Counter()
    for run, record in results:
        c, s = record["coefficients"], record["statistics"]
        b = np.array(c["bias"]) - run.b
        rows["bias"].append(np.stack([b, np.array(s["interval_95"]["bias"], float)]))
        if run.rows is not None or "method" in record and record["method"] != "bias":
            E = np.array(c["sensitivity"]) - run.S
            U = np.array(s["interval_95"]["sensitivity"], float)
            main = np.eye(3, dtype=bool)
            rows["main"].append(np.stack([E[main], U[main]]))
            rows["cross"].append(np.stack([E[~main], U[~main]]))
        for one in set(record.get("note_codes", [])):
            notes[one] += 1
        for one in {w["code"] for w in record.get("warnings", [])}:
            warnings[one] += 1
    text = ""
    for name, all_ in rows.items():
        a = np.array(all_)
        error, U = a[:, 0], a[:, 1]
        held = (np.abs(error) <= U).mean(axis=0)
        width = np.median(U) / (1.96 * np.sqrt((error**2).mean()))
        text += f"  {name} {100 * held.mean():.0f} (worst {100 * held.min():.0f}; width {width:.2f})"
    n = len(results)
    share = lambda counter: ", ".join(f"{k} {100 * v / n:.1f}" for k, v in counter.most_common())
    return f"{text}\n      warnings: {share(warnings) or '-'}; notes: {share(notes) or '-'}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("axiscal")
    parser.add_argument("-n", "--units", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--list", action="store_true")
    parser.add_argument("world", nargs="*", help="names of worlds or their beginnings; default: all worlds")
    given = parser.parse_intermixed_args()
    if given.list:
        print("\n".join(WORLDS))
        return
    for name, world in WORLDS.items():
        if given.world and not any(name.startswith(one) for one in given.world):
            continue
        with tempfile.TemporaryDirectory() as folder:
            if world["kind"] == "later":
                print(f"{name}: {given.units}", judge_later(given.axiscal, world, given.units, given.seed, folder), flush=True)
                continue
            results = simulate(given.axiscal, world, given.units, given.seed, folder)
        print(f"{name}: {len(results)} of {given.units}", judge(results) if results else "refused", flush=True)


if __name__ == "__main__":
    main()
