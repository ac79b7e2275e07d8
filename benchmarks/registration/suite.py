"""What is tried on which instances, and everything that comes of it."""

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from rich.console import Console

from benchmarks.figures import Figure
from benchmarks.registration import prototype
from benchmarks.registration.agreement import print_agreement
from benchmarks.registration.anywhere import proposal_figures
from benchmarks.registration.choice import Choice
from benchmarks.registration.instances import (
    APC,
    BUNNY,
    HALF,
    INEXACT,
    MORO,
    MOST_SCENES,
    PLAIN,
    RBT,
    REAL,
    SENSORS,
    SETS,
    SYNTHETIC,
    YCB,
    Instance,
    inexact_instances,
    real_instances,
    sensor_instances,
    synthetic_instances,
)
from benchmarks.registration.methods import (
    BEST_OF,
    DEFAULT,
    GICP,
    ICP,
    NOTHING,
    PAPER,
    PROTOTYPE,
    TOLD,
    available_methods,
)
from benchmarks.registration.objects import DATA
from benchmarks.registration.overlays import write_overlays
from benchmarks.registration.several_views import view_figures
from benchmarks.registration.starts import GOOD, MIDDLE, SHELLS, Shell
from benchmarks.registration.tables import (
    print_confidences,
    print_made_worse,
    print_reliability,
    print_tables,
)
from benchmarks.registration.targets import figures
from benchmarks.registration.timing import timings
from benchmarks.registration.trials import run_trials, single_threaded_pool

OVERLAYS_VARIABLE = "BENCHMARK_OVERLAYS"
TABLE_WIDTH = 120
"""Columns, also where the output is no terminal."""

AN_OBJECT, OF_A_SENSOR = 8, 3
"""Instances of each object in each plain synthetic set, and with each sensor and the wrong meshes."""
QUICK_SETS = (HALF, YCB)
"""One instance of each makes a quick run."""
QUICK_SCENES = 1
"""Of each synthetic set then; it holds at least one instance."""
STARTS = dict.fromkeys(SYNTHETIC, 5) | {YCB: 20, BUNNY: 20, MORO: 6, APC: 20, RBT: 8}
"""From each shell about each instance: fewer where there are many instances."""
WIDELY_STARTED = (*PLAIN, YCB, BUNNY)
"""Sets that are started from the farthest shell, too."""
SEARCHES = 60
"""Without a start, in all images of a real set together."""
STARTS_A_SLOW_ONE = 5
"""The best of 32 has this many times fewer starts, ..."""
INSTANCES_A_PAPER = 24
"""... and one instance in so many has one for the paper's method."""
INSTANCES_AN_AGREEMENT = 3
"""One synthetic instance in so many shows how the sparse agreement ranks poses."""


def measure(quick: bool) -> list[Figure]:
    """All figures; prints tables, and writes overlays where asked."""
    console = Console(highlight=False, width=max(Console().width, TABLE_WIDTH))
    try:
        choice = Choice.read(SETS, QUICK_SETS if quick else SETS, available_methods())
    except ValueError as error:
        raise SystemExit(str(error)) from error
    if not DATA.is_dir():
        console.print(f"The real scenes and the YCB objects are left out: there is no {DATA}.")
    if not prototype.is_there():
        console.print(f"The research prototype is left out: there is no {prototype.FOLDER}.")
    instances = _instances(choice, quick)
    plans = [
        _quick_plan(choice) if quick else _plan(one, number, choice) for number, one in enumerate(instances)
    ]
    with single_threaded_pool() as pool:
        half = [one for one in instances if one.set_name == HALF]
        timed = [] if choice.is_part else timings(pool, half, quick)
        results = run_trials(pool, instances, plans, quick, console)
        beside = [] if choice.is_part else _beside_trials(pool, instances, quick, console)
    trials = [trial for result in results for trial in result.trials]
    for name in choice.sets:
        print_tables(console, trials, name)
    print_made_worse(console, [trial for trial in trials if trial.shell == GOOD])
    own = [trial for trial in trials if trial.method == DEFAULT and trial.shell != GOOD]
    print_confidences(console, own)
    for title, sets in (("synthetic", SYNTHETIC), ("real", REAL)):
        if some := [trial for trial in own if trial.set_name in sets]:
            print_reliability(console, some, title)
    if folder := os.environ.get(OVERLAYS_VARIABLE):
        write_overlays(Path(folder), instances, trials)
    return [*figures(results), *beside, *timed]


def _instances(choice: Choice, quick: bool) -> list[Instance]:
    scenes = QUICK_SCENES if quick else MOST_SCENES
    found = [_of_set(name, scenes) for name in choice.sets]
    return [one for own in found for one in (own[:1] if quick else own)]


def _of_set(name: str, scenes: int) -> list[Instance]:
    if name in PLAIN:
        return synthetic_instances(name, AN_OBJECT, scenes)
    if name in SENSORS:
        return sensor_instances(name, OF_A_SENSOR, scenes)
    return inexact_instances(OF_A_SENSOR, scenes) if name == INEXACT else real_instances(name)


def _beside_trials(
    pool: Executor, instances: Sequence[Instance], quick: bool, console: Console
) -> list[Figure]:
    """What is measured of snaps without trials of single starts."""
    plain = [one for one in instances if one.set_name in PLAIN]
    print_agreement(console, plain[::INSTANCES_AN_AGREEMENT])
    searches = 1 if quick else SEARCHES
    proposed = [
        figure
        for name in REAL
        for figure in proposal_figures(pool, [one for one in instances if one.set_name == name], searches)
    ]
    return [*view_figures(pool, quick), *proposed]


def _plan(instance: Instance, number: int, choice: Choice) -> dict[Shell, Mapping[str, int]]:
    count = min(STARTS[instance.set_name], choice.starts or STARTS[instance.set_name])
    fast = dict.fromkeys((NOTHING, GICP, PROTOTYPE, DEFAULT, TOLD), count)
    slow = {
        ICP: count,
        BEST_OF: -(-count // STARTS_A_SLOW_ONE),
        PAPER: int(number % INSTANCES_A_PAPER == 0),
    }
    shells = SHELLS if instance.set_name in WIDELY_STARTED else SHELLS[:-1]
    plan = {**dict.fromkeys(shells, fast | slow), GOOD: fast}
    return {
        shell: {name: n for name, n in counts.items() if name in choice.methods}
        for shell, counts in plan.items()
    }


def _quick_plan(choice: Choice) -> dict[Shell, Mapping[str, int]]:
    return dict.fromkeys((MIDDLE, GOOD), dict.fromkeys(choice.methods, 1))
