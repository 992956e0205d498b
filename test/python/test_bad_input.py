"""Bad input is told in words, and nothing is printed."""

from __future__ import annotations

import numpy as np
import pytest

import holdfast
from conftest import SIGMA, surface_points

COVARIANCE = np.eye(3) * SIGMA**2
POINTS = surface_points(np.random.default_rng(5))
N = len(POINTS)


def with_row(array, row, value):
    changed = np.array(array, dtype=float)
    changed[row] = value
    return changed


FULL = np.broadcast_to(COVARIANCE, (N, 3, 3)).copy()
SKEW = with_row(FULL, 4, [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]])
INDEFINITE = with_row(FULL, 4, [[1, 2, 0], [2, 1, 0], [0, 0, 1]]) * 1e-6

FIT_CASES = [
    (ValueError, r"points: shape \(N, 3\) is needed, not \(150, 2\)", POINTS[:, :2], COVARIANCE),
    (ValueError, r"not \(3,\)", POINTS[0], COVARIANCE),
    (ValueError, r"not \(1, 150, 3\)", POINTS[None], COVARIANCE),
    (ValueError, "points: there are none", POINTS[:0], COVARIANCE),
    (TypeError, "points: .*real numbers.*object", POINTS.astype(object), COVARIANCE),
    (TypeError, "points: .*real numbers.*complex", POINTS.astype(complex), COVARIANCE),
    (TypeError, "points: .*real numbers", "points", COVARIANCE),
    (TypeError, "points: .*real numbers", None, COVARIANCE),
    (TypeError, "points: .*real numbers.*bool", POINTS > 0, COVARIANCE),
    (TypeError, "points: .*real numbers", [[1, 2, 3], [1, 2]], COVARIANCE),
    (ValueError, "points: row 7 is not finite", with_row(POINTS, 7, np.nan), COVARIANCE),
    (ValueError, "points: row 0 is not finite", with_row(POINTS, 0, np.inf), COVARIANCE),
    (ValueError, "covariances: row 4 is not finite", POINTS, with_row(FULL, 4, np.nan)),
    (ValueError, "covariances: row 4 has a negative variance", POINTS, with_row(FULL, 4, -COVARIANCE)),
    (ValueError, "covariances: row 0 has a negative variance", POINTS, -COVARIANCE),
    (ValueError, "covariances: row 4 .*not symmetric", POINTS, SKEW),
    (ValueError, "covariances: row 4 .*negative eigenvalue", POINTS, INDEFINITE),
    (ValueError, "covariances: shape .* beside 150 points is needed, not", POINTS, FULL[:-1]),
    (ValueError, "covariances: shape", POINTS, np.ones(N)),
    (TypeError, "covariances: .*real numbers", POINTS, "small"),
    (TypeError, "either covariances or a sensor", POINTS, None),
    (ValueError, "points are in m, covariances in m.2", POINTS, COVARIANCE * 1e12),
]


@pytest.mark.parametrize("case", range(len(FIT_CASES)))
def test_of_fit(case, capfd):
    error, message, points, covariances = FIT_CASES[case]
    with pytest.raises(error, match=message):
        holdfast.fit(points, covariances)
    if points is not None and covariances is not None:
        with pytest.raises(error, match="number 1: .*" + message if error is ValueError else message):
            holdfast.fit_many([POINTS, points], [COVARIANCE, covariances])
    out, err = capfd.readouterr()
    assert not out and not err


OPTION_CASES = [
    (TypeError, r"fit\(\) has no option 'surfce'; it has surface", {"surfce": "plane"}),
    (ValueError, "surface: 'ball' is none of auto, paraboloid, plane", {"surface": "ball"}),
    (TypeError, "surface: a text is needed, not int", {"surface": 3}),
    (ValueError, "plane_boundary: 'star' is none of", {"plane_boundary": "star"}),
    (ValueError, "covariance: 'best' is none of", {"covariance": "best"}),
    (TypeError, "containment: a number is needed, not str", {"containment": "0.9"}),
    (TypeError, "containment: a number is needed, not NoneType", {"containment": None}),
    (TypeError, "containment: a number is needed, not bool", {"containment": True}),
    (ValueError, "containment", {"containment": 2.0}),
    (ValueError, "containment: it is not a number", {"containment": float("nan")}),
    (TypeError, "max_iterations: a whole number is needed, not float", {"max_iterations": 3.0}),
    (ValueError, "iterations", {"max_iterations": 0}),
    (ValueError, "max_iterations: it is too large", {"max_iterations": 2**40}),
    (TypeError, "debias_scatter: True or False is needed, not int", {"debias_scatter": 1}),
    (ValueError, "sigma|floor", {"sigma_floor_m": -1.0}),
    (ValueError, r"viewpoint: shape \(3,\) is needed", {"viewpoint": (0.0, 1.0)}),
    (ValueError, "viewpoint: it is not finite", {"viewpoint": (0.0, 1.0, np.inf)}),
]


