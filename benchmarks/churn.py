"""Resident memory after pages were opened and closed for long, beside that after the first rounds."""

import asyncio
import time
from contextlib import AsyncExitStack
from pathlib import Path

from benchmarks.figures import Figure, Target
from benchmarks.memory import IMPATIENT, megabytes, open_page, wait_until_closed
from benchmarks.operators import signed_in_operators
from benchmarks.scenes import known_tasks, write_full_frames
from benchmarks.server import RunningServer, server_on

TITLE = "Memory (resident) of the application after pages were opened and closed for ten minutes"
TARGET = Target(1.10)
AT_ONCE = 4
FRAMES = 20
ROUNDS_BEFORE = 6
"""Until everything was in use once and the caches are full."""
SECONDS = 600.0


def run(folder: Path, quick: bool) -> list[Figure]:
    """Twenty frames, and a server that closes sessions soon."""
    write_full_frames(folder / "frames", AT_ONCE if quick else FRAMES)
    with server_on(folder, [folder / "frames"], IMPATIENT) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """Operators open four pages, each on the next frame, close them, and wait until their sessions are."""
    return asyncio.run(_measure(server, 1 if quick else ROUNDS_BEFORE, 0.0 if quick else SECONDS))


async def _measure(server: RunningServer, rounds_before: int, seconds: float) -> list[Figure]:
    tasks = [task.id for task in known_tasks(server.state_dir)]
    async with signed_in_operators(server, AT_ONCE) as operators:

        async def one_round(number: int) -> None:
            async with AsyncExitStack() as pages:
                for place, operator in enumerate(operators):
                    await open_page(pages, operator, tasks[(number * AT_ONCE + place) % len(tasks)])
            await wait_until_closed(server)

        for number in range(rounds_before):
            await one_round(number)
        before = megabytes(server.process)
        rounds, began = 0, time.perf_counter()
        while rounds == 0 or time.perf_counter() - began < seconds:
            await one_round(rounds)
            rounds += 1
        after = megabytes(server.process)
    return [
        Figure("rounds of four pages", rounds, "rounds"),
        Figure("before", before, "MB"),
        Figure("after", after, "MB"),
        Figure("after to before", after / before, "times", TARGET),
    ]
