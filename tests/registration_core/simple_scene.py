"""A small scene whose truth is known: an asymmetric object on a table, seen by a noisy depth camera."""

from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel, Symmetries
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

CAMERA = Intrinsics(320, 240, 262.5, 262.5, 159.5, 119.5)


@dataclass(frozen=True)
class SimpleScene:
    """What a snap is given, and the answer."""

    model: ObjectModel
    depth: NDArray[np.float32]
    camera: Intrinsics
    truth: NDArray[np.float64]


def model_of(*parts: trimesh.Trimesh, symmetries: Symmetries | None = None) -> ObjectModel:
    """One model of several meshes in metres."""
    mesh = trimesh.util.concatenate(parts)
    faces = np.asarray(mesh.faces, dtype=np.int32)
    return ObjectModel(np.asarray(mesh.vertices, dtype=np.float64), faces, symmetries or Symmetries())


def block(size: tuple[float, float, float], at: tuple[float, float, float] = (0, 0, 0)) -> trimesh.Trimesh:
    """A box of `size` about `at`, metres."""
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(at)
    return mesh


def tool() -> ObjectModel:
    """A body, a handle and a foot, without any symmetry; its frame's origin is not at its centre."""
    return model_of(
        block((0.14, 0.05, 0.05), (0.03, 0.0, 0.09)),
        block((0.04, 0.04, 0.09), (-0.02, 0.0, 0.03)),
        block((0.09, 0.06, 0.03), (-0.01, 0.0, -0.02)),
        block((0.03, 0.03, 0.03), (0.08, 0.02, 0.12)),
    )


def standing_tool() -> SimpleScene:
    """The tool on a table, 0.75 m from the camera."""
    model = tool()
    T_camera_table = pose.exp([0.0, 0.12, 0.85, np.radians(-125.0), 0.0, 0.0])
    T_table_object = pose.exp([0.02, 0.0, 0.035, 0.0, 0.0, 0.6])
    truth = T_camera_table @ T_table_object
    table = model_of(block((1.2, 1.2, 0.02), (0.0, 0.0, -0.01)))
    depth = noisy(nearest(render_depth(table, CAMERA, T_camera_table), render_depth(model, CAMERA, truth)))
    return SimpleScene(model, depth, CAMERA, truth)


def nearest(*depths: NDArray[np.float32]) -> NDArray[np.float32]:
    """The depth image of several surfaces together."""
    stacked = np.where(np.stack(depths) > 0, np.stack(depths), np.inf).min(axis=0)
    return np.where(np.isfinite(stacked), stacked, 0).astype(np.float32)


def noisy(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Depth with a millimetre of noise at one metre, and millimetre steps."""
    noise = np.random.default_rng(7).normal(scale=0.001, size=depth.shape) * depth**2
    return np.where(depth > 0, np.round(depth + noise, 3), 0).astype(np.float32)
