"""The poses a registration went through, with undo and redo: a pure function of its events."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from app.confidence.assessment import Assessment, assessment_in

NEW_POSE_KINDS = frozenset({"drag", "set_pose", "snap_applied", "accept", "reset"})
"""Events that put a new pose on top, and with it end what could be redone."""


PosedBy = Literal["start", "human", "machine"]
"""Whose a pose is: "start" where the object began."""

MACHINE_KINDS = frozenset({"snap_applied", "accept"})
FOUND_BY_MACHINE = frozenset({"proposal", "mode"})
"""Techniques of `set_pose` by which an operator takes what the machine has found."""


class LoggedEvent(Protocol):
    """What replaying needs of an event."""

    @property
    def kind(self) -> str: ...
    @property
    def T_after(self) -> Sequence[Sequence[float]] | None: ...
    @property
    def detail(self) -> dict[str, Any]: ...
    @property
    def snap_id(self) -> str | None: ...


@dataclass(frozen=True)
class Step:
    """A pose in the history."""

    T_world_object: NDArray[np.float64]
    """(4, 4)."""
    confidence: float | None = None
    """Of the estimate that the pose stems from; None where a person set it."""
    dragged: bool = False
    """Whether an operator dragged the object here from the step before."""
    snap_id: str | None = None
    """Of the estimate that the pose stems from."""
    assessment: Assessment | None = None
    """What was thought of that estimate; None also where an older version did not say."""
    posed_by: PosedBy = "human"


@dataclass(frozen=True)
class History:
    """Steps from the start pose on, and which of them is the present one."""

    steps: tuple[Step, ...]
    position: int = 0

    @property
    def current(self) -> Step:
        """The present pose."""
        return self.steps[self.position]

    @property
    def can_undo(self) -> bool:
        """Whether there is a pose before."""
        return self.position > 0

    @property
    def can_redo(self) -> bool:
        """Whether a pose was undone."""
        return self.position < len(self.steps) - 1

    def pushed(self, step: Step) -> "History":
        """With a new present pose; what was undone is gone."""
        return History((*self.steps[: self.position + 1], step), self.position + 1)

    def undone(self) -> "History":
        """One pose back."""
        assert self.can_undo
        return History(self.steps, self.position - 1)

    def redone(self) -> "History":
        """One pose forward again."""
        assert self.can_redo
        return History(self.steps, self.position + 1)


def replay(T_start: NDArray[np.float64], events: Iterable[LoggedEvent]) -> History:
    """The history that the events of a registration amount to, in their order."""
    history = start(T_start)
    for event in events:
        history = after(history, event)
    return history


def start(T_start: NDArray[np.float64]) -> History:
    """The history before anything was done."""
    return History((Step(T_start, posed_by="start"),))


def after(history: History, event: LoggedEvent) -> History:
    """The history with one more event."""
    if event.kind == "undo":
        return history.undone()
    if event.kind == "redo":
        return history.redone()
    if event.kind not in NEW_POSE_KINDS:
        return history
    confidence = event.detail.get("confidence")
    return history.pushed(
        Step(
            np.array(event.T_after, dtype=np.float64),
            None if confidence is None else float(str(confidence)),
            event.kind == "drag",
            event.snap_id,
            assessment_in(event.detail),
            poser(event.kind, event.detail),
        )
    )


def poser(kind: str, detail: Mapping[str, object]) -> PosedBy:
    """Whose the pose is that an event of this kind and detail leads to."""
    if kind == "reset":
        return "start"
    found = kind in MACHINE_KINDS or detail.get("technique") in FOUND_BY_MACHINE
    return "machine" if found else "human"
