"""What objects of known pose account for in a depth image."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from registration_core.camera import Intrinsics
from registration_core.object_model import ObjectModel
from registration_core.rasterizer import render_depth

TOLERANCE = 0.008
"""Metres: a known pose is right to about 5 mm, and depth sensors err by 1 to 3 mm at a metre."""
BLUR = 5
"""Pixels: an outline may lie off by two to each side, so the depth of the neighbours counts as well."""


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
        nearest = minimum_filter(np.where(drawn > 0, drawn, np.float32(np.inf)), BLUR)
        farthest = maximum_filter(drawn, BLUR)  # 0 where nothing is drawn nearby
        explained |= (depth > nearest - TOLERANCE) & (depth < farthest + TOLERANCE)
    return explained & (depth > 0)
