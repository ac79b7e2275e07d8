"""What is wrong with a log: missing events, and clocks that jumped."""

from collections.abc import Sequence
from itertools import groupby, pairwise
from typing import NamedTuple

from app.analysis.trace.logs import LoggedRow
from app.storage.event_log import STATE_AFTER

JUMP_SECONDS = 1.0
"""By which a clock has to be off before it is said; the machine's own is corrected by less all the time."""


class Fault(NamedTuple):
    """Something wrong with a log, as a sentence about it."""

    text: str
    spoils_times: bool
    """Whether the times of the trace can no longer be trusted."""


def faults_of(rows: Sequence[LoggedRow]) -> list[Fault]:
    """What is wrong with the events of a registration that was submitted, in their order."""
    runs = [list(run) for _, run in groupby(rows, key=lambda row: row.boot_id)]
    found = [*_gaps(rows), *_lost_end(rows), *_backward_clocks(runs), *_backward_runs(runs)]
    for run in runs:
        if jump := _utc_jump(run):
            text = f"the clock was put {'forward' if jump > 0 else 'back'} by {abs(jump):.0f} s"
            if len(runs) == 1:
                found.append(Fault(f"{text}; the server's steady clock was used", False))
            else:
                found.append(Fault(f"{text}, and runs of the server are joined by it", True))
    return found


def _gaps(rows: Sequence[LoggedRow]) -> list[Fault]:
    found, expected = [], 1
    for row in rows:
        if row.sequence != expected:
            last = row.sequence - 1
            missing = f"event {last} is" if last == expected else f"events {expected} to {last} are"
            found.append(Fault(f"the log has a gap: {missing} missing", True))
        expected = row.sequence + 1
    return found


def _lost_end(rows: Sequence[LoggedRow]) -> list[Fault]:
    """No sequence number tells that the last events are missing."""
    changes = [row.kind for row in rows if row.kind in STATE_AFTER]
    if changes and STATE_AFTER[changes[-1]] == "submitted":
        return []
    return [Fault("the log has a gap: its end with the submission is missing", True)]


def _backward_clocks(runs: Sequence[Sequence[LoggedRow]]) -> list[Fault]:
    back = [
        before.monotonic_seconds - after.monotonic_seconds for run in runs for before, after in pairwise(run)
    ]
    return (
        [Fault(f"the server's steady clock went back by {max(back):.1f} s", True)] if _is_back(back) else []
    )


def _backward_runs(runs: Sequence[Sequence[LoggedRow]]) -> list[Fault]:
    back = [(before[-1].utc - after[0].utc).total_seconds() for before, after in pairwise(runs)]
    if not _is_back(back):
        return []
    return [Fault(f"the clock was put back by {max(back):.0f} s between two runs of the server", True)]


def _is_back(seconds: Sequence[float]) -> bool:
    return any(value > JUMP_SECONDS for value in seconds)


def _utc_jump(run: Sequence[LoggedRow]) -> float:
    """The largest step of UTC against the steady clock, seconds; 0 where there is none worth telling."""
    utc, steady = run[0].utc, run[0].monotonic_seconds
    largest = 0.0
    for row in run:
        step = (row.utc - utc).total_seconds() - (row.monotonic_seconds - steady)
        if abs(step) > max(JUMP_SECONDS, abs(largest)):
            largest = step
        utc, steady = row.utc, row.monotonic_seconds
    return largest
