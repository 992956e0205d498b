"""A ROS of its own for a test: master, folder and nodes that nobody else sees."""
import contextlib
import json
import os
import pathlib
import signal
import socket
import subprocess
import time
import xmlrpc.client

import numpy as np

BUILD = pathlib.Path(os.environ["HOLDFAST_BUILD_DIR"])
SOURCE = pathlib.Path(os.environ["HOLDFAST_SOURCE_DIR"])
PROGRAM = BUILD / "bin/holdfast"
NODE = BUILD / "bin/holdfast_node"
# Of whatever is waited for: far beyond what a busy machine takes, so that only what never
# comes fails.
LIMIT_S = 120.0


def wait_until(happened, what, limit_s=LIMIT_S):
    """Returns what `happened()` returns once that is true."""
    end = time.monotonic() + limit_s
    while True:
        result = happened()
        if result:
            return result
        if time.monotonic() > end:
            raise AssertionError(f"in {limit_s} s there was no {what}")
        time.sleep(0.01)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def environment(folder, port):
    """For processes of the ROS whose master listens on that port."""
    result = dict(os.environ)
    result.update(ROS_MASTER_URI=f"http://127.0.0.1:{port}", ROS_IP="127.0.0.1",
                  ROS_HOME=str(folder), ROS_LOG_DIR=str(folder / "log"))
    result.pop("ROS_HOSTNAME", None)
    return result


def hear_hangups():
    """In a child: that these tests run under nohup is none of its business."""
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


class Process:
    """A process in a session of its own, what it says in a file."""

    def __init__(self, command, env, log):
        self.log = pathlib.Path(log)
        with open(self.log, "wb") as out:
            self.popen = subprocess.Popen(
                [str(word) for word in command], env=env, stdin=subprocess.DEVNULL,
                stdout=out, stderr=subprocess.STDOUT, start_new_session=True,
                preexec_fn=hear_hangups)

    def text(self):
        return self.log.read_text(errors="replace")

    def warnings(self):
        return [line for line in self.text().splitlines() if " WARN]" in line]

    def is_alive(self):
        return self.popen.poll() is None

    def stop(self, by=signal.SIGINT):
        """Its exit code."""
        if self.is_alive():
            self.popen.send_signal(by)
        try:
            return self.popen.wait(LIMIT_S)
        except subprocess.TimeoutExpired:
            self.kill()
            raise AssertionError(f"{self.popen.args[0]} does not stop:\n{self.text()}")

    def kill(self):
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.popen.pid, signal.SIGKILL)
        self.popen.wait()


class World:
    """roscore in a folder."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.nodes = []
        for _ in range(5):  # another process may have taken the port meanwhile
            self.port = free_port()
            self.env = environment(self.folder, self.port)
            self.core = Process(["roscore", "-p", self.port], self.env,
                                self.folder / "roscore.log")
            if wait_until(lambda: self.state() or not self.core.is_alive(),
                          "roscore") is not True:
                return
        raise AssertionError("roscore does not start:\n" + self.core.text())

    def state(self):
        """Publishers, subscribers and services, as the master knows them."""
        try:
            master = xmlrpc.client.ServerProxy(self.env["ROS_MASTER_URI"])
            return master.getSystemState("/test")[2]
        except (OSError, xmlrpc.client.Error):
            return None

    def names(self, topic, role):
        """Nodes that publish (role 0) or hear (role 1) a topic."""
        return dict(self.state()[role]).get(topic, [])

    def start(self, name, *arguments):
        """A node of ours; arguments as _parameter:=value or from:=to."""
        node = Process([NODE, f"__name:={name}", *arguments], self.env,
                       self.folder / f"{name}.log")
        self.nodes.append(node)
        return node

    def stop(self):
        for node in self.nodes:
            if node.is_alive():
                node.kill()
        if self.core.is_alive():
            self.core.stop()


def run(*command, env=None):
    return subprocess.run([str(word) for word in command], check=True, text=True,
                          capture_output=True, env=env).stdout


def simulate(folder, frames, scene="boulder_field", stride=4):
    """A walk: the files of its frames and, of each, seconds and x y z qx qy qz qw."""
    run(PROGRAM, "simulate", scene, "--trajectory", "walk", "--frames", frames,
        "--stride", stride, "-o", folder, "--quiet")
    poses = np.loadtxt(pathlib.Path(folder) / "trajectory.txt")
    return sorted(pathlib.Path(folder).glob("frame_*.pcd")), poses


def read_pcd(path):
    """Height x width x 3 of a binary PCD of x y z."""
    header, data = pathlib.Path(path).read_bytes().split(b"DATA binary\n", 1)
    words = dict(line.split(" ", 1) for line in header.decode().splitlines()
                 if not line.startswith("#"))
    assert words["FIELDS"] == "x y z", words
    return np.frombuffer(data, "<f4").reshape(
        int(words["HEIGHT"]), int(words["WIDTH"]), 3).copy()


def write_pcd(path, points):
    height, width = points.shape[:2]
    pathlib.Path(path).write_bytes(
        f"VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {width}\n"
        f"HEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\n"
        "DATA binary\n".encode() + points.astype("<f4").tobytes())


def fit(path, *options):
    """What the program makes of a file."""
    return json.loads(run(PROGRAM, "fit", path, "--json", "-", "--quiet", *options))
