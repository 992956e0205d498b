"""Patches over time, and the calibration of a camera."""

from __future__ import annotations

import numpy as np
import pytest

import holdfast

MOTION = np.diag([1e-6] * 3 + [1e-6] * 3)


def test_views_make_patches_surer(rocks, kinect, tmp_path):
    made = holdfast.PatchMap(kinect, radius_m=0.08, spacing_m=0.1)
    first = made.update(rocks.points)
    assert first["born"] > 5 and first["fused"] == 0 and first["pose_found"] is None
    once = made.patches
    assert len(once) == len(made) and once.ok.all()
    for seed in range(5):
        made.move(np.eye(4), MOTION)
        report = made.update(rocks.draw(seed))
    assert made.frames == 6 and report["fused"] > 5
    assert np.nanmedian(made.patches.points) > np.nanmedian(once.points)

    made.save(tmp_path / "rocks.map")
    again = holdfast.PatchMap.load(tmp_path / "rocks.map", kinect, spacing_m=0.1)
    assert len(again) == len(made)
    np.testing.assert_array_equal(again.patches.centre, made.patches.centre)
    np.testing.assert_array_equal(again.patches.covariance, made.patches.covariance)
    other = holdfast.Sensor.load("xtion")
    with pytest.raises(ValueError, match="the map is of kinect_v1"):
        holdfast.PatchMap.load(tmp_path / "rocks.map", other)


def test_motions_add_up(kinect):
    step = np.eye(4)
    step[:3, 3] = [0.1, 0.0, 0.0]
    turn = np.eye(4)
    turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    made = holdfast.PatchMap(kinect)
    made.move(step, MOTION)
    made.move(turn, MOTION)
    made.move(step, MOTION)
    made.update(np.full((48, 64, 3), 1.0))
    np.testing.assert_allclose(made.pose, step @ turn @ step, atol=1e-12)


def test_calibration_finds_the_noise_that_was_drawn(kinect):
    quiet = holdfast.Sensor.make(
        "stereo", sigma_point_px=0.0, sigma_disparity_px=0.15, baseline_m=0.075, focal_px=580.0
    )
    image = holdfast.simulate("plane_rectangle", quiet, distance=1.0)
    frames = [image.draw(seed) for seed in range(6)]
    found = holdfast.calibrate(frames, quiet)
    assert found["status"] == "ok" and found["frames"] == 6
    value, low, high = found["sigmas_px"]["temporal"]
    assert low < value < high and abs(value - 0.15) < 0.02
    nothing = holdfast.calibrate([np.full((480, 640, 3), np.nan)] * 2, quiet)
    assert nothing["status"] == "nothing_static" and nothing["quantum_px"] is None
