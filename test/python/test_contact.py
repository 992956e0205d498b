"""Feet, contact risk and footholds."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import holdfast

ROOT = Path(__file__).resolve().parents[2]
QUALITY = ("slip", "height", "tilt", "gap", "support", "total", "joint", "cvar_gap_m",
           "contact_area_m2", "pose", "pose_covariance")  # fmt: skip
AHEAD = (0.0, 0.0, 1.0)  # a load that presses on what a camera looks at


def bowl(rng, kx=0.0, ky=0.0, sigma=0.003, n=200, half=0.1, surface="paraboloid"):
    xy = rng.uniform(-half, half, (n, 2))
    z = 1.0 + 0.5 * (xy**2 @ [kx, ky])
    points = np.column_stack([xy, z]) + rng.normal(0.0, sigma, (n, 3))
    patch = holdfast.fit(points, sigma**2 * np.eye(3), surface=surface)
    assert patch.ok
    return patch


@pytest.fixture(scope="module")
def foot():
    return holdfast.Foot.make((0.08, 0.04), friction=0.6, friction_sigma=0.1)


@pytest.fixture(scope="module")
def rock_map(rocks, kinect):
    made = holdfast.PatchMap(kinect, radius_m=0.08, spacing_m=0.06)
    for seed in range(3):
        made.update(rocks.draw(seed))
    return made


@pytest.fixture(scope="module")
def down(rocks):
    return rocks.sensor_pose[:3, :3].T @ [0.0, 0.0, -1.0]


def test_feet(tmp_path):
    assert {"point_foot", "humanoid_foot", "gripper_pad"} <= set(holdfast.Foot.names())
    flat = holdfast.Foot.load("humanoid_foot")
    assert flat.name == "humanoid_foot" and flat.ankle == "compliant"
    assert flat.area == pytest.approx(0.02) and flat.reach == pytest.approx(np.hypot(0.1, 0.05))
    assert flat.sole.shape == (4, 2) and flat.friction == (0.7, 0.15)
    shutil.copy(ROOT / "config" / "feet" / "gripper_pad.yaml", tmp_path / "pad.yaml")
    assert holdfast.Foot.load(tmp_path / "pad.yaml").name == "gripper_pad"
    made = holdfast.Foot.make(
        [(0, 0), (0.1, 0), (0, 0.1)], name="wedge", curvature=(2, 3), ankle="stiff", gap_m=0.01
    )
    assert made.area == pytest.approx(0.005) and made.ankle == "stiff" and made.name == "wedge"
    np.testing.assert_array_equal(made.curvature, [2.0, 3.0])
    assert made.tolerances["gap_m"] == 0.01 and "wedge" in repr(made)


def test_slip_is_what_drawn_normals_say(rng):
    """The load is inclined, so that it leaves the friction cone every now and then."""
    patch = bowl(rng, sigma=0.01, n=40, surface="plane")
    load = np.array([0.5, 0.0, 1.0])
    sole = holdfast.Foot.make((0.02, 0.02), friction=0.6, friction_sigma=0.1)
    risk = holdfast.contact_risk(patch, sole, patch.centre, load)
    n = 400000
    k = [patch.state_names.index(name) for name in ("nu_x", "nu_y")]
    nu = rng.multivariate_normal([0.0, 0.0], patch.covariance[np.ix_(k, k)], n)
    # R <- R Exp(nu_x, nu_y, 0) turns z towards (nu_y, -nu_x).
    tilted = np.column_stack([nu[:, 1], -nu[:, 0], np.ones(n)])
    normals = tilted @ patch.pose[:3, :3].T
    along = normals @ (-load / np.linalg.norm(load))
    slope = np.sqrt((normals**2).sum(axis=1) / along**2 - 1.0)
    spread = np.log(1.0 + (0.1 / 0.6) ** 2)
    friction = np.exp(rng.normal(np.log(0.6) - spread / 2, np.sqrt(spread), n))
    share = np.mean(slope > friction)
    assert 0.05 < share < 0.5
    # What slopes have of second order in the turn is left out: its square, times a density.
    second_order = 5.0 * patch.covariance[np.ix_(k, k)].trace()
    assert abs(risk.slip - share) < 4 * np.sqrt(share * (1 - share) / n) + second_order


@pytest.mark.parametrize("ankle", ["compliant", "stiff"])
def test_a_sole_turned_half_round_is_the_same(rng, ankle):
    patch = bowl(rng, kx=4.0, ky=-2.0)
    sole = holdfast.Foot.make((0.08, 0.04), ankle=ankle, gap_m=0.003)
    yaws = np.array([0.3, 0.3 + np.pi, 1.2])
    risks = holdfast.contact_risk(patch, sole, np.tile(patch.centre, (3, 1)), AHEAD, yaw=yaws)
    assert risks.ok.all() and len(risks) == 3
    for name in ("slip", "height", "tilt", "gap", "total", "joint", "contact_area_m2"):
        column = getattr(risks, name)
        assert column[0] == pytest.approx(column[1], rel=1e-3, abs=1e-5), name
    # Only what depends on the sole may differ otherwise.
    assert risks.slip[0] == pytest.approx(risks.slip[2], rel=1e-3, abs=1e-6)
    assert risks.gap[0] != risks.gap[2]


def test_union_and_joint_and_pose(rng, foot):
    patch = bowl(rng, kx=3.0, ky=3.0)
    risk = holdfast.contact_risk(patch, foot, patch.centre, AHEAD, yaw=0.7)
    assert risk.ok and risk.status == "ok" and risk.patch == 0 and risk.yaw == 0.7
    parts = risk.slip + risk.height + risk.tilt + risk.gap + risk.support
    assert risk.total == pytest.approx(min(parts, 1.0)) and risk.joint <= risk.total + 1e-6
    rotation = risk.pose[:3, :3]
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(rotation) > 0 and rotation[2, 2] < -0.9  # out, to the camera
    np.testing.assert_allclose(risk.pose[:2, 3], patch.centre[:2], atol=1e-9)
    values = np.linalg.eigvalsh(risk.pose_covariance)
    assert values.min() > -1e-12 and np.sum(values > 1e-6 * values.max()) == 3
    assert risk.assumptions == holdfast.RISK_ASSUMPTIONS and len(risk.assumptions) == 6


def test_rough_measurements_are_riskier(rng, foot):
    totals = []
    for sigma in (0.01, 0.02, 0.04):
        patch = bowl(rng, sigma=sigma, n=40)
        totals.append(holdfast.contact_risk(patch, foot, patch.centre, AHEAD).total)
    assert totals[0] < totals[1] < totals[2]


def test_where_nothing_was_seen_there_are_no_numbers(rng, foot):
    patch = bowl(rng)
    points = patch.centre + [[0.0, 0, 0], [0.5, 0, 0]]
    risks = holdfast.contact_risk(patch, foot, points, AHEAD)
    assert list(risks.ok) == [True, False]
    assert list(risks.status) == ["ok", "insufficient_support"]
    for name in QUALITY:
        column = getattr(risks, name)
        assert np.isfinite(column[0]).all() and np.isnan(column[1]).all(), name
        assert getattr(risks[1], name) is None
    assert risks[1].support_share == 0.0
    beside = holdfast.contact_risk(patch, foot, patch.centre, (1, 0, 0))
    assert not beside.ok and beside.status == "not_facing_the_load"
    failed = holdfast.fit(np.zeros((3, 3)), np.eye(3))
    assert not holdfast.contact_risk(failed, foot, (0, 0, 1), AHEAD).ok


def test_many_points_are_as_single_ones(rng, foot):
    patch = bowl(rng, kx=2.0, sigma=0.02, n=40)
    points = patch.centre + rng.uniform(-0.02, 0.02, (5, 3)) * [1, 1, 0]
    risks = holdfast.contact_risk(patch, foot, points, AHEAD, yaw=0.2)
    for point, risk in zip(points, risks):
        alone = holdfast.contact_risk(patch, foot, point, AHEAD, yaw=0.2)
        assert alone.total == risk.total
        np.testing.assert_array_equal(alone.pose, risk.pose)
    some = risks[risks.total < np.median(risks.total)]
    assert len(some) == 2 and len(risks[1:4]) == 3 and risks[-1].total == risks.total[-1]
    assert set(risks.to_dict()) >= set(QUALITY) | {"ok", "status", "point", "yaw", "patch"}
    assert len(holdfast.contact_risk(patch, foot, np.zeros((0, 3)), AHEAD)) == 0


def test_every_patch_of_a_map_is_accounted_for(rock_map, foot, down):
    ranking = holdfast.rank_footholds(rock_map, foot, down, yaws=8, spacing_m=0.1)
    counts = ranking.counts
    assert counts["candidates"] == len(rock_map) == len(ranking.tried)
    assert sum(v for k, v in counts.items() if k != "candidates") == counts["candidates"]
    best, tried = ranking.footholds, ranking.tried
    assert len(ranking) == len(best) == counts["footholds"] > 3 and best.ok.all()
    assert (np.diff(np.floor(best.total / 1e-6)) >= 0).all()
    gaps = np.linalg.norm(best.point[:, None] - best.point, axis=2)
    assert gaps[np.triu_indices(len(best), 1)].min() >= 0.1
    for name in QUALITY:
        whole = np.isfinite(getattr(tried, name).reshape(len(tried), -1)).all(axis=1)
        np.testing.assert_array_equal(whole, tried.ok)
    assert best.pose.shape == (len(best), 4, 4)
    assert best.pose_covariance.shape == (len(best), 6, 6)
    assert (best.views > 0).all() and (best.last_seen <= rock_map.frames).all()
    assert 0.05 < ranking.widest_support_m < 0.2
    assert ranking.assumptions == holdfast.RISK_ASSUMPTIONS


def test_rankings_do_not_depend_on_threads_or_limits(rock_map, foot, down):
    one = holdfast.rank_footholds(rock_map, foot, down, yaws=4).footholds
    two = holdfast.rank_footholds(rock_map, foot, 3 * down, yaws=4, threads=2).footholds
    np.testing.assert_array_equal(one.patch, two.patch)
    np.testing.assert_allclose(one.total, two.total, atol=1e-12)
    few = holdfast.rank_footholds(rock_map, foot, down, yaws=4, max_footholds=2)
    np.testing.assert_array_equal(few.footholds.patch, one.patch[:2])
    assert len(few) == 2 and few.counts["beyond_limit"] > 0
    assert sum(few.counts.values()) == 2 * len(rock_map)


def test_places_of_a_map_are_as_the_ranking_has_them(rock_map, foot, down):
    best = holdfast.rank_footholds(rock_map, foot, down, yaws=1).footholds
    asked = holdfast.contact_risk(rock_map, foot, best.point, down, yaw=best.yaw)
    same = asked.patch == best.patch  # the nearest patch may be another one
    assert same.sum() > 2
    np.testing.assert_allclose(asked.total[same], best.total[same], atol=1e-6)
    np.testing.assert_allclose(asked.pose[same], best.pose[same], atol=1e-9)


def test_a_map_without_patches_has_no_footholds(kinect, foot):
    empty = holdfast.PatchMap(kinect)
    ranking = holdfast.rank_footholds(empty, foot, AHEAD)
    assert len(ranking) == 0 and not any(ranking.counts.values())
    assert ranking.footholds.pose.shape == (0, 4, 4)
    assert not holdfast.contact_risk(empty, foot, (0, 0, 1), AHEAD).ok


FOOT_CASES = [
    (ValueError, r"sole: shape \(2,\) of length and width, or \(N, 2\)", ((1, 2, 3),), {}),
    (TypeError, "sole: .*real numbers", ("long",), {}),
    (ValueError, "three corners", ([(0, 0), (1, 0)],), {}),
    (ValueError, "cross", ([(0, 0), (1, 1), (1, 0), (0, 1)],), {}),
    (ValueError, "curvature: shape", ((0.1, 0.1),), {"curvature": 3.0}),
    (ValueError, "ankle: 'soft' is none of compliant, stiff", ((0.1, 0.1),), {"ankle": "soft"}),
    (TypeError, "name: a text", ((0.1, 0.1),), {"name": 3}),
    (TypeError, r"Foot.make\(\) has no option 'mass'", ((0.1, 0.1),), {"mass": 3}),
    (ValueError, "friction", ((0.1, 0.1),), {"friction": -1.0}),
    (ValueError, "tolerance", ((0.1, 0.1),), {"gap_m": 0.0}),
    (ValueError, "sole: length and width must be positive", ((-0.1, 0.1),), {}),
]


@pytest.mark.parametrize("case", range(len(FOOT_CASES)))
def test_feet_that_make_no_sense(case, capfd):
    error, message, given, options = FOOT_CASES[case]
    with pytest.raises(error, match=message):
        holdfast.Foot.make(*given, **options)
    assert capfd.readouterr() == ("", "")


def test_files_of_feet_that_make_no_sense(tmp_path):
    with pytest.raises(ValueError, match="no_such: no such file, and no built-in foot"):
        holdfast.Foot.load("no_such")
    (tmp_path / "bad.yaml").write_text("name: x\nsole: 3\n")
    with pytest.raises(ValueError, match="bad.yaml:2: "):
        holdfast.Foot.load(tmp_path / "bad.yaml")
    with pytest.raises(TypeError):
        holdfast.Foot.load(3)


RISK_CASES = [
    (ValueError, r"point: shape \(3,\) or \(N, 3\)", ((0.0, 1.0), AHEAD), {}),
    (ValueError, "point of a placement must be finite", ((0, 0, np.nan), AHEAD), {}),
    (ValueError, "number 1: the point", ([[0, 0, 1], [0, 0, np.inf]], AHEAD), {}),
    (TypeError, "point: .*real numbers", ("here", AHEAD), {}),
    (ValueError, "load must be finite and not zero", ((0, 0, 1), (0, 0, 0)), {}),
    (ValueError, "load_direction: it is not finite", ((0, 0, 1), (0, 0, np.inf)), {}),
    (ValueError, r"load_direction: shape \(3,\)", ((0, 0, 1), (0, 1)), {}),
    (ValueError, "yaw", ((0, 0, 1), AHEAD), {"yaw": np.nan}),
    (ValueError, "yaw: shape", ((0, 0, 1), AHEAD), {"yaw": [0.0, 1.0]}),
    (TypeError, "yaw: .*real numbers", ((0, 0, 1), AHEAD), {"yaw": "north"}),
    (ValueError, "sole must point against", ((0, 0, 1), AHEAD), {"sole_normal": AHEAD}),
]


@pytest.mark.parametrize("case", range(len(RISK_CASES)))
def test_placements_that_make_no_sense(case, foot, capfd):
    error, message, given, options = RISK_CASES[case]
    patch = bowl(np.random.default_rng(3))
    with pytest.raises(error, match=message):
        holdfast.contact_risk(patch, foot, *given, **options)
    assert capfd.readouterr() == ("", "")


def test_rankings_that_make_no_sense(kinect, foot):
    made = holdfast.PatchMap(kinect)
    with pytest.raises(TypeError, match="foot: a holdfast.Foot is needed, not str"):
        holdfast.rank_footholds(made, "humanoid_foot", AHEAD)
    with pytest.raises(TypeError, match="patch_map: a holdfast.PatchMap is needed, not list"):
        holdfast.rank_footholds([], foot, AHEAD)
    with pytest.raises(TypeError, match="surface: a holdfast.Patch or a holdfast.PatchMap"):
        holdfast.contact_risk(3, foot, (0, 0, 1), AHEAD)
    with pytest.raises(ValueError, match="yaw"):
        holdfast.rank_footholds(made, foot, AHEAD, yaws=0)
    with pytest.raises(ValueError, match="spacing"):
        holdfast.rank_footholds(made, foot, AHEAD, spacing_m=-1.0)
    with pytest.raises(ValueError, match="one foothold"):
        holdfast.rank_footholds(made, foot, AHEAD, max_footholds=0)
    with pytest.raises(ValueError, match="threads"):
        holdfast.rank_footholds(made, foot, AHEAD, threads=-1)
    with pytest.raises(TypeError, match=r"rank_footholds\(\) has no option 'spacing'"):
        holdfast.rank_footholds(made, foot, AHEAD, spacing=1)
    with pytest.raises(ValueError, match="load"):
        holdfast.rank_footholds(made, foot, (0, 0, 0))
