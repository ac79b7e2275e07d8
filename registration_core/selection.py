# mypy: allow-untyped-defs
"""Choosing the winner without doing harm: pixel residuals of each candidate, a prior, and a lead that is
demanded.

Each candidate is rendered and every pixel falls into one of twelve classes. Counts are divided by one area
for all candidates, so that a background which does not depend on the pose cancels and candidates of different
outlines are compared on the union of their pixels.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.agreement import Prior, heavy_tails
from registration_core.kernels import EXACT, Array32, f4
from registration_core.observation import Grid
from registration_core.rasterizer import draw_mesh
from registration_core.snap_config import SelectionConfig
from registration_core.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]


class Residual(IntEnum):
    """Classes of pixels. "Plane" pixels lie on the supporting plane, the others off it."""

    MATCH = 0
    """Depths agree within 5 mm."""
    NEAR_MISS = 1
    """Within 5 to 12 mm."""
    HIDDEN = 2
    """Observed more than 12 mm in front: an occluder."""
    SEEN_THROUGH = 3
    """Observed more than 12 mm behind: there is no surface where one is claimed."""
    PLANE_MATCH = 4
    PLANE_NEAR_MISS = 5
    PLANE_HIDDEN = 6
    PLANE_SEEN_THROUGH = 7
    TILTED = 8
    """Depths agree within 8 mm, normals do not."""
    UNMEASURED = 9
    CONTINUING = 10
    """Just outside the outline, where observed surface goes on."""
    UNEXPLAINED = 11
    """Foreground at the object's depth beside the outline."""


SIGNS = np.array([1, -1, -1, -1, 1, -1, -1, -1, 1, -1, -1, -1], dtype=np.float64)
"""Whether a class speaks for or against a candidate."""

MATCH, NEAR, TILT_MATCH = 0.005, 0.012, 0.008
"""Limits of the classes, metres."""
MIN_PARALLEL = 0.75
"""Cosine of two normals from which on they agree."""
MARGIN = 3
"""Pixels around a candidate's outline that are looked at."""


@dataclass(frozen=True, eq=False)
class Judgement:
    """Scores of candidates (N) and which one won."""

    winner: int
    scores: Array
    """(N,), natural logarithm of odds."""
    shares: Array
    """(N, 12), pixels of each class over the mean silhouette area at the start's depth."""


def judge(
    candidates: Array32, near: int, model: ViewpointModel, grid: Grid, prior: Prior, config: SelectionConfig
) -> Judgement:
    """Choose among poses (N, 3, 4): the start first, then `near` polishes of it, then the modes found
    elsewhere.

    The best polish replaces the start only where it gains `gain_near`, and another mode replaces what
    stands then only where it gains `gain_far`: in doubt the operator is right.
    """
    shares = residual_shares(candidates, model, grid, float(prior.start[2, 3]))
    scores = shares @ (SIGNS * np.array(config.weights)) - config.prior * heavy_tails(candidates, prior)
    winner = 0
    for first, last, gain in ((1, 1 + near, config.gain_near), (1 + near, len(candidates), config.gain_far)):
        if first < last:
            best = first + int(np.argmax(scores[first:last]))
            if scores[best] > scores[winner] + gain:
                winner = best
    return Judgement(winner, scores, shares)


def residual_shares(poses: Array32, model: ViewpointModel, grid: Grid, distance: float) -> Array:
    """Shares (N, 12) of the classes of Residual for poses (N, 3, 4), over the mean silhouette at
    `distance`.
    """
    counts = np.zeros((len(poses), len(Residual)))
    _count_residuals(
        poses.astype(np.float64), model.coarse_vertices, model.coarse_faces, not model.coarse_is_closed,
        grid, counts,
    )  # fmt: skip
    return counts / (model.mean_area * float(grid.fx) * float(grid.fy) / distance**2)


