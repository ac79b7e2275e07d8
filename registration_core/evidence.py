# mypy: allow-untyped-defs
"""What the pixels say of a candidate pose: it is rendered, and every pixel in and around its outline counted.

A pixel inside the outline falls into a bin by how far behind the claimed surface it was measured. A pixel
just outside tells whether the surface ends where the outline does. Counts are divided by one area for all
candidates, so that a background which does not depend on the pose cancels and candidates of different
outlines are compared on the union of their pixels.

A pixel of a known object says nothing for or against what it hides, and never that a surface goes on; only a
surface claimed clearly before it was seen through.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.kernels import EXACT, Array32, f4
from registration_core.observation import NEAREST, Grid
from registration_core.rasterizer import draw_mesh
from registration_core.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

BEHIND = np.array([-0.030, -0.012, -0.006, -0.003, 0.003, 0.006, 0.012, 0.030])
"""Limits of the bins of "measured behind the claimed surface by", metres; pixels off the supporting plane."""
BEHIND_ON_PLANE = np.array([-0.030, -0.012, -0.005, 0.005, 0.012, 0.030])
"""The same for pixels on the supporting plane."""

OFF_PLANE = 0
"""First of the 9 bins of BEHIND."""
ON_PLANE = OFF_PLANE + len(BEHIND) + 1
"""First of the 7 bins of BEHIND_ON_PLANE."""
UNMEASURED = ON_PLANE + len(BEHIND_ON_PLANE) + 1
"""Inside the outline, without a measurement."""
RING = UNMEASURED + 1
"""First of the 8 classes of a pixel two beyond a part of the outline that agrees: unmeasured; the plane, near
and clear; something in front; the same depth within 6, 15 and 40 mm; clear behind.
"""
COUNT = RING + 8
CONTINUING = (4, 5, 6)
"""The classes by which the surface may go on."""

MATCH = 0.006
"""Limit of agreement beside which the ring is counted, metres."""
MARGIN = 3
"""Pixels around a candidate's outline that are looked at."""


def evidence(poses: Array32, model: ViewpointModel, grid: Grid, distance: float) -> Array:
    """Counts (N, COUNT) for poses (N, 3, 4), as shares of the mean silhouette area at `distance` [m]."""
    counts = np.zeros((len(poses), COUNT))
    _count(
        poses.astype(np.float64), model.coarse_vertices, model.coarse_faces, not model.coarse_is_closed, grid,
        counts,
    )  # fmt: skip
    return counts / (model.mean_area * float(grid.fx) * float(grid.fy) / max(distance, NEAREST) ** 2)


@njit(**EXACT)
def _count(poses, vertices, faces, both_sides, grid, counts):
    height, width = grid.depth.shape
    fx, fy, cx, cy = float(grid.fx), float(grid.fy), float(grid.cx), float(grid.cy)
    inverse_depth = np.zeros((height, width))
    points = np.empty((vertices.shape[0], 3))
    for i in range(poses.shape[0]):
        T, count = poses[i], counts[i]
        left, right, top, bottom = 1e9, -1e9, 1e9, -1e9
        for v in range(vertices.shape[0]):
            for a in range(3):
                points[v, a] = (
                    T[a, 0] * vertices[v, 0] + T[a, 1] * vertices[v, 1] + T[a, 2] * vertices[v, 2] + T[a, 3]
                )
            z = max(points[v, 2], 0.02)
            x, y = points[v, 0] / z * fx + cx, points[v, 1] / z * fy + cy
            left, right, top, bottom = min(left, x), max(right, x), min(top, y), max(bottom, y)
        first_column = int(max(0.0, np.floor(left) - MARGIN))
        end_column = int(min(float(width), np.ceil(right) + MARGIN + 1))
        first_row = int(max(0.0, np.floor(top) - MARGIN))
        end_row = int(min(float(height), np.ceil(bottom) + MARGIN + 1))
        if first_column >= end_column or first_row >= end_row:
            continue
        crop = inverse_depth[first_row:end_row, first_column:end_column]
        crop[:] = 0.0
        draw_mesh(points, faces, fx, fy, cx - first_column, cy - first_row, crop, None, both_sides)
        for row in range(first_row, end_row):
            for column in range(first_column, end_column):
                r, c = row - first_row, column - first_column
                seen = float(grid.depth[row, column])
                known = grid.known[row, column]
                on_plane = grid.weight[row, column] < f4(0.5) and not known
                if crop[r, c] > 0.0:
                    behind = seen - 1.0 / crop[r, c]
                    if seen <= 0.0:
                        count[UNMEASURED] += 1
                    elif known and behind < MATCH:
                        count[OFF_PLANE] += 1
                    elif on_plane:
                        count[ON_PLANE + _bin(behind, BEHIND_ON_PLANE)] += 1
                    else:
                        count[OFF_PLANE + _bin(behind, BEHIND)] += 1
                else:
                    _count_ring(grid, crop, row, column, first_row, first_column, seen, on_plane, count)


@njit(**EXACT)
def _bin(value, limits):
    k = 0
    for limit in limits:
        k += 1 if value >= limit else 0
    return k


@njit(**EXACT)
def _count_ring(grid, crop, row, column, first_row, first_column, seen, on_plane, count):
    """Count a pixel outside the outline if the candidate's surface lies two pixels to a side of it."""
    for dr, dc in ((0, -2), (0, 2), (-2, 0), (2, 0)):
        r, c = row - first_row + dr, column - first_column + dc
        if r < 0 or c < 0 or r >= crop.shape[0] or c >= crop.shape[1] or crop[r, c] == 0.0:
            continue
        rim = 1.0 / crop[r, c]
        agrees = abs(grid.depth[row + dr, column + dc] - rim) < MATCH
        if agrees and not grid.known[row + dr, column + dc]:
            ring_class = _ring_class(seen, seen - rim, on_plane)
            nothing_said = grid.known[row, column] and ring_class in CONTINUING
            count[RING + (0 if nothing_said else ring_class)] += 1
        return


@njit(**EXACT)
def _ring_class(seen, behind, on_plane):
    if seen <= 0.0:
        return 0
    if behind < -0.015:
        return 3
    if on_plane:
        return 1 if behind < 0.015 else 2
    if abs(behind) < 0.006:
        return 4
    if behind < 0.015:
        return 5
    return 6 if behind < 0.040 else 7
