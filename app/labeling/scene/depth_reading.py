"""How well the depth image of a frame agrees with one object at a pose; the last answer is kept."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.depth_verdicts import DepthAgreement, depth_agreement

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DepthView:
    """One depth image and its camera."""

    depth: NDArray[np.float32]
    """(H, W), metres, 0 where there is none."""
    camera: Intrinsics
    T_world_camera: Array


class DepthReading:
    """Compares an object with depth images: for the page's numbers and for the colours in the 3-D view.

    Args:
        model: Gives the object's mesh, coarse enough to be drawn many times a second.
        view: Gives a frame's depth image by the frame's id.
    """

    def __init__(self, model: Callable[[], ObjectModel], view: Callable[[int], DepthView]) -> None:
        self._model = model
        self._view = view
        self._read = lru_cache(maxsize=2)(self._compare)

    def of(self, frame_id: int, T_world_object: Array) -> DepthAgreement:
        """What a frame's depth says of the object at a pose."""
        return self._read(frame_id, T_world_object.tobytes())

    def surface(self, frame_id: int, T_world_object: Array) -> Array:
        """The points (N, 3) of that agreement in the object's frame, metres."""
        view = self._view(frame_id)
        T_object_camera = pose.inverse(T_world_object) @ view.T_world_camera
        return pose.apply(T_object_camera, self.of(frame_id, T_world_object).points(view.camera))

    def _compare(self, frame_id: int, pose_bytes: bytes) -> DepthAgreement:
        view = self._view(frame_id)
        T_world_object = np.frombuffer(pose_bytes).reshape(4, 4)
        T_camera_object = pose.inverse(view.T_world_camera) @ T_world_object
        return depth_agreement(self._model(), view.depth, view.camera, T_camera_object)
