"""Patches of images and clouds, as arrays."""

from __future__ import annotations

import json

import numpy as np
import pytest

import holdfast


@pytest.fixture(scope="module")
def patches(rocks, kinect):
    return holdfast.extract(rocks.points, kinect, radius_m=0.08, spacing_m=0.06)


def test_finds_patches_where_the_surface_is(rocks, kinect, patches):
    assert len(patches) > 20
    assert patches.accepted.all() and patches.ok.all()
    rows = rocks.points.reshape(-1, 3)[patches.seed_index]
    distance = np.linalg.norm(rows - patches.centre, axis=1)
    assert distance.max() < 0.08
    np.testing.assert_allclose(np.linalg.norm(patches.normal, axis=1), 1.0, atol=1e-12)
    assert ((patches.normal * patches.centre).sum(axis=1) < 0).all()


def test_columns_are_what_patches_have(patches):
    for i in (0, 3, len(patches) - 1):
        one = patches[i]
        assert patches.type[i] == one.type and patches.surface[i] == one.surface
        assert patches.status[i] == one.status and patches.verdict[i] == one.verdict
        for name in "chi2 chi2_expected chi2_per_dof dof points radius normal_sigma".split():
            assert getattr(patches, name)[i] == getattr(one, name), name
        for name in "centre normal curvatures".split():
            np.testing.assert_array_equal(getattr(patches, name)[i], getattr(one, name))
        n, p = patches.state_size[i], patches.parameter_size[i]
        np.testing.assert_array_equal(patches.state[i, :n], one.state)
        np.testing.assert_array_equal(patches.covariance[i, :n, :n], one.covariance)
        np.testing.assert_array_equal(patches.parameters[i, :p], one.parameters)
        np.testing.assert_array_equal(
            patches.parameter_covariance[i, :p, :p], one.parameter_covariance
        )
        assert np.isnan(patches.state[i, n:]).all()
        assert np.isnan(patches.covariance[i, n:]).all()


def test_columns_are_made_once_and_slices_are_views(patches):
    assert patches.centre is patches.centre
    part = patches[2:9]
    assert len(part) == 7 and np.shares_memory(part.centre, patches.centre)
    assert not part.centre.flags.writeable
    np.testing.assert_array_equal(part.chi2, patches.chi2[2:9])


def test_choosing(patches):
    assert [p.seed_index for p in patches] == list(patches.seed_index)
    assert patches[-1].seed_index == patches.seed_index[-1]
    for surface in np.unique(patches.surface):
        mask = patches.surface == surface
        np.testing.assert_array_equal(patches.mask(surface), mask)
        chosen = patches[mask]
        assert len(chosen) == mask.sum() and set(chosen.surface) == {surface}
    assert [p.type for p in patches[[3, 1]]] == [patches.type[3], patches.type[1]]
    assert not patches.mask("plane_quad").any()
    assert len(patches[np.zeros(len(patches), bool)]) == 0


def test_threads_do_not_matter(rocks, kinect, patches):
    for threads in (1, 2):
        again = holdfast.extract(
            rocks.points, kinect, radius_m=0.08, spacing_m=0.06, threads=threads
        )
        assert len(again) == len(patches)
        for name, column in patches.to_dict().items():
            np.testing.assert_array_equal(again.to_dict()[name], column, err_msg=name)


def test_what_was_left_out_is_accounted_for(rocks, kinect):
    every = holdfast.extract(
        rocks.points, kinect, radius_m=0.08, spacing_m=0.06, keep_failures=True
    )
    kept = holdfast.extract(rocks.points, kinect, radius_m=0.08, spacing_m=0.06)
    assert len(every) == len(kept) + sum(kept.rejected.values()) + sum(kept.turned_down.values())
    assert every.accepted.sum() == len(kept)
    counts = kept.accounting
    assert counts["in_cloud"] == rocks.points.size // 3
    assert counts["in_cloud"] == sum(n for what, n in counts.items() if what != "in_cloud")
    free = holdfast.extract(
        rocks.points, kinect, radius_m=0.08, spacing_m=0.06, validate=False
    )
    assert set(free.verdict) == {""} and len(free) > len(kept)


