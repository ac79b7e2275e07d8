"""Putting an object somewhere other than by the gizmo, and looking at it from elsewhere."""

from typing import Annotated, Literal

import numpy as np
from fastapi import APIRouter
from numpy.typing import NDArray
from pydantic import BaseModel, Field, FiniteFloat

from app.api.dependencies import IdentityDep, ServicesDep
from app.api.problems import InputError
from app.api.registrations import RegistrationOut, SeatDep, registration_out
from app.labeling import placement, viewpoint
from app.labeling.degrees_of_freedom import GizmoAxes
from app.labeling.desk import Seat
from app.labeling.track import ActionError
from app.labeling.viewpoint import Viewpoint
from app.scene_data import SceneData, camera_of
from app.tables import Frame
from registration_core import pose

router = APIRouter(prefix="/api/registrations", tags=["placement"])

Array = NDArray[np.float64]

TURN = np.radians(30.0)
"""One step around the object."""

Metres = Annotated[FiniteFloat, Field(ge=-10.0, le=10.0)]
Radians = Annotated[FiniteFloat, Field(ge=-2.0 * np.pi, le=2.0 * np.pi)]
Share = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]


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


class PixelPoint(BaseModel):
    """A pixel of a frame; (0, 0) is the middle of the top-left one."""

    frame_id: int
    column: FiniteFloat
    row: FiniteFloat


class ViewPoint(BaseModel):
    """A place in the operator's 3-D view, as shares of its width and height from the top left."""

    across: Share
    down: Share


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
def nudge(body: Nudge, seat: SeatDep, identity: IdentityDep) -> RegistrationOut:
    """Move the object a little, or turn it about its middle."""
    translation, rotation = np.array(body.translation), np.array(body.rotation)

    def change(T_world_object: Array) -> Array:
        axes = _axes(seat, body.axes, T_world_object)
        return placement.nudged(T_world_object, axes, translation, rotation, seat.model.centre)

    seat.session.move(change, identity.actor, body.technique)
    return registration_out(seat)


@router.post("/{registration_id}/rest")
def rest(seat: SeatDep, services: ServicesDep, identity: IdentityDep) -> RegistrationOut:
    """Put the object down on the surface near it, without turning it."""

    def change(T_world_object: Array) -> Array:
        centre = pose.apply(T_world_object, seat.model.centre)
        plane = _plane(services.data, _frame(seat), centre, seat.model.radius)
        if plane is None:
            raise ActionError("There is no flat surface near the object; bring it closer to one.")
        return placement.rested(T_world_object, seat.model.vertices, plane)

    seat.session.move(change, identity.actor, "rest")
    return registration_out(seat)


@router.post("/{registration_id}/place")
def place(
    body: PixelPoint | ViewPoint, seat: SeatDep, services: ServicesDep, identity: IdentityDep
) -> RegistrationOut:
    """Put the object where somebody pointed, without turning it.

    On a bare surface it comes to stand. On anything else its own surface meets the point, along the ray
    from the eye.
    """
    if isinstance(body, PixelPoint):
        frame = _frame(seat, body.frame_id)
        eye = np.array(frame.T_world_camera)[:3, 3]
        point = _point_in_image(services.data, frame, body)
    else:
        frame, seen_from = _frame(seat), _viewpoint(seat)
        eye = seen_from.position
        points = _points(services.data, frame)
        found = placement.point_along_ray(points, eye, seen_from.ray(body.across, body.down))
        if found is None:
            raise ActionError("There is no point of the cloud there; point at the cloud itself.")
        point = found

    def change(T_world_object: Array) -> Array:
        plane = _plane(services.data, frame, point, seat.model.radius)
        return placement.placed(T_world_object, seat.model, point, eye, plane)

    seat.session.move(change, identity.actor, "place")
    return registration_out(seat)


@router.post("/{registration_id}/look", status_code=204)
def look(body: Look, seat: SeatDep, services: ServicesDep) -> None:
    """Look at the object from elsewhere in the operator's 3-D view; not while it is being dragged."""
    now = _viewpoint(seat)
    state = seat.session.snapshot()
    if state.dragging:
        raise ActionError("The object is being dragged; the view stays as it is.")
    T_world_sensor = np.array(_frame(seat).T_world_camera)
    centre = pose.apply(state.T_world_object, seat.model.centre)
    match body.at:
        case "sensor":
            then = viewpoint.from_sensor(now, T_world_sensor, centre)
        case "object":
            then = viewpoint.closer(now, centre, seat.model.radius)
        case "left" | "right":
            then = viewpoint.turned(now, centre, -TURN if body.at == "left" else TURN)
        case side:
            plane = _plane(services.data, _frame(seat), centre, seat.model.radius)
            up = -T_world_sensor[:3, 1] if plane is None else plane[:3]
            then = viewpoint.from_side(now, side, centre, seat.model.radius, T_world_sensor, up)
    assert seat.view is not None
    seat.view.look(then)


@router.put("/{registration_id}/gizmo")
def align_gizmo(body: GizmoChoice, seat: SeatDep) -> RegistrationOut:
    """Let the gizmo's arrows lie along the object's axes or the world's."""
    seat.session.align_gizmo(body.axes)
    return registration_out(seat)


def _axes(seat: Seat, name: str, T_world_object: Array) -> Array:
    """Axes as the columns of (3, 3), in the world's frame."""
    if name == "world":
        return np.eye(3)
    if name == "object":
        return T_world_object[:3, :3]
    seen_from = seat.view.viewpoint if seat.view else None
    T = seen_from.T_world_camera if seen_from else np.array(_frame(seat).T_world_camera)
    return T[:3, :3]


def _viewpoint(seat: Seat) -> Viewpoint:
    seen_from = seat.view.viewpoint if seat.view else None
    if seen_from is None:
        raise ActionError("Nobody has the 3-D view of this registration open.")
    return seen_from


def _frame(seat: Seat, frame_id: int | None = None) -> Frame:
    """A frame of the scene: the one that is shown, where none is named."""
    frame_id = seat.session.snapshot().frame_id if frame_id is None else frame_id
    if frame_id not in seat.frames:
        raise ActionError(f"Frame {frame_id} does not belong to this scene.")
    return seat.frames[frame_id]


def _point_in_image(data: SceneData, frame: Frame, pixel: PixelPoint) -> Array:
    for name, value, size in (("column", pixel.column, frame.width), ("row", pixel.row, frame.height)):
        if not -0.5 <= value <= size - 0.5:
            raise InputError(f"{name} must be inside the image, from 0 to {size - 1}; it is {value:g}")
    point = placement.point_at_pixel(
        data.depth(frame), camera_of(frame), np.array(frame.T_world_camera), pixel.column, pixel.row
    )
    if point is None:
        raise ActionError("No depth was measured there; point at another place of the object.")
    return point


def _points(data: SceneData, frame: Frame) -> Array:
    return placement.measured_points(data.depth(frame), camera_of(frame), np.array(frame.T_world_camera))


def _plane(data: SceneData, frame: Frame, centre: Array, radius: float) -> Array | None:
    """What an object of this centre (3,) and radius stands on, if anything."""
    near = placement.nearby(_points(data, frame), centre, radius)
    return placement.supporting_plane(near, np.array(frame.T_world_camera)[:3, 3])
