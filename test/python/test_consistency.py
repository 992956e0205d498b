"""Are the covariances right? Errors of many fits against scipy's chi-square."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import holdfast
from conftest import SIGMA, surface_points

TRIALS = 600
SWEEP = [
    # kxx, kxy, kyy, points
    (2.0, 0.0, 1.0, 60),
    (4.0, 0.0, -1.0, 60),
    (6.0, 2.0, -3.0, 120),
    (-5.0, 1.0, -8.0, 250),
]


def state_errors(case, rng):
    """Of paraboloids about what the same points give without noise, and covariances."""
    kxx, kxy, kyy, n = case
    exact = surface_points(rng, kxx, kxy, kyy, n, sigma=0.0)
    covariance = np.eye(3) * SIGMA**2
    truth = holdfast.fit(exact, covariance, surface="paraboloid")
    noisy = exact + rng.normal(0.0, SIGMA, (TRIALS, n, 3))
    fits = holdfast.fit_many(noisy, [covariance] * TRIALS, surface="paraboloid")
    assert fits.ok.all()
    return fits.difference(truth), fits.covariance


@pytest.mark.parametrize("case", SWEEP)
def test_errors_follow_chi_square(case, rng):
    errors, covariances = state_errors(case, rng)
    for part in (slice(3, 6), slice(6, 8), slice(8, 11), slice(3, 11)):
        e, S = errors[:, part], covariances[:, part, part]
        squared = np.einsum("ni,ni->n", e, np.linalg.solve(S, e[..., None])[..., 0])
        dof = e.shape[1]
        low, high = stats.chi2.ppf([5e-4, 1 - 5e-4], dof * TRIALS) / TRIALS
        # Second order adds a little: a few per cent at most.
        assert low * 0.95 < squared.mean() < high * 1.05, part
        inside = (squared < stats.chi2.ppf(0.95, dof)).mean()
        assert abs(inside - 0.95) < 0.035, part


def test_chi2_follows_chi_square(rng):
    covariance = np.eye(3) * SIGMA**2
    points = [surface_points(rng, 3.0, 0.0, 1.0, 100) for _ in range(TRIALS)]
    fits = holdfast.fit_many(points, [covariance] * TRIALS, surface="paraboloid")
    probability = stats.chi2.cdf(fits.chi2, fits.dof)
    assert stats.kstest(probability, "uniform").pvalue > 1e-3
