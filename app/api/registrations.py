"""Registrations: how they stand, what an operator or a script may do, and the log."""

from collections.abc import Callable
from datetime import datetime
from typing import Any, Literal

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select

from app.api.dependencies import (
    EXAMPLE_POSE,
    AfterDep,
    AnyoneDep,
    Id,
    IdentityDep,
    LimitDep,
    LiveSessionDep,
    Page,
    ServicesDep,
    page_of,
    rigid_pose,
)
from app.api.registration_state import RegistrationOut, registration_out
from app.labeling.layers import Layers
from app.labeling.session import LabelingSession
from app.storage.roles import Actor
from app.storage.tables import Event, FrameUse, Method, Pose

router = APIRouter(prefix="/api/registrations", tags=["registrations"])

Technique = Literal[
    "nudge", "turn", "flip", "numbers", "rest", "place", "three points", "proposal", "mode", "copy"
]
"""Ways to put an object somewhere other than by the gizmo."""


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


class MethodChoice(BaseModel):
    """What Snap is to compute with."""

    method: Method


class FramesChoice(BaseModel):
    """The frames that Snap is to use."""

    frames: FrameUse


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


@router.get("/{registration_id}")
def get_registration(live_session: LiveSessionDep) -> RegistrationOut:
    """How a registration of mine stands."""
    return registration_out(live_session)


@router.put("/{registration_id}/pose")
def set_pose(body: NewPose, live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
    """Put the object at a pose."""
    T_world_object = rigid_pose(body.T_world_object, "T_world_object")
    detail = {} if body.stems_from is None else {"stems_from": body.stems_from}
    live_session.session.set_pose(T_world_object, identity.actor, body.technique, detail)
    return registration_out(live_session)


@router.put("/{registration_id}/frame")
def show_frame(body: FrameChoice, live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
    """Show, and snap against, another frame of the scene."""
    live_session.session.show_frame(body.frame_id, identity.actor)
    return registration_out(live_session)


@router.put("/{registration_id}/live")
def set_live(body: LiveChoice, live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
    """Turn live snapping on or off."""
    live_session.session.set_live(body.on, identity.actor)
    return registration_out(live_session)


@router.put("/{registration_id}/method")
def choose_method(body: MethodChoice, live_session: LiveSessionDep) -> RegistrationOut:
    """Choose what Snap computes with; live snapping, `auto` and the search stay with the default."""
    live_session.session.choose_method(body.method)
    return registration_out(live_session)


@router.put("/{registration_id}/snap-frames")
def choose_frames(body: FramesChoice, live_session: LiveSessionDep) -> RegistrationOut:
    """Choose the frames that Snap uses: those that see the object, or the one that is shown alone."""
    live_session.session.choose_frames(body.frames)
    return registration_out(live_session)


@router.put("/{registration_id}/layers")
def show_layers(body: Layers, live_session: LiveSessionDep) -> RegistrationOut:
    """Let the 3-D view show or hide the cloud, the mesh, and the colours of depth agreement on it."""
    live_session.session.show_layers(body)
    return registration_out(live_session)


def _add_action(name: str, act: Callable[[LabelingSession, Actor], None], description: str) -> None:
    def route(live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
        act(live_session.session, identity.actor)
        return registration_out(live_session)

    router.add_api_route(
        f"/{{registration_id}}/{name}",
        route,
        methods=["POST"],
        description=description,
        name=f"{name}_registration",
    )


_add_action("undo", LabelingSession.undo, "Take the last change of pose back.")
_add_action("redo", LabelingSession.redo, "Bring back what was undone last.")
_add_action("reset", LabelingSession.reset, "Put the object back to where it began.")
_add_action("accept", LabelingSession.accept, "Take the pose that the machine offers.")
_add_action("dismiss", LabelingSession.dismiss, "Decline the pose that the machine offers.")
_add_action("submit", LabelingSession.submit, "Finish with the present pose.")
_add_action("reopen", LabelingSession.reopen, "Go on with what was submitted or skipped.")


@router.post("/{registration_id}/skip")
def skip(body: Skip, live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
    """Finish without a pose."""
    live_session.session.skip(identity.actor, body.reason)
    return registration_out(live_session)


@router.get("/{registration_id}/events")
def list_events(
    registration_id: Id,
    services: ServicesDep,
    identity: IdentityDep,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page[EventOut]:
    """The log of a registration: one's own, or anyone's for a reviewer."""
    services.live_sessions.check_readable(registration_id, identity)
    query = select(Event).where(Event.registration_id == registration_id)
    with services.database.read() as session:
        return page_of(session, query, Event.sequence, after, limit, _event_out)


def _event_out(row: Event) -> EventOut:
    return EventOut(**{name: getattr(row, name) for name in EventOut.model_fields})
