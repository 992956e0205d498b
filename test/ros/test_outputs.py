"""Maps, risk, markers, diagnostics and parameters."""
import diagnostic_msgs.msg
import dynamic_reconfigure.client
import nav_msgs.msg
import numpy as np
import pytest
import tf2_msgs.msg
import visualization_msgs.msg

import ros_world
from grid_map_msgs.msg import GridMap, GridMapInfo
from holdfast_msgs.msg import FootholdArray, Patch
from messages import CLOUD, PATCHES, TF, cloud, symmetric, transform

PATIENT = f"_transform_timeout:={ros_world.LIMIT_S}"


def send_walk(one, walk, frame="camera"):
    """All answers to the frames of a walk with its poses."""
    answers = []
    for points, (seconds, *pose) in zip(walk[0], walk[2]):
        one.send("/tf", transform("odom", frame, 10.0 + seconds, pose))
        answers.append(one.ask(cloud(points, 10.0 + seconds, frame)))
    return answers


def heights(answer):
    """Standard deviation of each patch's centre along its normal, m."""
    result = []
    for patch in answer.patches:
        q = patch.pose.orientation
        normal = np.array([2 * (q.x * q.z + q.w * q.y), 2 * (q.y * q.z - q.w * q.x),
                           1 - 2 * (q.x * q.x + q.y * q.y)])
        centre = symmetric(patch.state_covariance)[-3:, -3:]
        result.append(np.sqrt(normal @ centre @ normal))
    return np.array(result)


def test_a_map_is_in_the_frame_of_odometry_and_keeps_its_patches(walk, link):
    one = link("_map:=true", "_odometry_frame:=odom", "_max_patches:=0",
               PATIENT, inputs={**CLOUD, **TF})
    answers = send_walk(one, walk)
    for answer in answers:
        assert answer.problem == "" and answer.header.frame_id == "odom"
    first = {patch.id for patch in answers[0].patches}
    last = {patch.id: patch for patch in answers[-1].patches}
    assert 0 not in first and len(last) == len(answers[-1].patches)
    assert len(first & set(last)) > 0.5 * len(first)
    assert max(patch.views for patch in last.values()) > 1
    assert {patch.is_seen_now for patch in last.values()} == {True, False}
    # The scene is a field of boulders about z = 0, which the sensor sees from above.
    z = [patch.pose.position.z for patch in last.values()]
    assert abs(np.median(z)) < 0.2


def test_odometry_that_is_less_sure_makes_a_map_less_sure(walk, link):
    sigmas = []
    for rate in (1e-4, 0.05):
        one = link("_map:=true", "_odometry_frame:=odom", "_max_patches:=0", PATIENT,
                   inputs={**CLOUD, **TF, "odometry": nav_msgs.msg.Odometry})
        message = nav_msgs.msg.Odometry(child_frame_id="camera")
        message.twist.covariance = (rate ** 2 * np.eye(6)).ravel().tolist()
        one.send("odometry", message)
        # Heard by the time the first frame is answered; the second is the first to move.
        last = send_walk(one, walk)[-1]
        unseen = [not patch.is_seen_now for patch in last.patches]
        sigmas.append(np.median(heights(last)[unseen]))
    # A centimetre and 0.01 rad at two metres for each frame, beside a few millimetres.
    assert sigmas[1] > 2.0 * sigmas[0], sigmas


def test_a_map_without_odometry_finds_its_poses_and_tells_them(walk, link):
    one = link("_map:=true", "_max_patches:=0",
               outputs={**PATCHES, "/tf": tf2_msgs.msg.TFMessage})
    for points, (seconds, *_) in zip(walk[0], walk[2]):
        answer = one.ask(cloud(points, 10.0 + seconds))
        assert answer.header.frame_id == "holdfast_map"
        told = one.get("/tf").transforms[0]
        assert told.header.frame_id == "camera" and told.child_frame_id == "holdfast_map"
        assert told.header.stamp == answer.header.stamp


def test_risk_comes_as_a_grid_and_as_footholds(walk, link):
    one = link("_foot:=point_foot", "_map:=true", "_odometry_frame:=odom",
               "_max_footholds:=5", PATIENT, inputs={**CLOUD, **TF},
               outputs={**PATCHES, "grid": GridMap, "footholds": FootholdArray})
    answer = send_walk(one, walk)[-1]
    # Of a grid the newest counts, and one that waits is dropped for it.
    grid = one.get("grid")
    while grid.info.header.stamp != answer.header.stamp:
        grid = one.get("grid")
    for _ in walk[0]:
        footholds = one.get("footholds")
    assert footholds.header.stamp == answer.header.stamp
    for header in (grid.info.header, footholds.header):
        assert header.frame_id == "odom"
    assert "risk_total" in grid.layers and grid.basic_layers == ["elevation"]
    rows = round(grid.info.length_x / grid.info.resolution)
    columns = round(grid.info.length_y / grid.info.resolution)
    for layer in grid.data:
        assert [dim.label for dim in layer.layout.dim] == ["column_index", "row_index"]
        assert [dim.size for dim in layer.layout.dim] == [columns, rows]
        assert len(layer.data) == rows * columns
    risk = np.array(grid.data[grid.layers.index("risk_total")].data)
    risk = risk[np.isfinite(risk)]
    assert risk.size and risk.min() >= 0.0 and risk.max() <= 1.0
    assert 0 < len(footholds.footholds) <= 5
    ids = {patch.id for patch in answer.patches}
    totals = [foothold.risk_total for foothold in footholds.footholds]
    # Steps of a millionth, within which the area of contact decides.
    assert all(a <= b + 2e-6 for a, b in zip(totals, totals[1:]))
    assert {foothold.patch for foothold in footholds.footholds} <= ids


