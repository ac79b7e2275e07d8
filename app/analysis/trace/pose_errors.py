"""How far many poses are from one."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class PoseErrors(NamedTuple):
    """Of each of M poses."""

    translation: Array
    """(M,), metres between the object's origins."""
    rotation: Array
    """(M,), radians, the least over the object's symmetries."""


def pose_errors(T: Array, T_truth: Array, symmetries: Array) -> PoseErrors:
    """Errors of poses T (M, 4, 4) against one (4, 4) of an object with symmetries (S, 4, 4).

    Both are taken to the same twin, the one that is turned least: a symmetry about an axis beside the origin
    moves the origin too.
    """
    twins = T_truth @ symmetries
    traces = T[:, :3, :3].reshape(-1, 9) @ twins[:, :3, :3].reshape(-1, 9).T
    nearest = traces.argmax(axis=1)
    cosines = (traces.max(axis=1) - 1.0) / 2.0
    return PoseErrors(
        np.linalg.norm(T[:, :3, 3] - twins[nearest, :3, 3], axis=1),
        np.arccos(np.clip(cosines, -1.0, 1.0)),
    )
