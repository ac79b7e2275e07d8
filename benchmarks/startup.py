"""Seconds from the command to a server that answers."""

import sys
from pathlib import Path

from benchmarks import PROJECT
from benchmarks.figures import Figure, Target, percentile
from benchmarks.server import SERVE, running_server

TITLE = "Start: from the command to GET /api/health 200"
TARGET = Target(5.0)
RUN_SCRIPT = (str(PROJECT / "scripts" / "run"),)


def run(folder: Path, quick: bool) -> list[Figure]:
    """A first start makes the database and imports the demo scenes; later ones find them."""
    state = folder / "state"
    first = _seconds(state)
    figures = [Figure("first start, empty state directory", first, "s")]
    again = [_seconds(state) for _ in range(1 if quick else 3)]
    figures.append(Figure("second start, median", percentile(again, 50), "s", TARGET))
    if not quick and sys.platform == "linux":
        with running_server(state, command=RUN_SCRIPT) as server:
            figures.append(Figure("second ./scripts/run", server.seconds_to_ready, "s", TARGET))
    return figures


def _seconds(state: Path) -> float:
    with running_server(state, "--prepare", command=SERVE) as server:
        return server.seconds_to_ready
