"""Putting an object somewhere other than by the gizmo, and looking at it from elsewhere."""

from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter
from numpy.typing import NDArray
from pydantic import BaseModel, Field, FiniteFloat

from app.api.dependencies import AnyoneDep, LiveSessionDep, ServicesDep
from app.api.pointing import PixelPoint, ViewPoint, frame_of, points_of, target_of, viewpoint_of
from app.api.registration_state import RegistrationOut, registration_out
from app.datasets.scene_data import SceneData
from app.labeling.live.live_session import LiveSession
from app.labeling.moves import placement, viewpoint
from app.labeling.moves.degrees_of_freedom import GizmoAxes
from app.labeling.moves.pose_record import ActionError
from app.storage.tables import Frame
from registration_core.geometry import pose

router = APIRouter(prefix="/api/registrations", tags=["placement"])

Array = NDArray[np.float64]

TURN = np.radians(30.0)
"""One step around the object."""

Metres = Annotated[FiniteFloat, Field(ge=-10.0, le=10.0)]
Radians = Annotated[FiniteFloat, Field(ge=-2.0 * np.pi, le=2.0 * np.pi)]


class Nudge(BaseModel):
    """A small move, or a turn about the object's middle."""

    axes: Literal["view", "object", "world"] = Field(
        description="`view`: x right, y down, z away, as the operator's 3-D view shows it; "
        "where nobody has it open, as the frame's camera does."
    )
    translation: tuple[Metres, Metres, Metres] = Field((0.0, 0.0, 0.0), description="Metres, along the axes.")
    rotation: tuple[Radians, Radians, Radians] = Field(
        (0.0, 0.0, 0.0), description="Rotation vector in the axes, radians."
    )
    technique: Literal["nudge", "turn", "flip"] = Field("nudge", description="What it was, for the log.")


class Look(BaseModel):
    """What the 3-D view is to look at, and from where."""

    at: Literal["sensor", "top", "front", "side", "object", "left", "right"] = Field(
        description="The sensor's own view; the object from the top, the front or the side of what it stands "
        "on; the object, closer; or a step of 30 degrees around it."
    )


class GizmoChoice(BaseModel):
    """Along which axes the gizmo's arrows lie."""

    axes: GizmoAxes


@router.post("/{registration_id}/nudge")
def nudge(body: Nudge, live_session: LiveSessionDep, identity: AnyoneDep) -> RegistrationOut:
    """Move the object a little, or turn it about its middle."""
    translation, rotation = np.array(body.translation), np.array(body.rotation)

    def change(T_world_object: Array) -> Array:
        axes = _axes(live_session, body.axes, T_world_object)
        return placement.nudged(T_world_object, axes, translation, rotation, live_session.model.centre)

    live_session.session.move(change, identity.actor, body.technique)
    return registration_out(live_session)


@router.post("/{registration_id}/rest")
def rest(live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep) -> RegistrationOut:
    """Put the object down on the surface near it, without turning it."""

    def change(T_world_object: Array) -> Array:
        centre = pose.apply(T_world_object, live_session.model.centre)
        plane = _plane(services.data, frame_of(live_session), centre, live_session.model.radius)
        if plane is None:
            raise ActionError("There is no flat surface near the object; bring it closer to one.")
        return placement.rested(T_world_object, live_session.model.vertices, plane)

    live_session.session.move(change, identity.actor, "rest")
    return registration_out(live_session)


@router.post("/{registration_id}/place")
def place(
    body: PixelPoint | ViewPoint, live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep
) -> RegistrationOut:
    """Put the object where somebody pointed, without turning it.

    On a bare surface it comes to stand. On anything else its own surface meets the point, along the ray
    from the eye.
    """
    target = target_of(body, live_session, services.data)

    def change(T_world_object: Array) -> Array:
        plane = _plane(services.data, target.frame, target.point, live_session.model.radius)
        return placement.placed(T_world_object, live_session.model, target.point, target.eye, plane)

    live_session.session.move(change, identity.actor, "place")
    return registration_out(live_session)


@router.post("/{registration_id}/look", status_code=204)
def look(body: Look, live_session: LiveSessionDep, services: ServicesDep) -> None:
    """Look at the object from elsewhere in the operator's 3-D view; not while it is being dragged."""
    now = viewpoint_of(live_session)
    state = live_session.session.snapshot()
    if state.dragging:
        raise ActionError("The object is being dragged; the view stays as it is.")
    T_world_sensor = np.array(frame_of(live_session).T_world_camera)
    centre = pose.apply(state.T_world_object, live_session.model.centre)
    match body.at:
        case "sensor":
            then = viewpoint.from_sensor(now, T_world_sensor, centre)
        case "object":
            then = viewpoint.closer(now, centre, live_session.model.radius)
        case "left" | "right":
            then = viewpoint.turned(now, centre, -TURN if body.at == "left" else TURN)
        case side:
            plane = _plane(services.data, frame_of(live_session), centre, live_session.model.radius)
            up = -T_world_sensor[:3, 1] if plane is None else plane[:3]
            then = viewpoint.from_side(now, side, centre, live_session.model.radius, T_world_sensor, up)
    assert live_session.view is not None
    live_session.view.look(then)


@router.put("/{registration_id}/gizmo")
def align_gizmo(body: GizmoChoice, live_session: LiveSessionDep) -> RegistrationOut:
    """Let the gizmo's arrows lie along the object's axes or the world's."""
    live_session.session.align_gizmo(body.axes)
    return registration_out(live_session)


def _axes(live_session: LiveSession, name: str, T_world_object: Array) -> Array:
    """Axes as the columns of (3, 3), in the world's frame."""
    if name == "world":
        return np.eye(3)
    if name == "object":
        return T_world_object[:3, :3]
    seen_from = live_session.view.viewpoint if live_session.view else None
    T = seen_from.T_world_camera if seen_from else np.array(frame_of(live_session).T_world_camera)
    return T[:3, :3]


def _plane(data: SceneData, frame: Frame, centre: Array, radius: float) -> Array | None:
    """What an object of this centre (3,) and radius stands on, if anything."""
    near = placement.nearby(points_of(data, frame), centre, radius)
    return placement.supporting_plane(near, np.array(frame.T_world_camera)[:3, 3])
