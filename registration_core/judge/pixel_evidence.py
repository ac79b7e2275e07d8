# mypy: allow-untyped-defs
"""What the pixels say of a candidate pose: it is rendered, and every pixel in and around its outline counted.

A pixel inside the outline falls into a bin by how far behind the claimed surface it was measured; bins of
the claim's own rims are apart from those of its inner parts, since sensors fray and round what they see at
rims. A pixel just outside, or a little farther out, tells whether the surface ends where the outline does.
Counts are divided by one area for all candidates, so that a background which does not depend on the pose
cancels and candidates of different outlines are compared on the union of their pixels.

Where there is a colour image, the edges of the outline beside pixels that are not hidden are counted as well:
whether the colour changes there.

A pixel of a known object says nothing for or against what it hides, and never that a surface goes on; only a
surface claimed clearly before it was seen through.
"""

from itertools import pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.geometry.kernels import EXACT, Array32
from registration_core.rendering.rasterizer import draw_mesh
from registration_core.search.color_edges import BORDER
from registration_core.search.observation import NEAREST, Grid
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

BEHIND = np.array([-0.030, -0.012, -0.006, 0.006, 0.012, 0.030])
"""Limits of the bins of "measured behind the claimed surface by", metres; pixels off the supporting plane."""
BEHIND_ON_PLANE = np.array([-0.012, -0.006, 0.006, 0.012])
"""The same for pixels on the supporting plane."""
BEYOND = np.array([-0.015, -0.006, 0.006, 0.015, 0.040])
"""Limits of the bins of "measured behind the rim beside it by", metres; pixels outside, off the plane."""
BEYOND_ON_PLANE = np.array([-0.006, 0.006, 0.015])
"""The same for pixels on the supporting plane."""
OUT = (2, 4)
"""How far outside the outline pixels are counted, in two rings."""

OFF_BINS, ON_BINS = len(BEHIND) + 1, len(BEHIND_ON_PLANE) + 1
INSIDE_BINS = OFF_BINS + ON_BINS + 1
"""Of each part, inner and rim: the bins off the plane, those on it, and one for what was not measured."""
ON_PLANE, UNMEASURED = OFF_BINS, OFF_BINS + ON_BINS
"""First bin on the plane, and the last one, within a part."""
MATCHED, MATCHED_ON_PLANE = 3, ON_PLANE + 2
"""The bins within a part of what was measured where it is claimed."""
HIDDEN = (0, 1, ON_PLANE)
"""The bins within a part of what something hides that lies clearly in front."""
RING = 2 * INSIDE_BINS
"""First class outside the outline."""
OFF_RING, ON_RING = len(BEYOND) + 1, len(BEYOND_ON_PLANE) + 1
RING_BINS = OFF_RING + ON_RING + 1
"""Of each ring: the bins off the plane, those on it, and one for what was not measured."""
ENDS = (4, 5, OFF_RING + 3)
"""The bins within a ring of what was measured clearly behind the rim: the surface ends there."""
BELOW = RING + len(OUT) * RING_BINS
"""Share of the object's vertices that lie clearly below the supporting plane, where nothing can be."""
COLOR_STEADY, COLOR_CHANGES = BELOW + 1, BELOW + 2
"""Edges of pixels of the visible outline where the colour does not change, and where it does."""
COUNT = COLOR_CHANGES + 1

STEP = 0.010
"""Metres of depth between pixels of a claim, for each pixel that they are apart: beyond it they are rim."""
AGREES = 0.010
"""A pixel outside counts only beside a rim that was measured where it is claimed, within this, metres."""
IN_FRONT = -0.012
"""Metres behind a claimed surface, a negative number, below which something else was measured in front."""
SEEN_THROUGH = 0.006
"""Metres behind a claimed surface at which a known object says that the surface is not there."""
GOES_ON = (-0.006, 0.040)
"""Metres behind the rim between which the surface may go on outside."""
SMALL = 0.06
"""Metres: of an object with a smaller diameter all differences of depth count as if both were as large."""
SUNK = 0.010
"""How far below the plane a vertex must lie to count as below it, metres: depth errs, and so do planes."""
MOST_BELOW = 0.5
"""Of the vertices; more below says no more."""
MARGIN = 5
"""Pixels around a candidate's outline that are looked at."""


