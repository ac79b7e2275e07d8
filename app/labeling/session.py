"""One operator's work on one object: what they and the machine may do, in which order, and what is recorded.

Every action is written down before it takes effect, so that what is shown was saved. Nothing here knows
viser, the web or the workers: the session is handed plain functions.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack

import numpy as np
from numpy.typing import NDArray

from app.labeling.layers import Layers
from app.labeling.moves.camera_watch import Camera
from app.labeling.moves.degrees_of_freedom import GizmoAxes
from app.labeling.moves.history import History, Step
from app.labeling.moves.operator_actions import OperatorActions
from app.labeling.moves.permissions import (
    TOOL_OF,
    Tool,
    Wanted,
    frame_uses_of,
    methods_of,
    require,
    require_frames,
    require_method,
    tools_of,
)
from app.labeling.moves.pose_record import ActionError, PoseRecord, RecordEvent
from app.labeling.scene.known_object import KnownObject
from app.labeling.session_lock import SessionLock
from app.labeling.session_state import SessionState
from app.labeling.snaps.find import Region, Search, SearchOrder
from app.labeling.snaps.machine import Machine
from app.labeling.snaps.request import Submit
from app.labeling.snaps.snap_exchange import ChooseFrames, SnapOrder, SnapResult
from app.labeling.snaps.start_spread import StartSpread, Unsaid
from app.storage.event_log import STATE_AFTER, NewEvent
from app.storage.roles import Actor
from app.storage.tables import Condition, FrameUse, Method
from app.workers.jobs import Proposals
from app.workers.methods import config_of
from registration_core import SnapConfig
from registration_core.symmetry.pose_equivalence import SamePose

Array = NDArray[np.float64]

BROKEN_DRAG = "The connection broke in mid-drag: the object is where it had come to. Undo takes it back."


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
        choose_frames: Chooses the frames of a snap.
        skip_reason: Why it was skipped, where it was.
        known_objects: Tells what is known of other objects in the scene.
        now: Tells the seconds that the paths of drags are written down with.
        in_study: Whether by a participant, who has only what the condition is named after.
        method: What Snap computes with until another one is chosen, where the condition lets it.
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
        request_snap: Submit[SnapOrder, SnapResult],
        request_search: Submit[SearchOrder, Proposals],
        choose_frames: ChooseFrames,
        skip_reason: str | None = None,
        known_objects: Callable[[], tuple[KnownObject, ...]] = tuple,
        now: Callable[[], float] = time.monotonic,
        in_study: bool = False,
        method: Method = "default",
    ) -> None:
        self.tools: frozenset[Tool] = tools_of(condition, in_study)
        """What may be used beside the gizmo, undo and the views."""
        self.methods = methods_of(condition, in_study, method)
        """What Snap may compute with."""
        self._method = self.methods[0]
        self.frame_uses = frame_uses_of(condition, in_study)
        """The frames that Snap may use."""
        self.registration_id = registration_id
        self._state = state
        self._skip_reason = skip_reason
        self._frame_ids = tuple(frame_ids)
        self._lock = lock = SessionLock(lambda: self._machine.follow(self._is_open), self.snapshot)
        self._record = PoseRecord(history, frame_id, pivot, record_event)
        self._operator = OperatorActions(self._record, now)
        self._machine = Machine(
            registration_id,
            self._record,
            self.tools,
            self.methods,
            self.frame_uses,
            condition == "auto",
            same_pose,
            lambda order, on_progress, on_end: request_snap(
                order, lock.report(on_progress), lock.report(on_end)
            ),
            choose_frames,
            known_objects,
        )
        self._search = Search(
            self._record,
            self.tools,
            lambda order, on_progress, on_end: request_search(
                order, lock.report(on_progress), lock.report(on_end)
            ),
            known_objects,
        )
        self._preview: tuple[Step, Array] | None = None
        """What is looked at, and the step that it is looked at from."""
        self._layers = Layers()

    # -- what is seen ------------------------------------------------------------------------------

    @property
    def method(self) -> Method:
        """What Snap computes with where it is not asked otherwise."""
        return self._method

    def snapshot(self) -> SessionState:
        """The present state."""
        with self._lock.held:
            record, history = self._record, self._record.history
            return SessionState(
                registration_id=self.registration_id,
                revision=self._lock.revision,
                state=self._state,
                skip_reason=self._skip_reason,
                frame_id=record.frame_id,
                T_world_object=record.T_world_object,
                confidence=None if record.drag else history.current.confidence,
                assessment=None if record.drag else history.current.assessment,
                posed_by="human" if record.drag else history.current.posed_by,
                can_undo=self._is_open and history.can_undo,
                can_redo=self._is_open and history.can_redo,
                dragging=record.drag is not None,
                gizmo_axes=self._operator.axes,
                layers=self._layers,
                snap=self._machine.status,
                offer=self._machine.offer,
                method=self._method,
                frame_use=self._machine.frame_use,
                is_live=self._machine.is_live,
                live=self._machine.live,
                estimate_snap_id=None if record.drag else history.current.snap_id,
                search=self._search.status,
                preview=self._shown_preview(),
                message=record.message,
            )

    def subscribe(self, listener: Callable[[SessionState], None]) -> Callable[[], None]:
        """Call `listener` after every change, in order, from any thread; it must be quick.

        Returns:
            A function that ends the subscription.
        """
        return self._lock.subscribe(listener)

    @property
    def last_used(self) -> float:
        """When anything changed last, seconds of the monotonic clock."""
        return self._lock.last_used

    # -- the operator's hand -----------------------------------------------------------------------

    def start_drag(self) -> None:
        """The operator took hold of the gizmo."""
        with self._lock.held:
            if self._is_open:
                self._operator.take()
                self._lock.notify()

    def drag_to(self, T_world_object: Array) -> None:
        """The gizmo is here now; nothing is written before it is let go."""
        with self._lock.held:
            if self._record.drag is not None:
                self._record.drag.move(T_world_object)
                self._lock.notify()

    def end_drag(self, broken: bool = False) -> None:
        """The operator let go: the drag is written down; where that fails, it is taken back and said so.

        In `auto` the machine has its turn then. A drag that was `broken`, by a lost connection, is kept as
        far as it came, which is said, and is no sign to the machine.
        """
        with self._lock.attempt():
            moved = self._let_go()
            if moved and broken:
                self._record.message = BROKEN_DRAG
            elif moved:
                self._machine.take_turn()

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
        with self._lock.change():
            self._require_free_hands()
            self._put(T_world_object, actor, technique, detail or {})

    def move(self, change: Callable[[Array], Array], actor: Actor, technique: str) -> None:
        """Put the object where `change` leads from its present pose; nothing comes between the two."""
        with self._lock.change():
            self._require_free_hands()
            self._put(change(self._record.history.current.T_world_object), actor, technique, {})

    def align_gizmo(self, axes: GizmoAxes) -> None:
        """Let the gizmo's arrows lie along other axes; each drag is logged with those that it had."""
        with self._lock.change():
            self._require_free_hands()
            self._operator.axes = axes

    def show_layers(self, layers: Layers) -> None:
        """Let the view show these; that moves nothing, and may be done at any time."""
        with self._lock.change():
            if layers.agreement:
                require(self.tools, "agreement")
            self._layers = layers

    def reset(self, actor: Actor) -> None:
        """Put the object back to where it began; this can be undone."""
        with self._lock.change():
            self._require_free_hands()
            self._operator.reset(actor)
            self._put_found_away()

    def undo(self, actor: Actor) -> None:
        """Take the last change of pose back, whoever made it."""
        with self._lock.change():
            self._require_free_hands()
            self._operator.undo(actor)

    def redo(self, actor: Actor) -> None:
        """Bring back what was undone last."""
        with self._lock.change():
            self._require_free_hands()
            self._operator.redo(actor)

    def show_frame(self, frame_id: int, actor: Actor) -> None:
        """Show, and snap against, another frame of the scene."""
        with self._lock.change():
            if frame_id not in self._frame_ids:
                raise ActionError(f"Frame {frame_id} does not belong to this scene.")
            self._record.record(NewEvent(kind="frame", actor=actor, detail={"frame_id": frame_id}))
            self._record.frame_id = frame_id

    def look_from(self, camera: Camera, seconds: float) -> None:
        """The operator turned the view, within the last `seconds`. Without the lock: no drag waits for it."""
        if self._is_open:
            event = NewEvent("view", Actor.HUMAN, duration_seconds=seconds, detail=dict(camera))
            self._record.record(event)

    def submit(self, actor: Actor) -> None:
        """Finish the registration with the present pose."""
        with self._lock.change():
            self._require_free_hands()
            self._machine.abandon(actor, "submitted")
            self._search.abandon(actor, "submitted")
            self._change_state("submit", actor)

    def skip(self, actor: Actor, reason: str) -> None:
        """Finish the registration without a pose, saying why."""
        with self._lock.change():
            self._require_free_hands()
            require(self.tools, "ending")
            self._machine.abandon(actor, "skipped")
            self._search.abandon(actor, "skipped")
            self._change_state("skip", actor, reason)

    def reopen(self, actor: Actor) -> None:
        """Go on with a registration that was submitted or skipped; undo and redo are as they were."""
        with self._lock.change():
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
        frames: Wanted | None = None,
    ) -> str:
        """Ask the workers for a better pose from the present one; the newest request wins.

        Args:
            actor: Who asks.
            config: That of the chosen method where it is None.
            seed: A fresh one where it is None.
            start_spread: How far off the present pose may be; None where that is unknown.
            frames: Those that it is to use; the chosen ones where it is None.

        Returns:
            The snap's id.
        """
        with self._lock.change():
            self._require_open()
            self._require_frames_of_scene(frames)
            return self._machine.snap(actor, config or config_of(self._method), seed, start_spread, frames)

    def choose_frames(self, choice: FrameUse) -> None:
        """Let Snap use these frames from now on, where it is not asked otherwise. That moves nothing."""
        with self._lock.change():
            require(self.tools, "snap")
            require_frames(self.frame_uses, choice)
            self._machine.frame_use = choice

    def choose_method(self, method: Method) -> None:
        """Let Snap compute with this from now on, where it is not asked otherwise. That moves nothing."""
        with self._lock.change():
            require(self.tools, "snap")
            require_method(self.methods, method)
            self._method = method

    def cancel_snap(self, actor: Actor) -> None:
        """Stop the snap that is under way; nothing happens where there is none."""
        with self._lock.change():
            self._machine.abandon(actor, "cancelled by request")

    def accept(self, actor: Actor) -> None:
        """Take the pose that the machine offers, or shows live; this one even out of the operator's hand."""
        with self._lock.change():
            if self._machine.live is not None:
                self._let_go()
            self._require_free_hands()
            self._machine.accept(actor)

    def set_live(self, on: bool, actor: Actor) -> None:
        """Turn live snapping on or off."""
        with self._lock.change():
            self._require_open()
            self._machine.set_live(on, actor)

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
        with self._lock.change():
            self._require_open()
            search_id = self._search.start(actor, region, config or SnapConfig(), seed)
            self._preview = None
            return search_id

    def leave_search(self, actor: Actor) -> None:
        """Cancel the search that is under way, or put its candidates away."""
        with self._lock.change():
            self._search.abandon(actor, "cancelled by request")
            self._search.put_away()
            self._preview = None

    def preview(self, T_world_object: Array | None) -> None:
        """Show a pose as a ghost, until the object moves or another one is shown; None shows nothing."""
        with self._lock.change():
            self._require_free_hands()
            require(self.tools, "snap")
            now = self._record.history.current
            self._preview = None if T_world_object is None else (now, T_world_object)

    def dismiss(self, actor: Actor) -> None:
        """Decline the pose that the machine offers."""
        with self._lock.change():
            self._require_open()
            self._machine.dismiss(actor)

    def close(self) -> None:
        """End the session, cancelling a snap under way. What was recorded stays, and can be gone on with."""
        with self._lock.held, ExitStack() as ends:  # each of them, whatever becomes of the others
            ends.callback(self._lock.end)
            ends.callback(self._search.abandon, Actor.MACHINE, "session closed")
            ends.callback(self._machine.close)

    def tell(self) -> None:
        """Tell the listeners the state once more: something beside it has changed."""
        with self._lock.held:
            self._lock.notify()

    # -- helpers -----------------------------------------------------------------------------------

    @property
    def _is_open(self) -> bool:
        return self._state == "open"

    def _require_open(self) -> None:
        if not self._is_open:
            raise ActionError(f"This registration was {self._state}; reopen it to change it.")

    def _require_frames_of_scene(self, frames: Wanted | None) -> None:
        if isinstance(frames, tuple):
            for frame_id in frames:
                if frame_id not in self._frame_ids:
                    raise ActionError(f"The scene has no frame {frame_id}.")

    def _require_free_hands(self) -> None:
        self._require_open()
        if self._record.drag is not None:
            raise ActionError("The object is being dragged; let go of it first.")

    def _change_state(self, kind: str, actor: Actor, reason: str | None = None) -> None:
        T = self._record.history.current.T_world_object.tolist()
        detail = {} if reason is None else {"reason": reason}
        self._record.record(NewEvent(kind=kind, actor=actor, T_before=T, T_after=T, detail=detail))
        self._state, self._skip_reason = STATE_AFTER[kind], reason
        self._machine.offer = None
        self._search.put_away()

    def _let_go(self) -> bool:
        moved = self._operator.let_go()
        if moved:
            self._put_found_away()
        return moved

    def _put(
        self, T_world_object: Array, actor: Actor, technique: str | None, detail: Mapping[str, object]
    ) -> None:
        require(self.tools, TOOL_OF.get(technique, "precision"))
        named = {} if technique is None else {"technique": technique}
        self._operator.put(T_world_object, actor, {**named, **detail})
        self._put_found_away()

    def _put_found_away(self) -> None:
        """The object was moved by hand: what the machine has found is no answer to where it is now."""
        self._machine.offer = None
        self._search.put_away()

    def _shown_preview(self) -> Array | None:
        if self._preview is None or self._record.drag is not None or not self._is_open:
            return None
        looked_at_from, T_world_object = self._preview
        return T_world_object if looked_at_from is self._record.history.current else None
