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
    """Errors of poses T (M, 4, 4) against one (4, 4) of an object with symmetries (S, 4, 4)."""
    twins = T_truth[:3, :3] @ symmetries[:, :3, :3]
    traces = np.einsum("mij,sij->ms", T[:, :3, :3], twins).max(axis=1)
    return PoseErrors(
        np.linalg.norm(T[:, :3, 3] - T_truth[:3, 3], axis=1),
        np.arccos(np.clip((traces - 1.0) / 2.0, -1.0, 1.0)),
    )
