"""The machine's hand on the object: the snaps it was asked for, what they brought, and what it offers."""

import secrets
import uuid
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace

from app.labeling.moves.history import Step
from app.labeling.moves.permissions import Tool, Wanted, require, require_frames, require_method
from app.labeling.moves.pose_record import ActionError, Array, PoseRecord, said_of
from app.labeling.scene.known_object import KnownObject
from app.labeling.snaps.live_snap import LiveSnap
from app.labeling.snaps.request import Request, Submit
from app.labeling.snaps.snap_exchange import (
    ChooseFrames,
    FramesReport,
    Offer,
    SnapFrames,
    SnapOrder,
    SnapResult,
    SnapStatus,
    estimate_row,
    frames_report,
    stored_known,
    stored_others,
    stored_spread,
)
from app.labeling.snaps.start_spread import StartSpread, Unsaid, spread_from_drags
from app.storage.event_log import NewEvent
from app.storage.roles import Actor
from app.storage.tables import FrameUse, Method
from app.workers.methods import method_of
from app.workers.pool import SnapError
from registration_core import SnapConfig
from registration_core.symmetry.pose_equivalence import SamePose

MOVED_ON = "the object was moved meanwhile"
TAKEN_BACK = "this pose was taken back before"
"""Why a pose is only offered; else its assessment says it."""

LIVE_SEED = 0
"""Always the same, so that the ghost of an object that rests does so, too."""


