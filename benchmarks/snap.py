"""Seconds from pressing Snap to its result, as a page sees it."""

import asyncio
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from app.resources import DEMO_SCENES
from benchmarks.figures import Figure, Target, percentile, spread
from benchmarks.operators import Operator, Stream, signed_in_operators
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import RunningServer, server_on
from registration_core.geometry import pose_error

TITLE = "Snap on the demo scenes: from POST .../snaps to the result on the stream"
TARGET = Target(0.15)
CANCEL_TARGET = Target(0.2)
RIGHT = 0.1
"""Share of the diameter up to which ADD-S is called right."""


class SnapFailedError(Exception):
    """A snap came to nothing."""


@dataclass(frozen=True)
class Snapped:
    """One snap."""

    seconds: float
    """As the operator sees it."""
    server_seconds: float
    """Between the two lines of the log."""
    compute_seconds: float
    """In the worker."""
    is_right: bool


def run(folder: Path, quick: bool) -> list[Figure]:
    """From 2 cm and 15 degrees off the truth; the first snap of each object is measured on its own."""
    with server_on(folder, [DEMO_SCENES]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """At every task, one after the other."""
    return asyncio.run(_measure(server, tasks=1 if quick else None, snaps=1 if quick else 4))


async def _measure(server: RunningServer, tasks: int | None, snaps: int) -> list[Figure]:
    rng = np.random.default_rng(0)
    first: dict[int, float] = {}
    later: list[Snapped] = []
    cancels: list[float] = []
    async with signed_in_operators(server, 1) as (operator,):
        for task in known_tasks(server.state_dir)[:tasks]:
            registration_id = await operator.start(task.id)
            async with operator.stream(registration_id) as stream:
                warm_up = await _snap(operator, stream, registration_id, task, rng)
                first.setdefault(task.object_id, warm_up.seconds)
                later += [await _snap(operator, stream, registration_id, task, rng) for _ in range(snaps)]
                cancels.append(await _cancel(operator, stream, registration_id))
    return [
        *spread(f"Snap to result ({len(later)} snaps)", [one.seconds for one in later], TARGET),
        Figure("Snap to result, worst", percentile([one.seconds for one in later], 100), "s"),
        *spread("of it between the log's lines", [one.server_seconds for one in later]),
        *spread("of it computing", [one.compute_seconds for one in later]),
        *spread("an object's first snap, at once after opening", list(first.values())),
        *spread("Cancel of a paper() run to cancelled", cancels, CANCEL_TARGET),
        Figure(
            "right poses (ADD-S below a tenth of the diameter)",
            100 * float(np.mean([s.is_right for s in later])),
            "%",
        ),
    ]


async def _snap(
    operator: Operator, stream: Stream, registration_id: int, task: KnownTask, rng: np.random.Generator
) -> Snapped:
    start = task.near_pose(rng)
    await operator.set_pose(registration_id, start)
    await stream.until_at(start)
    began = time.perf_counter()
    snap_id = await operator.request_snap(registration_id)
    registration = await stream.until_snap_ended(snap_id)
    seconds = time.perf_counter() - began
    if registration["snap"]["state"] != "done":
        raise SnapFailedError(f"task {task.id}: {registration['snap']['message']}")
    estimate = (await operator.call("GET", f"/api/snaps/{snap_id}"))["estimate"]
    return Snapped(
        seconds=seconds,
        server_seconds=await _logged_seconds(operator, registration_id, snap_id),
        compute_seconds=estimate["seconds"],
        is_right=_is_right(task, np.array(estimate["T_world_object"])),
    )


async def _cancel(operator: Operator, stream: Stream, registration_id: int) -> float:
    snap_id = await operator.request_snap(registration_id, {"preset": "paper"})
    await stream.until_snap_runs(snap_id)
    began = time.perf_counter()
    await operator.call("DELETE", f"/api/snaps/{snap_id}")
    registration = await stream.until_snap_ended(snap_id)
    assert registration["snap"]["state"] == "cancelled"
    return time.perf_counter() - began


async def _logged_seconds(operator: Operator, registration_id: int, snap_id: str) -> float:
    log = await operator.call("GET", f"/api/registrations/{registration_id}/events?limit=500")
    times = [event["monotonic_seconds"] for event in log["items"] if event["snap_id"] == snap_id]
    return float(times[-1] - times[0])


def _is_right(task: KnownTask, T_world_object: np.ndarray) -> bool:
    error = pose_error.adi(T_world_object, task.T_world_object, task.model.vertices)
    return error < RIGHT * task.model.diameter
