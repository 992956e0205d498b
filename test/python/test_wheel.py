"""The wheel: built without network, in an environment of its own, on numpy alone."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pybind11 = pytest.importorskip("pybind11")

ROOT = Path(__file__).resolve().parents[2]
BUILD = os.environ.get("HOLDFAST_BUILD_DIR")

USE = """
import numpy as np, holdfast
assert "env" in holdfast.__file__, holdfast.__file__
xy = np.random.default_rng(1).uniform(-0.05, 0.05, (100, 2))
points = np.column_stack([xy, 1.0 + (xy ** 2).sum(axis=1)])
sensor = holdfast.Sensor.load("kinect_v1")
patch = holdfast.fit(points, sensor=sensor)
assert "humanoid_foot" in holdfast.Foot.names()
assert patch.ok and patch.covariance.shape[0] > 7
image = holdfast.simulate("rocks", sensor, stride=8)
assert len(holdfast.extract(image.points, sensor, radius_m=0.1)) > 0
"""


def run(*command, **more):
    done = subprocess.run(
        [str(part) for part in command], capture_output=True, text=True, check=False, **more
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """From a copy of the sources, which setuptools writes beside, and the objects that
    the build folder has."""
    if not BUILD:
        pytest.skip("HOLDFAST_BUILD_DIR names no build folder")
    pytest.importorskip("wheel")
    folder = tmp_path_factory.mktemp("wheel")
    source = folder / "source"
    shutil.copytree(
        ROOT, source, ignore=shutil.ignore_patterns("build*", ".git", "test", "samples")
    )
    pip = (sys.executable, "-m", "pip", "wheel", "--no-build-isolation", "--no-index")
    run(*pip, "--no-deps", "--wheel-dir", folder, source)
    (made,) = folder.glob("holdfast-*.whl")
    return made


def test_holds_the_module_its_types_and_sensors(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    for name in ("__init__.py", "_core.pyi", "py.typed", "sensors/kinect_v1.yaml", "feet/point_foot.yaml"):
        assert f"holdfast/{name}" in names
    (module,) = [name for name in names if re.fullmatch(r"holdfast/_core\..*so", name)]
    metadata = zipfile.ZipFile(wheel).read(
        next(name for name in names if name.endswith("METADATA"))
    )
    assert re.findall(rb"Requires-Dist: (\w+)", metadata) == [b"numpy"]
    # Before 2.12 pybind11 knows no numpy 2.
    knows_numpy_2 = pybind11.version_info[:2] >= (2, 12)
    assert (b"<2" in re.search(rb"Requires-Dist: (.*)", metadata).group(1)) != knows_numpy_2
    assert any(name.endswith("LICENSE") for name in names)


def test_the_sources_that_are_packed_are_all_it_takes(tmp_path):
    source = tmp_path / "source"
    shutil.copytree(ROOT, source, ignore=shutil.ignore_patterns("build*", ".git", "test"))
    pack = f"from setuptools import build_meta; build_meta.build_sdist({str(tmp_path)!r})"
    run(sys.executable, "-c", pack, cwd=source)
    (packed,) = tmp_path.glob("holdfast-*.tar.gz")
    assert packed.stat().st_size < 2e6
    with tarfile.open(packed) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    for folder in ("cmake", "config", "include", "src"):
        for path in (ROOT / folder).rglob("*"):
            if path.is_file() and "__pycache__" not in path.parts:
                assert str(path.relative_to(ROOT)) in names, path
    tops = {name.partition("/")[0] for name in names}
    assert tops >= {"CMakeLists.txt", "LICENSE", "pyproject.toml", "setup.py", "doc"}
    assert not tops & {"apps", "build", "test"}


def test_works_in_a_fresh_environment(wheel, tmp_path):
    environment = tmp_path / "env"
    # Without a pip of its own, which would take most of the time: it sees the system's.
    run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", environment)
    python = environment / "bin" / "python"
    run(python, "-m", "pip", "install", "--no-index", "--no-deps", wheel)
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "HOLDFAST_CONFIG_DIR")}
    run(python, "-c", USE, cwd=tmp_path, env=clean)
    (module,) = environment.glob("lib/python*/site-packages/holdfast/_core*.so")
    libraries = run("ldd", module)
    assert "not found" not in libraries
    for foreign in ("libpcl", "libflann", "libvtk", "libholdfast", "libOpenNI2"):
        assert foreign not in libraries
