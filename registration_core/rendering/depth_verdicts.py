"""How well depth agrees with an object at a pose, pixel by pixel, in words and numbers for people.

Where a snap weighs candidates against each other (`evidence`, `selection`), this says of one pose what can be
seen of it: every pixel of the object's visible surface either lies at the measured depth, or in front of what
was measured, or behind it, or nothing was measured there.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.object_model import ObjectModel
from registration_core.rendering.rasterizer import draw_mesh

Array = NDArray[np.float64]

TOLERANCE = 0.005
"""Metres that a match may be off, up to a distance of 1 m; beyond, it grows with the square of the distance,
as the noise of depth sensors does."""
HIDDEN = 0.030
"""Metres: what was measured so far in front of the object hides it, as far as a count of matches goes."""
LEAST_SEEN = 0.05
"""Share of the surface that must be measured and not hidden, or a share of matches would say nothing."""


class Verdict(IntEnum):
    """Where the object's surface lies at a pixel, as the depth image has it."""

    NO_DATA = 0
    MATCH = 1
    IN_FRONT = 2
    """Nearer to the camera than what was measured."""
    BEHIND = 3
    """Farther away than what was measured: hidden by it, or sunk into it."""


@dataclass(frozen=True, eq=False)
class DepthAgreement:
    """The visible surface of an object, N pixels of it, and what depth says there."""

    columns: NDArray[np.intp]
    """(N,), pixels."""
    rows: NDArray[np.intp]
    """(N,), pixels."""
    depth: Array
    """(N,), of the object's surface, metres."""
    gap: Array
    """(N,), how far behind the surface was measured, metres; of no meaning where nothing was."""
    verdicts: NDArray[np.uint8]
    """(N,), each a `Verdict`."""

    def share(self, verdict: Verdict) -> float:
        """Of the visible surface; 0 where nothing of the object is in the image."""
        return float(np.mean(self.verdicts == verdict)) if len(self.verdicts) else 0.0

    @property
    def inlier_share(self) -> float | None:
        """Matches among the pixels that were measured and are not `HIDDEN`; None where these are too few."""
        seen = np.count_nonzero((self.verdicts != Verdict.NO_DATA) & (self.gap >= -HIDDEN))
        if seen == 0 or seen < LEAST_SEEN * len(self.verdicts):
            return None
        return np.count_nonzero(self.verdicts == Verdict.MATCH) / seen

    @property
    def median_residual(self) -> float | None:
        """Of the matches, metres, without sign; None where there is none."""
        gaps = np.abs(self.gap[self.verdicts == Verdict.MATCH])
        return float(np.median(gaps)) if len(gaps) else None

    def points(self, camera: Intrinsics) -> Array:
        """The visible surface (N, 3) in camera axes, metres."""
        x, y = (self.columns - camera.cx) / camera.fx, (self.rows - camera.cy) / camera.fy
        return np.stack([x * self.depth, y * self.depth, self.depth], axis=-1)


def depth_agreement(
    model: ObjectModel, depth: NDArray[np.float32], camera: Intrinsics, T_camera_object: Array
) -> DepthAgreement:
    """Compare an object at a pose with a depth image (H, W), metres, 0 where nothing was measured."""
    inverse_depth = np.zeros((camera.height, camera.width))
    vertices = pose.apply(T_camera_object, model.vertices)
    top, bottom, left, right = draw_mesh(
        vertices, model.faces, camera.fx, camera.fy, camera.cx, camera.cy, inverse_depth, None, True
    )
    rows, columns = np.nonzero(inverse_depth[top:bottom, left:right])
    rows, columns = rows + top, columns + left
    surface = 1.0 / inverse_depth[rows, columns]
    measured = depth[rows, columns].astype(np.float64)
    gap = measured - surface
    tolerance = TOLERANCE * np.maximum(surface, 1.0) ** 2
    verdicts = np.full(len(gap), Verdict.MATCH, dtype=np.uint8)
    verdicts[gap > tolerance] = Verdict.IN_FRONT
    verdicts[gap < -tolerance] = Verdict.BEHIND
    verdicts[measured <= 0.0] = Verdict.NO_DATA
    return DepthAgreement(columns, rows, surface, gap, verdicts)
