"""What objects of known pose account for in a depth image."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.rasterizer import render_depth

TOLERANCE = 0.006
"""Metres: a known pose is right to a few millimetres, and depth sensors err by 1 to 3 at a metre. More would
take surface away from what stands beside it."""
BLUR = 3
"""Pixels: an outline may lie off by one to each side, so the depth of the neighbours counts as well."""


def explained_pixels(
    depth: NDArray[np.float32],
    camera: Intrinsics,
    known: Sequence[tuple[ObjectModel, NDArray[np.float64]]],
) -> NDArray[np.bool_]:
    """Where a depth image (H, W), metres, shows one of the known objects: (H, W).

    Args:
        known: each object with its `T_camera_object` (4, 4).
    """
    explained = np.zeros(depth.shape, dtype=np.bool_)
    for model, T_camera_object in known:
        drawn = render_depth(model, camera, T_camera_object)
        part = _around(drawn > 0)
        surface, seen = drawn[part], depth[part]
        nearest = minimum_filter(np.where(surface > 0, surface, np.float32(np.inf)), BLUR)
        farthest = maximum_filter(surface, BLUR)
        explained[part] |= (seen > nearest - TOLERANCE) & (seen < farthest + TOLERANCE)
    return explained & (depth > 0)


def _around(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    """The rectangle that holds what is set and BLUR pixels around it; empty where nothing is."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return slice(0), slice(0)
    return (
        slice(max(rows[0] - BLUR, 0), rows[-1] + BLUR + 1),
        slice(max(columns[0] - BLUR, 0), columns[-1] + BLUR + 1),
    )