def test_clouds_and_other_frames(rocks, kinect, patches):
    pose = np.eye(4)
    pose[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    pose[:3, 3] = [400000.0, 5000000.0, 30.0]
    moved = rocks.points @ pose[:3, :3].T + pose[:3, 3]
    there = holdfast.extract(
        moved, kinect, sensor_pose=pose, radius_m=0.08, spacing_m=0.06
    )
    # Survey coordinates hold less than a nanometre, single precision rounds elsewhere.
    assert abs(len(there) - len(patches)) <= 0.05 * len(patches)
    common, i, j = np.intersect1d(there.seed_index, patches.seed_index, return_indices=True)
    assert len(common) > 0.9 * len(patches)
    back = (there.centre[i] - pose[:3, 3]) @ pose[:3, :3]
    near = np.linalg.norm(back - patches.centre[j], axis=1)
    assert np.median(near) < 1e-5
    cloud = rocks.points[np.isfinite(rocks.points).all(axis=2)]
    scattered = holdfast.extract(cloud, kinect, radius_m=0.08, spacing_m=0.06)
    assert len(scattered) > 10


def test_own_covariances_and_single_precision(rocks, kinect):
    options = dict(radius_m=0.08, spacing_m=0.1)
    full = kinect.covariances(rocks.points)
    upper = np.triu_indices(3)
    a = holdfast.extract(rocks.points, kinect, covariances=full, **options)
    b = holdfast.extract(
        rocks.points.astype(np.float32),
        kinect,
        covariances=full[..., upper[0], upper[1]],
        **options,
    )
    assert len(a) == len(b) > 5
    np.testing.assert_array_equal(a.centre, b.centre)


def test_whole(rocks, kinect):
    plane = holdfast.simulate("plane_ellipse", kinect, stride=3)
    patches = holdfast.extract(plane.points, kinect, whole=True)
    assert len(patches) == 1 and patches[0].seed_index is None
    assert patches[0].surface == "plane"


def test_one_mesh_of_all(patches):
    vertices, triangles, owners = patches.mesh()
    assert len(owners) == len(triangles) and triangles.max() == len(vertices) - 1
    alone, its = patches[2].mesh()
    np.testing.assert_array_equal(
        vertices[triangles[owners == 2]], alone[its]
    )


def test_json_is_that_of_the_program(patches):
    made = json.loads(patches.to_json())
    assert len(made["patches"]) == len(patches)
    for key in ("sensor", "options", "patches"):
        assert key in made
    np.testing.assert_array_equal([p["parameters"]["c_x"] if isinstance(p["parameters"], dict) else p["parameters"][-3] for p in made["patches"]], patches.centre[:, 0])
    json.loads(holdfast.fit_many([np.eye(3)], [np.eye(3) * 1e-6]).to_json())


def test_json_ends_where_patches_do(patches):
    assert len(json.loads(patches[:2].to_json())["patches"]) == 2


def test_simulation_is_reproducible(kinect):
    a = holdfast.simulate("stairs", kinect, stride=8, seed=7)
    b = holdfast.simulate("stairs", kinect, stride=8, seed=7)
    np.testing.assert_array_equal(a.points, b.points)
    assert a.points.shape == (60, 80, 3) and a.covariances.shape == (60, 80, 3, 3)
    seen = np.isfinite(a.truth[..., 2])
    np.testing.assert_array_equal(seen, a.hits >= 0)
    noise = (a.points - a.truth)[seen]
    assert 0 < np.abs(noise).max() < 0.3
    assert not np.array_equal(a.draw(1)[seen], a.draw(2)[seen])
    still = holdfast.simulate("stairs", kinect, stride=8, noise_scale=0.0)
    np.testing.assert_array_equal(still.points, still.truth)
    K = kinect.camera_matrix
    u = a.truth[..., 0] / a.truth[..., 2] * K[0, 0] + K[0, 2]
    np.testing.assert_allclose(u[seen], np.broadcast_to(8.0 * np.arange(80), (60, 80))[seen], atol=1e-6)


def test_arrays_outlive_what_they_came_from(kinect):
    points = holdfast.simulate("ball", kinect, stride=8).points
    assert np.isfinite(points).any()


def test_sensor_of_own_making(kinect):
    sensor = holdfast.Sensor.make("constant", sigma_m=0.002, sigma_lateral_m=0.002)
    points = np.array([[0.1, 0.2, 1.0], [0.0, 0.0, 2.0]])
    np.testing.assert_allclose(
        sensor.covariances(points), np.broadcast_to(np.eye(3) * 4e-6, (2, 3, 3)), atol=1e-18
    )
    assert np.isnan(kinect.covariances([[0, 0, -1.0]])).all()
    assert "kinect_v1" in holdfast.Sensor.names() and kinect.size == (480, 640)
    stereo = holdfast.Sensor.make(
        "stereo", sigma_point_px=0.35, sigma_disparity_px=0.17, fx=575.8, fy=575.8
    )
    np.testing.assert_allclose(
        stereo.covariances(points), kinect.covariances(points), rtol=1e-12
    )
    depth = np.full(kinect.size, 2.0)
    depth[5, 7] = 0
    image = kinect.points(depth)
    assert np.isnan(image[5, 7]).all() and image[0, 0, 2] == 2.0
