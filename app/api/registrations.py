"""Registrations: their state, what an operator or a script may do, the log, and the stream of changes."""

import asyncio
import threading
from collections.abc import AsyncIterator, Callable
from datetime import datetime
from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Depends, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent
from pydantic import BaseModel, Field
from sqlalchemy import select

from app.api.dependencies import (
    AfterDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    ServicesDep,
    identify,
    page_of,
    rigid_pose,
)
from app.auth import Actor
from app.labeling.degrees_of_freedom import GizmoAxes
from app.labeling.desk import Seat
from app.labeling.layers import Layers
from app.labeling.session import LabelingSession, SessionState
from app.tables import Event, Pose
from registration_core import pose
from registration_core.depth_agreement import Verdict

router = APIRouter(prefix="/api/registrations", tags=["registrations"])

SECONDS_BETWEEN_UPDATES = 0.05
"""A stream tells no more often than that, and always tells the last state."""

SECONDS_BETWEEN_SIGNS_OF_LIFE = 10.0
"""A stream tells no less often than that."""

Technique = Literal[
    "nudge", "turn", "flip", "numbers", "rest", "place", "three points", "proposal", "mode", "copy"
]
"""Ways to put an object somewhere other than by the gizmo."""

EXAMPLE_POSE = [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0.8], [0, 0, 0, 1]]


class SnapOut(BaseModel):
    """The last snap of a registration."""

    id: str
    asked_by: str = Field(description="human, script, or in `auto` the machine by itself")
    state: str
    progress: float
    message: str | None


class OfferOut(BaseModel):
    """A pose that the machine offers."""

    snap_id: str
    T_world_object: Pose
    confidence: float
    quiet: bool = Field(description="Nobody asked for it: it can be taken, and asks for no answer.")


class LiveOut(BaseModel):
    """Where a snap would land now."""

    T_world_object_start: Pose = Field(description="The pose that it would start from.")
    T_world_object: Pose
    confidence: float


class SearchOut(BaseModel):
    """The last search of a registration, until its candidates are taken or put away."""

    id: str
    state: str
    message: str | None


class AgreementOut(BaseModel):
    """How well the shown frame's depth agrees with the object where it is now."""

    inlier_share: float | None = Field(
        description="Matches among the pixels with depth that nothing hides; null where these are too few."
    )
    median_residual: float | None = Field(description="Of the matches, metres, without sign.")
    match: float = Field(description="Like the three below a share of the object's visible surface.")
    in_front: float = Field(description="The object is nearer than what was measured.")
    behind: float = Field(description="The object is farther away than what was measured.")
    no_data: float


class RegistrationOut(BaseModel):
    """One operator's work on one task, now."""

    id: int
    task_id: int
    condition: str
    state: str
    skip_reason: str | None
    frame_id: int
    T_world_object: Pose
    T_camera_object: Pose
    confidence: float | None
    can_undo: bool
    can_redo: bool
    dragging: bool
    gizmo_axes: GizmoAxes
    """Along which the gizmo's arrows lie."""
    layers: Layers
    """What the 3-D view shows."""
    agreement: AgreementOut | None
    """Nothing where no part of the object is in the frame."""
    saved: bool
    """Whether all of it is on the disk: a drag is when it ends."""
    snap: SnapOut | None
    offer: OfferOut | None
    is_live: bool
    live: LiveOut | None
    estimate_snap_id: str | None = Field(description="The snap that the pose stems from.")
    search: SearchOut | None
    preview: Pose | None = Field(description="T_world_object that is looked at before it is taken.")
    message: str | None
    view_url: str
    view_open: bool
    """Whether a page is connected to the 3-D view."""


class NewPose(BaseModel):
    """Where the object is to be."""

    T_world_object: Pose = Field(examples=[EXAMPLE_POSE])
    technique: Technique | None = Field(None, description="How the pose was found, for the log.")
    stems_from: str | None = Field(
        None, max_length=40, description="The search or snap that found it, for the log."
    )


class FrameChoice(BaseModel):
    """A frame of the scene."""

    frame_id: int


class LiveChoice(BaseModel):
    """Whether the machine is to show where a snap would land, all the time."""

    on: bool


