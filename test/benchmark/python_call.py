#!/usr/bin/env python3
"""What one call from Python costs over the C++ function on the same memory: ratios and
differences of the fastest of many, in one run, with warm-up.

  PYTHONPATH=build/python python3 test/benchmark/python_call.py
"""

from __future__ import annotations

import time

import numpy as np

import holdfast

SIGMA_M = 0.001
REPEATS = 2000
ROUNDS = 7


def fastest(call, repeats=REPEATS):
    best = float("inf")
    for _ in range(repeats):
        start = time.perf_counter_ns()
        call()
        best = min(best, time.perf_counter_ns() - start)
    return best * 1e-9


def bowl(rng, n):
    """Points (n, 3) of a shallow bowl a metre before the camera, m."""
    x, y = rng.uniform(-0.06, 0.06, (2, n))
    noise = rng.normal(0.0, SIGMA_M, n)
    return np.column_stack([x, y, 1.0 + 2.0 * x**2 + 3.0 * y**2 + noise])


def main():
    rng = np.random.default_rng(7)
    print("points  C++ [us]  call [us]  difference [us]")
    for n in (100, 400):
        points = bowl(rng, n)
        full = np.broadcast_to(np.eye(3) * SIGMA_M**2, (n, 3, 3)).copy()
        rounds = []
        for _ in range(ROUNDS):
            alone = holdfast._core._fit_seconds(points, full, REPEATS)
            one = fastest(lambda: holdfast.fit(points, full))
            rounds.append((one - alone, alone, one))
        difference, alone, one = sorted(rounds)[ROUNDS // 2]
        print(f"{n:6d}  {alone * 1e6:8.2f}  {one * 1e6:9.2f}  {difference * 1e6:15.2f}")


if __name__ == "__main__":
    main()
