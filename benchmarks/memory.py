"""Resident memory of the application and its workers, with sessions open and after they were closed."""

import asyncio
import sys
import time
from contextlib import AsyncExitStack
from pathlib import Path

import psutil

from benchmarks.figures import Figure, Target
from benchmarks.impatient_server import IDLE_SECONDS
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.scenes import known_tasks, write_full_frames
from benchmarks.server import RunningServer, prepare_state, running_server

TITLE = "Memory (resident) with open sessions of 300,000 points, each on a frame of its own"
TARGET = Target(700.0)
IMPATIENT = (sys.executable, "-m", "benchmarks.impatient_server", "serve")
SECONDS_TO_SETTLE = 3.0
SECONDS_TO_CLOSE = 30.0


class SessionsStayError(Exception):
    """Sessions that nobody uses were not closed."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Sessions are opened one after the other and closed together."""
    counts = (1, 2) if quick else (1, 5, 20)
    write_full_frames(folder / "frames", counts[-1])
    state = folder / "state"
    prepare_state(state, [folder / "frames"])
    with running_server(state, command=IMPATIENT) as server:
        return asyncio.run(_measure(server, counts, settle=0.0 if quick else SECONDS_TO_SETTLE))


async def _measure(server: RunningServer, counts: tuple[int, ...], settle: float) -> list[Figure]:
    figures = _figures(server, "no session yet")
    tasks = known_tasks(server.state_dir)
    listening = _listening(server)
    async with signed_in_operators(server, counts[-1]) as operators:
        async with AsyncExitStack() as pages:
            for number, (operator, task) in enumerate(zip(operators, tasks, strict=True), start=1):
                await _open_page(pages, operator, task.id)
                if number in counts:
                    await asyncio.sleep(settle)
                    target = TARGET if number == 20 else None
                    figures += _figures(server, f"{number} session{'s' * (number > 1)}", target)
        await _wait_until_closed(server, listening)
    await asyncio.sleep(settle)
    return figures + _figures(server, "after all were closed")


async def _open_page(pages: AsyncExitStack, operator: Operator, task_id: int) -> None:
    registration_id = await operator.start(task_id)
    await pages.enter_async_context(operator.stream(registration_id))
    await pages.enter_async_context(operator.view(registration_id))


async def _wait_until_closed(server: RunningServer, listening: int) -> None:
    deadline = time.perf_counter() + IDLE_SECONDS + SECONDS_TO_CLOSE
    while _listening(server) > listening:
        if time.perf_counter() > deadline:
            raise SessionsStayError(f"{_listening(server) - listening} sessions were not closed")
        await asyncio.sleep(0.2)


def _listening(server: RunningServer) -> int:
    """How many ports the application listens on: each open view has one."""
    connections = server.process.net_connections("tcp")
    return sum(connection.status == psutil.CONN_LISTEN for connection in connections)


def _figures(server: RunningServer, when: str, target: Target | None = None) -> list[Figure]:
    workers = [_megabytes(worker) for worker in server.worker_processes()]
    return [
        Figure(f"{when}: application", _megabytes(server.process), "MB", target),
        Figure(f"{when}: each of {len(workers)} workers, largest", max(workers), "MB"),
    ]


def _megabytes(process: psutil.Process) -> float:
    return process.memory_info().rss / 1e6
