"""The node answers frames of a bag as the library does, and outlives what is no frame."""
import numpy as np
import pytest
import rosbag
import sensor_msgs.msg

import ros_world
from messages import CLOUD, TF, cloud, symmetric, transform

# Every seed of every frame, as the program does it.
WHOLE = ("_max_patches:=0",)

def assert_same_patches(answer, file, *options):
    expected = ros_world.fit(file, *options)["patches"]
    assert len(answer.patches) == len(expected) > 0
    float32 = np.finfo(np.float32).eps
    for patch, other in zip(answer.patches, expected):
        same = dict(rtol=float32, atol=0.0)
        np.testing.assert_allclose(patch.parameters, other["parameters"], **same)
        np.testing.assert_allclose(patch.state, other["state"], **same)
        np.testing.assert_allclose(symmetric(patch.state_covariance),
                                   other["state_covariance"], **same)
        unknown = np.array(other["covariance"], float)  # null becomes NaN
        np.testing.assert_allclose(symmetric(patch.covariance), unknown, **same)
        assert bool(patch.flags) == bool(other["flags"]), (patch.flags, other["flags"])
        assert patch.chi2 == pytest.approx(other["chi2"], rel=float32)
        assert patch.points == other["points"]


def test_every_frame_of_a_bag_is_answered_as_the_program_does(world, scratch, walk, link):
    frames, files, poses = walk
    bag_file = scratch / "walk.bag"
    with rosbag.Bag(str(bag_file), "w") as bag:
        for points, (seconds, *pose) in zip(frames, poses):
            message = cloud(points, 100.0 + seconds)
            bag.write("/tf", transform("odom", "camera", 100.0 + seconds, pose),
                      message.header.stamp)
            bag.write("/walk/cloud", message, message.header.stamp)
    one = link(*WHOLE, f"_queue:={len(frames)}", "cloud:=/walk/cloud", inputs={})
    ros_world.wait_until(lambda: world.names("/walk/cloud", 1), "subscription")
    player = ros_world.Process(
        ["rosbag", "play", "-q", "--wait-for-subscribers", "-k", bag_file],
        world.env, scratch / "play.log")
    try:
        answers = [one.get() for _ in frames]
    finally:
        player.kill()
    # The camera that the first frame's points lie on counts for all.
    _, intrinsics = intrinsics_of(files[0])
    latencies = []
    for answer, file, (seconds, *_) in zip(answers, files, poses):
        assert answer.problem == "" and answer.notices == []
        assert answer.header.frame_id == "camera"
        assert answer.header.stamp.to_sec() == pytest.approx(100.0 + seconds, abs=1e-6)
        assert answer.frames_dropped == 0
        assert_same_patches(answer, file, *intrinsics)
        latencies.append(answer.latency_ms)
    print(f"latency of {len(answers)} frames of {frames[0].shape[1]} x "
          f"{frames[0].shape[0]}, ms: median {np.median(latencies):.1f}, largest "
          f"{max(latencies):.1f}; work of the last {answers[-1].work_ms:.1f}")
    assert one.node.warnings() == []


def intrinsics_of(file):
    """The camera that the points of a file lie on, and the option that says so."""
    camera = ros_world.fit(file)["sensor"]["camera"]
    numbers = [camera[name] for name in ("fx", "fy", "cx", "cy")]
    return numbers, ("--intrinsics", ",".join(map(repr, numbers)))


def test_depth_images_are_the_clouds_of_their_camera(scratch, walk, link):
    (fx, fy, cx, cy), option = intrinsics_of(walk[1][0])
    depth = walk[0][0][:, :, 2]
    rows, columns = np.indices(depth.shape)
    wide = depth.astype(float)
    points = np.dstack([(columns - cx) / fx * wide, (rows - cy) / fy * wide, wide])
    file = scratch / "depth.pcd"
    ros_world.write_pcd(file, points)
    image = sensor_msgs.msg.Image(height=depth.shape[0], width=depth.shape[1],
                                  encoding="32FC1", step=4 * depth.shape[1])
    image.header.frame_id = "camera"
    image.data = depth.astype("<f4").tobytes()
    info = sensor_msgs.msg.CameraInfo(height=image.height, width=image.width)
    info.K = [fx, 0, cx, 0, fy, cy, 0, 0, 1]
    one = link(*WHOLE, "_input:=depth", inputs={
        "depth/image": sensor_msgs.msg.Image,
        "depth/camera_info": sensor_msgs.msg.CameraInfo})
    assert "camera_info" in one.ask(image, "depth/image").problem
    one.send("depth/camera_info", info)
    # Two topics, two connections: which is first is nobody's promise.
    assert_same_patches(one.ask_until_good(image, "depth/image"), file, *option)


