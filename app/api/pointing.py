"""What somebody points at: a pixel of a frame, or a place in the operator's 3-D view."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field, FiniteFloat

from app.api.problems import InputError
from app.datasets.scene_data import SceneData, camera_of
from app.labeling.live.live_session import LiveSession
from app.labeling.moves import placement
from app.labeling.moves.pose_record import ActionError
from app.labeling.moves.viewpoint import Viewpoint
from app.storage.tables import Frame

Array = NDArray[np.float64]

Share = Annotated[FiniteFloat, Field(ge=0.0, le=1.0)]


class PixelPoint(BaseModel):
    """A pixel of a frame; (0, 0) is the middle of the top-left one."""

    frame_id: int
    column: FiniteFloat
    row: FiniteFloat


class ViewPoint(BaseModel):
    """A place in the operator's 3-D view, as shares of its width and height from the top left."""

    across: Share
    down: Share


@dataclass(frozen=True)
class Target:
    """What was pointed at."""

    point: Array
    """(3,), in the world, metres."""
    eye: Array
    """(3,), from where it was seen."""
    frame: Frame
    """Whose depth image measured it."""


def target_of(pointed: PixelPoint | ViewPoint, live_session: LiveSession, data: SceneData) -> Target:
    """The measured point that somebody points at.

    Raises:
        InputError: where the pixel is outside the image.
        ActionError: where nothing was measured there, or nobody has the 3-D view open.
    """
    if isinstance(pointed, PixelPoint):
        frame = frame_of(live_session, pointed.frame_id)
        eye = np.array(frame.T_world_camera)[:3, 3]
        return Target(_point_in_image(data, frame, pointed), eye, frame)
    frame, seen_from = frame_of(live_session), viewpoint_of(live_session)
    ray = seen_from.ray(pointed.across, pointed.down)
    point = placement.point_along_ray(points_of(data, frame), seen_from.position, ray)
    if point is None:
        raise ActionError("There is no point of the cloud there; point at the cloud itself.")
    return Target(point, seen_from.position, frame)


def frame_of(live_session: LiveSession, frame_id: int | None = None) -> Frame:
    """A frame of the scene: the one that is shown, where none is named."""
    frame_id = live_session.session.snapshot().frame_id if frame_id is None else frame_id
    if frame_id not in live_session.frames:
        raise ActionError(f"Frame {frame_id} does not belong to this scene.")
    return live_session.frames[frame_id]


def viewpoint_of(live_session: LiveSession) -> Viewpoint:
    """From where the operator looks at the 3-D view."""
    seen_from = live_session.view.viewpoint if live_session.view else None
    if seen_from is None:
        raise ActionError("Nobody has the 3-D view of this registration open.")
    return seen_from


def points_of(data: SceneData, frame: Frame) -> Array:
    """What a frame measured: points (N, 3) in the world."""
    return placement.measured_points(data.depth(frame), camera_of(frame), np.array(frame.T_world_camera))


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
