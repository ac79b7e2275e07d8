"""Three points: a pose from points that somebody showed on the object and in the scene, in the same order."""

from typing import Annotated, Any

import numpy as np
from fastapi import APIRouter
from numpy.typing import NDArray
from pydantic import BaseModel, Field, FiniteFloat

from app.api.dependencies import AnyoneDep, LiveSessionDep, ServicesDep
from app.api.pointing import PixelPoint, ViewPoint, target_of, viewpoint_of
from app.api.problems import InputError
from app.api.registration_state import RegistrationOut, registration_out
from app.datasets.scene_data import SceneData
from app.labeling.live.live_session import LiveSession
from registration_core.geometry.correspondence import Correspondence, pose_from_correspondences

router = APIRouter(prefix="/api/registrations", tags=["three points"])

Array = NDArray[np.float64]

MOST_PAIRS = 50
Coordinate = Annotated[FiniteFloat, Field(ge=-1e4, le=1e4)]
Position = tuple[Coordinate, Coordinate, Coordinate]

SIDES = {"points_object": "the points on the object", "points_camera": "the points in the scene"}
"""What the arguments of the fit are for people."""


class PointPair(BaseModel):
    """One and the same point, on the object and in the scene."""

    on_object: Position = Field(description="Metres, in the object's frame.")
    in_scene: Position | PixelPoint | ViewPoint = Field(
        description="Metres, in the world's frame; or a pixel, whose depth tells the point."
    )


class PointPairs(BaseModel):
    """What the object's pose is to be told from."""

    pairs: list[PointPair] = Field(max_length=MOST_PAIRS, description="Three or more.")


class PointOut(BaseModel):
    """A measured point of the scene."""

    point_world: Position


class Marks(BaseModel):
    """What is to be numbered in the 3-D view, in place of what is."""

    points_world: list[Position] = Field(max_length=MOST_PAIRS)


class ThreePointsOut(BaseModel):
    """The registration at the new pose, and how well the pairs agree on it."""

    registration: RegistrationOut
    residuals: list[float] = Field(description="Metres: by how far each pair misses.")
    rms: float = Field(description="Root mean square of the residuals, metres.")
    start_spread: tuple[float, float] = Field(description="How far off the pose may be, metres and radians.")
    snap_id: str | None = Field(description="Of the snap from there; null in a task without a machine.")


@router.post("/{registration_id}/three-points")
def three_points(
    body: PointPairs, live_session: LiveSessionDep, services: ServicesDep, identity: AnyoneDep
) -> ThreePointsOut:
    """Put the object where the pairs agree best; where the task has a machine, it snaps from there."""
    on_object = np.array([pair.on_object for pair in body.pairs])
    in_world = np.array([_in_world(pair, live_session, services.data) for pair in body.pairs])
    fit = _fit(on_object, in_world, live_session.model.centre)
    detail = _detail(on_object, in_world, fit)
    live_session.session.set_pose(fit.T_camera_object, identity.actor, "three points", detail)
    snap_id = None
    if "snap" in live_session.session.tools:
        snap_id = live_session.session.snap(identity.actor, start_spread=fit.start_spread)
    return ThreePointsOut(
        registration=registration_out(live_session),
        residuals=fit.residuals.tolist(),
        rms=fit.rms,
        start_spread=fit.start_spread,
        snap_id=snap_id,
    )


@router.post("/{registration_id}/point")
def point(body: PixelPoint | ViewPoint, live_session: LiveSessionDep, services: ServicesDep) -> PointOut:
    """The measured point that somebody points at; nothing changes."""
    return PointOut(point_world=tuple(target_of(body, live_session, services.data).point))


@router.put("/{registration_id}/marks", status_code=204)
def mark(body: Marks, live_session: LiveSessionDep) -> None:
    """Number points in the operator's 3-D view."""
    viewpoint_of(live_session)
    assert live_session.view is not None
    live_session.view.mark([np.array(position) for position in body.points_world])


def _in_world(pair: PointPair, live_session: LiveSession, data: SceneData) -> Array:
    if isinstance(pair.in_scene, tuple):
        return np.array(pair.in_scene)
    return target_of(pair.in_scene, live_session, data).point


def _fit(on_object: Array, in_world: Array, centre: Array) -> Correspondence:
    """The fit is the same in whatever axes: here those of the world take the camera's place."""
    try:
        return pose_from_correspondences(on_object.reshape(-1, 3), in_world.reshape(-1, 3), centre=centre)
    except ValueError as error:
        sentence = str(error)
        for name, side in SIDES.items():
            sentence = sentence.replace(name, side)
        raise InputError(f"{sentence[0].upper()}{sentence[1:]}.") from error


def _detail(on_object: Array, in_world: Array, fit: Correspondence) -> dict[str, Any]:
    pairs = zip(on_object.tolist(), in_world.tolist(), strict=True)
    return {
        "pairs": [{"on_object": picked, "in_world": meant} for picked, meant in pairs],
        "residuals": fit.residuals.tolist(),
        "start_spread": list(fit.start_spread),
    }
