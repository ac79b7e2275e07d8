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
from benchmarks.server import RunningServer, server_on

TITLE = "Memory (resident) with open sessions of 300,000 points, each on a frame of its own"
TARGET = Target(700.0)
FOLDER = "snap6d-view-"
"""Where the socket file of a view lies."""
IMPATIENT = (sys.executable, "-m", "benchmarks.impatient_server", "serve")
COUNTS, QUICK_COUNTS = (1, 5, 20), (1, 2)
"""Numbers of sessions at which memory is looked at."""
SECONDS_TO_SETTLE = 3.0
SECONDS_TO_CLOSE = 30.0


class SessionsStayError(Exception):
    """Sessions that nobody uses were not closed."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """A frame for each session, and a server that closes sessions soon."""
    write_full_frames(folder / "frames", (QUICK_COUNTS if quick else COUNTS)[-1])
    with server_on(folder, [folder / "frames"], IMPATIENT) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """Sessions are opened one after the other and closed together."""
    counts, settle = (QUICK_COUNTS, 0.0) if quick else (COUNTS, SECONDS_TO_SETTLE)
    return asyncio.run(_measure(server, counts, settle))


async def _measure(server: RunningServer, counts: tuple[int, ...], settle: float) -> list[Figure]:
    figures = _figures(server, "no session yet")
    tasks = known_tasks(server.state_dir)[: counts[-1]]
    async with signed_in_operators(server, counts[-1]) as operators:
        async with AsyncExitStack() as pages:
            for number, (operator, task) in enumerate(zip(operators, tasks, strict=True), start=1):
                await open_page(pages, operator, task.id)
                if number in counts:
                    await asyncio.sleep(settle)
                    target = TARGET if number == 20 else None
                    figures += _figures(server, f"{number} session{'s' * (number > 1)}", target)
        assert open_views(server) == counts[-1]
        await wait_until_closed(server)
    await asyncio.sleep(settle)
    return figures + _figures(server, "after all were closed")


async def open_page(pages: AsyncExitStack, operator: Operator, task_id: int) -> None:
    """Take up a task with its stream and its 3-D view, until `pages` end."""
    registration_id = await operator.start(task_id)
    await pages.enter_async_context(operator.stream(registration_id))
    await pages.enter_async_context(operator.view(registration_id))


async def wait_until_closed(server: RunningServer) -> None:
    """Return when no session has a 3-D view any more.

    Raises:
        SessionsStayError: where some are kept.
    """
    deadline = time.perf_counter() + IDLE_SECONDS + SECONDS_TO_CLOSE
    while (still_open := open_views(server)) > 0:
        if time.perf_counter() > deadline:
            raise SessionsStayError(f"{still_open} sessions were not closed")
        await asyncio.sleep(0.2)


def open_views(server: RunningServer) -> int:
    """How many socket files the application serves 3-D views on."""
    return len({one.laddr for one in server.process.net_connections("unix") if FOLDER in str(one.laddr)})


def _figures(server: RunningServer, when: str, target: Target | None = None) -> list[Figure]:
    workers = [megabytes(worker) for worker in server.worker_processes()]
    return [
        Figure(f"{when}: application", megabytes(server.process), "MB", target),
        Figure(f"{when}: each of {len(workers)} workers, largest", max(workers), "MB"),
    ]


def megabytes(process: psutil.Process) -> float:
    """What of a process is in memory."""
    return process.memory_info().rss / 1e6