@pytest.mark.parametrize("case", range(len(OPTION_CASES)))
def test_of_options(case, capfd):
    error, message, options = OPTION_CASES[case]
    with pytest.raises(error, match=message):
        holdfast.fit(POINTS, COVARIANCE, **options)
    with pytest.raises(error, match=message):
        holdfast.fit_many([POINTS], [COVARIANCE], **options)
    assert capfd.readouterr() == ("", "")


def test_of_fit_with_a_sensor(kinect):
    with pytest.raises(TypeError, match="sensor: a holdfast.Sensor is needed, not str"):
        holdfast.fit(POINTS, sensor="kinect_v1")
    with pytest.raises(TypeError, match="either covariances or a sensor"):
        holdfast.fit(POINTS, COVARIANCE, sensor=kinect)
    with pytest.raises(TypeError, match="no other viewpoint"):
        holdfast.fit(POINTS, sensor=kinect, viewpoint=(0, 0, 0))
    with pytest.raises(ValueError, match="points are in m, not in mm"):
        holdfast.fit(POINTS * 1000, sensor=kinect)
    with pytest.raises(ValueError, match="row 3 is not in front of the camera"):
        holdfast.fit(with_row(POINTS, 3, [0, 0, -1]), sensor=kinect)
    with pytest.raises(ValueError, match="row 3 is not finite"):
        holdfast.fit(with_row(POINTS, 3, np.nan), sensor=kinect)


def test_of_fit_many():
    with pytest.raises(ValueError, match="2 of them beside 1 arrays"):
        holdfast.fit_many([POINTS], [COVARIANCE, COVARIANCE])
    with pytest.raises(ValueError, match="threads: it must not be negative"):
        holdfast.fit_many([POINTS], [COVARIANCE], threads=-1)
    with pytest.raises(TypeError, match="threads: a whole number"):
        holdfast.fit_many([POINTS], [COVARIANCE], threads=1.5)
    with pytest.raises(TypeError):
        holdfast.fit_many(3, [COVARIANCE])
    assert len(holdfast.fit_many([], [])) == 0


EXTRACT_CASES = [
    (ValueError, r"points: shape \(N, 3\) or \(H, W, 3\) is needed", np.ones((4, 4)), {}),
    (ValueError, "points: there are none", np.ones((0, 3)), {}),
    (ValueError, "points: none is finite", np.full((4, 4, 3), np.nan), {}),
    (TypeError, "points: .*real numbers", np.full((4, 3), "x"), {}),
    (TypeError, "points: .*real numbers.*object", POINTS.astype(object), {}),
    (ValueError, "points are in m, not in mm", POINTS * 1000, {}),
    (ValueError, "radius", POINTS, {"radius_m": -1.0}),
    (ValueError, "radius", POINTS, {"radius_m": 0.0}),
    (TypeError, r"extract\(\) has no option 'radius'", POINTS, {"radius": 0.1}),
    (ValueError, "neighborhood: 'cube' is none of patch, disc", POINTS, {"neighborhood": "cube"}),
    (ValueError, "threads", POINTS, {"threads": -2}),
    (ValueError, "overlap", POINTS, {"max_overlap": 3.0}),
    (ValueError, r"sensor_pose: shape \(4, 4\)", POINTS, {"sensor_pose": np.eye(3)}),
    (ValueError, "sensor_pose: it is no rigid", POINTS, {"sensor_pose": 2 * np.eye(4)}),
    (ValueError, "sensor_pose: it is no rigid", POINTS, {"sensor_pose": np.full((4, 4), np.nan)}),
    (ValueError, "covariances: shape", POINTS, {"covariances": np.ones((3, 6))}),
    (ValueError, "covariances: row 2 has a negative variance", POINTS, {"covariances": with_row(FULL, 2, -COVARIANCE)}),
    (TypeError, "validate: True or False", POINTS, {"validate": "no"}),
    (TypeError, "max_extent: a number is needed, not str", POINTS, {"max_extent": "1"}),
]


@pytest.mark.parametrize("case", range(len(EXTRACT_CASES)))
def test_of_extract(case, kinect, capfd):
    error, message, points, options = EXTRACT_CASES[case]
    with pytest.raises(error, match=message):
        holdfast.extract(points, kinect, **options)
    assert capfd.readouterr() == ("", "")


