"""Pictures of objects that did not pass the gate: where they were put, drawn into what the camera saw."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import binary_dilation

from app.export.content.selection import Annotation, ExportImage
from app.storage.files import FileStore
from registration_core import ObjectModel
from registration_core.bop.dataset import read_color, read_depth
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

OUTLINE = (255, 176, 96)
"""The colour of poses that a person made, as in the 3-D view."""
WIDTH = 2
"""Pixels of the line."""
MARGIN = 0.6
"""Of the object's box that is shown about it."""
SMALLEST = 32
"""Pixels of a box about which the margin is reckoned."""
LARGEST = (480, 360)
"""Pixels."""


def failure_picture(
    image: ExportImage, annotation: Annotation, model: ObjectModel, files: FileStore
) -> bytes:
    """A JPEG of the part of an image where an annotation lies, with its outline."""
    T_camera_object = pose.inverse(image.T_world_camera) @ annotation.T_world_object
    picture = _seen(image, files).copy()
    inside = np.zeros(picture.shape[:2], dtype=bool)
    if pose.is_within_reach(T_camera_object):
        inside = render_depth(model, image.camera, T_camera_object) > 0
    picture[binary_dilation(inside, iterations=WIDTH) & ~inside] = OUTLINE
    shown = Image.fromarray(_part(picture, inside))
    shown.thumbnail(LARGEST)
    content = io.BytesIO()
    shown.save(content, "jpeg", quality=85)
    return content.getvalue()


def _seen(image: ExportImage, files: FileStore) -> NDArray[np.uint8]:
    """The picture, or the depth image in grey, nearer brighter."""
    if image.color_hash is not None:
        return read_color(files.path(image.color_hash))
    depth = read_depth(files.path(image.depth_hash), image.depth_scale)
    farthest = max(float(depth.max()), 1e-6)
    grey = np.where(depth > 0, 255 * (1.0 - 0.8 * depth / farthest), 0).astype(np.uint8)
    return np.stack([grey] * 3, axis=-1)


def _part(picture: NDArray[np.uint8], inside: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """The object's surroundings; the whole picture where it is not in it."""
    rows, columns = np.nonzero(inside)
    if not len(rows):
        return picture
    top, bottom = int(rows.min()), int(rows.max())
    left, right = int(columns.min()), int(columns.max())
    margin = int(MARGIN * max(bottom - top, right - left, SMALLEST))
    return picture[max(top - margin, 0) : bottom + margin, max(left - margin, 0) : right + margin]
