"""Writes what BOP datasets are made of; the same content gives the same bytes."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from registration_core.bop.fields import METRES_PER_MILLIMETRE
from registration_core.bop.images import LARGEST_RAW_DEPTH
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.mesh_file import plain_ply
from registration_core.geometry.object_model import ObjectModel

Array = NDArray[np.float64]


def camera_file(camera: Intrinsics, depth_scale: float) -> dict[str, Any]:
    """Content of `camera.json`."""
    return {
        "cx": camera.cx,
        "cy": camera.cy,
        "depth_scale": depth_scale,
        "fx": camera.fx,
        "fy": camera.fy,
        "height": camera.height,
        "width": camera.width,
    }


def camera_entry(
    camera: Intrinsics, depth_scale: float, T_world_camera: Array | None = None
) -> dict[str, Any]:
    """An image's entry in `scene_camera.json`: world to camera in mm; raw depth * depth_scale is mm."""
    entry: dict[str, Any] = {"cam_K": camera.matrix.ravel().tolist(), "depth_scale": depth_scale}
    if T_world_camera is not None:
        T_camera_world = pose.inverse(T_world_camera)
        entry["cam_R_w2c"] = T_camera_world[:3, :3].ravel().tolist()
        entry["cam_t_w2c"] = millimetres(T_camera_world[:3, 3])
    return entry


def gt_entry(obj_id: int, T_camera_object: Array) -> dict[str, Any]:
    """An instance's entry in `scene_gt.json`: model to camera in mm."""
    return {
        "cam_R_m2c": T_camera_object[:3, :3].ravel().tolist(),
        "cam_t_m2c": millimetres(T_camera_object[:3, 3]),
        "obj_id": obj_id,
    }


def model_info(model: ObjectModel) -> dict[str, Any]:
    """An object's entry in `models_info.json`, mm; symmetries only where it has any."""
    low, high = model.vertices.min(axis=0), model.vertices.max(axis=0)
    info: dict[str, Any] = {"diameter": model.diameter / METRES_PER_MILLIMETRE}
    info |= dict(zip(("min_x", "min_y", "min_z"), millimetres(low), strict=True))
    info |= dict(zip(("size_x", "size_y", "size_z"), millimetres(high - low), strict=True))
    if model.symmetries.discrete:
        info["symmetries_discrete"] = [flat_in_millimetres(T) for T in model.symmetries.discrete]
    if model.symmetries.continuous:
        info["symmetries_continuous"] = [
            {"axis": list(symmetry.axis), "offset": millimetres(np.array(symmetry.offset))}
            for symmetry in model.symmetries.continuous
        ]
    return info


def json_text(content: Mapping[Any, Any]) -> str:
    """JSON with a line for each entry of the outermost object, in the order given."""
    lines = [f"  {json.dumps(str(key))}: {json.dumps(value)}" for key, value in content.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def write_json(path: Path, content: Mapping[Any, Any]) -> None:
    """Write `json_text`, and the folder where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json_text(content), encoding="utf-8")


def write_depth_png(path: Path, depth: NDArray[np.floating], depth_scale: float) -> None:
    """Write depth (H, W) in metres, 0 = no measurement, as a 16-bit PNG; raw * depth_scale is mm.

    Raises:
        ValueError: where a depth is negative, not finite, or too large for 16 bits at this scale.
    """
    farthest = LARGEST_RAW_DEPTH * depth_scale * METRES_PER_MILLIMETRE
    if not np.isfinite(depth).all() or depth.min() < 0 or depth.max() > farthest:
        raise ValueError(f"depth must be from 0 to {farthest:g} m to be written with scale {depth_scale:g}")
    raw = np.rint(depth.astype(np.float64) / (depth_scale * METRES_PER_MILLIMETRE)).astype(np.uint16)
    write_image(path, Image.fromarray(raw))


def write_color_png(path: Path, color: NDArray[np.uint8]) -> None:
    """Write colours (H, W, 3) as a PNG."""
    write_image(path, Image.fromarray(color))


def write_image(path: Path, image: Image.Image) -> None:
    """Write a PNG, and the folder where it is missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    image.save(path, format="PNG", optimize=True)


def write_mesh(path: Path, mesh: trimesh.Trimesh) -> None:
    """Write a mesh given in metres as PLY in mm, with its vertex colours."""
    scaled = mesh.copy()
    scaled.apply_scale(1.0 / METRES_PER_MILLIMETRE)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(plain_ply(scaled))


def millimetres(metres: Array) -> list[float]:
    """A vector in metres as a list in mm."""
    return (metres / METRES_PER_MILLIMETRE).tolist()


def flat_in_millimetres(T: tuple[tuple[float, ...], ...]) -> list[float]:
    """A 4x4 transform in metres as 16 numbers, row by row, its translation in mm."""
    matrix = np.array(T)
    matrix[:3, 3] /= METRES_PER_MILLIMETRE
    return matrix.ravel().tolist()
