"""Run the comparison: ``python -m benchmarks [--quick] [--only WORD] [--out FOLDER]``."""

import argparse
import os
import sys
from pathlib import Path

# Before NumPy is imported: the threads of its libraries would blur every figure.
for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"


def main(arguments: list[str] | None = None) -> int:
    """Measure, write CSV and report, and say where they are."""
    from . import kernels, minimum_jerk, path_timing, report, rows, service, waypoints
    from .cases import problems

    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Our methods beside their peers.")
    parser.add_argument(
        "--quick", action="store_true", help="few problems, small sizes, one round: does everything run?"
    )
    parser.add_argument("--only", default="", metavar="WORD", help="only problems and kernels with this in their name")
    parser.add_argument("--out", type=Path, default=Path("build/bench"), help="folder for report.md and the CSV files")
    asked = parser.parse_args(arguments)
    measured = []
    for problem in problems(asked.quick):
        if asked.only in problem.name:
            print(f"{problem.group}: {problem.name}", file=sys.stderr, flush=True)
            measured += rows.measure(problem, 1 if asked.quick else rows.ROUNDS)
    print("kernels and curves", file=sys.stderr, flush=True)
    figures = kernels.measure(asked.quick, asked.only)
    print("minimum jerk", file=sys.stderr, flush=True)
    standings = minimum_jerk.measure(asked.quick, asked.only)
    print("path timing", file=sys.stderr, flush=True)
    timings = path_timing.measure(asked.quick, asked.only)
    print("through waypoints", file=sys.stderr, flush=True)
    motions = waypoints.measure(asked.quick, asked.only)
    print("the service", file=sys.stderr, flush=True)
    served = service.measure(asked.quick)
    print(report.write(measured, figures, standings, timings, motions, served, asked.out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
