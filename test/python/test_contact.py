"""Feet, contact risk and footholds."""

from __future__ import annotations

import os
import shutil
import struct
import subprocess
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
    assert risk.assumptions == holdfast.RISK_ASSUMPTIONS and len(risk.assumptions) == 7


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
    assert (np.diff(np.round(best.total / 1e-6)) >= 0).all()
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


@pytest.fixture(scope="module")
def grid(rock_map, foot, down):
    return holdfast.risk_grid(rock_map, foot, down, resolution_m=0.04, yaws=4, threads=0)


def test_layers_are_views_of_the_grid(grid):
    rows, columns = grid.shape
    layers = grid.layers
    assert list(layers) == list(grid) and len(grid) == len(layers) == 14
    for name, layer in layers.items():
        assert layer.shape == (rows, columns) and layer.dtype == np.float32, name
        assert np.shares_memory(layer, grid[name]) and layer.flags.f_contiguous
        assert not layer.flags.writeable
    assert rows * columns > 200 and grid.resolution_m == 0.04
    # They outlive the grid.
    risk = holdfast.risk_grid(holdfast.PatchMap(holdfast.Sensor.load("kinect_v1")),
                              holdfast.Foot.make((0.1, 0.1)), AHEAD)["risk_total"]  # fmt: skip
    assert risk.shape == (0, 0)
    assert f"{rows} x {columns} cells of 0.04 m" in repr(grid)
    assert grid.assumptions == holdfast.RISK_ASSUMPTIONS


def test_cells_lie_where_the_grid_says(grid, down):
    np.testing.assert_allclose(grid.axes[:, 2], -down, atol=1e-12)
    np.testing.assert_allclose(np.diff(grid.x), -0.04, atol=1e-9)
    np.testing.assert_allclose(np.diff(grid.y), -0.04, atol=1e-9)
    middle = [grid.x.mean(), grid.y.mean(), 0.0]
    np.testing.assert_allclose(grid.position, middle, atol=1e-9)
    own = grid.points @ grid.axes
    elevation = grid["elevation"]
    seen = np.isfinite(elevation)
    assert seen.sum() > 100 and not seen.all()
    np.testing.assert_array_equal(seen, np.isfinite(grid.points).all(axis=2))
    x, y = np.meshgrid(grid.x, grid.y, indexing="ij")
    np.testing.assert_allclose(own[seen][:, 0], x[seen], atol=1e-9)
    np.testing.assert_allclose(own[seen][:, 1], y[seen], atol=1e-9)
    np.testing.assert_allclose(own[seen][:, 2], elevation[seen], atol=1e-5)
    normal = np.stack([grid[f"normal_{axis}"] for axis in "xyz"], axis=2)[seen]
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-5)
    assert (normal[:, 2] > 0).all() and (grid["elevation_sigma"][seen] > 0).all()


def test_a_cell_says_what_a_contact_there_says(grid, rock_map, foot, down):
    total = grid["risk_total"]
    known = np.isfinite(total)
    assert known.sum() > 50
    asked = holdfast.contact_risk(rock_map, foot, grid.points[known], down)
    # A cell takes the patch on top, a contact that of the nearest anchor: they are the same
    # where the sole stands on the cell's surface, and turned alike where no turn is best.
    off = np.linalg.norm(asked.pose[:, :3, 3] - grid.points[known], axis=1)
    same = (off < 1e-6) & (grid["yaw_best"][known] == 0.0)
    assert same.sum() > 20
    for name in ("total", "slip", "gap", "support"):
        values = grid[f"risk_{name}"][known][same]
        np.testing.assert_allclose(getattr(asked, name)[same], values, atol=1e-5, err_msg=name)


def tiff_layers(path):
    """Pages of float32 by their names: what `holdfast risk --layers` writes."""
    data = path.read_bytes()
    (at,) = struct.unpack_from("<I", data, 4)
    layers = {}
    while at:
        (count,) = struct.unpack_from("<H", data, at)
        tags = {}
        for k in range(count):
            tag, kind, length, value = struct.unpack_from("<HHII", data, at + 2 + 12 * k)
            tags[tag] = (length, value)
        name = data[tags[270][1] :].split(b"\0", 1)[0].decode()
        shape = tags[257][1], tags[256][1]
        layers[name] = np.frombuffer(data, "<f4", shape[0] * shape[1], tags[273][1]).reshape(shape)
        (at,) = struct.unpack_from("<I", data, at + 2 + 12 * count)
    return layers