def bad_clouds(points):
    """Clouds that have no answer, and a word of what is said of them."""
    cut = cloud(points, 1.0)
    cut.data = cut.data[:1000]
    bare = cloud(points, 1.0)
    bare.fields = bare.fields[:2]
    return {
        "valid point": cloud(np.full_like(points, np.nan), 1.0),
        "do not lie in": cut,
        "cannot see": cloud(points[:, :, [2, 0, 1]] * [1, -1, -1], 1.0),  # axes of a body
        "field z": bare,
        "valid": cloud(points[:0], 1.0),
    }


@pytest.mark.parametrize("word", ["valid point", "do not lie in", "cannot see", "field z",
                                  "valid"])
def test_of_a_bad_cloud_there_is_one_warning_and_the_node_lives(walk, link, word):
    points = walk[0][0]
    one = link("_warning_period:=1000000")
    for _ in range(5):
        answer = one.ask(bad_clouds(points)[word])
        assert word in answer.problem
        assert answer.patches == []
    good = one.ask(cloud(points, 1.0))
    assert good.problem == "" and good.patches
    one.close()
    assert len(one.node.warnings()) == 1, one.node.text()
    assert word in one.node.warnings()[0]


def test_of_a_missing_transform_there_is_one_warning_until_it_comes(walk, link):
    points = walk[0][0]
    one = link("_warning_period:=1000000", "_sensor_frame:=camera",
               "_transform_timeout:=0.05",
               inputs={**CLOUD, **TF})
    identity = (0, 0, 0, 0, 0, 0, 1)
    for _ in range(5):
        assert "no transform" in one.ask(cloud(points, 5.0, "base")).problem
    one.send("/tf", transform("base", "camera", 5.0, identity))
    answer = one.ask_until_good(cloud(points, 5.0, "base"))
    assert answer.header.frame_id == "base" and answer.patches
    one.close()
    assert len(one.node.warnings()) == 1, one.node.text()


def test_the_pose_of_the_sensor_comes_from_tf(walk, link):
    points, file = walk[0][0], walk[1][0]
    # A body's axes: x forward, y left, z up, half a metre before the camera.
    body = points[:, :, [2, 0, 1]] * [1, -1, -1] - [0.5, 0, 0]
    one = link(*WHOLE, "_sensor_frame:=camera", f"_transform_timeout:={ros_world.LIMIT_S}",
               inputs={**CLOUD, **TF})
    one.send("/tf", transform("body", "camera", 5.0, (-0.5, 0, 0, -0.5, 0.5, -0.5, 0.5)))
    answer = one.ask(cloud(body, 5.0, "body"))
    assert answer.problem == ""
    expected = ros_world.fit(file)["patches"]
    # The points are the same but for rounding, which a limit may turn on.
    assert len(answer.patches) == pytest.approx(len(expected), rel=0.01)
    up = np.array([patch.pose.orientation.w for patch in answer.patches])
    assert np.isfinite(up).all()


def test_time_may_jump(walk, link):
    points = walk[0][0]
    one = link("_warning_period:=1000000")
    assert one.ask(cloud(points, 1000.0)).problem == ""
    for seconds in (500.0, 400.0, 300.0):
        answer = one.ask(cloud(points, seconds))
        assert "time went back" in answer.problem
        assert answer.patches, "a frame after a jump is one as any other"
    late = one.ask(cloud(points, 299.9))
    assert "older" in late.problem and late.patches == []
    one.close()
    assert len(one.node.warnings()) == 1, one.node.text()


def test_it_stops_while_it_waits_for_a_transform(walk, link):
    one = link("_sensor_frame:=camera", "_transform_timeout:=1000000")
    one.send("cloud", cloud(walk[0][0], 5.0, "base"))
    one.close()


def test_newer_frames_replace_those_that_wait_and_are_counted(walk, link):
    points = walk[0][0]
    one = link(*WHOLE)
    sent = 50
    for i in range(sent):
        one.send("cloud", cloud(points, 1.0 + i))
    answers = [one.get()]
    while answers[-1].header.stamp.to_sec() < float(sent):
        answers.append(one.get())
    stamps = [answer.header.stamp.to_sec() for answer in answers]
    assert stamps == sorted(stamps)
    assert len(answers) + answers[-1].frames_dropped == sent
    # Fifty are written in less than the time of fifty frames of work.
    assert answers[-1].frames_dropped > 0
