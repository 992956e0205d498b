"""The programs in samples/python run, and say what they should."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SAMPLES = ROOT / "samples" / "python"
PAGE = ROOT / "doc" / "python.md"
README = ROOT / "README.md"


def run(*command, folder):
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert not done.stderr
    return done.stdout


def test_first_patch(tmp_path):
    out = run(SAMPLES / "first_patch.py", folder=tmp_path)
    assert re.search(r"paraboloid +normal .* sigma", out)


def test_covariance_check(tmp_path):
    out = run(SAMPLES / "covariance_check.py", folder=tmp_path)
    share = float(re.search(r"within the 95 % ellipsoid: ([\d.]+) %", out).group(1))
    assert 93 < share < 97
    assert (tmp_path / "covariance_check.png").stat().st_size > 5000


def test_foothold_ranking(tmp_path):
    out = run(SAMPLES / "foothold_ranking.py", folder=tmp_path)
    assert int(re.search(r"(\d+) footholds on", out).group(1)) > 5
    assert (tmp_path / "foothold_ranking.png").stat().st_size > 5000


def test_every_sample_is_tested():
    source = Path(__file__).read_text()
    for sample in SAMPLES.glob("*.py"):
        assert f'"{sample.name}"' in source, sample.name


def test_what_the_pages_show_works(tmp_path):
    """Block after block, as a reader would."""
    for page, blocks_at_least, said in ((README, 1, r"\(\d+, 11, 11\)"), (PAGE, 3, "paraboloid")):
        blocks = re.findall(r"```python\n(.*?)```", page.read_text(), flags=re.S)
        assert len(blocks) >= blocks_at_least
        (tmp_path / "page.py").write_text("\n".join(blocks))
        assert re.search(said, run(tmp_path / "page.py", folder=tmp_path))
