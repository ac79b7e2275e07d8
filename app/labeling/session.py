"""One operator's work on one object: what they and the machine may do, in which order, and what is recorded.

Every action is written down before it takes effect, so that what is shown was saved. Nothing here knows
viser, the web or the workers: the session is handed plain functions.
"""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ParamSpec

import numpy as np
from numpy.typing import NDArray

from app.auth import Actor
from app.event_log import NewEvent
from app.labeling.degrees_of_freedom import GizmoAxes, degrees_of_freedom
from app.labeling.drag import Drag
from app.labeling.history import History, Step
from app.labeling.machine import Machine, SamePose
from app.labeling.snap_exchange import Offer, RequestSnap, SnapFailure, SnapOrder, SnapResult, SnapStatus
from app.labeling.start_spread import StartSpread, Unsaid
from app.labeling.track import ActionError, RecordEvent, Track
from app.tables import Condition
from registration_core import SnapConfig

Array = NDArray[np.float64]
P = ParamSpec("P")


@dataclass(frozen=True)
class SessionState:
    """All that a page or a script may want to know of a session at one moment."""

    registration_id: int
    state: str
    frame_id: int
    T_world_object: Array
    confidence: float | None
    can_undo: bool
    can_redo: bool
    dragging: bool
    gizmo_axes: GizmoAxes
    snap: SnapStatus | None
    offer: Offer | None
    is_live: bool
    live: Offer | None
    """Where a snap would land now."""
    message: str | None


