"""Rigid poses in SE(3) as (4, 4) float64 arrays; twists are (translation [m], rotation vector [rad])."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


FARTHEST = 1e8
"""Metres; what is computed from a pose farther away overflows."""


class PoseDistance(NamedTuple):
    """How far two poses are apart."""

    translation: float
    """Euclidean distance of the origins, metres."""
    rotation: float
    """Geodesic angle between the rotations, radians."""


def from_rotation_translation(rotation: ArrayLike, translation: ArrayLike) -> Array:
    """Pose (4, 4) from a rotation matrix (3, 3) and a translation (3,) in metres."""
    T = np.eye(4)
    T[:3, :3] = rotation
    T[:3, 3] = translation
    return T


def is_within_reach(T: Array) -> bool:
    """Whether something at this pose (4, 4) is where anything can be computed of it."""
    return bool(np.abs(T).max() <= FARTHEST)  # false for NaN as well


def inverse(T: Array) -> Array:
    """Inverse of rigid poses (..., 4, 4), without a linear solve."""
    R_transposed = np.swapaxes(T[..., :3, :3], -1, -2)
    inverted = np.zeros_like(T)
    inverted[..., :3, :3] = R_transposed
    inverted[..., :3, 3] = -np.einsum("...ij,...j->...i", R_transposed, T[..., :3, 3])
    inverted[..., 3, 3] = 1.0
    return inverted


def apply(T: Array, points: ArrayLike) -> Array:
    """Transform points (..., 3) by one pose (4, 4): `p_a = T_a_b @ p_b`."""
    return np.asarray(points, dtype=np.float64) @ T[:3, :3].T + T[:3, 3]


def exp(twist: ArrayLike) -> Array:
    """Pose whose translation is `twist[:3]` [m] and whose rotation vector is `twist[3:]` [rad].

    Translation and rotation are kept apart (the group R^3 x SO(3)), as in `Estimate.covariance`.
    """
    twist = np.asarray(twist, dtype=np.float64)
    return from_rotation_translation(Rotation.from_rotvec(twist[3:]).as_matrix(), twist[:3])


def log(T: Array) -> Array:
    """Twist (6,) of a pose: the inverse of `exp` for rotations below pi."""
    return np.concatenate([T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_rotvec()])


def distance(T_a: Array, T_b: Array) -> PoseDistance:
    """Distance of two poses: metres between the origins, radians between the rotations."""
    return PoseDistance(
        float(np.linalg.norm(T_a[:3, 3] - T_b[:3, 3])), rotation_angle(T_a[:3, :3].T @ T_b[:3, :3])
    )


def rotation_angle(R: Array) -> float:
    """Angle in [0, pi] of one rotation matrix (3, 3); exact near 0 and near pi."""
    axis = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(np.linalg.norm(axis), np.trace(R) - 1.0))


def mean(T: Array, weights: ArrayLike | None = None) -> Array:
    """Weighted mean of poses (N, 4, 4): mean translation and chordal L2 mean rotation."""
    weights = np.ones(len(T)) if weights is None else np.asarray(weights, dtype=np.float64)
    rotation = Rotation.from_matrix(T[:, :3, :3]).mean(weights).as_matrix()
    return from_rotation_translation(rotation, np.average(T[:, :3, 3], axis=0, weights=weights))


def orthonormalised(T: Array) -> Array:
    """The rigid poses nearest to T (..., 4, 4), which are rigid up to rounding."""
    u, _, v = np.linalg.svd(T[..., :3, :3])
    rigid = T.copy()
    rigid[..., :3, :3] = u @ v
    return rigid


def perturbed(T: Array, translation: float, rotation: float, rng: np.random.Generator) -> Array:
    """T moved by exactly `translation` [m] and `rotation` [rad] about its origin, in random directions."""
    direction, axis = rng.normal(size=(2, 3))
    twist = np.concatenate(
        [
            translation * direction / np.linalg.norm(direction),
            rotation * axis / np.linalg.norm(axis),
        ]
    )
    moved = T.copy()
    step = exp(twist)
    moved[:3, :3] = step[:3, :3] @ T[:3, :3]
    moved[:3, 3] += step[:3, 3]
    return moved


def checked(T: ArrayLike, name: str) -> Array:
    """T as a rigid (4, 4) float64 pose with its rounding removed.

    Raises:
        ValueError: naming `name`, where T has another shape, is not finite, or is no rigid transform.
    """
    try:
        pose = np.asarray(T, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{name} must be a 4x4 matrix of numbers") from None
    if pose.shape != (4, 4):
        raise ValueError(f"{name} must be a 4x4 matrix; it has shape {pose.shape}")
    if not np.isfinite(pose).all():
        raise ValueError(f"{name} must hold finite numbers only; it has a NaN or an infinity")
    if not np.allclose(pose[3], [0.0, 0.0, 0.0, 1.0], atol=1e-6):
        raise ValueError(f"{name} must end in the row 0 0 0 1; its last row is {pose[3].tolist()}")
    R = pose[:3, :3]
    if not np.allclose(R @ R.T, np.eye(3), atol=1e-3):
        raise ValueError(f"{name} must be a rigid transform; its rotation part scales or shears")
    if np.linalg.det(R) < 0:
        raise ValueError(f"{name} must be a rigid transform; its rotation part is a reflection")
    return orthonormalised(pose)
