"""Which degrees of freedom a drag used. A viser gizmo does not say which handle was held: the poses do."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose

Array = NDArray[np.float64]

TRANSLATION_THRESHOLD = 1e-4
"""Metres; less than that is rounding on the way through the browser."""
ROTATION_THRESHOLD = 1e-3
"""Radians."""


GizmoAxes = Literal["object", "world"]
"""Along which axes the gizmo's arrows lie."""


@dataclass(frozen=True)
class GizmoMotion:
    """How a drag moved the gizmo, in the axes that it had when the drag began; what is mere rounding is 0."""

    translation: Array
    """(3,), metres."""
    rotation: Array
    """(3,), rotation vector, radians."""


def gizmo_motion(T_start: Array, T_end: Array, pivot: Array, axes: GizmoAxes = "object") -> GizmoMotion:
    """How the gizmo moved.

    Args:
        T_start: The object's pose (4, 4) before, in any frame.
        T_end: Its pose after, in the same frame.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        axes: The gizmo's.
    """
    difference = pose.inverse(T_start) @ T_end
    translation = pose.apply(difference, pivot) - pivot
    rotation = Rotation.from_matrix(difference[:3, :3]).as_rotvec()
    if axes == "world":
        translation, rotation = T_start[:3, :3] @ translation, T_start[:3, :3] @ rotation
    return GizmoMotion(
        np.where(np.abs(translation) > TRANSLATION_THRESHOLD, translation, 0.0),
        np.where(np.abs(rotation) > ROTATION_THRESHOLD, rotation, 0.0),
    )


def degrees_of_freedom(
    T_start: Array, T_end: Array, pivot: Array, axes: GizmoAxes = "object"
) -> tuple[str, ...]:
    """Names among tx, ty, tz, rx, ry, rz of what a `gizmo_motion` changed."""
    motion = gizmo_motion(T_start, T_end, pivot, axes)
    changes = {"t": motion.translation, "r": motion.rotation}
    return tuple(
        f"{letter}{axis}"
        for letter, change in changes.items()
        for axis, amount in zip("xyz", change, strict=True)
        if amount
    )
