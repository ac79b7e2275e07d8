"""One operator's work on one object: what they and the machine may do, in which order, and what is recorded.

Every action is written down before it takes effect, so that what is shown was saved. Nothing here knows
viser, the web or the workers: the session is handed plain functions.
"""

import secrets
import threading
import time
import uuid
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ParamSpec

import numpy as np
from numpy.typing import NDArray

from app.auth import Actor
from app.event_log import STATE_AFTER, NewEvent
from app.labeling.camera_watch import Camera
from app.labeling.degrees_of_freedom import GizmoAxes, degrees_of_freedom
from app.labeling.drag import Drag
from app.labeling.history import History, Step
from app.labeling.layers import Layers
from app.labeling.machine import Machine
from app.labeling.same_pose import SamePose
from app.labeling.search import Region, RequestSearch, Search, SearchOrder
from app.labeling.snap_exchange import (
    KnownObject,
    Offer,
    RequestSnap,
    SnapFailure,
    SnapOrder,
    SnapResult,
    SnapStatus,
)
from app.labeling.start_spread import StartSpread, Unsaid
from app.labeling.tools import TOOL_OF, Tool, require, tools_of
from app.labeling.track import ActionError, RecordEvent, Track
from app.tables import Condition
from registration_core import SnapConfig

Array = NDArray[np.float64]
P = ParamSpec("P")

BROKEN_DRAG = "The connection broke in mid-drag: the object is where it had come to. Undo takes it back."


@dataclass(frozen=True)
class SessionState:
    """All that a page or a script may want to know of a session at one moment."""

    registration_id: int
    revision: int
    """Grows with every change, also when the session is opened anew: the larger state is the newer."""
    state: str
    skip_reason: str | None
    frame_id: int
    T_world_object: Array
    confidence: float | None
    can_undo: bool
    can_redo: bool
    dragging: bool
    gizmo_axes: GizmoAxes
    layers: Layers
    snap: SnapStatus | None
    offer: Offer | None
    is_live: bool
    live: Offer | None
    """Where a snap would land now."""
    estimate_snap_id: str | None
    """The snap that the pose stems from."""
    search: SnapStatus | None
    preview: Array | None
    """A pose T_world_object that the operator looks at before taking it."""
    message: str | None


