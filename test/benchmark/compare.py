#!/usr/bin/env python3
"""What patches cost in two builds on one machine, in turns, so that what else it does
falls on both: of all rounds the least, and the ratio.

  test/benchmark/compare.py BEFORE/bin/holdfast_benchmark AFTER/bin/holdfast_benchmark

Cases that only one build knows stand with that build's time alone; repeated_chain, which
reuses memory, is compared with whole_chain of a build that could not.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

CASES = (
    "^(whole_chain|repeated_chain|whole_chain_pattern|whole_chain_threads"
    "|fit_exact|neighborhood|pcl_normal_kdtree|ceres_autodiff)/"
)


def times_us(program: str, cases: str, min_time: str) -> dict[str, float]:
    """Time per patch of each case of one run, us."""
    with tempfile.TemporaryDirectory() as folder:
        result = Path(folder) / "result.json"
        subprocess.run(
            [
                program,
                f"--benchmark_filter={cases}",
                f"--benchmark_min_time={min_time}",
                f"--benchmark_out={result}",
                "--benchmark_out_format=json",
            ],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        runs = json.loads(result.read_text())["benchmarks"]
    return {run["name"]: run["us"] for run in runs if "us" in run}


def least(times: dict[str, float], others: dict[str, float]) -> dict[str, float]:
    return {
        case: min(times.get(case, float("inf")), others.get(case, float("inf")))
        for case in times.keys() | others.keys()
    }


def counterpart(case: str, before: dict[str, float]) -> float | None:
    if case in before:
        return before[case]
    return before.get(case.replace("repeated_chain", "whole_chain"))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", help="benchmark of the older build")
    parser.add_argument("after", help="benchmark of the newer build")
    parser.add_argument("--rounds", type=int, default=3, help="default %(default)s")
    parser.add_argument("--cases", default=CASES, help="regular expression of names")
    parser.add_argument("--min-time", default="0.2", help="of a case, s (%(default)s)")
    options = parser.parse_args()

    before: dict[str, float] = {}
    after: dict[str, float] = {}
    for _ in range(options.rounds):
        before = least(before, times_us(options.before, options.cases, options.min_time))
        after = least(after, times_us(options.after, options.cases, options.min_time))

    print(f"{'us per patch':<26} {'before':>9} {'after':>9} {'ratio':>7}")
    for case in sorted(after, key=lambda name: (name.rsplit("/", 1)[-1], name)):
        earlier = counterpart(case, before)
        row = f"{case:<26} {'' if earlier is None else f'{earlier:.2f}':>9} "
        row += f"{after[case]:>9.2f} "
        row += "" if earlier is None else f"{after[case] / earlier:>7.2f}"
        print(row.rstrip())


if __name__ == "__main__":
    main()
