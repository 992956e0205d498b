"""What the tests of the Python module share."""

from __future__ import annotations

import zlib

import numpy as np
import pytest

import holdfast


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Seeded from the name of the test; the seed is printed where a test fails."""
    seed = zlib.crc32(request.node.nodeid.encode())
    print(f"seed {seed}")
    return np.random.default_rng(seed)


@pytest.fixture(scope="session")
def kinect() -> holdfast.Sensor:
    return holdfast.Sensor.load("kinect_v1")


@pytest.fixture(scope="session")
def rocks(kinect: holdfast.Sensor) -> holdfast.Simulation:
    return holdfast.simulate("rocks", kinect, stride=4, seed=3)


SIGMA = 0.001


def surface_points(
    rng: np.random.Generator,
    kxx: float = 3.0,
    kxy: float = 0.5,
    kyy: float = -2.0,
    n: int = 150,
    sigma: float = SIGMA,
) -> np.ndarray:
    """Noisy points of z = 1 + (kxx x^2 + 2 kxy xy + kyy y^2)/2 over 10 x 10 cm."""
    x, y = rng.uniform(-0.05, 0.05, (2, n))
    z = 1.0 + 0.5 * (kxx * x**2 + 2 * kxy * x * y + kyy * y**2)
    return np.column_stack([x, y, z]) + rng.normal(0.0, sigma, (n, 3))
