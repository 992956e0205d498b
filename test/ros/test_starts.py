"""The node comes and goes: by itself, with the terminal, by roslaunch."""
import contextlib
import os
import pathlib
import pty
import signal
import subprocess
import xmlrpc.client

import pytest
import yaml

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
    for component in ("lib", "ros"):
        ros_world.run("cmake", "--install", ros_world.BUILD, "--prefix", prefix,
                      "--component", component)
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


class Terminal:
    """A process that a terminal began, which may be closed. What it says is in a file:
    who reads from a terminal keeps it open."""

    def __init__(self, command, env, log):
        self.log = pathlib.Path(log)
        self.pid, self.screen = pty.fork()
        if self.pid == 0:
            out = os.open(self.log, os.O_CREAT | os.O_TRUNC | os.O_WRONLY, 0o644)
            os.dup2(out, 1)
            os.dup2(out, 2)
            ros_world.hear_hangups()
            os.execvpe(str(command[0]), [str(word) for word in command], env)

    def close(self):
        """As its window does. Returns how its process ended, as waitpid() has it."""
        os.close(self.screen)

        def status():
            pid, how = os.waitpid(self.pid, os.WNOHANG)
            return [how] if pid else None

        return ros_world.wait_until(status, "end")[0]


def is_running(pid):
    """A process that nobody has asked for its end has ended all the same."""
    try:
        stat = pathlib.Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return stat.rsplit(")", 1)[1].split()[0] != "Z"


def test_it_stops_with_its_terminal(core, scratch):
    terminal = Terminal([ros_world.NODE, "__name:=seen"], core.env,
                        scratch / "seen.log")
    ros_world.wait_until(lambda: is_up(core, "seen"), "node")
    status = terminal.close()
    assert os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0, terminal.log.read_text()
    assert not is_up(core, "seen")


def test_all_of_ros_stops_with_the_terminal_of_roslaunch(scratch, installed):
    port = ros_world.free_port()
    env = ros_world.environment(scratch / "launched", port)
    env["ROS_PACKAGE_PATH"] = str(installed / "share")
    terminal = Terminal(["roslaunch", "-p", port, "holdfast", "holdfast.launch",
                         "cloud:=/cloud", "foot:=point_foot", "map:=true",
                         "odometry_frame:=odom"], env, scratch / "roslaunch.log")
    try:
        master = xmlrpc.client.ServerProxy(env["ROS_MASTER_URI"])

        def pids():
            with contextlib.suppress(OSError, xmlrpc.client.Error):
                subscribers = dict(master.getSystemState("/test")[2][1])
                if "/holdfast" in subscribers.get("/cloud", []):
                    uri = master.lookupNode("/test", "/holdfast")[2]
                    node = xmlrpc.client.ServerProxy(uri)
                    return [one.getPid("/test")[2] for one in (node, master)]
            return None

        running = ros_world.wait_until(pids, "node")
        assert all(is_running(pid) for pid in running)
    finally:
        terminal.close()
    ros_world.wait_until(lambda: not any(is_running(pid) for pid in running),
                         "end of node and master", 60.0)


def test_what_is_installed_is_a_package(installed):
    catkin_pkg = pytest.importorskip("catkin_pkg.package")
    for name in ("holdfast", "holdfast_msgs"):
        package = catkin_pkg.parse_package(str(installed / "share" / name))
        assert package.name == name
    assert (installed / "share/holdfast/rviz/holdfast.rviz").exists()
    assert {path.stem for path in (installed / "share/holdfast_msgs/msg").iterdir()} == {
        path.stem for path in (installed / "include/holdfast_msgs").iterdir()}
    with open(installed / "share/holdfast/rviz/holdfast.rviz", encoding="utf-8") as file:
        assert "Visualization Manager" in yaml.safe_load(file)
