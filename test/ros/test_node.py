"""The node answers frames of a bag as the library does, and outlives what is no frame."""
import numpy as np
import pytest
import rosbag
import sensor_msgs.msg
import tf2_msgs.msg

import ros_world
from holdfast_msgs.msg import PatchArray
from messages import Link, cloud, symmetric, transform

# Every seed of every frame, as the program does it.
WHOLE = ("_max_patches:=0", "_budget_ms:=0")
CLOUD = {"cloud": sensor_msgs.msg.PointCloud2}
PATCHES = {"patches": PatchArray}


@pytest.fixture
def link(world, request):
    """Makes nodes, and stops them in the end."""
    links = []

    def make(*arguments, inputs=CLOUD, outputs=PATCHES):
        name = f"{request.node.name}_{len(links)}"
        links.append(Link(world, name, *arguments, inputs=inputs, outputs=outputs))
        return links[-1]

    yield make
    for one in links:
        if one.node.is_alive():
            one.close()


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
        ["rosbag", "play", "-q", "-r", "10", "--wait-for-subscribers", "-k", bag_file],
        world.env, scratch / "play.log")
    try:
        answers = [one.get() for _ in frames]
    finally:
        player.kill()
    # The camera that the first frame's points lie on counts for all.
    camera = ros_world.fit(files[0])["sensor"]["camera"]
    intrinsics = ("--intrinsics",
                  ",".join(repr(camera[name]) for name in ("fx", "fy", "cx", "cy")))
    latencies = []
    for answer, file, (seconds, *_) in zip(answers, files, poses):
        assert answer.problem == ""
        assert answer.header.frame_id == "camera"
        assert answer.header.stamp.to_sec() == pytest.approx(100.0 + seconds, abs=1e-6)
        assert answer.frames_dropped == 0
        assert_same_patches(answer, file, *intrinsics)
        latencies.append(answer.latency_ms)
    print(f"latency of {len(answers)} frames of {frames[0].shape[1]} x "
          f"{frames[0].shape[0]}, ms: median {np.median(latencies):.1f}, largest "
          f"{max(latencies):.1f}; work of the last {answers[-1].work_ms:.1f}")
    assert one.node.warnings() == []
