"""A drag under way: where it began, where it is, and the way between."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from app.labeling.moves.degrees_of_freedom import GizmoAxes, degrees_of_freedom
from app.storage.event_log import NewEvent
from app.storage.roles import Actor
from registration_core.geometry import pose

Array = NDArray[np.float64]


class Drag:
    """Follows T_world_object from the moment the gizmo is held, on a clock that tells seconds."""

    def __init__(self, T_world_object: Array, axes: GizmoAxes, now: Callable[[], float]) -> None:
        self._T_start = T_world_object
        self._axes = axes
        self._now = now
        self._began = now()
        self._path = [[0.0, *_path_row(T_world_object)]]
        self.T_now = T_world_object

    def move(self, T_world_object: Array) -> None:
        """The object is here now; out of reach, it stays where it was."""
        if not pose.is_within_reach(T_world_object):
            return
        self.T_now = T_world_object
        self._path.append([round(self._now() - self._began, 4), *_path_row(T_world_object)])

    def event(self, pivot: Array) -> NewEvent | None:
        """The drag as it is logged; None where it moved nothing.

        Args:
            pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        """
        dof = degrees_of_freedom(self._T_start, self.T_now, pivot, self._axes)
        if not dof:
            return None
        return NewEvent(
            kind="drag",
            actor=Actor.HUMAN,
            T_before=self._T_start.tolist(),
            T_after=self.T_now.tolist(),
            dof=dof,
            path=self._path,
            duration_seconds=self._now() - self._began,
            detail={"axes": self._axes},
        )


def _path_row(T: Array) -> list[float]:
    quaternion = Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)
    return [round(float(value), 6) for value in (*T[:3, 3], *quaternion)]