def class_names() -> tuple[str, ...]:
    """What each of the COUNT classes counts, in their order."""
    inside = _bin_names(BEHIND, "off plane") + _bin_names(BEHIND_ON_PLANE, "on plane") + ["unmeasured"]
    outside = _bin_names(BEYOND, "off plane") + _bin_names(BEYOND_ON_PLANE, "on plane") + ["unmeasured"]
    parts = [f"{part}, {name}" for part in ("inner", "rim") for name in inside]
    rings = [f"{out} pixels out, {name}" for out in OUT for name in outside]
    return (*parts, *rings, "below the plane", "outline, color steady", "outline, color changes")


def _bin_names(limits: Array, where: str) -> list[str]:
    ends = [f"{1000 * limit:.0f} mm" for limit in limits]
    spans = [f"{low} to {high}" for low, high in pairwise(ends)]
    return [f"{where}, {span}" for span in (f"before {ends[0]}", *spans, f"beyond {ends[-1]}")]


def evidence(poses: Array32, model: ViewpointModel, grid: Grid, distance: float) -> Array:
    """Counts (N, COUNT) for poses (N, 3, 4), as shares of the mean silhouette area at `distance` [m]; that
    of BELOW is a share of vertices.
    """
    counts = np.zeros((len(poses), COUNT))
    _count(
        poses.astype(np.float64), model.coarse_vertices, model.coarse_faces, not model.coarse_is_closed, grid,
        max(1.0, SMALL / model.diameter), counts,
    )  # fmt: skip
    counts /= model.mean_area * float(grid.fx) * float(grid.fy) / max(distance, NEAREST) ** 2
    if grid.plane.any():
        counts[:, BELOW] = np.minimum(below(poses, model.coarse_vertices, grid.plane), MOST_BELOW)
    return counts


def below(poses: Array32, vertices: Array32, plane: Array) -> Array:
    """Share (N,) of the vertices (V, 3) that poses (N, 3, 4) put below a plane (4,), by more than SUNK."""
    normals = np.einsum("i,nij->nj", plane[:3], poses.astype(np.float64))
    heights = normals[:, :3] @ vertices.T.astype(np.float64) + (normals[:, 3:] + plane[3])
    return np.mean(heights < -SUNK, axis=1)


@njit(**EXACT)
def _count(poses, vertices, faces, both_sides, grid, sharpness, counts):
    depth, on_plane, known, changes = grid.depth, grid.on_plane, grid.known, grid.changes
    height, width = depth.shape
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
        seen = depth[first_row:end_row, first_column:end_column]
        plane = on_plane[first_row:end_row, first_column:end_column]
        others = known[first_row:end_row, first_column:end_column]
        _count_inside(crop, seen, plane, others, sharpness, count)
        _count_outside(crop, seen, plane, others, sharpness, count)
        if changes.size > 0:
            _count_colors(crop, seen, others, changes, height - 2, first_row, first_column, sharpness, count)


@njit(**EXACT)
def _count_inside(crop, depth, on_plane, known, sharpness, count):
    """Count the pixels of the claimed surface; all arrays are (h, w), the part of the image about it."""
    for r in range(crop.shape[0]):
        for c in range(crop.shape[1]):
            here = crop[r, c]
            if here == 0.0:
                continue
            first = INSIDE_BINS if _is_rim(crop, r, c, here) else 0
            seen = float(depth[r, c])
            behind = sharpness * (seen - 1.0 / here)
            if seen <= 0.0:
                count[first + UNMEASURED] += 1
            elif known[r, c] and behind < SEEN_THROUGH:
                count[first] += 1
            elif on_plane[r, c]:
                count[first + ON_PLANE + _bin(behind, BEHIND_ON_PLANE)] += 1
            else:
                count[first + _bin(behind, BEHIND)] += 1


@njit(**EXACT, inline="always")
def _bin(value, limits):
    k = 0
    for limit in limits:
        k += 1 if value >= limit else 0
    return k


