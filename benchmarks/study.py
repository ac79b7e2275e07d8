"""A study of simulated operators by command, end to end: what it takes, and how that grows with operators."""

import csv
import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import psutil

from app.resources import DEMO_SCENES
from benchmarks import PROJECT
from benchmarks.figures import Figure, Target
from benchmarks.registration.objects import DATA
from benchmarks.server import prepare_state

TITLE = (
    "A simulated study on 2 demo and 2 real scenes, quickly and accurately, by hand; snaps offline; report"
)

NAME = "benchmark"
OPERATORS, SCENES = 8, 4
"""Novices, and as many experts; and scenes."""
MOST_SECONDS, MOST_MEGABYTES, LEAST_BUSY, MOST_GROWTH = 900.0, 2000.0, 90.0, 2.1
SECONDS_BETWEEN_LOOKS = 0.2


class CommandError(Exception):
    """A command failed; the message holds what it printed."""


@dataclass(frozen=True)
class Look:
    """A command at one moment, with all processes that it started."""

    seconds: float
    """Since it began."""
    processor_seconds: float
    """That those which run now have used."""
    megabytes: float
    """Resident; what processes share counts with each."""
    snaps: int
    """Offline snaps that are stored."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """The run, and another one with twice the operators."""
    datasets = [DEMO_SCENES, *([DATA / "ycbv"] if DATA.is_dir() and not quick else [])]
    operators, scenes = (1, 1) if quick else (OPERATORS, SCENES)
    once, twice = (_study(folder / f"{n}", datasets, n, scenes) for n in (operators, 2 * operators))
    total = _seconds(once)
    snapping = once["snap"]
    return [
        Figure(f"{2 * operators} operators, all in all", total, "s", Target(MOST_SECONDS)),
        *(Figure(f"of it, study {command}", looks[-1].seconds, "s") for command, looks in once.items()),
        Figure("offline snaps, one a sampled pose", snapping[-1].snaps, "rows"),
        Figure("busy processors while they are computed", _busy(snapping), "%", Target(LEAST_BUSY, True)),
        Figure("memory of study snap", max(one.megabytes for one in snapping), "MB", Target(MOST_MEGABYTES)),
        Figure("time with twice the operators", _seconds(twice) / total, "times", Target(MOST_GROWTH)),
        *_rotation(folder / f"{operators}" / "report" / "gains.csv"),
    ]


def _rotation(gains: Path) -> Iterator[Figure]:
    """What a snap does to the rotation, as the report tells it."""
    with gains.open(newline="") as lines:
        for row in csv.DictReader(lines):
            if row["error"] == "rotation":
                who = f"{row['group']}, {row['mode']}, {row['moment']}"
                interval = f"95 %: {row['gain_low']} to {row['gain_high']}"
                yield Figure(
                    f"{who}: a snap takes off the rotation error ({interval})", float(row["gain"]), "°"
                )


def _study(state: Path, datasets: Sequence[Path], operators: int, scenes: int) -> dict[str, Sequence[Look]]:
    prepare_state(state, datasets)
    size = ("--operators", str(operators), "--scenes", str(scenes))
    return {
        "simulate": _watched(state, "simulate", NAME, *size),
        "snap": _watched(state, "snap", NAME),
        "report": _watched(state, "report", NAME, "--out", str(state / "report")),
    }


def _seconds(commands: dict[str, Sequence[Look]]) -> float:
    return sum(looks[-1].seconds for looks in commands.values())


def _busy(looks: Sequence[Look]) -> float:
    """Percent of all processors, from the first snap that was stored to the last one."""
    last = next(i for i, one in enumerate(looks) if one.snaps == looks[-1].snaps)
    first = next(i for i, one in enumerate(looks) if one.snaps or i == last - 1)
    used = looks[last].processor_seconds - looks[first].processor_seconds
    return 100.0 * used / (looks[last].seconds - looks[first].seconds) / (os.cpu_count() or 1)


def _watched(state: Path, *arguments: str) -> list[Look]:
    """Run a command about studies to its end."""
    output = state.with_suffix(".log")
    began = time.perf_counter()
    with output.open("wb") as sink, closing(sqlite3.connect(state / "snap6d.sqlite")) as database:
        process = psutil.Popen(
            [sys.executable, "-m", "app.cli.commands", "study", *arguments],
            cwd=PROJECT,
            env={**os.environ, "SNAP6D_STATE_DIR": str(state)},
            stdin=subprocess.DEVNULL,
            stdout=sink,
            stderr=subprocess.STDOUT,
        )
        looks = []
        while process.poll() is None:
            looks.append(_look(process, database, began))
            time.sleep(SECONDS_BETWEEN_LOOKS)
        looks.append(_look(process, database, began))
    if process.returncode:
        raise CommandError(f"study {arguments[0]} failed:\n{output.read_text()}")
    return looks


def _look(process: psutil.Process, database: sqlite3.Connection, began: float) -> Look:
    seconds, megabytes = 0.0, 0.0
    for one in _family(process):
        try:
            used = one.cpu_times()
            seconds += used.user + used.system
            megabytes += one.memory_info().rss / 1e6
        except psutil.NoSuchProcess:
            continue
    snaps = database.execute("SELECT coalesce(max(id), 0) FROM offline_snaps").fetchone()[0]
    return Look(time.perf_counter() - began, seconds, megabytes, snaps)


def _family(process: psutil.Process) -> list[psutil.Process]:
    try:
        return [process, *process.children(recursive=True)]
    except psutil.NoSuchProcess:
        return []
