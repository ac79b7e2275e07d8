"""Seconds from opening a task to its scene complete on the wire, with the most points that are shown."""

import asyncio
import time
from collections.abc import Sequence
from pathlib import Path

from app.datasets.scene_data import CLOUD_POINTS
from benchmarks.figures import Figure, Target, percentile
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import known_tasks, write_full_frames
from benchmarks.server import RunningServer, server_on
from tests.app.labeling.viser_client import GIZMO

TITLE = "Opening a task: from POST /api/tasks/{id}/registration to the whole scene on the wire"
TARGET = Target(1.0)
TASKS, QUICK_TASKS = 10, 2
SCENE = frozenset({"/cloud", GIZMO, f"{GIZMO}/mesh"})


class IncompleteSceneError(Exception):
    """The scene did not come whole."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Every task has a frame of its own, so that a first opening finds nothing in memory."""
    write_full_frames(folder / "frames", QUICK_TASKS if quick else TASKS)
    with server_on(folder, [folder / "frames"]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """Each task is opened three times."""
    return asyncio.run(_measure(server, QUICK_TASKS if quick else TASKS))


async def _measure(server: RunningServer, count: int) -> list[Figure]:
    tasks = [task.id for task in known_tasks(server.state_dir)[:count]]
    async with signed_in_operators(server, 2) as (first, second):
        cold = [await _seconds_to_open(first, task) for task in tasks]
        warm = [await _seconds_to_open(second, task) for task in tasks]
        again = [await _seconds_to_open(first, task) for task in tasks]
    return [
        Figure("points on the wire", CLOUD_POINTS, ""),
        Figure("the server's very first opening", cold[0], "s", TARGET),
        *_median_and_worst("a frame's first opening", cold[1:]),
        *_median_and_worst("another operator's first opening of it", warm),
        *_median_and_worst("opening it again", again),
    ]


def _median_and_worst(name: str, seconds: Sequence[float]) -> list[Figure]:
    return [
        Figure(f"{name}, median", percentile(seconds, 50), "s", TARGET),
        Figure(f"{name}, worst", percentile(seconds, 100), "s", TARGET),
    ]


async def _seconds_to_open(operator: Operator, task_id: int) -> float:
    began = time.perf_counter()
    registration_id = await operator.start(task_id)
    async with operator.view(registration_id) as view:
        seconds = time.perf_counter() - began
        if view.points != CLOUD_POINTS or not view.nodes >= SCENE:
            raise IncompleteSceneError(f"task {task_id} showed {view.points} points and {sorted(view.nodes)}")
    return seconds