def test_the_program_writes_the_same_layers(rock_map, down, tmp_path):
    program = Path(os.environ.get("HOLDFAST_BUILD_DIR", "")) / "bin" / "holdfast"
    if not program.is_file():
        pytest.skip("no program beside the module")
    rock_map.save(tmp_path / "rocks.map")
    subprocess.run(
        [program, "risk", "rocks.map", "--foot", "point_foot", "--layers", "layers.tif",
         "--resolution", "0.05", "--quiet",
         "--load-direction", *(f"{x:.17g}" for x in down)],
        cwd=tmp_path, check=True,
    )  # fmt: skip
    written = tiff_layers(tmp_path / "layers.tif")
    foot = holdfast.Foot.load("point_foot")
    made = holdfast.risk_grid(rock_map, foot, down, resolution_m=0.05, threads=0)
    assert list(written) == list(made)
    for name, layer in written.items():
        np.testing.assert_allclose(made[name], layer, atol=1e-6, equal_nan=True, err_msg=name)


def test_grids_have_the_bounds_asked_for(rock_map, foot, down):
    bounds = np.array([[-0.1, -0.2], [0.1, 0.1]])
    small = holdfast.risk_grid(rock_map, foot, down, resolution_m=0.05, yaws=1, bounds=bounds)
    assert small.shape == (4, 6)
    assert small.x.max() < 0.1 and small.y.min() > -0.2
    one = holdfast.risk_grid(
        rock_map, foot, 2 * down, resolution_m=0.05, yaws=1, bounds=bounds, threads=2
    )
    for name, layer in small.layers.items():
        np.testing.assert_array_equal(layer, one[name], err_msg=name)


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


GRID_CASES = [
    (ValueError, "resolution must be > 0", {"resolution_m": 0.0}),
    (ValueError, "resolution_m: it is not a number", {"resolution_m": np.nan}),
    (TypeError, "resolution_m: a number is needed, not str", {"resolution_m": "fine"}),
    (ValueError, "yaw", {"yaws": 0}),
    (ValueError, "threads", {"threads": -1}),
    (TypeError, r"risk_grid\(\) has no option 'resolution'; it has resolution_m", {"resolution": 1}),
    (ValueError, r"bounds: shape \(2, 2\) of the lowest x, y", {"bounds": (0, 1)}),
    (ValueError, "low ones below the high", {"bounds": [[1, 1], [0, 0]]}),
    (ValueError, "bounds must be finite", {"bounds": [[0, 0], [1, np.inf]]}),
    (TypeError, "bounds: .*real numbers", {"bounds": "all"}),
    (ValueError, "10 million cells", {"bounds": [[0, 0], [100, 100]], "resolution_m": 0.01}),
]


@pytest.mark.parametrize("case", range(len(GRID_CASES)))
def test_grids_that_make_no_sense(case, kinect, foot, capfd):
    error, message, options = GRID_CASES[case]
    with pytest.raises(error, match=message):
        holdfast.risk_grid(holdfast.PatchMap(kinect), foot, AHEAD, **options)
    assert capfd.readouterr() == ("", "")


def test_arguments_of_grids_that_are_none(kinect, foot, grid):
    made = holdfast.PatchMap(kinect)
    with pytest.raises(TypeError, match="patch_map: a holdfast.PatchMap is needed, not list"):
        holdfast.risk_grid([], foot, AHEAD)
    with pytest.raises(TypeError, match="foot: a holdfast.Foot is needed, not str"):
        holdfast.risk_grid(made, "humanoid_foot", AHEAD)
    with pytest.raises(ValueError, match="load"):
        holdfast.risk_grid(made, foot, (0, 0, 0))
    with pytest.raises(KeyError, match="'risk' is none of elevation, "):
        grid["risk"]
    with pytest.raises(TypeError, match="layer: a text is needed, not int"):
        grid[0]
    with pytest.raises(ValueError, match="read-only"):
        grid["risk_total"][0, 0] = 0.0
