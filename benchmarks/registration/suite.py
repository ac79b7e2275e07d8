"""What is tried on which instances, and everything that comes of it."""

import os
from collections.abc import Mapping
from pathlib import Path

from rich.console import Console

from benchmarks.figures import Figure
from benchmarks.registration.agreement import print_agreement
from benchmarks.registration.anywhere import proposal_figures
from benchmarks.registration.instances import (
    HALF,
    MOST_SCENES,
    REAL,
    SYNTHETIC,
    YCB,
    Instance,
    real_instances,
    synthetic_instances,
)
from benchmarks.registration.methods import BEST_OF, DEFAULT, GICP, ICP, METHODS, NOTHING, PAPER, TOLD
from benchmarks.registration.objects import DATA
from benchmarks.registration.overlays import write_overlays
from benchmarks.registration.several_views import view_figures
from benchmarks.registration.starts import GOOD, MIDDLE, NEAR, SHELLS, Shell
from benchmarks.registration.tables import print_reliability, print_tables
from benchmarks.registration.targets import figures
from benchmarks.registration.timing import timings
from benchmarks.registration.trials import run_trials

OVERLAYS_VARIABLE = "BENCHMARK_OVERLAYS"
TABLE_WIDTH = 120
"""Columns, also where the output is no terminal."""

AN_OBJECT = 8
"""Synthetic instances of each object in each set."""
QUICK_SCENES = 3
"""Of each synthetic set, in a quick run; they hold at least one instance."""
STARTS, REAL_STARTS = 5, 20
"""From each shell about each instance."""
SEEDS = 10
"""Of proposals for each instance."""
STARTS_A_SLOW_ONE = 5
"""The best of 32 has this many times fewer starts, ..."""
INSTANCES_A_PAPER = 12
"""... and one instance in so many has one for the paper's method."""
INSTANCES_AN_AGREEMENT = 3
"""One synthetic instance in so many shows how the sparse agreement ranks poses."""


def measure(quick: bool) -> list[Figure]:
    """All figures; prints tables, and writes overlays where asked."""
    console = Console(highlight=False, width=max(Console().width, TABLE_WIDTH))
    if not DATA.is_dir():
        console.print(f"The real scenes and the YCB objects are left out: there is no {DATA}.")
    scenes = QUICK_SCENES if quick else MOST_SCENES
    instances = [
        *(one for name in SYNTHETIC for one in synthetic_instances(name, AN_OBJECT, scenes)),
        *(one for name in REAL for one in real_instances(name)),
    ]
    if quick:
        instances = [next(one for one in instances if one.set_name == name) for name in _sets(instances)]
    plans = [_quick_plan() if quick else _plan(one, number) for number, one in enumerate(instances)]
    timed = timings([one for one in instances if one.set_name == HALF], quick)
    results = run_trials(instances, plans, quick, console)
    trials = [trial for result in results for trial in result.trials]
    for name in _sets(instances):
        print_tables(console, trials, name)
    for title, sets in (("synthetic", SYNTHETIC), ("real", REAL)):
        own = [t for t in trials if t.method == DEFAULT and t.set_name in sets and t.shell != GOOD]
        if own:
            print_reliability(console, own, title)
    synthetic = [one for one in instances if one.set_name in SYNTHETIC]
    print_agreement(console, synthetic[::INSTANCES_AN_AGREEMENT])
    if folder := os.environ.get(OVERLAYS_VARIABLE):
        write_overlays(Path(folder), instances, trials)
    proposed = proposal_figures([one for one in instances if one.set_name == YCB], 1 if quick else SEEDS)
    return [*figures(results), *view_figures(1 if quick else REAL_STARTS), *proposed, *timed]


def _sets(instances: list[Instance]) -> list[str]:
    return list(dict.fromkeys(one.set_name for one in instances))


def _plan(instance: Instance, number: int) -> dict[Shell, Mapping[str, int]]:
    count = REAL_STARTS if instance.set_name in REAL else STARTS
    fast = dict.fromkeys((NOTHING, ICP, GICP, DEFAULT, TOLD), count)
    slow = {BEST_OF: count // STARTS_A_SLOW_ONE, PAPER: int(number % INSTANCES_A_PAPER == 0)}
    return {**dict.fromkeys(SHELLS, fast | slow), GOOD: dict.fromkeys((NOTHING, GICP, DEFAULT, TOLD), count)}


def _quick_plan() -> dict[Shell, Mapping[str, int]]:
    return dict.fromkeys((NEAR, MIDDLE, GOOD), dict.fromkeys(METHODS, 1))
