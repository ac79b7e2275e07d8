"""A pose over time: knots, between which it moves evenly; a jump is two knots at one time."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

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
        T = np.tile(np.eye(4), (len(times), 1, 1))
        T[:, :3, :3] = Rotation.from_quat(self.rotations[before], scalar_first=True).as_matrix()
        turning = share[:, 0] > 0.0  # between two knots; most of the time a pose rests on one
        start = Rotation.from_quat(self.rotations[before[turning]], scalar_first=True)
        end = Rotation.from_quat(self.rotations[after[turning]], scalar_first=True)
        turn = Rotation.from_rotvec(share[turning] * (start.inv() * end).as_rotvec())
        T[turning, :3, :3] = (start * turn).as_matrix()
        T[:, :3, 3] = (1.0 - share) * self.positions[before] + share * self.positions[after]
        return T


class MotionWriter:
    """Puts knots together, in the order of time; one that comes late counts from when the one before did."""

    def __init__(self, T_start: ArrayLike) -> None:
        self._seconds: list[float] = []
        self._rows: list[Sequence[float]] = []
        """Of each knot: any number, x, y, z, wxyz."""
        self._poses: list[ArrayLike] = []
        self._unfilled: list[list[float]] = []
        """Poses (4, 4), and their rows, which are filled in all together at the end: one by one is slow."""
        self._present = self._row(T_start)
        self._add(0.0)

    def jump(self, seconds: float, T: ArrayLike) -> None:
        """From this time on the object is at the pose T (4, 4)."""
        self._add(seconds)
        self._present = self._row(T)
        self._add(seconds)

    def follow(self, seconds: float, path: Sequence[Sequence[float]], T_end: ArrayLike) -> None:
        """From this time on the object takes a path (N, 8): seconds since then, x, y, z, wxyz; to T_end."""
        self._add(seconds)
        self._seconds += [seconds + row[0] for row in path]
        self._rows += path
        self._present = self._row(T_end)
        self._add(self._seconds[-1])

    def motion(self) -> Motion:
        """What was put together."""
        matrices = np.array(self._poses, dtype=np.float64)
        quaternions = Rotation.from_matrix(matrices[:, :3, :3]).as_quat(scalar_first=True)
        numbers = np.column_stack([np.zeros(len(matrices)), matrices[:, :3, 3], quaternions])
        for row, filled in zip(self._unfilled, numbers.tolist(), strict=True):
            row[:] = filled
        count = len(self._rows)
        knots = np.fromiter(chain.from_iterable(self._rows), np.float64, 8 * count).reshape(count, 8)
        return Motion(np.maximum.accumulate(self._seconds), knots[:, 1:4], knots[:, 4:])

    def _add(self, seconds: float) -> None:
        self._seconds.append(seconds)
        self._rows.append(self._present)

    def _row(self, T: ArrayLike) -> list[float]:
        row: list[float] = []
        self._poses.append(T)
        self._unfilled.append(row)
        return row
