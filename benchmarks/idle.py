"""Share of a core that a server takes which nobody uses, with its workers."""

import time
from pathlib import Path

import psutil

from app.resources import DEMO_SCENES
from benchmarks.figures import Figure, Target
from benchmarks.server import RunningServer, server_on

TITLE = "A server that nobody uses: share of a core that it takes"
TARGET = Target(2.0)
SECONDS_TO_SETTLE, SECONDS_TO_WATCH = 60.0, 60.0
"""Objects are built for snaps at first; then nothing is left to do."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """The demo scenes, and nobody signed in."""
    with server_on(folder, [DEMO_SCENES]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """A look at the processes, and another one later."""
    settle, watch = (0.0, 1.0) if quick else (SECONDS_TO_SETTLE, SECONDS_TO_WATCH)
    time.sleep(settle)
    before = _seconds_of_work(server)
    time.sleep(watch)
    after = _seconds_of_work(server)
    shares = {pid: 100.0 * (after[pid] - before.get(pid, 0.0)) / watch for pid in after}
    return [
        Figure("the application", shares[server.process.pid], "%"),
        Figure("with its workers", sum(shares.values()), "%", TARGET),
    ]


def _seconds_of_work(server: RunningServer) -> dict[int, float]:
    """Processor time by process, of the application and all that it started."""
    return {
        process.pid: _work(process) for process in (server.process, *server.process.children(recursive=True))
    }


def _work(process: psutil.Process) -> float:
    times = process.cpu_times()
    return float(times.user + times.system)
