"""Many operators who drag and snap at once, without a browser, and whether all that they finished is kept."""

import asyncio
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.resources import DEMO_SCENES
from benchmarks.bookkeeping import Comparison, Finished, compare_all
from benchmarks.figures import Figure, Target, spread
from benchmarks.operators import Operator, Stream, signed_in_operators
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import RunningServer, database_of, server_on
from benchmarks.viser_client import ViewClient
from registration_core.geometry import pose

TITLE = "Load: operators who drag (20 updates a second for a second) and snap, each with a page open"
NOTHING = Target(0.0)
SNAP_TARGETS = {10: Target(0.5)}
"""Of the 95th percentile, by the number of operators."""
UPDATES_A_DRAG = 20
SNAPS_BETWEEN_BUSY_ONES = 3
"""Of each operator's snaps, every so manieth is one during which the operator drags on."""

Array = NDArray[np.float64]


class SnapFailedError(Exception):
    """A snap came to nothing."""


@dataclass
class Worker:
    """One operator at one task."""

    operator: Operator
    task: KnownTask
    stream: Stream
    view: ViewClient
    rng: np.random.Generator
    finished: Finished
    seconds_to_save: list[float] = field(default_factory=list)
    """From letting go to the word that the drag is saved."""
    seconds_to_snap: list[float] = field(default_factory=list)

    async def work(self, cycle: int) -> None:
        """One drag and one snap; now and then the operator drags on during the snap."""
        await self._drag()
        began = time.perf_counter()
        snap_id = await self.operator.request_snap(self.finished.registration_id)
        if cycle % SNAPS_BETWEEN_BUSY_ONES == SNAPS_BETWEEN_BUSY_ONES - 1:
            await self._drag()
            registration = await self.stream.until_snap_ended(snap_id)
            result = _offered(registration, snap_id)
        else:
            registration = await self.stream.until_snap_ended(snap_id)
            self.seconds_to_snap.append(time.perf_counter() - began)
            result = np.array(registration["T_world_object"])
        if registration["snap"]["state"] != "done":
            raise SnapFailedError(f"task {self.task.id}: {registration['snap']['message']}")
        self.finished.snaps[snap_id] = result

    async def _drag(self) -> None:
        T_object_gizmo = pose.from_rotation_translation(np.eye(3), self.task.model.centre)
        T_world_object = self.task.near_pose(self.rng)
        await self.view.drag(_way(self.view.T_world_gizmo, T_world_object @ T_object_gizmo))
        let_go = time.perf_counter()
        await self.stream.until_at(T_world_object)
        self.seconds_to_save.append(time.perf_counter() - let_go)
        self.finished.drags.append(T_world_object)


@dataclass(frozen=True)
class Shift:
    """What one operator did."""

    finished: Finished
    seconds_to_save: list[float]
    seconds_to_snap: list[float]
    error: str


def run(folder: Path, quick: bool) -> list[Figure]:
    """Every operator has a task; all begin together."""
    crews, seconds = ((2,), 2.0) if quick else ((10, 20), 60.0)
    return [figure for count in crews for figure in _crew(folder / str(count), count, seconds)]


def _crew(folder: Path, count: int, seconds: float) -> list[Figure]:
    with server_on(folder, [DEMO_SCENES]) as server:
        shifts = asyncio.run(_work_together(server, count, seconds))
        with database_of(server.state_dir) as database:
            comparison = compare_all(database, [shift.finished for shift in shifts])
    return _figures(shifts, comparison, seconds)


async def _work_together(server: RunningServer, clients: int, seconds: float) -> list[Shift]:
    tasks = known_tasks(server.state_dir)[:clients]
    ready = asyncio.Barrier(clients)
    async with signed_in_operators(server, clients) as operators:
        return await asyncio.gather(
            *(_shift(operator, task, ready, seconds) for operator, task in zip(operators, tasks, strict=True))
        )


async def _shift(operator: Operator, task: KnownTask, ready: asyncio.Barrier, seconds: float) -> Shift:
    registration_id = await operator.start(task.id)
    finished = Finished(registration_id, updates_a_drag=UPDATES_A_DRAG)
    async with operator.stream(registration_id) as stream, operator.view(registration_id) as view:
        worker = Worker(operator, task, stream, view, np.random.default_rng(task.id), finished)
        await ready.wait()
        error = await _work_until(worker, time.perf_counter() + seconds)
    return Shift(finished, worker.seconds_to_save, worker.seconds_to_snap, error)


async def _work_until(worker: Worker, deadline: float) -> str:
    cycle = 0
    while time.perf_counter() < deadline:
        try:
            await worker.work(cycle)
        except Exception as error:  # whatever goes wrong for one operator is a finding, not the end
            return f"{type(error).__name__}: {error}"
        cycle += 1
    return ""


def _way(T_start: Array, T_end: Array) -> list[Array]:
    """A drag's poses (4, 4), of which the last is `T_end` exactly."""
    twist = pose.log(pose.inverse(T_start) @ T_end)
    shares = np.arange(1, UPDATES_A_DRAG) / UPDATES_A_DRAG
    return [*(T_start @ pose.exp(share * twist) for share in shares), T_end]


def _offered(registration: dict[str, Any], snap_id: str) -> Array | None:
    offer = registration["offer"]
    return np.array(offer["T_world_object"]) if offer and offer["snap_id"] == snap_id else None


def _figures(shifts: list[Shift], comparison: Comparison, seconds: float) -> list[Figure]:
    drags = sum(len(shift.finished.drags) for shift in shifts)
    snaps = sum(len(shift.finished.snaps) for shift in shifts)
    errors = [shift.error for shift in shifts if shift.error]
    return [
        Figure(f"drags that {len(shifts)} operators finished in {seconds:.0f} s", drags, ""),
        Figure("drags lost", comparison.drags.lost, "", NOTHING),
        Figure("drags doubled", comparison.drags.surplus, "", NOTHING),
        Figure("rows of drag paths lost", comparison.path_rows.lost, "", NOTHING),
        Figure("rows of drag paths doubled", comparison.path_rows.surplus, "", NOTHING),
        Figure("snaps finished", snaps, ""),
        Figure("snaps lost", comparison.snaps.lost, "", NOTHING),
        Figure("snaps doubled", comparison.snaps.surplus, "", NOTHING),
        Figure("errors" + "".join(f"\n  {error}" for error in sorted(set(errors))), len(errors), "", NOTHING),
        *spread("letting go to saved", [s for shift in shifts for s in shift.seconds_to_save]),
        *spread(
            "Snap to result",
            [s for shift in shifts for s in shift.seconds_to_snap],
            SNAP_TARGETS.get(len(shifts)),
        ),
    ]
