"""Builds the Python module by CMake.

HOLDFAST_BUILD_DIR names a build folder to take it from, one that was configured with
HOLDFAST_WITH_PYTHON for the same Python; without, a folder of its own is made, with the
options in HOLDFAST_CMAKE_ARGS.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent
PARTS_LEFT_OUT = (
    "BUILD_APPS BUILD_BENCHMARKS BUILD_EXPERIMENTS BUILD_SAMPLES BUILD_TESTS "
    "WITH_OPENNI2 WITH_VIEWER"
).split()


def version() -> str:
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    found = re.search(r"project\(holdfast\s+VERSION (\S+)", text)
    if found is None:
        raise SystemExit("CMakeLists.txt: no version of the project")
    return found.group(1)


def dependencies() -> list[str]:
    """Before 2.12 pybind11 reads arrays of numpy 2 wrongly, so the module refuses it."""
    try:
        from pybind11 import version_info
    except ImportError:  # the build folder's own is unknown
        version_info = (0, 0)
    return ["numpy>=1.20" if tuple(version_info[:2]) >= (2, 12) else "numpy>=1.20,<2"]


def configure(folder: Path) -> None:
    command = ["cmake", "-S", str(ROOT), "-B", str(folder)]
    command += ["-DCMAKE_BUILD_TYPE=Release", "-DHOLDFAST_WITH_PYTHON=ON"]
    command += [f"-DHOLDFAST_{part}=OFF" for part in PARTS_LEFT_OUT]
    command += [f"-DPython_EXECUTABLE={sys.executable}"]
    if shutil.which("ninja"):
        command += ["-G", "Ninja"]
    command += shlex.split(os.environ.get("HOLDFAST_CMAKE_ARGS", ""))
    subprocess.run(command, check=True)


class CMakeBuild(build_ext):
    def build_extension(self, extension: Extension) -> None:
        given = os.environ.get("HOLDFAST_BUILD_DIR")
        folder = Path(given or self.build_temp).resolve()
        if not given:
            configure(folder)
        jobs = os.environ.get("CMAKE_BUILD_PARALLEL_LEVEL", str(os.cpu_count() or 1))
        build = ["cmake", "--build", str(folder), "--target", "holdfast_python"]
        subprocess.run([*build, "--parallel", jobs], check=True)
        module = Path(self.get_ext_fullpath(extension.name)).resolve()
        install = ["cmake", "--install", str(folder), "--component", "python"]
        subprocess.run([*install, "--prefix", str(module.parent.parent)], check=True)
        if not module.exists():
            suffix = sysconfig.get_config_var("EXT_SUFFIX")
            raise SystemExit(f"{folder}: no module with the ending {suffix} of this Python")


setup(
    version=version(),
    install_requires=dependencies(),
    ext_modules=[Extension("holdfast._core", sources=[])],
    cmdclass={"build_ext": CMakeBuild},
)