class LabelingSession:
    """The state of one registration and the actions on it, safe to call from any thread.

    Args:
        registration_id: Whose row in the database this is.
        history: The poses so far, as replayed from the log.
        state: "open", "submitted" or "skipped".
        frame_id: The frame that is shown and snapped against.
        frame_ids: The scene's frames.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        condition: What it may be done with.
        same_pose: Tells whether two poses are one, as far as anybody could tell.
        record_event: Writes an event durably; raises where it cannot.
        request_snap: Hands an order to the workers.
        request_search: Hands a search to the workers.
        skip_reason: Why it was skipped, where it was.
        known_objects: Tells what is known of other objects in the scene.
        now: Tells the seconds that the paths of drags are written down with.
        in_study: Whether by a participant, who has only what the condition is named after.
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
        request_search: RequestSearch,
        skip_reason: str | None = None,
        known_objects: Callable[[], tuple[KnownObject, ...]] = tuple,
        now: Callable[[], float] = time.monotonic,
        in_study: bool = False,
    ) -> None:
        self.tools: frozenset[Tool] = tools_of(condition, in_study)
        """What may be used beside the gizmo, undo and the views."""
        self.registration_id = registration_id
        self._state = state
        self._skip_reason = skip_reason
        self._frame_ids = tuple(frame_ids)
        self._request_snap = request_snap
        self._now = now
        self._known_objects = known_objects
        self._track = Track(history, frame_id, pivot, record_event)
        self._machine = Machine(
            registration_id,
            self._track,
            self.tools,
            condition == "auto",
            same_pose,
            self._request_from_workers,
            known_objects,
        )
        self._search = Search(
            self._track,
            lambda order, on_progress, on_end: request_search(
                order, self._in_turn(on_progress), self._in_turn(on_end)
            ),
        )
        self._preview: tuple[Step, Array] | None = None
        """What is looked at, and the step that it is looked at from."""
        self._lock = threading.RLock()
        self._listeners: list[Callable[[SessionState], None]] = []
        self._gizmo_axes: GizmoAxes = "object"
        self._layers = Layers()
        self._revision = time.time_ns() // 1_000_000
        self.last_used = time.monotonic()

    # -- what is seen ------------------------------------------------------------------------------

    def snapshot(self) -> SessionState:
        """The present state."""
        with self._lock:
            track, history = self._track, self._track.history
            return SessionState(
                registration_id=self.registration_id,
                revision=self._revision,
                state=self._state,
                skip_reason=self._skip_reason,
                frame_id=track.frame_id,
                T_world_object=track.T_world_object,
                confidence=None if track.drag else history.current.confidence,
                can_undo=self._is_open and history.can_undo,
                can_redo=self._is_open and history.can_redo,
                dragging=track.drag is not None,
                gizmo_axes=self._gizmo_axes,
                layers=self._layers,
                snap=self._machine.status,
                offer=self._machine.offer,
                is_live=self._machine.is_live,
                live=self._machine.live,
                estimate_snap_id=None if track.drag else history.current.snap_id,
                search=self._search.status,
                preview=self._shown_preview(),
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
            self._track.drag = Drag(self._track.history.current.T_world_object, self._gizmo_axes, self._now)
            self._changed()

    def drag_to(self, T_world_object: Array) -> None:
        """The gizmo is here now; nothing is written before it is let go."""
        with self._lock:
            if self._track.drag is None:
                return
            self._track.drag.move(T_world_object)
            self._changed()

    def end_drag(self, broken: bool = False) -> None:
        """The operator let go: the drag is written down; where that fails, it is taken back and said so.

        In `auto` the machine has its turn then. A drag that was `broken`, by a lost connection, is kept as
        far as it came, which is said, and is no sign to the machine.
        """
        with self._lock:
            try:
                moved = self._write_drag()
                if moved and broken:
                    self._track.message = BROKEN_DRAG
                elif moved:
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
            require(self.tools, TOOL_OF.get(technique, "precision"))
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

    def show_layers(self, layers: Layers) -> None:
        """Let the view show these; that moves nothing, and may be done at any time."""
        with self._lock:
            if layers.agreement:
                require(self.tools, "agreement")
            self._layers = layers
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

    def look_from(self, camera: Camera, seconds: float) -> None:
        """The operator turned the view, within the last `seconds`. Without the lock: no drag waits for it."""
        if self._is_open:
            event = NewEvent("view", Actor.HUMAN, duration_seconds=seconds, detail=dict(camera))
            self._track.record(event)

    def submit(self, actor: Actor) -> None:
        """Finish the registration with the present pose."""
        with self._lock:
            self._require_free_hands()
            self._machine.abandon(actor, "submitted")
            self._search.abandon(actor, "submitted")
            self._change_state("submit", actor)

    def skip(self, actor: Actor, reason: str) -> None:
        """Finish the registration without a pose, saying why."""
        with self._lock:
            self._require_free_hands()
            require(self.tools, "ending")
            self._machine.abandon(actor, "skipped")
            self._search.abandon(actor, "skipped")
            self._change_state("skip", actor, reason)

    def reopen(self, actor: Actor) -> None:
        """Go on with a registration that was submitted or skipped; undo and redo are as they were."""
        with self._lock:
            if self._is_open:
                raise ActionError("This registration is open.")
            require(self.tools, "ending")
            self._change_state("reopen", actor)

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

    def search(
        self,
        actor: Actor,
        region: Region | None = None,
        config: SnapConfig | None = None,
        seed: int | None = None,
    ) -> str:
        """Ask the workers where in the frame the object may be; the newest search wins.

        Args:
            actor: Who asks.
            region: Where to look; everywhere where it is None.
            config: `SnapConfig()` where it is None.
            seed: A fresh one where it is None.

        Returns:
            The search's id.
        """
        with self._lock:
            self._require_open()
            require(self.tools, "find it")
            order = SearchOrder(
                search_id=uuid.uuid4().hex,
                frame_id=self._track.frame_id,
                region=region,
                config=config or SnapConfig(),
                seed=secrets.randbelow(2**31) if seed is None else seed,
                known=self._known_objects(),
            )
            self._preview = None
            self._search.start(actor, order)
            self._changed()
            return order.search_id

    def leave_search(self, actor: Actor) -> None:
        """Cancel the search that is under way, or put its candidates away."""
        with self._lock:
            self._search.abandon(actor, "cancelled by request")
            self._search.put_away()
            self._preview = None
            self._changed()

    def preview(self, T_world_object: Array | None) -> None:
        """Show a pose as a ghost, until the object moves or another one is shown; None shows nothing."""
        with self._lock:
            self._require_free_hands()
            require(self.tools, "snap")
            now = self._track.history.current
            self._preview = None if T_world_object is None else (now, T_world_object)
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
            self._search.abandon(Actor.MACHINE, "session closed")
            self._listeners.clear()

    def tell(self) -> None:
        """Tell the listeners the state once more: something beside it has changed."""
        with self._lock:
            self._changed()

    # -- helpers -----------------------------------------------------------------------------------

    @property
    def _is_open(self) -> bool:
        return self._state == "open"

    def _require_open(self) -> None:
        if not self._is_open:
            raise ActionError(f"This registration was {self._state}; reopen it to change it.")

    def _require_free_hands(self) -> None:
        self._require_open()
        if self._track.drag is not None:
            raise ActionError("The object is being dragged; let go of it first.")

    def _change_state(self, kind: str, actor: Actor, reason: str | None = None) -> None:
        T = self._track.history.current.T_world_object.tolist()
        detail = {} if reason is None else {"reason": reason}
        self._track.record(NewEvent(kind=kind, actor=actor, T_before=T, T_after=T, detail=detail))
        self._state, self._skip_reason = STATE_AFTER[kind], reason
        self._machine.offer = None
        self._search.put_away()
        self._changed()

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
        self._search.put_away()

    def _shown_preview(self) -> Array | None:
        if self._preview is None or self._track.drag is not None or not self._is_open:
            return None
        looked_at_from, T_world_object = self._preview
        return T_world_object if looked_at_from is self._track.history.current else None

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
        self._revision += 1
        state = self.snapshot()
        for listener in tuple(self._listeners):
            listener(state)
