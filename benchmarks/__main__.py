"""`python -m benchmarks [NAME ...]`: run all benchmarks, or the named ones, and print a table for each."""

import argparse
import os
import platform
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from rich.console import Console

from benchmarks import (
    PROJECT,
    ablation,
    big_mesh,
    browser,
    churn,
    commits,
    curves,
    first_snap,
    idle,
    known,
    live,
    load,
    many_tasks,
    memory,
    open_task,
    registration,
    snap,
    startup,
    study,
    techniques,
)
from benchmarks.figures import Figure, table
from benchmarks.registration import sensors

BENCHMARKS = {
    "startup": startup,
    "open_task": open_task,
    "big_mesh": big_mesh,
    "snap": snap,
    "first_snap": first_snap,
    "commits": commits,
    "many_tasks": many_tasks,
    "memory": memory,
    "churn": churn,
    "idle": idle,
    "live": live,
    "browser": browser,
    "load": load,
    "techniques": techniques,
    "registration": registration,
    "sensors": sensors,
    "ablation": ablation,
    "known": known,
    "study": study,
    "curves": curves,
}
WORK_DIR = PROJECT / "test-results"
"""On the disk that the state directory is on by default: what a sync costs depends on it."""
IDLE_LOAD = 0.3
"""Load average per processor up to which a machine may be called idle."""


def main() -> int:
    """Returns 1 where a target was missed."""
    parser = argparse.ArgumentParser(prog="benchmarks", description="Measure snaps and the application.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)}; default: all")
    parser.add_argument("--quick", action="store_true", help="tiny counts: only whether everything works")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.names) - set(BENCHMARKS))
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]!r}; choose of {', '.join(BENCHMARKS)}")
    console = Console(highlight=False)
    console.print(_machine())
    figures = [
        figure for name in arguments.names or BENCHMARKS for figure in measure(name, arguments.quick, console)
    ]
    missed = sum(figure.is_missed for figure in figures)
    judged = sum(figure.target is not None for figure in figures)
    console.print(f"\n{judged - missed} of {judged} targets reached.")
    return 1 if missed else 0


def measure(name: str, quick: bool, console: Console) -> list[Figure]:
    """Run one benchmark in a folder of its own and print its table."""
    benchmark = BENCHMARKS[name]
    run: Callable[[Path, bool], list[Figure]] = benchmark.run
    WORK_DIR.mkdir(exist_ok=True)
    began = time.perf_counter()
    with console.status(f"{name} ..."), tempfile.TemporaryDirectory(dir=WORK_DIR) as folder:
        figures = run(Path(folder), quick)
    console.print()
    console.print(table(benchmark.TITLE, figures))
    console.print(f"{name}: {time.perf_counter() - began:.0f} s")
    return figures


def _machine() -> str:
    processors = os.cpu_count() or 1
    load_average = os.getloadavg()[0]
    text = (
        f"{platform.system()} {platform.machine()}, {processors} processors,"
        f" Python {platform.python_version()}; load average {load_average:.1f}.\n"
        "The figures hold for an idle machine: whatever else runs makes them worse."
    )
    if load_average > IDLE_LOAD * processors:
        text += "\n[yellow]This machine is not idle now.[/yellow]"
    return text


if __name__ == "__main__":
    sys.exit(main())
