"""One operator's work on one object: what they and the machine may do, in which order, and what is recorded.

Every action is written down before it takes effect, so that what is shown was saved. Nothing here knows
viser, the web or the workers: the session is handed plain functions.
"""

import secrets
import threading
import time
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.auth import Actor
from app.event_log import NewEvent
from app.labeling.degrees_of_freedom import GizmoAxes, degrees_of_freedom
from app.labeling.drag import Drag
from app.labeling.history import History, Step
from app.labeling.snap_exchange import (
    Offer,
    RequestSnap,
    SnapFailure,
    SnapOrder,
    SnapResult,
    SnapStatus,
    estimate_row,
    stored_spread,
)
from app.labeling.start_spread import StartSpread, Unsaid, spread_from_drags
from app.tables import EstimateRow
from registration_core import SnapConfig

Array = NDArray[np.float64]


class ActionError(Exception):
    """An action that is not possible now; the message says why and may be shown."""


class RecordEvent(Protocol):
    """Writes an event, and the estimate it brings, durably."""

    def __call__(self, event: NewEvent, estimate: EstimateRow | None = None) -> object: ...


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
        record_event: RecordEvent,
        request_snap: RequestSnap,
    ) -> None:
        self.registration_id = registration_id
        self._history = history
        self._state = state
        self._frame_id = frame_id
        self._frame_ids = tuple(frame_ids)
        self._pivot = pivot
        self._record_event = record_event
        self._request_snap = request_snap
        self._lock = threading.RLock()
        self._listeners: list[Callable[[SessionState], None]] = []
        self._drag: Drag | None = None
        self._gizmo_axes: GizmoAxes = "object"
        self._snap: SnapStatus | None = None
        self._cancel_snap: Callable[[], None] | None = None
        self._offer: Offer | None = None
        self._message: str | None = None
        self.last_used = time.monotonic()

    # -- what is seen ------------------------------------------------------------------------------

    def snapshot(self) -> SessionState:
        """The present state."""
        with self._lock:
            current = self._history.current
            return SessionState(
                registration_id=self.registration_id,
                state=self._state,
                frame_id=self._frame_id,
                T_world_object=self._drag.T_now if self._drag else current.T_world_object,
                confidence=None if self._drag else current.confidence,
                can_undo=self._is_open and self._history.can_undo,
                can_redo=self._is_open and self._history.can_redo,
                dragging=self._drag is not None,
                gizmo_axes=self._gizmo_axes,
                snap=self._snap,
                offer=self._offer,
                message=self._message,
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
            self._drag = Drag(self._history.current.T_world_object, self._gizmo_axes)
            self._changed()

    def drag_to(self, T_world_object: Array) -> None:
        """The gizmo is here now; nothing is written before it is let go."""
        with self._lock:
            if self._drag is None:
                return
            self._drag.move(T_world_object)
            self._changed()

    def end_drag(self) -> None:
        """The operator let go: the drag is written down; where that fails, it is taken back and said so."""
        with self._lock:
            drag, self._drag = self._drag, None
            if drag is None:
                return
            event = drag.event(self._pivot)
            try:
                if event is not None:
                    self._push(event, Step(drag.T_now, dragged=True))
            except Exception as error:
                self._message = f"The last drag could not be saved and was taken back: {error}"
                raise
            finally:
                self._changed()

    def set_pose(self, T_world_object: Array, actor: Actor, technique: str | None = None) -> None:
        """Put the object at a pose.

        Args:
            T_world_object: Where it goes.
            actor: Who moves it.
            technique: How the pose was found, for the log.
        """
        with self._lock:
            self._require_free_hands()
            before = self._history.current.T_world_object
            event = NewEvent(
                kind="set_pose",
                actor=actor,
                T_before=before.tolist(),
                T_after=T_world_object.tolist(),
                dof=degrees_of_freedom(before, T_world_object, self._pivot),
                detail={} if technique is None else {"technique": technique},
            )
            self._push(event, Step(T_world_object))
            self._changed()

    def move(self, change: Callable[[Array], Array], actor: Actor, technique: str) -> None:
        """Put the object where `change` leads from its present pose; nothing comes between the two."""
        with self._lock:
            self._require_free_hands()
            self.set_pose(change(self._history.current.T_world_object), actor, technique)

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
            self._push(self._move_event("reset", actor, self._history.steps[0]), self._history.steps[0])
            self._changed()

    def undo(self, actor: Actor) -> None:
        """Take the last change of pose back, whoever made it."""
        with self._lock:
            self._require_free_hands()
            if not self._history.can_undo:
                raise ActionError("There is nothing to undo.")
            self._go_to(self._history.undone(), "undo", actor)

    def redo(self, actor: Actor) -> None:
        """Bring back what was undone last."""
        with self._lock:
            self._require_free_hands()
            if not self._history.can_redo:
                raise ActionError("There is nothing to redo.")
            self._go_to(self._history.redone(), "redo", actor)

    def show_frame(self, frame_id: int, actor: Actor) -> None:
        """Show, and snap against, another frame of the scene."""
        with self._lock:
            if frame_id not in self._frame_ids:
                raise ActionError(f"Frame {frame_id} does not belong to this scene.")
            self._record_event(NewEvent(kind="frame", actor=actor, detail={"frame_id": frame_id}))
            self._frame_id = frame_id
            self._changed()

    def submit(self, actor: Actor) -> None:
        """Finish the registration with the present pose."""
        with self._lock:
            self._require_free_hands()
            self._abandon_snap(actor, "submitted")
            T = self._history.current.T_world_object.tolist()
            self._record_event(NewEvent(kind="submit", actor=actor, T_before=T, T_after=T))
            self._state = "submitted"
            self._offer = None
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
            self._abandon_snap(actor, "superseded")
            config = config or SnapConfig()
            history = self._history
            if self._drag is not None:  # it counts as if it ended now
                history = history.pushed(Step(self._drag.T_now, dragged=True))
            if start_spread is Unsaid.FROM_DRAGS:
                start_spread = spread_from_drags(history, self._pivot, config.spread)
            order = SnapOrder(
                snap_id=uuid.uuid4().hex,
                frame_id=self._frame_id,
                T_world_object=history.current.T_world_object,
                config=config,
                seed=secrets.randbelow(2**31) if seed is None else seed,
                start_spread=start_spread,
            )
            self._record_event(
                NewEvent(
                    kind="snap_requested",
                    actor=actor,
                    T_before=order.T_world_object.tolist(),
                    snap_id=order.snap_id,
                    detail={
                        "seed": order.seed,
                        "config": order.config.to_dict(),
                        "start_spread": stored_spread(order.start_spread),
                        "frame_id": order.frame_id,
                    },
                )
            )
            self._snap = SnapStatus(order.snap_id)
            self._offer = None
            self._message = None
            then = self._history.current
            self._cancel_snap = self._request_snap(
                order,
                lambda share: self._snap_progressed(order.snap_id, share),
                lambda outcome: self._snap_ended(order, then, outcome),
            )
            self._changed()
            return order.snap_id

    def cancel_snap(self, actor: Actor) -> None:
        """Stop the snap that is under way; nothing happens where there is none."""
        with self._lock:
            self._abandon_snap(actor, "cancelled by request")
            self._changed()

    def accept(self, actor: Actor) -> None:
        """Take the pose that the machine offers."""
        with self._lock:
            self._require_free_hands()
            offer = self._require_offer()
            step = Step(offer.T_world_object, offer.confidence)
            self._push(self._move_event("accept", actor, step, offer.snap_id), step)
            self._changed()

    def dismiss(self, actor: Actor) -> None:
        """Decline the pose that the machine offers."""
        with self._lock:
            self._require_open()
            offer = self._require_offer()
            self._record_event(NewEvent(kind="dismiss", actor=actor, snap_id=offer.snap_id))
            self._offer = None
            self._changed()

    def close(self) -> None:
        """End the session, cancelling a snap under way. What was recorded stays, and can be gone on with."""
        with self._lock:
            self._abandon_snap(Actor.MACHINE, "session closed")
            self._listeners.clear()

    def _snap_progressed(self, snap_id: str, share: float) -> None:
        with self._lock:
            if self._is_current(snap_id):
                assert self._snap is not None
                progress = max(self._snap.progress, min(1.0, share))
                self._snap = replace(self._snap, state="running", progress=progress)
                self._changed()

    def _snap_ended(self, order: SnapOrder, then: Step, outcome: SnapResult | SnapFailure) -> None:
        with self._lock:
            if not self._is_current(order.snap_id):
                return
            assert self._snap is not None
            try:
                if isinstance(outcome, SnapFailure):
                    self._fail_snap(order, str(outcome))
                else:
                    moved = self._drag is not None or self._history.current is not then
                    self._take_result(order, outcome, offered=moved)
            except Exception as error:
                self._snap = replace(
                    self._snap, state="failed", message=f"The result could not be saved: {error}"
                )
                raise
            finally:
                self._changed()

    def _take_result(self, order: SnapOrder, result: SnapResult, offered: bool) -> None:
        estimate = result.estimate
        event = NewEvent(
            kind="snap_offered" if offered else "snap_applied",
            actor=Actor.MACHINE,
            T_before=order.T_world_object.tolist(),
            T_after=result.T_world_object.tolist(),
            snap_id=order.snap_id,
            duration_seconds=estimate.seconds,
            detail={"confidence": estimate.confidence},
        )
        row = estimate_row(self.registration_id, order, result)
        if offered:
            self._record_event(event, row)
            self._offer = Offer(order.snap_id, result.T_world_object, estimate.confidence)
        else:
            self._push(event, Step(result.T_world_object, estimate.confidence), row)
        assert self._snap is not None
        self._snap = replace(self._snap, state="done", progress=1.0)

    def _fail_snap(self, order: SnapOrder, message: str) -> None:
        assert self._snap is not None
        self._record_event(
            NewEvent(
                kind="snap_failed",
                actor=Actor.MACHINE,
                snap_id=order.snap_id,
                detail={"message": message},
            )
        )
        self._snap = replace(self._snap, state="failed", message=message)

    def _abandon_snap(self, actor: Actor, reason: str) -> None:
        if self._snap is None or not self._snap.is_live:
            return
        assert self._cancel_snap is not None
        self._record_event(
            NewEvent(kind="snap_cancelled", actor=actor, snap_id=self._snap.id, detail={"reason": reason})
        )
        self._cancel_snap()
        self._snap = replace(self._snap, state="cancelled")

    # -- helpers -----------------------------------------------------------------------------------

    @property
    def _is_open(self) -> bool:
        return self._state == "open"

    def _is_current(self, snap_id: str) -> bool:
        return self._snap is not None and self._snap.id == snap_id and self._snap.is_live

    def _require_open(self) -> None:
        if not self._is_open:
            raise ActionError("This registration was submitted and cannot be changed any more.")

    def _require_free_hands(self) -> None:
        self._require_open()
        if self._drag is not None:
            raise ActionError("The object is being dragged; let go of it first.")

    def _require_offer(self) -> Offer:
        if self._offer is None:
            raise ActionError("The machine offers no pose at present.")
        return self._offer

    def _move_event(self, kind: str, actor: Actor, step: Step, snap_id: str | None = None) -> NewEvent:
        return NewEvent(
            kind=kind,
            actor=actor,
            T_before=self._history.current.T_world_object.tolist(),
            T_after=step.T_world_object.tolist(),
            snap_id=snap_id,
            detail={} if step.confidence is None else {"confidence": step.confidence},
        )

    def _push(self, event: NewEvent, step: Step, estimate: EstimateRow | None = None) -> None:
        self._record_event(event, estimate)
        self._history = self._history.pushed(step)
        self._offer = None
        self._message = None

    def _go_to(self, history: History, kind: str, actor: Actor) -> None:
        self._record_event(self._move_event(kind, actor, history.current))
        self._history = history
        self._message = None
        self._changed()

    def _changed(self) -> None:
        self.last_used = time.monotonic()
        state = self.snapshot()
        for listener in tuple(self._listeners):
            listener(state)
