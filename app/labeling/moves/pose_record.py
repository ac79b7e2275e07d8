"""One registration's way: where the object is and was, each step of it written down before it counts."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.labeling.moves.drag import Drag
from app.labeling.moves.history import History, Step
from app.storage.event_log import NewEvent
from app.storage.roles import Actor
from app.storage.tables import EstimateRow

Array = NDArray[np.float64]


class ActionError(Exception):
    """An action that is not possible now; the message says why and may be shown."""


class RecordEvent(Protocol):
    """Writes an event, and the estimate it brings, durably."""

    def __call__(self, event: NewEvent, estimate: EstimateRow | None = None) -> object: ...


class PoseRecord:
    """What the operator's hand and the machine's share: the poses, the drag under way, the frame.

    Args:
        history: The poses so far.
        frame_id: The frame that is shown and snapped against.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        record: Writes an event durably; raises where it cannot.
    """

    def __init__(self, history: History, frame_id: int, pivot: Array, record: RecordEvent) -> None:
        self.history = history
        self.frame_id = frame_id
        self.pivot = pivot
        self.record = record
        self.drag: Drag | None = None
        self.message: str | None = None
        """What has to be told until the pose changes next."""

    @property
    def T_world_object(self) -> Array:
        """Where the object is now, be it in the operator's hand."""
        return self.drag.T_now if self.drag else self.history.current.T_world_object

    @property
    def as_if_let_go(self) -> History:
        """The history as it would be if a drag under way ended now."""
        return self.history.pushed(Step(self.drag.T_now, dragged=True)) if self.drag else self.history

    def push(self, event: NewEvent, step: Step, estimate: EstimateRow | None = None) -> None:
        """Put a new pose on top."""
        self.record(event, estimate)
        self.history = self.history.pushed(step)
        self.message = None

    def go_to(self, history: History, kind: str, actor: Actor) -> None:
        """Go back or forth in the history."""
        self.record(self.move_event(kind, actor, history.current))
        self.history = history
        self.message = None

    def move_event(self, kind: str, actor: Actor, step: Step, snap_id: str | None = None) -> NewEvent:
        """A change from the present pose to that of a step."""
        return NewEvent(
            kind=kind,
            actor=actor,
            T_before=self.history.current.T_world_object.tolist(),
            T_after=step.T_world_object.tolist(),
            snap_id=snap_id,
            detail=said_of(step),
        )


def said_of(step: Step) -> dict[str, Any]:
    """What the log keeps of the estimate that a step stems from."""
    confidence = {} if step.confidence is None else {"confidence": step.confidence}
    return confidence | ({} if step.assessment is None else {"assessment": step.assessment.stored()})
