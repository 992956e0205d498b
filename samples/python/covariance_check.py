"""Is the covariance of a patch right? Draw the noise again 2000 times and look.

python3 samples/python/covariance_check.py    writes covariance_check.png
"""

import matplotlib.pyplot as plt
import numpy as np
from scipy import stats

import holdfast

TRIALS = 2000
SIGMA = 0.001  # m, of every point, in every direction
rng = np.random.default_rng(1)

# A bowl of 10 x 10 cm, one metre away, seen by 100 points.
x, y = rng.uniform(-0.05, 0.05, (2, 100))
exact = np.column_stack([x, y, 1.0 - 2.0 * x**2 - 4.0 * y**2])
noisy = exact + rng.normal(0.0, SIGMA, (TRIALS, *exact.shape))

covariance = SIGMA**2 * np.eye(3)
truth = holdfast.fit(exact, covariance, surface="paraboloid")
fits = holdfast.fit_many(noisy, [covariance] * TRIALS, surface="paraboloid")

# The curvature matrix of every fit less the true one, in units of its covariance.
k = [truth.state_names.index(name) for name in ("k_xx", "k_xy", "k_yy")]
errors = fits.difference(truth)[:, k]
covariances = fits.covariance[:, k][:, :, k]
squared = np.einsum("ni,ni->n", errors, np.linalg.solve(covariances, errors[..., None])[..., 0])

inside = np.mean(squared < stats.chi2.ppf(0.95, len(k)))
print(f"mean squared error over its covariance: {squared.mean() / len(k):.3f} (1 is right)")
print(f"within the 95 % ellipsoid: {100 * inside:.1f} %")

grid = np.linspace(0.0, 15.0, 200)
plt.hist(squared, bins=60, range=(0, 15), density=True, alpha=0.5, label=f"{TRIALS} fits")
plt.plot(grid, stats.chi2.pdf(grid, len(k)), label="chi-square, 3 degrees of freedom")
plt.xlabel("squared Mahalanobis distance of the curvature")
plt.legend()
plt.savefig("covariance_check.png", dpi=100)