class Skip(BaseModel):
    """Why there is no pose."""

    reason: Literal["not visible", "no depth", "wrong model", "ambiguous"]


class EventOut(BaseModel):
    """One line of the log."""

    sequence: int
    kind: str
    actor: str
    user_id: int
    utc: datetime
    monotonic_seconds: float
    boot_id: str
    duration_seconds: float | None
    T_before: Pose | None
    T_after: Pose | None
    dof: list[str] | None
    path: list[list[float]] | None
    snap_id: str | None
    detail: dict[str, Any]


def my_seat(registration_id: Id, services: ServicesDep, identity: IdentityDep) -> Seat:
    """The caller's own live session."""
    return services.desk.seat(registration_id, identity)


SeatDep = Annotated[Seat, Depends(my_seat)]
PageName = Annotated[
    str | None, Query(max_length=40, description="Of an open page, made up by itself; scripts leave it out.")
]


@router.get("/{registration_id}")
def get_registration(seat: SeatDep) -> RegistrationOut:
    """How a registration of mine stands."""
    return registration_out(seat)


@router.put("/{registration_id}/pose")
def set_pose(body: NewPose, seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
    """Put the object at a pose."""
    T_world_object = rigid_pose(body.T_world_object, "T_world_object")
    detail = {} if body.stems_from is None else {"stems_from": body.stems_from}
    seat.session.set_pose(T_world_object, identity.actor, body.technique, detail)
    return registration_out(seat)


@router.put("/{registration_id}/frame")
def show_frame(body: FrameChoice, seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
    """Show, and snap against, another frame of the scene."""
    seat.session.show_frame(body.frame_id, identity.actor)
    return registration_out(seat)


@router.put("/{registration_id}/live")
def set_live(body: LiveChoice, seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
    """Turn live snapping on or off."""
    seat.session.set_live(body.on, identity.actor)
    return registration_out(seat)


@router.put("/{registration_id}/layers")
def show_layers(body: Layers, seat: SeatDep) -> RegistrationOut:
    """Let the 3-D view show or hide the cloud, the mesh, and the colours of depth agreement on it."""
    seat.session.show_layers(body)
    return registration_out(seat)


def _add_action(name: str, act: Callable[[LabelingSession, Actor], None], summary: str) -> None:
    def route(seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
        act(seat.session, identity.actor)
        return registration_out(seat)

    router.add_api_route(
        f"/{{registration_id}}/{name}", route, methods=["POST"], summary=summary, name=f"{name}_registration"
    )


_add_action("undo", LabelingSession.undo, "Take the last change of pose back")
_add_action("redo", LabelingSession.redo, "Bring back what was undone last")
_add_action("reset", LabelingSession.reset, "Put the object back to where it began")
_add_action("accept", LabelingSession.accept, "Take the pose that the machine offers")
_add_action("dismiss", LabelingSession.dismiss, "Decline the pose that the machine offers")
_add_action("submit", LabelingSession.submit, "Finish with the present pose")
_add_action("reopen", LabelingSession.reopen, "Go on with what was submitted or skipped")


@router.post("/{registration_id}/skip")
def skip(body: Skip, seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
    """Finish without a pose."""
    seat.session.skip(identity.actor, body.reason)
    return registration_out(seat)


@router.get("/{registration_id}/events")
def list_events(
    registration_id: Id,
    services: ServicesDep,
    identity: IdentityDep,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page:
    """The log of a registration: one's own, or anyone's for a reviewer."""
    services.desk.check_readable(registration_id, identity)
    query = select(Event).where(Event.registration_id == registration_id)
    with services.database.read() as session:
        return page_of(session, query, Event.sequence, after, limit, _event_out)


@router.get("/{registration_id}/stream", response_class=EventSourceResponse)
async def stream(
    request: Request, seat: SeatDep, services: ServicesDep, page: PageName = None
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events: the registration at once, again whenever it changes, and every ten seconds.

    So a page that hears nothing for longer knows that it has lost the connection. When the login ends, so
    does the stream.

    With the name of a page, another page's stream of this registration ends with the event `taken_over`.
    """
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()
    leave = services.desk.watch(seat)

    given_way = threading.Event()

    def tell(_state: SessionState) -> None:
        loop.call_soon_threadsafe(changed.set)

    def give_way() -> None:
        given_way.set()
        loop.call_soon_threadsafe(changed.set)

    unsubscribe = seat.session.subscribe(tell)
    stand_up = seat.chair.sit(page, give_way) if page else None
    try:
        while True:
            changed.clear()
            if given_way.is_set():
                yield ServerSentEvent(event="taken_over", data={"id": seat.registration.id})
                return
            out = await asyncio.to_thread(registration_out, seat)
            yield ServerSentEvent(event="registration", data=out)
            await asyncio.sleep(SECONDS_BETWEEN_UPDATES)
            if not await _in_time(changed) and await asyncio.to_thread(identify, request) is None:
                return
    finally:
        if stand_up:
            stand_up()
        unsubscribe()
        leave()


async def _in_time(changed: asyncio.Event) -> bool:
    try:
        await asyncio.wait_for(changed.wait(), SECONDS_BETWEEN_SIGNS_OF_LIFE)
    except TimeoutError:
        return False
    return True


def registration_out(seat: Seat) -> RegistrationOut:
    """A live session as JSON."""
    state = seat.session.snapshot()
    T_world_camera = np.array(seat.frames[state.frame_id].T_world_camera)
    return RegistrationOut(
        id=state.registration_id,
        task_id=seat.registration.task_id,
        condition=seat.registration.task.condition,
        state=state.state,
        skip_reason=state.skip_reason,
        frame_id=state.frame_id,
        T_world_object=state.T_world_object.tolist(),
        T_camera_object=(pose.inverse(T_world_camera) @ state.T_world_object).tolist(),
        confidence=state.confidence,
        can_undo=state.can_undo,
        can_redo=state.can_redo,
        dragging=state.dragging,
        gizmo_axes=state.gizmo_axes,
        layers=state.layers,
        agreement=_agreement_out(seat, state),
        saved=not state.dragging,
        snap=_snap_out(state),
        offer=_offer_out(state),
        is_live=state.is_live,
        live=_live_out(state),
        estimate_snap_id=state.estimate_snap_id,
        search=_search_out(state),
        preview=None if state.preview is None else state.preview.tolist(),
        message=state.message,
        view_url=f"/view/{state.registration_id}/",
        view_open=seat.viewers > 0,
    )


def _snap_out(state: SessionState) -> SnapOut | None:
    snap = state.snap
    if snap is None:
        return None
    return SnapOut(
        id=snap.id, asked_by=snap.asked_by, state=snap.state, progress=snap.progress, message=snap.message
    )


def _agreement_out(seat: Seat, state: SessionState) -> AgreementOut | None:
    agreement = seat.reading.of(state.frame_id, state.T_world_object)
    if not len(agreement.verdicts):
        return None
    return AgreementOut(
        inlier_share=agreement.inlier_share,
        median_residual=agreement.median_residual,
        match=agreement.share(Verdict.MATCH),
        in_front=agreement.share(Verdict.IN_FRONT),
        behind=agreement.share(Verdict.BEHIND),
        no_data=agreement.share(Verdict.NO_DATA),
    )


def _offer_out(state: SessionState) -> OfferOut | None:
    offer = state.offer
    if offer is None:
        return None
    return OfferOut(
        snap_id=offer.snap_id,
        T_world_object=offer.T_world_object.tolist(),
        confidence=offer.confidence,
        quiet=offer.quiet,
    )


def _live_out(state: SessionState) -> LiveOut | None:
    live = state.live
    if live is None:
        return None
    return LiveOut(
        T_world_object_start=live.T_world_object_start.tolist(),
        T_world_object=live.T_world_object.tolist(),
        confidence=live.confidence,
    )


def _search_out(state: SessionState) -> SearchOut | None:
    search = state.search
    return SearchOut(id=search.id, state=search.state, message=search.message) if search else None


def _event_out(row: Event) -> EventOut:
    return EventOut(**{name: getattr(row, name) for name in EventOut.model_fields})
