"""A mesh of a million faces: seconds to import it and to open a task with it, and how long others wait."""

import asyncio
import time
from pathlib import Path

import numpy as np
import trimesh

from benchmarks.figures import Figure, Target
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import write_full_frames
from benchmarks.server import RunningServer, prepare_state, running_server
from registration_core.synthetic.objects import ProceduralObject

TITLE = "A mesh of a million faces, and another operator's requests meanwhile"
OPEN_TARGET = Target(5.0)
OTHERS_TARGET = Target(100.0)
SECONDS_BETWEEN_REQUESTS = 0.02
SMALL_SECTIONS, LARGE_SECTIONS = 100, 1000
"""Around the ring; half as many around its tube, and two faces each."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """The second scene has the mesh; the first keeps the other operator busy."""
    sections = SMALL_SECTIONS if quick else LARGE_SECTIONS
    write_full_frames(folder / "frames", 2, [ring(SMALL_SECTIONS), ring(sections)])
    state = folder / "state"
    began = time.perf_counter()
    prepare_state(state, [folder / "frames"])
    imported = time.perf_counter() - began
    with running_server(state) as server:
        return [
            Figure("faces", sections * sections, ""),
            Figure("import", imported, "s"),
            *measure(server, quick),
        ]


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """The second task is the one that is heavy."""
    return asyncio.run(_measure(server))


async def _measure(server: RunningServer) -> list[Figure]:
    async with signed_in_operators(server, 3) as (first, second, other):
        busy = await other.start(1)
        answers: list[float] = []
        asking = asyncio.create_task(_ask(other, busy, answers))
        opened = [await _seconds_to_open(operator, 2) for operator in (first, second)]
        asking.cancel()
    return [
        Figure("opening a task with it", opened[0], "s", OPEN_TARGET),
        Figure("opening it again, by another operator", opened[1], "s", OPEN_TARGET),
        Figure("another operator's slowest answer meanwhile", 1000 * max(answers), "ms", OTHERS_TARGET),
    ]


async def _ask(operator: Operator, registration_id: int, answers: list[float]) -> None:
    while True:
        began = time.perf_counter()
        await operator.call("GET", f"/api/registrations/{registration_id}")
        answers.append(time.perf_counter() - began)
        await asyncio.sleep(SECONDS_BETWEEN_REQUESTS)


async def _seconds_to_open(operator: Operator, task_id: int) -> float:
    began = time.perf_counter()
    registration_id = await operator.start(task_id)
    async with operator.view(registration_id):
        pass
    return time.perf_counter() - began


def ring(sections: int) -> ProceduralObject:
    """A bumpy ring; two faces for each of so many by half as many places on it."""
    mesh = trimesh.creation.torus(0.05, 0.02, major_sections=sections, minor_sections=sections // 2)
    bumps = 1.0 + 0.02 * np.sin(400.0 * mesh.vertices).prod(axis=1, keepdims=True)
    mesh.vertices = mesh.vertices * bumps
    return ProceduralObject(f"ring {sections}", mesh)
