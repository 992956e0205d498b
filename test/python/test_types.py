"""The stubs are those of the module, and help() teaches."""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
from pathlib import Path

import pytest

import holdfast

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = Path(holdfast.__file__).parent

USE = """
import numpy as np
import holdfast

sensor: holdfast.Sensor = holdfast.Sensor.load("kinect_v1")
image = holdfast.simulate("rocks", sensor, stride=4)
patches = holdfast.extract(image.points, sensor, radius_m=0.05, seeds="grid")
one: holdfast.Patch = patches[0]
some: holdfast.Patches = patches[patches.surface == "plane"]
if one.covariance is not None:
    reveal = one.covariance.shape
patch = holdfast.fit(np.zeros((5, 3)), np.eye(3), surface="plane")
holdfast.fit(np.zeros((5, 3)), np.eye(3), surface="ball")  # type: ignore[arg-type]
holdfast.fit(np.zeros((5, 3)), np.eye(3), sensor="kinect")  # type: ignore[arg-type]
"""


STUBTEST = (
    "mypy.stubtest",
    "holdfast",
    "--allowlist",
    str(Path(__file__).with_name("stubtest_allowed.txt")),
)


def run(*command: str, folder: Path) -> None:
    pytest.importorskip("mypy")
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent)}
    done = subprocess.run(
        [sys.executable, "-m", *command],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_mypy_takes_what_users_write(tmp_path):
    (tmp_path / "use.py").write_text(USE)
    run("mypy", "--strict", "--warn-unused-ignores", "use.py", folder=tmp_path)


def test_stubs_are_those_of_the_module(tmp_path):
    run(*STUBTEST, folder=tmp_path)


def test_stubs_that_are_not_are_found(tmp_path):
    """A check that cannot fail is none."""
    stub = (PACKAGE / "_core.pyi").read_text()
    package = tmp_path / "holdfast"
    package.mkdir()
    for name in ("__init__.py", "py.typed"):
        (package / name).write_text((PACKAGE / name).read_text())
    (package / "_core.pyi").write_text(stub.replace("containment: float", "contentment: float"))
    (package / next(PACKAGE.glob("_core*.so")).name).symlink_to(next(PACKAGE.glob("_core*.so")))
    environment = {**os.environ, "MYPYPATH": str(tmp_path), "PYTHONPATH": str(tmp_path)}
    pytest.importorskip("mypy")
    done = subprocess.run(
        [sys.executable, "-m", *STUBTEST],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode != 0 and "contentment" in done.stdout


def test_everything_has_help():
    for name in holdfast.__all__:
        thing = getattr(holdfast, name)
        assert thing.__doc__, name
        if callable(thing):
            assert thing.__module__ == "holdfast", name
        if inspect.isclass(thing):
            for member, value in vars(thing).items():
                if not member.startswith("_"):
                    assert getattr(thing, member).__doc__, f"{name}.{member}"


@pytest.mark.parametrize("name", ["fit", "fit_many", "extract", "simulate", "contact_risk", "rank_footholds", "risk_grid"])
def test_help_teaches(name):
    function = getattr(holdfast, name)
    parameters = inspect.signature(function).parameters
    text = function.__doc__
    for section in ("Arguments", "Returns", "Raises", "lock"):
        assert section in text or name == "fit_many", section
    if name != "fit_many":
        for parameter in parameters:
            assert f"    {parameter}:" in text, parameter
    assert max(map(len, text.splitlines())) <= 88


def test_defaults_are_those_of_the_library():
    parameters = inspect.signature(holdfast.fit).parameters
    assert parameters["surface"].default == "auto"
    assert parameters["containment"].default == 0.95
    assert parameters["covariance"].default == "exact"
    assert parameters["separate_pattern"].default is False


def test_version_is_that_of_the_project():
    import re

    text = (ROOT / "CMakeLists.txt").read_text()
    assert re.search(r"project\(holdfast\s+VERSION (\S+)", text).group(1) == holdfast.__version__
