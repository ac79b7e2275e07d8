"""Live snapping in drags: how long after a pose its result is there, how often, and what drags feel of it."""

import asyncio
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from app.resources import DEMO_SCENES
from benchmarks.figures import Figure, Target, percentile
from benchmarks.operators import Stream, signed_in_operators
from benchmarks.scenes import KnownTask, known_tasks
from benchmarks.server import RunningServer, server_on
from benchmarks.viser_client import Array, ViewClient
from registration_core.geometry import pose

TITLE = "Live snap in drags of the demo objects, one operator"
LATENCY_TARGET = Target(0.150)
RATE_TARGET = Target(5.0, at_least=True)
HARM_TARGET = Target(1.1)
SHIFT, UPDATES = 0.06, 40
"""Metres that a drag moves the object, and poses on its way: two seconds of them."""
SAME = 1e-6
"""Entries of poses that are the same."""


@dataclass
class Watched:
    """What a page was shown during drags."""

    seconds_to_result: list[float] = field(default_factory=list)
    """From the sending of a pose to the arrival of the result that started from it."""
    results_a_second: list[float] = field(default_factory=list)
    gaps: list[float] = field(default_factory=list)
    """Between the states of a drag that arrived."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Each demo object of the first scene is dragged about the truth, with live snapping and without."""
    with server_on(folder, [DEMO_SCENES]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """So many drags of each object without live snapping, and as many with it."""
    with_live, without_live = asyncio.run(_measure(server, 1 if quick else 5, 1 if quick else 4))
    live, without = (percentile(watched.gaps, 50) for watched in (with_live, without_live))
    count = len(with_live.seconds_to_result)
    return [
        Figure(
            "a pose to the live result from it, median",
            percentile(with_live.seconds_to_result, 50),
            "s",
            LATENCY_TARGET,
        ),
        Figure(f"the same, p95 of {count}", percentile(with_live.seconds_to_result, 95), "s"),
        Figure(
            "live results, in the drag with the fewest",
            min(with_live.results_a_second),
            "a second",
            RATE_TARGET,
        ),
        Figure("between a drag's states, without live snap, median", without, "s"),
        Figure("the same with it, times as long", live / without, "times", HARM_TARGET),
    ]


async def _measure(server: RunningServer, tasks: int, drags: int) -> tuple[Watched, Watched]:
    with_live, without_live = Watched(), Watched()
    async with signed_in_operators(server, 1) as (operator,):
        for task in known_tasks(server.state_dir)[:tasks]:
            registration_id = await operator.start(task.id)
            await operator.set_pose(registration_id, task.T_world_object)
            async with operator.stream(registration_id) as stream, operator.view(registration_id) as view:
                await stream.until_at(task.T_world_object)
                for is_live in (False, True):
                    watched = with_live if is_live else without_live
                    await operator.call("PUT", f"/api/registrations/{registration_id}/live", {"on": is_live})
                    for number in range(drags):
                        await _drag(task, stream, view, 1 if number % 2 else -1, watched)
    return with_live, without_live


async def _drag(task: KnownTask, stream: Stream, view: ViewClient, sign: int, watched: Watched) -> None:
    """There and back along an axis of the gizmo, so that every drag begins at the truth."""
    T_object_gizmo = pose.from_rotation_translation(np.eye(3), task.model.centre)
    waves = np.sin(np.linspace(0.0, np.pi, UPDATES + 1))[1:]
    path = [
        task.T_world_object @ T_object_gizmo @ pose.exp(sign * SHIFT * wave * np.eye(6)[0]) for wave in waves
    ]
    states: list[tuple[float, dict[str, Any]]] = []
    watching = asyncio.create_task(_watch(stream, states))
    sent = await view.drag(path)
    await stream.until(lambda now: now["saved"])
    watching.cancel()
    dragged = [(at, now) for at, now in states if now["dragging"]]
    watched.gaps += np.diff([at for at, _ in dragged]).tolist()
    ways = [T @ pose.inverse(T_object_gizmo) for T in path]
    seconds = []
    for at, start in _results(dragged):
        # the way back leads through the same poses: the later one counts
        begun = [b for b, T in zip(sent, ways, strict=True) if b < at and np.allclose(T, start, atol=SAME)]
        seconds += [at - begun[-1]] if begun else []
    watched.seconds_to_result += seconds
    watched.results_a_second.append(len(seconds) / (sent[-1] - sent[0]))


async def _watch(stream: Stream, states: list[tuple[float, dict[str, Any]]]) -> None:
    """Note every state as it arrives."""
    seen = await stream.until(lambda _now: True)
    while True:
        last = seen
        seen = await stream.until(lambda now: now is not last)  # noqa: B023 - awaited before it changes
        states.append((time.perf_counter(), seen))


def _results(states: list[tuple[float, dict[str, Any]]]) -> list[tuple[float, Array]]:
    """When each live result arrived first, and the pose (4, 4) that it started from."""
    found: list[tuple[float, Array]] = []
    for at, now in states:
        if now["live"] is None:
            continue
        start = np.array(now["live"]["T_world_object_start"])
        if not found or not np.array_equal(found[-1][1], start):
            found.append((at, start))
    return found
