"""Where a snap begins: the truth, moved and turned by exactly as much as a shell says."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.camera import project

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Shell:
    """How far off the truth starts are."""

    translation: float
    """Of the centre of the object's bounding box, metres."""
    rotation: float
    """About that centre, radians."""

    def __str__(self) -> str:
        length = (
            f"{1000 * self.translation:.0f} mm"
            if self.translation < 0.01
            else f"{100 * self.translation:.0f} cm"
        )
        return f"{length}/{np.degrees(self.rotation):.0f}°"


SHELLS = (
    Shell(0.02, np.radians(15.0)),
    Shell(0.05, np.radians(30.0)),
    Shell(0.10, np.radians(60.0)),
    Shell(0.15, np.radians(90.0)),
)
NEAR, MIDDLE, FAR, FARTHEST = SHELLS
GOOD = Shell(0.002, np.radians(2.0))
"""As far off as a good pose may be."""

NEAREST = 0.1
"""Metres: a start's centre lies beyond this, and within the image, or nobody would see it."""


def starts(
    T_camera_object: Array, model: ObjectModel, camera: Intrinsics, shell: Shell, count: int, seed: int
) -> list[Array]:
    """Poses (4, 4) on a shell about the true one; the first ones are the same for every count.

    The object turns about its centre, not about the origin of its mesh, which may lie far outside of it.
    """
    assert is_in_view(pose.apply(T_camera_object, model.centre), camera)
    rng = np.random.default_rng([seed, round(1e4 * shell.translation), round(1e4 * shell.rotation)])
    T_object_centre = pose.from_rotation_translation(np.eye(3), model.centre)
    truth = T_camera_object @ T_object_centre
    found: list[Array] = []
    while len(found) < count:
        T_camera_centre = pose.perturbed(truth, shell.translation, shell.rotation, rng)
        if is_in_view(T_camera_centre[:3, 3], camera):
            found.append(T_camera_centre @ pose.inverse(T_object_centre))
    return found


def is_in_view(centre: Array, camera: Intrinsics) -> bool:
    """Whether a point (3,), camera axes, metres, lies before the camera and within its image."""
    if centre[2] < NEAREST:
        return False
    column, row = project(centre, camera)
    return bool(0 <= column < camera.width and 0 <= row < camera.height)
