"""Where an object stands when its registration begins: in view, before the scene, upright."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose

THREE_QUARTER_VIEW = Rotation.from_euler("ZX", [135, -120], degrees=True).inv().as_matrix()
"""R_camera_object of an object that stands on its z axis, seen from 30 degrees above, between its x and y
axes: so the handles of a gizmo in the object's axes do not hide each other."""
MIDDLE_SHARE = 0.4
"""Of the image's width and height: the part in which the scene's distance is looked up."""
DISTANCE_WITHOUT_DEPTH = 1.0
"""Metres."""


def start_pose(
    model: ObjectModel, depth: NDArray[np.float32], camera: Intrinsics, T_world_camera: NDArray[np.float64]
) -> NDArray[np.float64]:
    """T_world_object (4, 4) of a mesh put in the middle of the image, just before what is seen there.

    Args:
        model: The object.
        depth: (H, W), metres, 0 = no measurement.
        camera: Of the depth image.
        T_world_camera: The camera's pose (4, 4).
    """
    distance = _distance_in_the_middle(depth)
    ray = np.array(
        [(camera.width / 2 - camera.cx) / camera.fx, (camera.height / 2 - camera.cy) / camera.fy, 1.0]
    )
    z = max(distance - model.radius, 2.0 * model.radius)
    T_camera_object = pose.from_rotation_translation(
        THREE_QUARTER_VIEW, ray * z - THREE_QUARTER_VIEW @ model.centre
    )
    return T_world_camera @ T_camera_object


def _distance_in_the_middle(depth: NDArray[np.float32]) -> float:
    height, width = depth.shape
    rows, columns = int(height * MIDDLE_SHARE / 2), int(width * MIDDLE_SHARE / 2)
    middle = depth[height // 2 - rows : height // 2 + rows, width // 2 - columns : width // 2 + columns]
    for part in (middle, depth):
        if (part > 0).any():
            return float(np.median(part[part > 0]))
    return DISTANCE_WITHOUT_DEPTH