def test_of_sensors(tmp_path, kinect):
    with pytest.raises(ValueError, match="no_such: no such file, and no built-in sensor"):
        holdfast.Sensor.load("no_such")
    with pytest.raises(TypeError):
        holdfast.Sensor.load(3)
    (tmp_path / "bad.yaml").write_text("name: x\ncamera: 3\n")
    with pytest.raises(ValueError, match="bad.yaml:2: "):
        holdfast.Sensor.load(tmp_path / "bad.yaml")
    with pytest.raises(ValueError, match="model: 'sonar' is none of"):
        holdfast.Sensor.make("sonar")
    with pytest.raises(TypeError, match=r"Sensor.make\(\) has no option 'sigma'"):
        holdfast.Sensor.make("constant", sigma=1)
    with pytest.raises(ValueError, match="sigma_m"):
        holdfast.Sensor.make("constant", sigma_m=-1.0)
    with pytest.raises(ValueError, match="sigma_disparity_px"):
        holdfast.Sensor.make("stereo", sigma_point_px=0.3)
    with pytest.raises(ValueError, match="width and height"):
        holdfast.Sensor.make("constant", sigma_m=0.001, width=0)
    with pytest.raises(ValueError, match="pattern"):
        holdfast.Sensor.make("constant", sigma_m=0.001, pattern=[(-1.0, 2.0, "gaussian")])
    with pytest.raises(ValueError, match="pattern: its sigma .* is more than that"):
        holdfast.Sensor.make("constant", sigma_m=0.001, pattern=[(0.1, 2.0, "gaussian")])
    with pytest.raises(TypeError, match="pattern: each wave"):
        holdfast.Sensor.make("constant", sigma_m=0.001, pattern=[1.0])
    with pytest.raises(ValueError, match="covariances|points: shape"):
        kinect.covariances(np.ones(3))
    with pytest.raises(ValueError, match=r"depth: shape \(480, 640\)"):
        kinect.points(np.ones((4, 4)))


def test_of_the_simulator(kinect):
    with pytest.raises(ValueError, match="moon"):
        holdfast.simulate("moon", kinect)
    with pytest.raises(TypeError, match="scene: a text is needed"):
        holdfast.simulate(3, kinect)
    with pytest.raises(TypeError, match="holdfast.Sensor"):
        holdfast.simulate("rocks", "kinect_v1")
    with pytest.raises(ValueError, match="stride"):
        holdfast.simulate("rocks", kinect, stride=0)
    with pytest.raises(ValueError, match="seed: it must lie between"):
        holdfast.simulate("rocks", kinect, seed=-1)
    with pytest.raises(ValueError, match="noise"):
        holdfast.simulate("rocks", kinect, stride=8, noise_scale=-1.0)
    with pytest.raises(ValueError, match="distance"):
        holdfast.simulate("rocks", kinect, distance=-1.0)


def test_of_the_calibration(kinect):
    with pytest.raises(ValueError, match="frame"):
        holdfast.calibrate([], kinect)
    with pytest.raises(ValueError, match=r"frames: shape \(H, W, 3\) of each"):
        holdfast.calibrate(np.ones((4, 4, 3)), kinect)
    with pytest.raises(TypeError, match="region_px"):
        holdfast.calibrate([np.ones((4, 4, 3))], kinect, region_px=1.5)


def test_of_maps(tmp_path, kinect):
    with pytest.raises(TypeError, match=r"PatchMap\(\) has no option 'radius'"):
        holdfast.PatchMap(kinect, radius=1)
    with pytest.raises(ValueError, match="radii"):
        holdfast.PatchMap(kinect, radius_m=-1.0)
    made = holdfast.PatchMap(kinect)
    with pytest.raises(ValueError, match="covariance: it is zero"):
        made.move(np.eye(4), np.zeros((6, 6)))
    with pytest.raises(ValueError, match="covariance: it is none"):
        made.move(np.eye(4), -np.eye(6))
    with pytest.raises(ValueError, match="increment: it is no rigid"):
        made.move(np.zeros((4, 4)), np.eye(6))
    with pytest.raises(ValueError, match="organized"):
        made.update(POINTS)
    with pytest.raises(OSError, match="no_folder"):
        made.save(tmp_path / "no_folder" / "map")
    with pytest.raises(ValueError, match="no_map"):
        holdfast.PatchMap.load(tmp_path / "no_map", kinect)


def test_of_patches(rng):
    patches = holdfast.fit_many([POINTS] * 3, [COVARIANCE] * 3)
    with pytest.raises(IndexError, match="none has number 3"):
        patches[3]
    with pytest.raises(IndexError):
        patches[np.ones(5, bool)]
    with pytest.raises(ValueError, match="there is no type 'cone'"):
        patches.mask("cone")
    with pytest.raises(ValueError, match="read-only"):
        patches.centre[0, 0] = 1.0
    with pytest.raises(AttributeError):
        patches.centre = 1
    with pytest.raises(ValueError, match="spacing"):
        patches[0].mesh(spacing=-1.0)
    with pytest.raises(ValueError, match=r"points: shape \(N, 3\)"):
        patches[0].distance(np.ones(3))
