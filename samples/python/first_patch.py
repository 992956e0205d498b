"""One patch of a simulated depth image, and how sure it is.

python3 samples/python/first_patch.py
"""

import numpy as np

import holdfast

sensor = holdfast.Sensor.load("kinect_v1")
image = holdfast.simulate("elliptic_paraboloid", sensor, distance=1.0, seed=1)
points = image.points[image.hits == 0]  # (N, 3), m, those that met the patch

patch = holdfast.fit(points, sensor=sensor)
if not patch.ok:
    raise SystemExit(f"no patch: {patch.status}")

print(f"{patch.type}  normal {patch.normal.round(3)}  sigma {patch.normal_sigma:.4f} rad")
print(f"centre {patch.centre.round(4)} m  sigma {1e3 * patch.centre_sigma:.2f} mm")
print(f"chi2 {patch.chi2:.0f}, where {patch.chi2_expected:.0f} is expected")
for name, value, variance in zip(patch.state_names, patch.state, np.diag(patch.covariance)):
    print(f"  {name:5s} {value:10.5f} +- {np.sqrt(variance):.5f}")
