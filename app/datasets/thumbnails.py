"""Small pictures of tasks: the scene, and in its corner the object that is asked for."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.datasets.start_pose import THREE_QUARTER_VIEW
from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

SIZE = (320, 240)
INSET = 96
"""Pixels, width and height of the object's picture."""
INSET_COLOR = np.array([255, 176, 96], dtype=np.float64)
INSET_BACKGROUND = (24, 27, 33)
PLAIN_SCENE = (70, 76, 86)


def task_thumbnail(color: NDArray[np.uint8] | None, model: ObjectModel) -> bytes:
    """A JPEG of 320x240: the colour image (H, W, 3), or a plain ground, and a shaded picture of the mesh."""
    scene = Image.new("RGB", SIZE, PLAIN_SCENE) if color is None else Image.fromarray(color).resize(SIZE)
    scene.paste(Image.fromarray(object_picture(model, INSET)), (SIZE[0] - INSET - 6, SIZE[1] - INSET - 6))
    content = io.BytesIO()
    scene.save(content, "jpeg", quality=85)
    return content.getvalue()


def object_picture(model: ObjectModel, size: int) -> NDArray[np.uint8]:
    """The mesh alone (size, size, 3), lit from the camera, seen askew from above."""
    distance = 4.0 * model.radius
    focal = 0.46 * size * distance / model.radius
    camera = Intrinsics(size, size, focal, focal, (size - 1) / 2, (size - 1) / 2)
    centre_in_camera = np.array([0.0, 0.0, distance])
    T_camera_object = pose.from_rotation_translation(
        THREE_QUARTER_VIEW, centre_in_camera - THREE_QUARTER_VIEW @ model.centre
    )
    depth = render_depth(model, camera, T_camera_object)
    picture = np.empty((size, size, 3), dtype=np.uint8)
    picture[:] = INSET_BACKGROUND
    inside = depth > 0
    picture[inside] = (_shade(depth, focal)[inside, None] * INSET_COLOR).astype(np.uint8)
    return picture


def _shade(depth: NDArray[np.float32], focal: float) -> NDArray[np.float64]:
    """Cosine between the surface's normal and the view, from the depth's slope, in [0.25, 1]."""
    metres_per_pixel = np.maximum(depth, 1e-6) / focal
    slope_y, slope_x = np.gradient(depth)
    steepness = np.hypot(slope_x, slope_y) / metres_per_pixel
    return np.clip(1.0 / np.sqrt(1.0 + steepness**2), 0.25, 1.0)
