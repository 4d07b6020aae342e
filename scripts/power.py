#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Prints how often the most powerful test at a level of 1 % finds two effects, from the readings alone.

power.py

- The magnitude of the field wanders: it is correlated by 0.9 from reading to reading, with a standard deviation of 2
  sigma. sigma is the noise of a reading, relative to the field.
- A response with a square: v = b + S f + k f^2 with k = N(0, 1 sigma) for each axis, turned by hand (method
  `magnitude`) or laid on the table.

The test knows everything but the coefficients (Neyman and Pearson). "unknown noise" does not know the size of the
noise. No other test of the same level can be better, whatever its form. The figures are in docs/accuracy.md. Needs
numpy.
"""
import numpy as np

from worlds import ALL_24, SIGMA, STANDARD_12, to_cube

TRIALS = 4000


def power(J, effect, rng):
    """Returns the power of the best test for `effect`, with and without the size of the noise.

    J: rows x unknowns, the columns of the coefficients. effect: rows x rows, the covariance that the effect adds; the
    noise has the variance SIGMA^2. The test uses only what J leaves of the readings.
    """
    U, S, _ = np.linalg.svd(J, full_matrices=True)
    left = U[:, (S > 1e-9 * S[0]).sum():]
    none = SIGMA**2 * np.eye(left.shape[1])
    some = none + left.T @ effect @ left
    root = np.linalg.cholesky(some)
    z = rng.normal(size=(left.shape[1], TRIALS))
    y0, y1 = SIGMA * z, root @ rng.normal(size=z.shape)
    a, b = np.linalg.inv(none), np.linalg.inv(some)
    square = lambda y, m: np.einsum("ij,ij->j", y, m @ y)
    found = []
    for statistic in (lambda y: square(y, a) - square(y, b), lambda y: square(y, a) / square(y, b)):
        found.append((statistic(y1) > np.quantile(statistic(y0), 0.99)).mean())
    return np.array(found)


def columns_of_table(rows):
    """Returns the columns of b, S and the field's direction for labelled readings, and the fields in the cube."""
    n = len(rows)
    R = [to_cube(*row).T for row in rows]
    f = np.array([r @ [2e-3, -3e-3, 1.0] for r in R])
    J = np.zeros((3 * n, 14))
    for k in range(3):
        J[k * n:(k + 1) * n, 4 * k:4 * k + 4] = np.column_stack([np.ones(n), f])
        J[k * n:(k + 1) * n, 12:] = np.array([r[k, :2] for r in R])
    return J, f


def wandering_field(points, at_random, rng):
    n = len(points)
    J, f = columns_of_table([points[i] for i in (rng.permutation(n) if at_random else range(n))])
    along = np.vstack([np.diag(f[:, k]) for k in range(3)])
    t = np.arange(n)
    return power(J, (2 * SIGMA)**2 * along @ 0.9**np.abs(t[:, None] - t) @ along.T, rng)


def square_on_table(blocks, rng):
    J, f = columns_of_table(STANDARD_12 * blocks)
    squares = np.zeros((len(J), 3))
    for k in range(3):
        squares[k * len(f):(k + 1) * len(f), k] = f[:, k]**2
    return power(J, SIGMA**2 * squares @ squares.T, rng)


def square_by_magnitude(n, rng):
    u = rng.normal(size=(n, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    J = np.column_stack([u] + [u[:, i] * u[:, j] for i in range(3) for j in range(i + 1)])
    return power(J, SIGMA**2 * (u**3) @ (u**3).T, rng)


def main():
    rng = np.random.default_rng(1)
    print("effect: power with known noise, with unknown noise")
    for points in (STANDARD_12, ALL_24):
        for at_random in (True, False):
            found = np.mean([wandering_field(points, at_random, rng) for _ in range(8)], axis=0)
            order = "random order" if at_random else "the order of the design"
            print(f"field wanders, {len(points)} readings in {order}: {100 * found[0]:.0f} %, {100 * found[1]:.0f} %")
    for n in (60, 150):
        found = np.mean([square_by_magnitude(n, rng) for _ in range(4)], axis=0)
        print(f"square of 1 sigma, {n} readings by hand: {100 * found[0]:.0f} %, {100 * found[1]:.0f} %")
    for blocks in (1, 4):
        found = np.mean([square_on_table(blocks, rng) for _ in range(4)], axis=0)
        print(f"square of 1 sigma, 12 orientations, {blocks} blocks: {100 * found[0]:.0f} %, {100 * found[1]:.0f} %")


if __name__ == "__main__":
    main()
