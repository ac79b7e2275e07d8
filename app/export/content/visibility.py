"""What of an object an image shows: its silhouette, the visible part of it, and BOP's numbers about both."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.camera import project
from registration_core.rendering.rasterizer import NEAR, render_depth

Mask = NDArray[np.bool_]

TOLERANCE = 0.015
"""Metres that the object's surface may lie behind the observed one and still count as visible."""

NO_BOX = [-1, -1, -1, -1]


@dataclass(frozen=True, eq=False)
class Appearance:
    """One object instance in one image."""

    mask: Mask
    """(H, W): the silhouette inside the image, as if nothing stood before it."""
    mask_visib: Mask
    """(H, W): its visible part."""
    info: dict[str, Any]
    """Its entry in `scene_gt_info.json`."""


def is_before_camera(model: ObjectModel, T_camera_object: NDArray[np.float64]) -> bool:
    """Whether any part of the object lies before the camera's near plane."""
    return bool(pose.apply(T_camera_object, model.vertices)[:, 2].max() > NEAR)


def appearance(
    model: ObjectModel,
    depth: NDArray[np.float32],
    camera: Intrinsics,
    T_camera_object: NDArray[np.float64],
) -> Appearance:
    """How the object shows in an image with observed depth (H, W), metres, 0 = no measurement.

    Counts and boxes of the whole silhouette are taken on a canvas of three times the image's width and
    height, with the image in its middle, as bop_toolkit's `calc_gt_info` takes them.
    """
    left, top, width, height = silhouette_window(model, camera, T_camera_object)
    window_depth = render_depth(model, camera.cropped(left, top, width, height), T_camera_object)
    model_depth = pasted(window_depth, left, top, depth.shape)
    mask = model_depth > 0
    visible = visible_mask(depth, model_depth, camera)
    shown = bool(visible.any())
    count_all = int(np.count_nonzero(window_depth))
    count_visible = int(np.count_nonzero(visible))
    info = {
        "bbox_obj": bounding_box(window_depth > 0, left, top) if shown else NO_BOX,
        "bbox_visib": bounding_box(visible) if shown else NO_BOX,
        "px_count_all": count_all,
        "px_count_valid": int(np.count_nonzero(depth[mask])),
        "px_count_visib": count_visible,
        "visib_fract": count_visible / count_all if count_all else 0.0,
    }
    return Appearance(mask, visible, info)


def silhouette_window(
    model: ObjectModel, camera: Intrinsics, T_camera_object: NDArray[np.float64]
) -> tuple[int, int, int, int]:
    """The part of the canvas that can hold the silhouette: left, top, width, height in the image's pixels."""
    low = np.array([-camera.width, -camera.height])
    high = np.array([2 * camera.width, 2 * camera.height]) - 1
    vertices = pose.apply(T_camera_object, model.vertices)
    if vertices[:, 2].min() > NEAR:  # else the silhouette's ends are not those of projected vertices
        pixels = project(vertices, camera)
        low, high = (
            np.clip(np.floor(pixels.min(axis=0)), low, high).astype(int),
            np.clip(np.ceil(pixels.max(axis=0)), low, high).astype(int),
        )
    width, height = high - low + 1
    return int(low[0]), int(low[1]), int(width), int(height)


def pasted(window: NDArray[np.float32], left: int, top: int, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """An image of the given shape, 0 but for the window, whose part outside of it is cut off."""
    image = np.zeros(shape, dtype=np.float32)
    rows = slice(max(top, 0), min(top + window.shape[0], shape[0]))
    columns = slice(max(left, 0), min(left + window.shape[1], shape[1]))
    if rows.start < rows.stop and columns.start < columns.stop:
        image[rows, columns] = window[
            rows.start - top : rows.stop - top, columns.start - left : columns.stop - left
        ]
    return image


def visible_mask(observed: NDArray[np.float32], rendered: NDArray[np.float32], camera: Intrinsics) -> Mask:
    """Where the rendered surface is visible: not more than `TOLERANCE` behind the observed one.

    Depths (H, W) are compared along the pixels' rays, and a pixel without a measurement counts as visible:
    the rule "bop19" of bop_toolkit's `visibility.py`.
    """
    behind = (rendered - observed) * ray_lengths(camera)
    return (rendered > 0) & ((observed == 0) | (behind <= TOLERANCE))


def ray_lengths(camera: Intrinsics) -> NDArray[np.float64]:
    """Distance from the camera's centre (H, W) of what each pixel sees at depth 1."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    return np.sqrt(x**2 + (y**2)[:, None] + 1.0)


def bounding_box(mask: Mask, left: int = 0, top: int = 0) -> list[int]:
    """Box x, y, width, height of a mask whose first pixel is (left, top) of the image.

    Width and height are last minus first pixel, as bop_toolkit has them: a single pixel has none.
    """
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    return [
        int(columns[0]) + left,
        int(rows[0]) + top,
        int(columns[-1] - columns[0]),
        int(rows[-1] - rows[0]),
    ]
