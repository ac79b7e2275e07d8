"""Scenes, and the pictures of their frames."""

import io
from typing import Any

import numpy as np
from fastapi import APIRouter, HTTPException, Response
from fastapi.responses import FileResponse
from PIL import Image
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import selectinload

from app.access.auth import Identity
from app.api.dependencies import (
    AfterDep,
    AnyoneDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    QueryId,
    ServicesDep,
    check_sees,
    page_of,
    row_or_404,
)
from app.services import Services
from app.storage.tables import Frame, Pose, Scene, Task
from registration_core.rendering.depth_verdicts import TOLERANCE

router = APIRouter(prefix="/api", tags=["scenes"])

FOREVER = {"cache-control": "private, max-age=31536000, immutable"}


class Intrinsics(BaseModel):
    """Of a pinhole camera, pixels."""

    fx: float
    fy: float
    cx: float
    cy: float


class FrameOut(BaseModel):
    """One RGB-D image."""

    id: int
    image_id: int
    width: int
    height: int
    intrinsics: Intrinsics
    T_world_camera: Pose
    depth_scale: float
    """A raw depth value times this is millimetres."""
    depth_tolerance: float
    """Metres that depth may be off and still agree with a surface, up to a distance of 1 m; beyond, it grows
    with the square of the distance."""
    color_url: str | None
    depth_url: str
    raw_depth_url: str


class SceneOut(BaseModel):
    """One rigid world with its frames."""

    id: int
    dataset_id: int
    split: str
    bop_scene_id: int
    label: str
    frames: list[FrameOut]


@router.get("/scenes")
def list_scenes(
    services: ServicesDep,
    _identity: IdentityDep,
    dataset_id: QueryId = None,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page[SceneOut]:
    """All scenes, or those of one dataset."""
    query = select(Scene).options(selectinload(Scene.frames))
    if dataset_id is not None:
        query = query.where(Scene.dataset_id == dataset_id)
    with services.database.read() as session:
        return page_of(session, query, Scene.id, after, limit, _scene_out)


@router.get("/scenes/{scene_id}")
def get_scene(scene_id: Id, services: ServicesDep, identity: AnyoneDep) -> SceneOut:
    """One scene with its frames."""
    check_sees(services, identity, Task.scene_id == scene_id, f"scene {scene_id}")
    with services.database.read() as session:
        return _scene_out(row_or_404(session, Scene, scene_id))


@router.get("/frames/{frame_id}/color.png", response_class=Response)
def get_color(frame_id: Id, services: ServicesDep, identity: AnyoneDep) -> Response:
    """A frame's colour image; 404 where it has none."""
    frame = _frame(services, frame_id, identity)
    if frame.color_hash is None:
        raise HTTPException(404, f"Frame {frame_id} has no colour image.")
    path = services.files.path(frame.color_hash)
    with Image.open(path) as image:
        if image.format == "PNG":
            return FileResponse(path, media_type="image/png", headers=FOREVER)
        content = io.BytesIO()
        image.convert("RGB").save(content, "png")
    return Response(content.getvalue(), media_type="image/png", headers=FOREVER)


@router.get("/frames/{frame_id}/depth.png", response_class=FileResponse)
def get_depth(frame_id: Id, services: ServicesDep, identity: IdentityDep) -> FileResponse:
    """A frame's depth image, 16 bit; `depth_scale` turns its values into millimetres."""
    frame = _frame(services, frame_id, identity)
    return FileResponse(services.files.path(frame.depth_hash), media_type="image/png", headers=FOREVER)


@router.get("/frames/{frame_id}/depth.raw", response_class=Response)
def get_raw_depth(frame_id: Id, services: ServicesDep, identity: IdentityDep) -> Response:
    """The values of `depth.png` as uint16, little endian, row by row: browsers read but 8 bits of a PNG."""
    with Image.open(services.files.path(_frame(services, frame_id, identity).depth_hash)) as image:
        content = np.asarray(image).astype("<u2").tobytes()
    return Response(content, media_type="application/octet-stream", headers=FOREVER)


def _frame(services: Services, frame_id: int, identity: Identity) -> Frame:
    with services.database.read() as session:
        frame = row_or_404(session, Frame, frame_id)
    check_sees(services, identity, Task.scene_id == frame.scene_id, f"frame {frame_id}")
    return frame


def _scene_out(row: Scene) -> SceneOut:
    return SceneOut(
        id=row.id,
        dataset_id=row.dataset_id,
        split=row.split,
        bop_scene_id=row.bop_scene_id,
        label=row.label,
        frames=[FrameOut(**_frame_out(frame)) for frame in row.frames],
    )


def _frame_out(row: Frame) -> dict[str, Any]:
    return {
        "id": row.id,
        "image_id": row.image_id,
        "width": row.width,
        "height": row.height,
        "intrinsics": Intrinsics(fx=row.fx, fy=row.fy, cx=row.cx, cy=row.cy),
        "T_world_camera": row.T_world_camera,
        "depth_scale": row.depth_scale,
        "depth_tolerance": TOLERANCE,
        "color_url": f"/api/frames/{row.id}/color.png" if row.color_hash else None,
        "depth_url": f"/api/frames/{row.id}/depth.png",
        "raw_depth_url": f"/api/frames/{row.id}/depth.raw",
    }