class Machine:
    """One at a time, please: the session that owns it lets nobody in while somebody else is.

    Args:
        registration_id: Whose estimates these are.
        record: The object's way, which results are put on.
        tools: What may be used on this task.
        methods: What Snap may compute with. Whatever the machine looks for unasked, and live, is by the
        default: the operator does not wait for it.
        takes_turns: Whether it looks for a better pose whenever the operator lets go.
        same_pose: Tells whether the operator has seen a result before.
        submit: Hands an order to the workers.
        choose_frames: Chooses the frames of a snap.
        known_objects: Tells what is known of other objects in the scene.
    """

    def __init__(
        self,
        registration_id: int,
        record: PoseRecord,
        tools: Collection[Tool],
        methods: Collection[Method],
        frame_uses: Sequence[FrameUse],
        takes_turns: bool,
        same_pose: SamePose,
        submit: Submit[SnapOrder, SnapResult],
        choose_frames: ChooseFrames,
        known_objects: Callable[[], tuple[KnownObject, ...]],
    ) -> None:
        self._registration_id = registration_id
        self._record = record
        self._tools = tools
        self._methods = methods
        self._frame_uses = frame_uses
        self._takes_turns = takes_turns
        self._same_pose = same_pose
        self._choose_frames = choose_frames
        self._known_objects = known_objects
        self._request = Request(submit, "result")
        self._live = LiveSnap(submit)
        self._taken_over: list[Array] = []
        """Poses that the machine put the object at by itself."""
        self.offer: Offer | None = None
        self.frame_use = frame_uses[0]
        """The frames that a snap uses where it is not asked otherwise."""

    @property
    def status(self) -> SnapStatus | None:
        """Of the last snap."""
        return self._request.status

    def snap(
        self,
        actor: Actor,
        config: SnapConfig,
        seed: int | None,
        start_spread: StartSpread | Unsaid | None,
        frames: Wanted | None = None,
    ) -> str:
        """Ask the workers for a better pose; returns the snap's id. See `LabelingSession.snap`."""
        require(self._tools, "snap")
        method = method_of(config.to_dict())
        require_method(self._methods, method)
        wanted = frames or self.frame_use
        require_frames(self._frame_uses, wanted)
        self.abandon(actor, "superseded")
        order = self._order(config, seed, start_spread)
        order = replace(order, frames=self._frames_of(order, wanted))
        self._record.record(
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
                    "used_frames": list(order.frames.used),
                    "other_frames": list(order.frames.others),
                    "known_objects": stored_known(order.known),
                },
            )
        )
        self.offer = None
        self._record.message = None
        then = self._record.history.current
        status = SnapStatus(order.snap_id, actor, method=method)
        self._request.start(order, status, lambda outcome: self._settle(order, then, actor, outcome))
        return order.snap_id

    @property
    def is_live(self) -> bool:
        """Whether live snapping is on."""
        return self._live.is_on

    @property
    def live(self) -> Offer | None:
        """Where a snap would land."""
        return self._live.found

    def set_live(self, on: bool, actor: Actor) -> None:
        """Turn live snapping on or off."""
        if on == self._live.is_on:
            return
        require(self._tools, "live snap")
        self._record.record(NewEvent(kind="live", actor=actor, detail={"on": on}))
        self._live.is_on = on

    def follow(self, is_open: bool) -> None:
        """Let live snapping keep up with what changed. A pose that the machine found needs no ghost."""
        record = self._record
        if self.live is not None:
            self.offer = None  # one pose at a time, the newest
        by_hand = record.drag is not None or record.history.current.confidence is None
        offered = self.offer is not None and record.drag is None
        if self.is_live and is_open and by_hand and not self._request.is_under_way and not offered:
            self._live.follow(record.T_world_object, record.frame_id, self._live_order)
        else:
            self._live.rest()

    def take_turn(self) -> None:
        """The operator has let go of the object: in `auto`, snap without being asked."""
        if self._takes_turns:
            self.snap(Actor.MACHINE, SnapConfig(), None, Unsaid.FROM_DRAGS)

    def abandon(self, actor: Actor, reason: str) -> None:
        """Stop the snap that is under way; nothing happens where there is none."""
        detail = {"reason": reason}
        self._request.abandon(
            lambda snap_id: self._record.record(
                NewEvent("snap_cancelled", actor, snap_id=snap_id, detail=detail)
            )
        )

    def close(self) -> None:
        """Stop whatever is under way, for good, also where that cannot be written down."""
        self._live.is_on = False
        self._live.rest()
        try:
            self.abandon(Actor.MACHINE, "session closed")
        except Exception:
            self._request.drop()
            raise

    def accept(self, actor: Actor) -> None:
        """Take the pose that is shown live, whose estimate is only written down now, or else the offer."""
        live = self.live
        offer = live or self._require_offer()
        step = _step(offer.result, offer.snap_id)
        event = self._record.move_event("accept", actor, step, offer.snap_id)
        row = estimate_row(self._registration_id, live.order, live.result) if live else None
        self._record.push(event, step, row)
        self.offer = None
        self._live.rest()

    def dismiss(self, actor: Actor) -> None:
        """Decline the pose that is offered."""
        offer = self._require_offer()
        self._record.record(NewEvent(kind="dismiss", actor=actor, snap_id=offer.snap_id))
        self.offer = None

    def _live_order(self) -> SnapOrder:
        return replace(self._order(SnapConfig(), LIVE_SEED, Unsaid.FROM_DRAGS), is_live=True)

    def _order(
        self, config: SnapConfig, seed: int | None, start_spread: StartSpread | Unsaid | None
    ) -> SnapOrder:
        history = self._record.as_if_let_go
        if start_spread is Unsaid.FROM_DRAGS:
            start_spread = spread_from_drags(history, self._record.pivot, config.spread)
        return SnapOrder(
            snap_id=uuid.uuid4().hex,
            frame_id=self._record.frame_id,
            frames=SnapFrames((self._record.frame_id,)),
            T_world_object=history.current.T_world_object,
            config=config,
            seed=secrets.randbelow(2**31) if seed is None else seed,
            start_spread=start_spread,
            known=self._known_objects(),
        )

    def _frames_of(self, order: SnapOrder, wanted: Wanted) -> SnapFrames:
        if order.config.method == "particle_filter" and wanted == "auto":
            wanted = "current"  # the paper's filter knows one view
        return self._choose_frames(order.frame_id, order.T_world_object, order.known, wanted)

    def _settle(
        self, order: SnapOrder, then: Step, asked_by: Actor, outcome: SnapResult | SnapError
    ) -> FramesReport | None:
        """Write down what came of a snap and, where it may, put the object there."""
        if isinstance(outcome, SnapError):
            detail = {"message": str(outcome)}
            self._record.record(NewEvent("snap_failed", Actor.MACHINE, snap_id=order.snap_id, detail=detail))
            return None
        return self._take(order, then, asked_by, outcome)

    def _take(self, order: SnapOrder, then: Step, asked_by: Actor, result: SnapResult) -> FramesReport:
        unasked = asked_by is Actor.MACHINE
        moved = self._record.drag is not None or self._record.history.current is not then
        withheld = MOVED_ON if moved else self._hesitates(result) if unasked else None
        step = _step(result, order.snap_id)
        event = NewEvent(
            kind="snap_offered" if withheld else "snap_applied",
            actor=Actor.MACHINE,
            T_before=order.T_world_object.tolist(),
            T_after=result.T_world_object.tolist(),
            snap_id=order.snap_id,
            duration_seconds=result.estimate.seconds,
            detail=said_of(step)
            | {
                "used_frames": list(order.frames.used),
                "other_frames": stored_others(order, result.estimate),
            }
            | ({"withheld": withheld} if withheld else {}),
        )
        row = estimate_row(self._registration_id, order, result)
        if withheld is None:
            self._record.push(event, step, row)
            self._taken_over += [result.T_world_object] if unasked else []
        else:
            self._record.record(event, row)
            self.offer = Offer(order, result, unasked, withheld)
        return frames_report(order, result.estimate)

    def _hesitates(self, result: SnapResult) -> str | None:
        """Why the machine does not take over by itself; None where it does."""
        if result.assessment.verdict != "accept":
            return result.assessment.sentence
        # What the operator took back, by undo or by dragging on, is not forced on them again.
        taken_back = any(self._same_pose(result.T_world_object, T) for T in self._taken_over)
        return TAKEN_BACK if taken_back else None

    def _require_offer(self) -> Offer:
        if self.offer is None:
            raise ActionError("The machine offers no pose at present.")
        return self.offer


def _step(result: SnapResult, snap_id: str) -> Step:
    assessment = result.assessment
    return Step(
        result.T_world_object,
        assessment.confidence,
        snap_id=snap_id,
        assessment=assessment,
        posed_by="machine",
    )
