"""A small BOP dataset whose true poses are known: an angle tool and a block on a table."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from registration_core.bop.writer import (
    camera_entry,
    gt_entry,
    model_info,
    write_color_png,
    write_depth_png,
    write_json,
    write_mesh,
)
from registration_core.geometry import pose
from tests.app.export.site import (
    BLOCK,
    CAMERA,
    DEPTH_SCALE,
    NEAR_VIEW,
    SIDE_VIEW,
    T_WORLD_BLOCK,
    T_WORLD_TOOL,
    TOOL,
    mesh_of,
    model_of,
    observed_depth,
)

__all__ = [
    "BLOCK",
    "CAMERA",
    "NEAR_VIEW",
    "SIDE_VIEW",
    "TOOL",
    "T_OBJECT_GIZMO",
    "change_json",
    "true_pose",
    "write_small_dataset",
]

NAME = "tools"
TRUE_POSES = {TOOL: T_WORLD_TOOL, BLOCK: T_WORLD_BLOCK}
T_OBJECT_GIZMO = pose.from_rotation_translation(np.eye(3), model_of(mesh_of(TOOL)).centre)
"""The gizmo of the tool sits in its middle."""
POSED_SCENE, UNPOSED_SCENE = "test/000001", "test/000002"
VIEWS = {0: NEAR_VIEW, 5: SIDE_VIEW}


def write_small_dataset(root: Path) -> Path:
    """Scene 1 has two images whose cameras are known; scene 2 has one whose camera is not."""
    infos = {}
    for obj_id in TRUE_POSES:
        mesh = mesh_of(obj_id)
        write_mesh(root / f"models/obj_{obj_id:06d}.ply", mesh)
        infos[obj_id] = model_info(model_of(mesh))
    write_json(root / "models/models_info.json", infos)
    write_json(root / "models/names.json", {TOOL: "angle tool", BLOCK: "block"})
    write_scene(root / POSED_SCENE, VIEWS, posed=True)
    write_scene(root / UNPOSED_SCENE, {0: NEAR_VIEW}, posed=False)
    return root


def write_scene(folder: Path, views: dict[int, np.ndarray], *, posed: bool) -> None:
    """The images of one scene, with their annotations."""
    cameras, truths = {}, {}
    for image_id, T_world_camera in views.items():
        depth = observed_depth(T_world_camera)
        write_depth_png(folder / f"depth/{image_id:06d}.png", depth, DEPTH_SCALE)
        grey = (255 * depth / depth.max()).astype(np.uint8)
        write_color_png(folder / f"rgb/{image_id:06d}.png", np.stack([grey, grey, 255 - grey], axis=-1))
        cameras[image_id] = camera_entry(CAMERA, DEPTH_SCALE, T_world_camera if posed else None)
        T_camera_world = pose.inverse(T_world_camera)
        truths[image_id] = [gt_entry(obj_id, T_camera_world @ T) for obj_id, T in TRUE_POSES.items()]
    write_json(folder / "scene_camera.json", cameras)
    write_json(folder / "scene_gt.json", truths)


def true_pose(obj_id: int, *, posed: bool = True) -> np.ndarray:
    """T_world_object (4, 4); the world of scene 2 is its camera."""
    return TRUE_POSES[obj_id] if posed else pose.inverse(NEAR_VIEW) @ TRUE_POSES[obj_id]


def change_json(path: Path, edit: Callable[[dict[str, Any]], object]) -> None:
    """Edit a JSON file."""
    content = json.loads(path.read_text())
    edit(content)
    path.write_text(json.dumps(content))
