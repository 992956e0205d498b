"""The node comes and goes: by itself, with the terminal, by roslaunch."""
import os
import pty
import signal
import subprocess

import pytest

import ros_world

STARTS = int(os.environ.get("HOLDFAST_ROS_STARTS", "10"))


@pytest.fixture(scope="module")
def core(scratch):
    world = ros_world.World(scratch / "core")
    yield world
    world.stop()


@pytest.fixture(scope="module")
def installed(scratch):
    """Where launch files look: the package as it is installed."""
    prefix = scratch / "prefix"
    ros_world.run("cmake", "--install", ros_world.BUILD, "--prefix", prefix,
                  "--component", "ros")
    return prefix


def is_up(world, name):
    return f"/{name}" in world.names("/cloud", 1)


def test_it_starts_and_stops_many_times_and_leaves_nothing_behind(core):
    for i in range(STARTS):
        node = core.start("again")
        ros_world.wait_until(lambda: is_up(core, "again") or not node.is_alive(), "node")
        assert node.is_alive(), node.text()
        by = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[i % 3]
        assert node.stop(by) == 0, (i, by, node.text())
        assert node.warnings() == []
        left = [topic for role in core.state() for topic, names in role
                if "/again" in names]
        assert left == [], f"start {i + 1} leaves {left}"
    print(f"{STARTS} starts and stops")


def test_it_stops_while_it_starts(core):
    """At whatever point of the start the signal comes: after 0 to 0.2 s."""
    for i in range(STARTS):
        node = core.start("early", "_sensor:=kinect_v1")
        try:
            node.popen.wait(0.02 * (i % 10))
        except subprocess.TimeoutExpired:
            pass
        # Before its handlers are there the signal itself ends it.
        assert node.stop(signal.SIGTERM) in (0, -signal.SIGTERM), node.text()


def test_it_stops_while_it_waits_for_a_transform(core, scratch):
    code = f"""
import rospy, numpy, sys
sys.path.insert(0, {str(ros_world.SOURCE / 'test/ros')!r})
from messages import CLOUD, Link, cloud
import ros_world
rospy.init_node("sender", disable_signals=True)
class World:
    start = None
publisher = rospy.Publisher("/cloud", CLOUD["cloud"], queue_size=10)
ros_world.wait_until(lambda: publisher.get_num_connections() > 0, "node")
publisher.publish(cloud(numpy.ones((4, 4, 3)), 1.0, "base"))
ros_world.wait_until(lambda: False, "end")
"""
    node = core.start("waiting", "_sensor_frame:=camera", "_transform_timeout:=100000")
    sender = ros_world.Process(["/usr/bin/env", "python3", "-c", code], core.env,
                               scratch / "sender.log")
    sender.kill()
    assert node.stop() in (0, -signal.SIGINT)


def session_of(pid):
    """Processes of a session that still run."""
    listed = subprocess.run(["ps", "-o", "pid=,stat=", "-s", str(pid)], text=True,
                            capture_output=True, check=False).stdout
    return [line for line in listed.splitlines() if " Z" not in line]
