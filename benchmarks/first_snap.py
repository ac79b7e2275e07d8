"""How much longer an object's first snap takes than later ones, asked for at once after opening its task."""

import asyncio
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.figures import Figure, Target, percentile, spread
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import KnownTask, dense_objects, known_tasks, write_full_frames
from benchmarks.server import RunningServer, prepare_state, running_server

TITLE = "First snap of an object over REST, at once after opening, against later ones"
TARGET = Target(2.0)
OBJECTS, QUICK_OBJECTS = 20, 2
SECONDS_TO_PREPARE = 600.0


def run(folder: Path, quick: bool) -> list[Figure]:
    """Twenty dense meshes, each in a frame of its own. Measured twice: after their import, when workers have
    built what they need of them, and after a restart, when they know none of them.
    """
    count = QUICK_OBJECTS if quick else OBJECTS
    write_full_frames(folder / "frames", count, dense_objects(count))
    state = folder / "state"
    prepare_state(state, [folder / "frames"])
    figures = []
    for when in ("after the import", "after a restart"):
        with running_server(state) as server:
            figures += [replace(one, name=f"{when}: {one.name}") for one in measure(server, quick)]
    return figures


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """Every object is snapped some times in a row."""
    return asyncio.run(_measure(server, QUICK_OBJECTS if quick else OBJECTS, later=1 if quick else 6))


async def _measure(server: RunningServer, count: int, later: int) -> list[Figure]:
    rng = np.random.default_rng(0)
    async with signed_in_operators(server, 1) as (operator,):
        prepared = await _seconds_to_prepare(operator)
        firsts, medians = [], []
        for task in known_tasks(server.state_dir)[:count]:
            start = task.near_pose(rng)
            registration_id = await operator.start(task.id)
            firsts.append(await _seconds_to_snap(operator, registration_id, task, start))
            others = [await _seconds_to_snap(operator, registration_id, task, start) for _ in range(later)]
            medians.append(percentile(others, 50))
    ratios = [first / median for first, median in zip(firsts, medians, strict=True)]
    return [
        Figure("until all objects are prepared", prepared, "s"),
        *spread("first snap of an object", firsts),
        *spread("later snaps, median of each object", medians),
        Figure("first against later, median", percentile(ratios, 50), "times"),
        Figure("first against later, worst", percentile(ratios, 100), "times", TARGET),
    ]


async def _seconds_to_prepare(operator: Operator) -> float:
    began = time.perf_counter()
    async with asyncio.timeout(SECONDS_TO_PREPARE):
        while any(
            dataset["objects_prepared"] < dataset["objects"]
            for dataset in (await operator.call("GET", "/api/datasets"))["items"]
        ):
            await asyncio.sleep(0.1)
    return time.perf_counter() - began


async def _seconds_to_snap(
    operator: Operator, registration_id: int, task: KnownTask, start: np.ndarray
) -> float:
    """From the request to the end as the stream tells it; the same snap every time."""
    await operator.set_pose(registration_id, start)
    began = time.perf_counter()
    snap_id = await operator.request_snap(registration_id, seed=task.id)
    async with operator.stream(registration_id) as stream:
        registration = await stream.until_snap_ended(snap_id)
    assert registration["snap"]["state"] == "done", registration["snap"]["message"]
    return time.perf_counter() - began
