"""What is not known about an estimated pose: how far off it may be, and what depth cannot tell."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincinv

from app.confidence.ambiguity_words import SHARE, Kind, Motion, axis_name, reach
from app.storage.tables import Pose

Array = NDArray[np.float64]

REACH = float(np.sqrt(2.0 * gammaincinv(3.0 / 2.0, SHARE)))
"""Standard deviations, in space: the root of the quantile of chi-square with three degrees of freedom."""


class EstimateLike(Protocol):
    """What has to be known of an estimate."""

    @property
    def T_world_object(self) -> Pose: ...
    @property
    def covariance(self) -> list[Any]: ...
    @property
    def ambiguities(self) -> list[Any] | None: ...


@dataclass(frozen=True, eq=False)
class UnknownMotion:
    """A motion of the object that depth cannot tell from none."""

    kind: Kind
    motion: Motion
    axis: Array
    """(3,), direction in the world."""
    extent: float
    """Radians or metres: where another mode lies, or how far to either side a free motion reaches."""
    axis_name: str


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Where the object may be, in the world."""

    centre: Array
    """(3,), the middle of the object, metres."""
    ellipsoid: Array
    """(3, 3), its columns are the semi-axes of the region that the middle lies in, metres."""
    rotation: float
    """Radians: the largest turn within the region of rotations."""
    unknown: tuple[UnknownMotion, ...]

    @property
    def translation(self) -> float:
        """Metres: the longest semi-axis."""
        return float(np.linalg.norm(self.ellipsoid, axis=0).max())


def uncertainty_of(estimate: EstimateLike, T_world_camera: Array, centre: Array, sides: Array) -> Uncertainty:
    """What an estimate says of its own pose.

    Args:
        estimate: Its covariance (6, 6) is in camera axes: the translation of the origin, then the turn.
        T_world_camera: (4, 4), of the frame that it was made with.
        centre: (3,), the middle of the object in its mesh's frame, metres.
        sides: (3,), of its bounding box there, metres.
    """
    T_world_object = np.array(estimate.T_world_object)
    R_world_camera = T_world_camera[:3, :3]
    x, y, z = R_world_camera.T @ T_world_object[:3, :3] @ centre
    # t_centre = t_origin + R centre, and a small turn w moves R centre by w x (R centre)
    jacobian = np.hstack([np.eye(3), [[0, z, -y], [-z, 0, x], [y, -x, 0]]])
    covariance = np.array(estimate.covariance)
    in_world = R_world_camera @ jacobian @ covariance @ jacobian.T @ R_world_camera.T
    variances, axes = np.linalg.eigh(in_world)
    turns = np.linalg.eigvalsh(covariance[3:, 3:])
    return Uncertainty(
        centre=T_world_object[:3, :3] @ centre + T_world_object[:3, 3],
        ellipsoid=REACH * axes * np.sqrt(np.maximum(variances, 0.0)),
        rotation=min(np.pi, REACH * float(np.sqrt(max(turns[-1], 0.0)))),
        unknown=tuple(_unknown(entry, T_world_object[:3, :3], sides) for entry in estimate.ambiguities or ()),
    )


def _unknown(entry: dict[str, Any], R_world_object: Array, sides: Array) -> UnknownMotion:
    return UnknownMotion(
        kind=entry["kind"],
        motion=entry["motion"],
        axis=R_world_object @ np.array(entry["axis"]),
        extent=reach(entry["kind"], entry["motion"], entry["extent"]),
        axis_name=axis_name(entry["axis"], sides),
    )
