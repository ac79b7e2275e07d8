"""A pose over time: knots, between which it moves evenly; a jump is two knots at one time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Knots of a pose in the order of time."""

    seconds: Array
    """(K,), ascending; of knots at one time the last one counts from then on."""
    positions: Array
    """(K, 3), metres."""
    rotations: Array
    """(K, 4), quaternions wxyz."""

    def at(self, seconds: ArrayLike) -> Array:
        """The poses (M, 4, 4) at these times (M,); before the first knot and after the last one it rests."""
        times = np.asarray(seconds, dtype=np.float64)
        last = len(self.seconds) - 1
        before = np.clip(np.searchsorted(self.seconds, times, side="right") - 1, 0, last)
        after = np.minimum(before + 1, last)
        span = self.seconds[after] - self.seconds[before]
        share = np.clip((times - self.seconds[before]) / np.where(span > 0, span, np.inf), 0.0, 1.0)[:, None]
        start = Rotation.from_quat(self.rotations[before], scalar_first=True)
        end = Rotation.from_quat(self.rotations[after], scalar_first=True)
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = (start * Rotation.from_rotvec(share * (start.inv() * end).as_rotvec())).as_matrix()
        T[:, :3, 3] = (1.0 - share) * self.positions[before] + share * self.positions[after]
        return T


class MotionWriter:
    """Puts knots together, in the order of time."""

    def __init__(self, T_start: ArrayLike) -> None:
        self._rows: list[list[float]] = []
        self._last = 0.0
        self._present = self._row(T_start)
        self._add(0.0, self._present)

    def jump(self, seconds: float, T: ArrayLike) -> None:
        """From this time on the object is at the pose T (4, 4)."""
        self._add(seconds, self._present)
        self._present = self._row(T)
        self._add(seconds, self._present)

    def follow(self, seconds: float, path: ArrayLike, T_end: ArrayLike) -> None:
        """From this time on the object takes a path (N, 8): seconds since then, x, y, z, wxyz; to T_end."""
        self._add(seconds, self._present)
        for since, *row in np.asarray(path, dtype=np.float64).reshape(-1, 8).tolist():
            self._add(seconds + since, row)
        self._present = self._row(T_end)
        self._add(self._last, self._present)

    def motion(self) -> Motion:
        """What was put together."""
        rows = np.array(self._rows)
        return Motion(rows[:, 0], rows[:, 1:4], rows[:, 4:])

    def _add(self, seconds: float, row: list[float]) -> None:
        self._last = max(seconds, self._last)
        self._rows.append([self._last, *row])

    @staticmethod
    def _row(T: ArrayLike) -> list[float]:
        matrix = np.asarray(T, dtype=np.float64)
        quaternion = Rotation.from_matrix(matrix[:3, :3]).as_quat(scalar_first=True)
        return [*matrix[:3, 3].tolist(), *quaternion.tolist()]
