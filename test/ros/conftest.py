import os
import pathlib
import shutil

import pytest

import ros_world

SCRATCH = pathlib.Path(os.environ["HOLDFAST_SCRATCH_DIR"])


@pytest.fixture(scope="session")
def scratch(request):
    """An empty folder of this file of tests."""
    folder = SCRATCH / ("ros_" + pathlib.Path(request.config.args[0]).stem)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


@pytest.fixture(scope="session")
def world(scratch):
    """A master; this process is one of its nodes."""
    result = ros_world.World(scratch / "ros")
    os.environ.update({name: value for name, value in result.env.items()
                       if name.startswith("ROS_")})
    import rospy  # reads the environment
    try:
        rospy.init_node("test", disable_signals=True)
        yield result
        rospy.signal_shutdown("the tests are over")
    finally:
        result.stop()


@pytest.fixture(scope="session")
def walk(scratch):
    """Frames of a walk over boulders: points, files, poses with their times."""
    files, poses = ros_world.simulate(scratch / "walk", 6)
    return [ros_world.read_pcd(path) for path in files], files, poses


@pytest.fixture
def link(world, request):
    """Makes nodes with their topics, and stops them in the end."""
    from messages import Link
    links = []

    def make(*arguments, **topics):
        name = "".join(c if c.isalnum() else "_" for c in request.node.name)
        links.append(Link(world, f"{name}_{len(links)}", *arguments, **topics))
        return links[-1]

    yield make
    for one in links:
        if one.node.is_alive():
            one.close()