@njit(**EXACT, inline="always")
def _is_rim(crop, r, c, here):
    """Whether the claimed surface, of inverse depth `here`, ends or steps within two pixels."""
    if r < 2 or c < 2 or r >= crop.shape[0] - 2 or c >= crop.shape[1] - 2:
        return True
    # |1 / a - 1 / b| > s means |a - b| > s a b; where nothing is drawn b is 0
    near, far = STEP * here, 2.0 * STEP * here
    return (
        _steps(crop[r - 1, c], here, near)
        or _steps(crop[r + 1, c], here, near)
        or _steps(crop[r, c - 1], here, near)
        or _steps(crop[r, c + 1], here, near)
        or _steps(crop[r - 2, c], here, far)
        or _steps(crop[r + 2, c], here, far)
        or _steps(crop[r, c - 2], here, far)
        or _steps(crop[r, c + 2], here, far)
    )


@njit(**EXACT, inline="always")
def _steps(beside, here, most):
    return beside == 0.0 or abs(beside - here) > most * beside


@njit(**EXACT)
def _count_outside(crop, depth, on_plane, known, sharpness, count):
    """Count the pixels outside the outline, each in the ring that it lies in: by the side on which the
    claimed surface is nearest.
    """
    height, width = crop.shape
    for r in range(height):
        for c in range(width):
            if crop[r, c] > 0.0:
                continue
            for ring in range(len(OUT)):
                apart = OUT[ring]
                i, j = r, c
                if c >= apart and crop[r, c - apart] > 0.0:
                    j = c - apart
                elif c + apart < width and crop[r, c + apart] > 0.0:
                    j = c + apart
                elif r >= apart and crop[r - apart, c] > 0.0:
                    i = r - apart
                elif r + apart < height and crop[r + apart, c] > 0.0:
                    i = r + apart
                else:
                    continue
                rim = 1.0 / crop[i, j]
                if sharpness * abs(depth[i, j] - rim) < AGREES and not known[i, j]:
                    seen = float(depth[r, c])
                    kind = _ring_bin(seen, sharpness * (seen - rim), on_plane[r, c], known[r, c])
                    count[RING + ring * RING_BINS + kind] += 1
                break


@njit(**EXACT, inline="always")
def _ring_bin(seen, behind, on_plane, known):
    nothing_said = known and GOES_ON[0] <= behind < GOES_ON[1]
    if seen <= 0.0 or nothing_said:
        kind = OFF_RING + ON_RING
    elif on_plane:
        kind = OFF_RING + _bin(behind, BEYOND_ON_PLANE)
    else:
        kind = _bin(behind, BEYOND)
    return kind


@njit(**EXACT)
def _count_colors(crop, depth, known, changes, rows, first_row, first_column, sharpness, count):
    """Count the edges of the visible outline by whether the colour changes across them, in the image that the
    grid's `rows` without its border were reduced from; not those too near to its border to be looked up.
    """
    block = changes.shape[0] // rows
    for r in range(crop.shape[0]):
        for c in range(crop.shape[1]):
            here = crop[r, c]
            hidden = depth[r, c] > 0.0 and sharpness * (depth[r, c] - 1.0 / here) < IN_FRONT
            if here == 0.0 or hidden or known[r, c]:
                continue
            for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                i, j = r + down, c + right
                if 0 <= i < crop.shape[0] and 0 <= j < crop.shape[1] and crop[i, j] == 0.0:
                    row, column = (first_row + r - 1) * block, (first_column + c - 1) * block
                    kind = _color_across(changes, row, column, block, down, right)
                    if kind >= 0:
                        count[kind] += 1


@njit(**EXACT, inline="always")
def _color_across(changes, row, column, block, down, right):
    """The class of the line from the block of pixels at (row, column) to the next one, as far from the edge
    between them as the outline may be off: half a block, or a pixel. -1 where it leaves what is known.
    """
    reach = max(1, block // 2)
    i, j = row + block // 2, column + block // 2
    if down != 0:
        i = (row + block if down > 0 else row) - reach
    else:
        j = (column + block if right > 0 else column) - reach
    last_i, last_j = i + abs(down) * (2 * reach - 1), j + abs(right) * (2 * reach - 1)
    if i < BORDER or j < BORDER or last_i >= changes.shape[0] - BORDER or last_j >= changes.shape[1] - BORDER:
        return -1
    for k in range(2 * reach):
        if changes[i + k * abs(down), j + k * abs(right)]:
            return COLOR_CHANGES
    return COLOR_STEADY