def test_risk_of_a_frame_alone_has_a_grid_with_axes_of_its_own(walk, link):
    one = link("_foot:=point_foot",
               outputs={**PATCHES, "grid": GridMap, "footholds": FootholdArray,
                        "/tf": tf2_msgs.msg.TFMessage})
    answer = one.ask(cloud(walk[0][0], 1.0))
    assert answer.problem == "" and answer.header.frame_id == "camera"
    assert one.get("grid").info.header.frame_id == "holdfast_grid"
    told = one.get("/tf").transforms[0]
    assert told.header.frame_id == "camera" and told.child_frame_id == "holdfast_grid"
    assert one.get("footholds").header.frame_id == "camera"


def test_the_grid_is_that_of_grid_map_on_the_wire():
    # As grid_map_msgs 1.6 and 1.7 have them.
    assert GridMap._md5sum == "95681e052b1f73bf87b7eb984382b401"
    assert GridMapInfo._md5sum == "43ee5430e1c253682111cb6bedac0ef9"


def test_markers_are_meshes_and_ellipsoids_of_three_sigmas(walk, link):
    Marker = visualization_msgs.msg.Marker
    one = link("_max_patches:=50",
               outputs={**PATCHES, "markers": visualization_msgs.msg.MarkerArray})
    answer = one.ask(cloud(walk[0][0], 1.0))
    clear, mesh, *ellipsoids = one.get("markers").markers
    assert clear.action == Marker.DELETEALL
    assert mesh.type == Marker.TRIANGLE_LIST and mesh.ns == "patches"
    assert len(mesh.points) % 3 == 0 and len(mesh.points) == len(mesh.colors)
    assert len(ellipsoids) == len(answer.patches) <= 50
    assert len({marker.id for marker in ellipsoids}) == len(ellipsoids)
    for marker, patch in zip(ellipsoids, answer.patches):
        centre = np.array(patch.covariance).reshape(len(patch.parameters), -1)[-3:, -3:]
        sigmas = np.sqrt(np.linalg.eigvalsh(centre).clip(0.0))
        size = sorted((marker.scale.x, marker.scale.y, marker.scale.z))
        np.testing.assert_allclose(size, 6.0 * sigmas, rtol=1e-3, atol=2e-6)


def test_the_outline_of_a_patch_lies_on_it(walk, link):
    one = link()
    for patch in one.ask(cloud(walk[0][0], 1.0)).patches:
        centre = np.array([patch.pose.position.x, patch.pose.position.y,
                           patch.pose.position.z])
        points = np.array([[p.x, p.y, p.z] for p in patch.boundary])
        assert len(points) >= 4
        # Bounds are multiples of the points' spread within the radius.
        assert np.linalg.norm(points - centre, axis=1).max() < 3.0 * patch.radius
        assert Patch.PLANE <= patch.surface <= Patch.CIRCULAR_PARABOLOID


def test_radius_and_limits_may_change_while_the_node_runs(walk, link):
    points = walk[0][0]
    one = link()
    assert {round(p.radius, 6) for p in one.ask(cloud(points, 1.0)).patches} == {0.05}
    client = dynamic_reconfigure.client.Client(f"/{one.name}", timeout=ros_world.LIMIT_S)
    client.update_configuration({"radius": 0.08, "max_patches": 20})
    answer = one.ask(cloud(points, 2.0))
    assert {round(p.radius, 6) for p in answer.patches} == {0.08}
    assert 0 < len(answer.patches) <= 20
    client.update_configuration({"max_chi2_per_dof": 0.001})
    assert one.ask(cloud(points, 3.0)).patches == []
    client.close()


def test_diagnostics_count(walk, link):
    one = link(outputs={
        **PATCHES, "/diagnostics": diagnostic_msgs.msg.DiagnosticArray})
    one.ask(cloud(walk[0][0], 1.0))
    one.ask(cloud(np.full_like(walk[0][0], np.nan), 2.0))

    def counted():
        status = one.get("/diagnostics").status[0]
        values = {pair.key: pair.value for pair in status.values}
        return values.get("frames answered") == "2" and (status, values)

    status, values = ros_world.wait_until(counted, "second frame in diagnostics")
    assert status.level == diagnostic_msgs.msg.DiagnosticStatus.WARN
    assert "no valid point" in status.message
    assert values["frames with a problem"] == "1"
    assert values["frames received"] == "2"


@pytest.mark.parametrize("argument, word", [
    ("_radus:=0.1", "no parameter radus"), ("_sensor:=nobody", "nobody"),
    ("_queue:=many", "wrong type"), ("_axes:=mine", "axes"), ("_foot:=hoof", "hoof"),
    ("_motion_sigma_m:=0", "sigmas")])
def test_a_wrong_parameter_ends_the_node_with_one_line(world, argument, word, request):
    node = world.start("".join(c if c.isalnum() else "_" for c in request.node.name),
                       argument)
    ros_world.wait_until(lambda: not node.is_alive(), "end")
    assert node.popen.returncode == 1
    lines = node.text().strip().splitlines()
    assert len(lines) == 1 and word in lines[0], node.text()
