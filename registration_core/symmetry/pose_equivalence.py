"""Whether two poses of an object are one and the same, as far as anybody could tell."""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry.object_model import ObjectModel
from registration_core.geometry.pose_error import mssd

Array = NDArray[np.float64]

LARGEST_SHARE = 0.05
"""Of the object's diameter: up to such an MSSD a snap's confidence calls both poses right."""

SamePose = Callable[[Array, Array], bool]
"""Tells it of two poses T_world_object (4, 4)."""


def same_pose_of(model: ObjectModel) -> SamePose:
    """How poses of this object are compared: by the corners of its bounding box."""
    sides = zip(model.vertices.min(axis=0), model.vertices.max(axis=0), strict=True)
    corners = np.array(list(product(*sides)))

    def same(T_a: Array, T_b: Array) -> bool:
        return mssd(T_a, T_b, corners, model.symmetry_transforms) < LARGEST_SHARE * model.diameter

    return same
