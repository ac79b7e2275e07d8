"""Where the 3-D view is looked at from. Points are (3,) in the world's frame, metres."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose

Array = NDArray[np.float64]

FRAMING = 2.0
"""How much room around an object that is zoomed to: the view's height over the object's."""
WIDE_FRAMING = 3.5
"""The same where its surroundings are to be seen too."""
OFF_THE_POLE = np.radians(1.0)
"""A view from the top looks from a little to the sensor's side, or its turn about the vertical is unknown."""


@dataclass(frozen=True)
class Viewpoint:
    """The camera of the 3-D view, and what it turns about."""

    T_world_camera: Array
    """(4, 4)."""
    distance: float
    """From the camera to the point in the middle of the view that it turns about, metres."""
    up: Array
    """(3,), unit: the axis that it turns about."""
    field_of_view: float
    """Vertical, radians."""
    aspect: float
    """Width over height."""

    @property
    def position(self) -> Array:
        """Of the camera (3,)."""
        return self.T_world_camera[:3, 3]

    @property
    def target(self) -> Array:
        """The point (3,) that the camera looks at and turns about."""
        return pose.apply(self.T_world_camera, [0.0, 0.0, self.distance])

    def ray(self, across: float, down: float) -> Array:
        """Direction (3,) of what is seen at a place of the picture, as shares of its width and height."""
        half_height = np.tan(self.field_of_view / 2.0)
        x, y = (2.0 * across - 1.0) * half_height * self.aspect, (2.0 * down - 1.0) * half_height
        return self.T_world_camera[:3, :3] @ np.array([x, y, 1.0])

    def framing(self, radius: float, room: float) -> float:
        """The distance at which a sphere of this radius fills one part in `room` of the view's height."""
        return room * radius / float(np.tan(self.field_of_view / 2.0))


def from_sensor(viewpoint: Viewpoint, T_world_sensor: Array, centre: Array) -> Viewpoint:
    """What the sensor at T_world_sensor (4, 4) saw; the view then turns about a point as far as `centre`."""
    distance = max(float(pose.apply(pose.inverse(T_world_sensor), centre)[2]), 0.1)
    return replace(
        viewpoint, T_world_camera=T_world_sensor, distance=distance, up=-T_world_sensor[:3, 1].copy()
    )


def facing(viewpoint: Viewpoint, centre: Array, outward: Array, up: Array, distance: float) -> Viewpoint:
    """A look at `centre` from the direction `outward` (3,), which is not along `up` (3,), any lengths."""
    forward = -outward / np.linalg.norm(outward)
    right = np.cross(forward, up)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    return replace(
        viewpoint,
        T_world_camera=pose.from_rotation_translation(rotation, centre - distance * forward),
        distance=distance,
        up=up / np.linalg.norm(up),
    )


def from_side(
    viewpoint: Viewpoint, side: str, centre: Array, radius: float, T_world_sensor: Array, up: Array
) -> Viewpoint:
    """A look at an object from the "top", the "front" or the "side" of what it stands on.

    Args:
        viewpoint: As it is.
        side: Front is where the sensor stands, and side is to the right of that.
        centre: (3,), of the object.
        radius: Of the object, metres.
        T_world_sensor: (4, 4).
        up: (3,), unit: the normal of what the object stands on.
    """
    towards_sensor = T_world_sensor[:3, 3] - centre
    front = towards_sensor - (towards_sensor @ up) * up
    if np.linalg.norm(front) < 0.1 * np.linalg.norm(towards_sensor):  # it looks straight down
        front = T_world_sensor[:3, 1] - (T_world_sensor[:3, 1] @ up) * up
    front /= np.linalg.norm(front)
    outward = {
        "top": np.cos(OFF_THE_POLE) * up + np.sin(OFF_THE_POLE) * front,
        "front": front,
        "side": np.cross(up, front),
    }[side]
    return facing(viewpoint, centre, outward, up, viewpoint.framing(radius, WIDE_FRAMING))


def closer(viewpoint: Viewpoint, centre: Array, radius: float) -> Viewpoint:
    """The same direction, at an object, so near that it fills the view."""
    distance = viewpoint.framing(radius, FRAMING)
    T = pose.from_rotation_translation(
        viewpoint.T_world_camera[:3, :3], centre - distance * viewpoint.T_world_camera[:3, 2]
    )
    return replace(viewpoint, T_world_camera=T, distance=distance)


def turned(viewpoint: Viewpoint, centre: Array, angle: float) -> Viewpoint:
    """Gone around a point by an angle, radians, counter-clockwise seen from above."""
    R = Rotation.from_rotvec(angle * viewpoint.up).as_matrix()
    around = pose.from_rotation_translation(R, centre - R @ centre)
    return replace(viewpoint, T_world_camera=around @ viewpoint.T_world_camera)
