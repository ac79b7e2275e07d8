"""Which degrees of freedom a drag used. A viser gizmo does not say which handle was held: the poses do."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core import pose

TRANSLATION_THRESHOLD = 1e-4
"""Metres; less than that is rounding on the way through the browser."""
ROTATION_THRESHOLD = 1e-3
"""Radians."""


def degrees_of_freedom(
    T_start: NDArray[np.float64], T_end: NDArray[np.float64], pivot: NDArray[np.float64]
) -> tuple[str, ...]:
    """Names among tx, ty, tz, rx, ry, rz, in the axes that the gizmo had when the drag began.

    Args:
        T_start: The object's pose (4, 4) before, in any frame.
        T_end: Its pose after, in the same frame.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
    """
    difference = pose.inverse(T_start) @ T_end
    translation = pose.apply(difference, pivot) - pivot
    rotation = Rotation.from_matrix(difference[:3, :3]).as_rotvec()
    moved = [f"t{axis}" for axis, v in zip("xyz", translation, strict=True) if abs(v) > TRANSLATION_THRESHOLD]
    turned = [f"r{axis}" for axis, v in zip("xyz", rotation, strict=True) if abs(v) > ROTATION_THRESHOLD]
    return tuple(moved + turned)
