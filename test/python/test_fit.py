"""One patch: right, and the same however it is asked for."""

from __future__ import annotations

import numpy as np
import pytest

import holdfast
from conftest import SIGMA, surface_points

COVARIANCE = np.eye(3) * SIGMA**2




def same(a: holdfast.Patch, b: holdfast.Patch) -> None:
    assert a.status == b.status and a.type == b.type and a.chi2 == b.chi2
    np.testing.assert_array_equal(a.state, b.state)
    np.testing.assert_array_equal(a.covariance, b.covariance)
    np.testing.assert_array_equal(a.parameters, b.parameters)
    np.testing.assert_array_equal(a.parameter_covariance, b.parameter_covariance)


def test_finds_the_surface(rng):
    patch = holdfast.fit(surface_points(rng), COVARIANCE)
    assert patch.ok and patch.status == "converged"
    assert patch.type == "hyperbolic_paraboloid" and patch.boundary == "ellipse"
    assert abs(patch.centre[2] - 1.0) < 0.005
    # Seen from the origin, the normal shows to it; curvatures are those of -z.
    assert patch.normal[2] < -0.99
    trace = patch.state[3] + patch.state[5]
    sigma = np.sqrt(patch.covariance[3, 3] + patch.covariance[5, 5])
    assert abs(trace + 1.0) < 5.0 * sigma
    assert patch.dof == 150 - 6 and 0.6 < patch.chi2_per_dof < 1.5


@pytest.mark.parametrize(
    "surface",
    ["plane", "sphere", "circular_cylinder", "circular_paraboloid", "paraboloid"],
)
def test_surfaces_can_be_forced(rng, surface):
    patch = holdfast.fit(surface_points(rng, 4.0, 0.0, 4.1), COVARIANCE, surface=surface)
    assert patch.ok
    assert surface in (patch.surface, "paraboloid")
    size = len(patch.state_names)
    assert patch.state.shape == (size,) and patch.covariance.shape == (size, size)
    dof = len(patch.parameter_names)
    assert patch.parameters.shape == (dof,)
    assert patch.parameter_covariance.shape == (dof, dof)
    eigenvalues = np.linalg.eigvalsh(patch.covariance)
    assert eigenvalues.min() > -1e-6 * eigenvalues.max()


@pytest.mark.parametrize("boundary", ["ellipse", "circle", "rectangle", "quad"])
def test_planes_take_any_boundary(rng, boundary):
    patch = holdfast.fit(
        surface_points(rng, 0.0, 0.0, 0.0),
        COVARIANCE,
        surface="plane",
        plane_boundary=boundary,
    )
    assert patch.type == f"plane_{boundary}"
    assert len(patch.bounds) == {"ellipse": 2, "circle": 1, "rectangle": 2, "quad": 5}[boundary]


@pytest.mark.parametrize("form", ["packed", "one", "stack", "fortran", "float32", "list"])
def test_takes_any_form_of_numbers(rng, form):
    points = surface_points(rng)
    full = np.broadcast_to(COVARIANCE, (len(points), 3, 3)).copy()
    expected = holdfast.fit(points, full)
    if form == "packed":
        upper = np.triu_indices(3)
        same(holdfast.fit(points, full[:, upper[0], upper[1]]), expected)
    elif form == "one":
        same(holdfast.fit(points, COVARIANCE), expected)
    elif form == "stack":
        wide = np.zeros((len(points), 7))
        wide[:, 1:4] = points
        same(holdfast.fit(wide[:, 1:4], full), expected)
    elif form == "fortran":
        same(holdfast.fit(np.asfortranarray(points), np.asfortranarray(full)), expected)
    elif form == "float32":
        single = points.astype(np.float32)
        same(holdfast.fit(single, full), holdfast.fit(single.astype(float), full))
    else:
        same(holdfast.fit(points.tolist(), full.tolist()), expected)


def test_covariance_of_the_centre_by_finite_differences(rng):
    """J Sigma J^T with J from moving every point a little, for a few points."""
    points = surface_points(rng, 5.0, 0.0, 3.0, n=40)
    options = dict(surface="paraboloid", polish_tolerance_sigma=1e-9)
    patch = holdfast.fit(points, COVARIANCE, **options)
    step = 1e-6
    total = np.zeros((3, 3))
    for i in range(len(points)):
        columns = []
        for axis in range(3):
            ends = []
            for sign in (-1, 1):
                moved = points.copy()
                moved[i, axis] += sign * step
                ends.append(holdfast.fit(moved, COVARIANCE, **options).centre)
            columns.append((ends[1] - ends[0]) / (2 * step))
        J = np.column_stack(columns)
        total += J @ COVARIANCE @ J.T
    np.testing.assert_allclose(
        patch.covariance[-3:, -3:], total, rtol=0, atol=1e-4 * np.trace(total)
    )


def test_moves_with_the_points(rng):
    points = surface_points(rng)
    shift = np.array([3.0, -2.0, 1.5])
    a = holdfast.fit(points, COVARIANCE)
    b = holdfast.fit(points + shift, COVARIANCE, viewpoint=shift)
    assert a.type == b.type
    np.testing.assert_allclose(b.centre, a.centre + shift, atol=1e-9)
    np.testing.assert_allclose(b.covariance, a.covariance, rtol=1e-5, atol=1e-16)


def test_normal_points_to_the_viewpoint(rng):
    points = surface_points(rng)
    assert holdfast.fit(points, COVARIANCE).normal[2] < 0
    assert holdfast.fit(points, COVARIANCE, viewpoint=(0, 0, 2)).normal[2] > 0


