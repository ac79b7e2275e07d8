"""Snaps and their peers on synthetic and real scenes: `python -m benchmarks registration`.

With `BENCHMARK_OVERLAYS=FOLDER` set, pictures of what failed are written to that folder. A part of the run:
`BENCHMARK_SETS=moro,apc BENCHMARK_METHODS=default,prototype BENCHMARK_STARTS=2`, names or parts of names.
"""

from pathlib import Path

from benchmarks.figures import Figure

TITLE = "Registration: the default snap, which is told no spread of its start unless it says so"


def run(folder: Path, quick: bool) -> list[Figure]:
    """Success, confidence and time; prints the tables that set all methods side by side."""
    from benchmarks.registration.suite import measure  # Open3D and the kernels: seconds to load

    return measure(quick)