class LabelingSession:
    """The state of one registration and the actions on it, safe to call from any thread.

    Args:
        registration_id: Whose row in the database this is.
        history: The poses so far, as replayed from the log.
        state: "open" or "submitted".
        frame_id: The frame that is shown and snapped against.
        frame_ids: The scene's frames.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        condition: What the machine may do.
        same_pose: Tells whether two poses are one, as far as anybody could tell.
        record_event: Writes an event durably; raises where it cannot.
        request_snap: Hands an order to the workers.
    """

    def __init__(
        self,
        registration_id: int,
        history: History,
        state: str,
        frame_id: int,
        frame_ids: Sequence[int],
        pivot: Array,
        condition: Condition,
        same_pose: SamePose,
        record_event: RecordEvent,
        request_snap: RequestSnap,
    ) -> None:
        self.registration_id = registration_id
        self._state = state
        self._frame_ids = tuple(frame_ids)
        self._request_snap = request_snap
        self._track = Track(history, frame_id, pivot, record_event)
        self._machine = Machine(
            registration_id, self._track, condition, same_pose, self._request_from_workers
        )
        self._lock = threading.RLock()
        self._listeners: list[Callable[[SessionState], None]] = []
        self._gizmo_axes: GizmoAxes = "object"
        self.last_used = time.monotonic()

    # -- what is seen ------------------------------------------------------------------------------

    def snapshot(self) -> SessionState:
        """The present state."""
        with self._lock:
            track, history = self._track, self._track.history
            return SessionState(
                registration_id=self.registration_id,
                state=self._state,
                frame_id=track.frame_id,
                T_world_object=track.T_world_object,
                confidence=None if track.drag else history.current.confidence,
                can_undo=self._is_open and history.can_undo,
                can_redo=self._is_open and history.can_redo,
                dragging=track.drag is not None,
                gizmo_axes=self._gizmo_axes,
                snap=self._machine.status,
                offer=self._machine.offer,
                is_live=self._machine.is_live,
                live=self._machine.live,
                message=track.message,
            )

    def subscribe(self, listener: Callable[[SessionState], None]) -> Callable[[], None]:
        """Call `listener` after every change, in order, from any thread; it must be quick.

        Returns:
            A function that ends the subscription.
        """
        with self._lock:
            self._listeners.append(listener)

        def unsubscribe() -> None:
            with self._lock:
                if listener in self._listeners:  # closing the session ended it before
                    self._listeners.remove(listener)

        return unsubscribe

    # -- the operator's hand -----------------------------------------------------------------------

    def start_drag(self) -> None:
        """The operator took hold of the gizmo."""
        with self._lock:
            if not self._is_open:
                return
            self._track.drag = Drag(self._track.history.current.T_world_object, self._gizmo_axes)
            self._changed()

    def drag_to(self, T_world_object: Array) -> None:
        """The gizmo is here now; nothing is written before it is let go."""
        with self._lock:
            if self._track.drag is None:
                return
            self._track.drag.move(T_world_object)
            self._changed()

    def end_drag(self) -> None:
        """The operator let go: the drag is written down; where that fails, it is taken back and said so.

        In `auto` the machine has its turn then.
        """
        with self._lock:
            try:
                if self._write_drag():
                    self._machine.take_turn()
            finally:
                self._changed()

    def set_pose(
        self,
        T_world_object: Array,
        actor: Actor,
        technique: str | None = None,
        detail: Mapping[str, object] | None = None,
    ) -> None:
        """Put the object at a pose.

        Args:
            T_world_object: Where it goes.
            actor: Who moves it.
            technique: How the pose was found, for the log.
            detail: What the technique found it from, for the log, as JSON.
        """
        with self._lock:
            self._require_free_hands()
            before = self._track.history.current.T_world_object
            event = NewEvent(
                kind="set_pose",
                actor=actor,
                T_before=before.tolist(),
                T_after=T_world_object.tolist(),
                dof=degrees_of_freedom(before, T_world_object, self._track.pivot),
                detail=({} if technique is None else {"technique": technique}) | dict(detail or {}),
            )
            self._move(event, Step(T_world_object))
            self._changed()

    def move(self, change: Callable[[Array], Array], actor: Actor, technique: str) -> None:
        """Put the object where `change` leads from its present pose; nothing comes between the two."""
        with self._lock:
            self._require_free_hands()
            self.set_pose(change(self._track.history.current.T_world_object), actor, technique)

    def align_gizmo(self, axes: GizmoAxes) -> None:
        """Let the gizmo's arrows lie along other axes; each drag is logged with those that it had."""
        with self._lock:
            self._require_free_hands()
            self._gizmo_axes = axes
            self._changed()

    def reset(self, actor: Actor) -> None:
        """Put the object back to where it began; this can be undone."""
        with self._lock:
            self._require_free_hands()
            start = self._track.history.steps[0]
            self._move(self._track.move_event("reset", actor, start), start)
            self._changed()

    def undo(self, actor: Actor) -> None:
        """Take the last change of pose back, whoever made it."""
        with self._lock:
            self._require_free_hands()
            if not self._track.history.can_undo:
                raise ActionError("There is nothing to undo.")
            self._track.go_to(self._track.history.undone(), "undo", actor)
            self._changed()

    def redo(self, actor: Actor) -> None:
        """Bring back what was undone last."""
        with self._lock:
            self._require_free_hands()
            if not self._track.history.can_redo:
                raise ActionError("There is nothing to redo.")
            self._track.go_to(self._track.history.redone(), "redo", actor)
            self._changed()

    def show_frame(self, frame_id: int, actor: Actor) -> None:
        """Show, and snap against, another frame of the scene."""
        with self._lock:
            if frame_id not in self._frame_ids:
                raise ActionError(f"Frame {frame_id} does not belong to this scene.")
            self._track.record(NewEvent(kind="frame", actor=actor, detail={"frame_id": frame_id}))
            self._track.frame_id = frame_id
            self._changed()

    def submit(self, actor: Actor) -> None:
        """Finish the registration with the present pose."""
        with self._lock:
            self._require_free_hands()
            self._machine.abandon(actor, "submitted")
            T = self._track.history.current.T_world_object.tolist()
            self._track.record(NewEvent(kind="submit", actor=actor, T_before=T, T_after=T))
            self._state = "submitted"
            self._machine.offer = None
            self._changed()

    # -- the machine's hand ------------------------------------------------------------------------

    def snap(
        self,
        actor: Actor,
        config: SnapConfig | None = None,
        seed: int | None = None,
        start_spread: StartSpread | Unsaid | None = Unsaid.FROM_DRAGS,
    ) -> str:
        """Ask the workers for a better pose from the present one; the newest request wins.

        Args:
            actor: Who asks.
            config: `SnapConfig()` where it is None.
            seed: A fresh one where it is None.
            start_spread: How far off the present pose may be; None where that is unknown.

        Returns:
            The snap's id.
        """
        with self._lock:
            self._require_open()
            snap_id = self._machine.snap(actor, config or SnapConfig(), seed, start_spread)
            self._changed()
            return snap_id

    def cancel_snap(self, actor: Actor) -> None:
        """Stop the snap that is under way; nothing happens where there is none."""
        with self._lock:
            self._machine.abandon(actor, "cancelled by request")
            self._changed()

    def accept(self, actor: Actor) -> None:
        """Take the pose that the machine offers, or shows live; this one even out of the operator's hand."""
        with self._lock:
            if self._machine.live is not None:
                self._write_drag()
            self._require_free_hands()
            self._machine.accept(actor)
            self._changed()

    def set_live(self, on: bool, actor: Actor) -> None:
        """Turn live snapping on or off."""
        with self._lock:
            self._require_open()
            self._machine.set_live(on, actor)
            self._changed()

    def dismiss(self, actor: Actor) -> None:
        """Decline the pose that the machine offers."""
        with self._lock:
            self._require_open()
            self._machine.dismiss(actor)
            self._changed()

    def close(self) -> None:
        """End the session, cancelling a snap under way. What was recorded stays, and can be gone on with."""
        with self._lock:
            self._machine.close()
            self._listeners.clear()

    # -- helpers -----------------------------------------------------------------------------------

    @property
    def _is_open(self) -> bool:
        return self._state == "open"

    def _require_open(self) -> None:
        if not self._is_open:
            raise ActionError("This registration was submitted and cannot be changed any more.")

    def _require_free_hands(self) -> None:
        self._require_open()
        if self._track.drag is not None:
            raise ActionError("The object is being dragged; let go of it first.")

    def _write_drag(self) -> bool:
        """End the drag; tells whether it moved anything."""
        drag, self._track.drag = self._track.drag, None
        event = None if drag is None else drag.event(self._track.pivot)
        if drag is None or event is None:
            return False
        try:
            self._move(event, Step(drag.T_now, dragged=True))
        except Exception as error:
            self._track.message = f"The last drag could not be saved and was taken back: {error}"
            raise
        return True

    def _move(self, event: NewEvent, step: Step) -> None:
        self._track.push(event, step)
        self._machine.offer = None

    def _request_from_workers(
        self,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapFailure], None],
    ) -> Callable[[], None]:
        return self._request_snap(order, self._in_turn(on_progress), self._in_turn(on_end))

    def _in_turn(self, report: Callable[P, None]) -> Callable[P, None]:
        """Workers report from any thread: let each in alone, and tell what it changed."""

        def run(*args: P.args, **kwargs: P.kwargs) -> None:
            with self._lock:
                try:
                    report(*args, **kwargs)
                finally:
                    self._changed()

        return run

    def _changed(self) -> None:
        self.last_used = time.monotonic()
        self._machine.follow(self._is_open)
        state = self.snapshot()
        for listener in tuple(self._listeners):
            listener(state)