def test_failed_fits_have_none(rng):
    patch = holdfast.fit(surface_points(rng, n=4), COVARIANCE)
    assert not patch.ok and patch.status == "too_few_points" and patch.points == 4
    for name in (
        "type surface boundary state state_names covariance parameters parameter_names "
        "parameter_covariance centre normal pose curvatures bounds area chi2 dof "
        "chi2_expected chi2_per_dof normal_sigma centre_sigma verdict residual seed"
    ).split():
        assert getattr(patch, name) is None, name
    assert patch.flags == ()
    with pytest.raises(ValueError, match="too_few_points"):
        patch.mesh()
    line = holdfast.fit(np.column_stack([np.linspace(0, 1, 50)] * 3), COVARIANCE)
    assert not line.ok and line.covariance is None


def test_flags_say_what_is_not_observable(rng):
    patch = holdfast.fit(
        surface_points(rng, 8.0, 0.0, 8.0), COVARIANCE, surface="elliptic_paraboloid"
    )
    assert "axis_not_observable" in patch.flags
    assert np.isnan(patch.parameter_covariance).any()
    assert np.isfinite(patch.covariance).all()


def test_modes_of_the_covariance_agree(rng):
    points = surface_points(rng, 6.0, 0.0, 2.0, n=300)
    exact = holdfast.fit(points, COVARIANCE).covariance
    for mode in ("gauss_newton", "second_order", "monte_carlo"):
        other = holdfast.fit(points, COVARIANCE, covariance=mode)
        ratio = np.diag(other.covariance)[3:] / np.diag(exact)[3:]
        assert (ratio > 0.7).all() and (ratio < 1.4).all(), mode
    assert holdfast.fit(points, COVARIANCE, covariance="second_order").mean_shift is not None


def test_mesh_and_distance(rng):
    patch = holdfast.fit(surface_points(rng), COVARIANCE)
    vertices, triangles = patch.mesh(spacing=0.01)
    assert vertices.shape[1] == 3 and triangles.shape[1] == 3
    assert triangles.min() == 0 and triangles.max() == len(vertices) - 1
    np.testing.assert_allclose(patch.distance(vertices), 0.0, atol=1e-12)
    above = patch.centre + 0.01 * patch.normal
    np.testing.assert_allclose(patch.distance(above[None]), 0.01, rtol=1e-9)
    corners = vertices[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals @ patch.normal > 0).all()
    assert abs(0.5 * (normals @ patch.normal).sum() - patch.area) < 0.1 * patch.area


def test_many_are_as_one_and_threads_do_not_matter(rng):
    points = [surface_points(rng, *rng.normal(0, 4, 3), n=40 + 7 * i) for i in range(60)]
    covariances = [np.eye(3) * SIGMA**2 * (1 + i % 3) for i in range(60)]
    one = holdfast.fit_many(points, covariances, threads=1)
    two = holdfast.fit_many(points, covariances, threads=2)
    assert len(one) == len(two) == 60
    for i, (a, b) in enumerate(zip(one, two)):
        same(a, b)
        same(a, holdfast.fit(points[i], covariances[i]))


def test_sensor_gives_the_covariances(kinect, rng):
    points = surface_points(rng)
    quiet = kinect.without_pattern()
    known = holdfast.fit(points, quiet.covariances(points))
    there = holdfast.fit(points, sensor=quiet, noise_at_surface=False)
    assert known.type == there.type
    np.testing.assert_allclose(there.state, known.state, rtol=0, atol=1e-9)
    np.testing.assert_allclose(
        there.covariance, known.covariance, rtol=0, atol=1e-6 * np.abs(known.covariance).max()
    )
    # What neighbouring pixels share does not average.
    shared = holdfast.fit(points, sensor=kinect)
    assert shared.centre_sigma > 1.5 * known.centre_sigma
    assert shared.chi2_expected < shared.dof


def test_differences_are_in_the_axes_of_the_first(rng):
    points = surface_points(rng, 5.0, 1.0, 3.0)
    a = holdfast.fit(points, COVARIANCE, surface="paraboloid")
    b = holdfast.fit(points + 1e-4, COVARIANCE, surface="paraboloid")
    np.testing.assert_allclose(a.difference(a), 0.0, atol=1e-12)
    turn = a.difference(b)
    np.testing.assert_allclose(turn[-3:], b.centre - a.centre, atol=1e-12)
    np.testing.assert_allclose(
        np.linalg.norm(turn[6:8]), np.arccos(np.clip(a.normal @ b.normal, -1, 1)), atol=1e-7
    )
    many = holdfast.fit_many([points], [COVARIANCE], surface="paraboloid")
    np.testing.assert_array_equal(many.difference(b)[0], turn)
    plane = holdfast.fit(points, COVARIANCE, surface="plane")
    assert np.isnan(many.difference(plane)).all()
    with pytest.raises(ValueError, match="type"):
        a.difference(plane)


def test_separate_pattern(kinect, rng):
    patch = holdfast.fit(
        surface_points(rng), sensor=kinect, separate_pattern=True, surface="paraboloid"
    )
    rest = patch.covariance - patch.white_covariance
    assert np.linalg.eigvalsh(rest).min() > -1e-9 * np.trace(patch.covariance)


def test_dict_holds_plain_things(rng):
    import json

    patch = holdfast.fit(surface_points(rng), COVARIANCE)
    made = patch.to_dict()
    assert made["type"] == patch.type and made["centre"] == patch.centre.tolist()
    json.dumps(made)


def test_paper_options_are_taken(rng):
    paper = dict(
        residual="sampson",
        debias_scatter=False,
        normal_from_pca=False,
        centre_on_normal_line=False,
        smooth_circle_radius=False,
        statistical_discrimination=False,
        covariance="stagewise",
    )
    assert holdfast.fit(surface_points(rng), COVARIANCE, **paper).ok