@njit(**EXACT)
def _count_residuals(poses, vertices, faces, both_sides, grid, counts):  # noqa: PLR0912 - one loop, for speed
    height, width = grid.depth.shape
    fx, fy, cx, cy = float(grid.fx), float(grid.fy), float(grid.cx), float(grid.cy)
    inverse_depth = np.zeros((height, width))
    nearest_face = np.zeros((height, width), np.int32)
    points = np.empty((vertices.shape[0], 3))
    for i in range(poses.shape[0]):
        T, count = poses[i], counts[i]
        left, right, top, bottom = 1e9, -1e9, 1e9, -1e9
        nearest, farthest = 1e9, 0.0
        for v in range(vertices.shape[0]):
            for a in range(3):
                points[v, a] = (
                    T[a, 0] * vertices[v, 0] + T[a, 1] * vertices[v, 1] + T[a, 2] * vertices[v, 2] + T[a, 3]
                )
            z = max(points[v, 2], 0.02)
            x, y = points[v, 0] / z * fx + cx, points[v, 1] / z * fy + cy
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
            nearest, farthest = min(nearest, z), max(farthest, z)
        first_column = int(max(0.0, np.floor(left) - MARGIN))
        end_column = int(min(float(width), np.ceil(right) + MARGIN + 1))
        first_row = int(max(0.0, np.floor(top) - MARGIN))
        end_row = int(min(float(height), np.ceil(bottom) + MARGIN + 1))
        if first_column >= end_column or first_row >= end_row:
            continue
        crop = inverse_depth[first_row:end_row, first_column:end_column]
        crop[:] = 0.0
        face_crop = nearest_face[first_row:end_row, first_column:end_column]
        draw_mesh(points, faces, fx, fy, cx - first_column, cy - first_row, crop, face_crop, both_sides)
        for row in range(first_row, end_row):
            for column in range(first_column, end_column):
                seen = grid.depth[row, column]
                on_plane = grid.weight[row, column] < f4(0.5)
                if inverse_depth[row, column] > 0.0:
                    behind = seen - 1.0 / inverse_depth[row, column]
                    if seen <= 0.0:
                        kind = Residual.UNMEASURED.value
                    elif on_plane:
                        kind = _kind(behind) + Residual.PLANE_MATCH.value
                    elif abs(behind) < NEAR and _tilted(
                        points, faces[nearest_face[row, column]], grid.normals[:, row, column]
                    ):
                        kind = Residual.TILTED.value if abs(behind) < TILT_MATCH else -1
                    else:
                        kind = _kind(behind)
                    if kind >= 0:
                        count[kind] += 1
                elif seen > 0.0 and not on_plane:
                    if nearest - 0.006 < seen < farthest + 0.006:
                        count[Residual.UNEXPLAINED.value] += 1
                    rim = _beside(inverse_depth, row, column, first_row, end_row, first_column, end_column)
                    if rim > 0.0 and abs(seen - 1.0 / rim) < 0.015:
                        count[Residual.CONTINUING.value] += 1


@njit(**EXACT)
def _kind(behind):
    if abs(behind) < MATCH:
        return 0
    if abs(behind) < NEAR:
        return 1
    return 2 if behind < 0.0 else 3


@njit(**EXACT)
def _tilted(points, face, observed):
    """Whether a face's normal disagrees with the observed one; False where that is unknown."""
    if observed[0] == 0.0 and observed[1] == 0.0 and observed[2] == 0.0:
        return False
    a, b, c = points[face[0]], points[face[1]], points[face[2]]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = np.sqrt(nx * nx + ny * ny + nz * nz) + 1e-30
    if nx * a[0] + ny * a[1] + nz * a[2] > 0.0:  # faces may be wound either way
        length = -length
    return (nx * observed[0] + ny * observed[1] + nz * observed[2]) / length < MIN_PARALLEL


@njit(**EXACT)
def _beside(inverse_depth, row, column, first_row, end_row, first_column, end_column):
    """Inverse depth of the candidate two pixels to a side; 0 where there is none."""
    if column - 2 >= first_column and inverse_depth[row, column - 2] > 0.0:
        return inverse_depth[row, column - 2]
    if column + 2 < end_column and inverse_depth[row, column + 2] > 0.0:
        return inverse_depth[row, column + 2]
    if row - 2 >= first_row and inverse_depth[row - 2, column] > 0.0:
        return inverse_depth[row - 2, column]
    if row + 2 < end_row and inverse_depth[row + 2, column] > 0.0:
        return inverse_depth[row + 2, column]
    return 0.0
