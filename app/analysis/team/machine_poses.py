"""What the machine did in one registration: the poses that it brought, and what became of them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.trace.logs import LoggedRow
from app.analysis.trace.trace import Trace
from app.labeling.moves.history import Step, replay
from app.storage.tables import Pose

Array = NDArray[np.float64]

RESULTS = ("snap_applied", "snap_offered", "accept")
"""Kinds of events that bring a snap's pose; `accept` alone where it was shown live."""


@dataclass(frozen=True, eq=False)
class MachinePose:
    """The result of one snap."""

    seconds: float
    """Of the trace, when it came."""
    T_start: Array
    """(4, 4), from where it was asked for."""
    T_result: Array
    """(4, 4)."""
    is_accepted: bool
    """Whether it is a step on the way to the last pose: applied or accepted, and not undone."""


def taken_steps(T_start: Pose, rows: Sequence[LoggedRow]) -> tuple[Step, ...]:
    """The steps that led to the last pose, without those that were undone."""
    history = replay(np.array(T_start), rows)
    return history.steps[: history.position + 1]


def machine_poses(trace: Trace, rows: Sequence[LoggedRow], taken: Sequence[Step]) -> list[MachinePose]:
    """The results of snaps in the order in which they came, each once."""
    accepted = {step.snap_id for step in taken if step.snap_id is not None}
    found: dict[str, MachinePose] = {}
    for row, span in zip(rows, trace.spans, strict=True):
        if row.kind in RESULTS and row.snap_id is not None and row.snap_id not in found:
            before = min(span.start, float(np.nextafter(span.end, -np.inf)))
            found[row.snap_id] = MachinePose(
                seconds=span.end,
                T_start=trace.motion.at([before])[0],
                T_result=np.array(row.T_after),
                is_accepted=row.snap_id in accepted,
            )
    return list(found.values())


def drags_after(taken: Sequence[Step]) -> int | None:
    """Drags after the last pose of the machine that was taken; None where there was none."""
    by_machine = [i for i, step in enumerate(taken) if step.snap_id is not None]
    return sum(step.dragged for step in taken[by_machine[-1] :]) if by_machine else None
