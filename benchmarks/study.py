"""A study of simulated operators by command, end to end: what it takes, and how that grows with operators."""

import os
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import psutil

from app.config import PROJECT
from benchmarks.figures import Figure, Target
from benchmarks.registration.objects import DATA
from benchmarks.server import DEMO_SCENES, prepare_state

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
class Cost:
    """What a command took."""

    seconds: float
    busy: float
    """Share of all processors, percent."""
    megabytes: float
    """Resident at the worst, of all its processes."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """The run, and another one with twice the operators."""
    datasets = [DEMO_SCENES, *([DATA / "ycbv"] if DATA.is_dir() else [])]
    operators, scenes = (1, 1) if quick else (OPERATORS, SCENES)
    prepare_state(folder / "once", datasets)
    prepare_state(folder / "twice", datasets)
    once = _study(folder / "once", operators, scenes)
    twice = _study(folder / "twice", 2 * operators, scenes)
    seconds = sum(cost.seconds for cost in once.values())
    growth = sum(cost.seconds for cost in twice.values()) / seconds
    batch = once["snap"]
    return [
        Figure(f"{2 * operators} operators, all in all", seconds, "s", Target(MOST_SECONDS)),
        *(Figure(f"of it: study {command}", cost.seconds, "s") for command, cost in once.items()),
        Figure("study snap keeps processors busy", batch.busy, "%", Target(LEAST_BUSY, at_least=True)),
        Figure("study snap: memory of all its processes", batch.megabytes, "MB", Target(MOST_MEGABYTES)),
        Figure("time with twice the operators", growth, "times", Target(MOST_GROWTH)),
    ]


def _study(state: Path, operators: int, scenes: int) -> dict[str, Cost]:
    size = ("--operators", str(operators), "--scenes", str(scenes))
    return {
        "simulate": _command(state, "simulate", NAME, *size),
        "snap": _command(state, "snap", NAME),
        "report": _command(state, "report", NAME, "--out", str(state / "report")),
    }


def _command(state: Path, *arguments: str) -> Cost:
    output = state.with_suffix(".log")
    before, began = _processor_seconds(), time.perf_counter()
    with output.open("wb") as sink:
        process = psutil.Popen(
            [sys.executable, "-m", "app.cli", "study", *arguments],
            cwd=PROJECT,
            env={**os.environ, "SNAP6D_STATE_DIR": str(state)},
            stdin=subprocess.DEVNULL,
            stdout=sink,
            stderr=subprocess.STDOUT,
        )
    megabytes = 0.0
    while process.poll() is None:
        megabytes = max(megabytes, _megabytes(process))
        time.sleep(SECONDS_BETWEEN_LOOKS)
    seconds = time.perf_counter() - began
    if process.returncode:
        raise CommandError(f"study {arguments[0]} failed:\n{output.read_text()}")
    busy = 100.0 * (_processor_seconds() - before) / (seconds * (os.cpu_count() or 1))
    return Cost(seconds, busy, megabytes)


def _processor_seconds() -> float:
    """That children of this process have used, once they ended, and theirs."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _megabytes(process: psutil.Process) -> float:
    """Of a process and those that it started; what they share counts with each."""
    total = 0.0
    for one in (process, *process.children(recursive=True)):
        try:
            total += one.memory_info().rss / 1e6
        except psutil.NoSuchProcess:
            continue
    return total
