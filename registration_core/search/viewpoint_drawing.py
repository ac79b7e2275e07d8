# mypy: allow-untyped-defs
"""Draws an object from many directions and picks the points that a viewpoint model keeps of each view."""

import numpy as np
from numba import njit

from registration_core.geometry.kernels import EXACT, uniform
from registration_core.rendering.rasterizer import draw_mesh

VIEW_DISTANCE = 8.0
"""Distance of the camera of a view from the object's centre, in radii of the object."""
VIEW_PIXELS = 96
"""Width and height of the image of a view."""
VIEW_FILL = 0.88
"""Share of the image that the bounding sphere fills."""


@njit(**EXACT)
def draw_views(vertices, faces, rotations, radius, points, normals, ring, area):
    """Fill the arrays of ViewpointModel (area in square metres) by drawing every view once."""
    distance = VIEW_DISTANCE * radius
    focal = VIEW_PIXELS / 2 / radius * distance * VIEW_FILL
    middle = VIEW_PIXELS / 2 - 0.5
    pixel = distance / focal
    gap = max(0.08 * radius, min(0.006, 0.2 * radius)) / pixel
    state = np.array([88172645463325252], np.uint64)
    seen = np.empty((VIEW_PIXELS * VIEW_PIXELS, 2), np.int32)
    for view in range(rotations.shape[0]):
        R = rotations[view]
        camera_vertices = vertices @ R.T
        camera_vertices[:, 2] += distance
        inverse_depth = np.zeros((VIEW_PIXELS, VIEW_PIXELS))
        nearest_face = np.full((VIEW_PIXELS, VIEW_PIXELS), -1, np.int32)
        draw_mesh(camera_vertices, faces, focal, focal, middle, middle, inverse_depth, nearest_face, True)
        count = 0
        for row in range(VIEW_PIXELS):
            for column in range(VIEW_PIXELS):
                if inverse_depth[row, column] > 0.0:
                    seen[count, 0], seen[count, 1] = row, column
                    count += 1
        area[view] = count * pixel * pixel
        if count == 0:  # a flat object seen edge-on: a single point stands for it
            continue
        _shuffle(seen, count, state)
        for k in range(points.shape[2]):
            row, column = seen[k % count]
            corner = faces[nearest_face[row, column]]
            a, b, c = camera_vertices[corner[0]], camera_vertices[corner[1]], camera_vertices[corner[2]]
            n = np.cross(b - a, c - a)
            n /= np.linalg.norm(n) + 1e-30
            z = 1.0 / inverse_depth[row, column]
            hit = z * np.array([(column - middle) / focal, (row - middle) / focal, 1.0])
            if n @ hit > 0.0:
                n = -n
            jittered = np.array(
                [
                    (column + uniform(state) - 0.5 - middle) / focal,
                    (row + uniform(state) - 0.5 - middle) / focal,
                    1.0,
                ]
            )
            slope = n @ jittered
            moved = (n @ hit) / slope if slope < -0.15 else z
            p = jittered * (moved if abs(moved - z) < 2.0 * pixel else z)
            p[2] -= distance
            points[view, :, k] = R.T @ p
            normals[view, :, k] = R.T @ n
        count = max(1, _find_ring(inverse_depth, gap, seen))
        _shuffle(seen, count, state)
        for k in range(ring.shape[2]):
            row, column = seen[k % count]
            z = _rim_depth(inverse_depth, row, column, gap + 1.0)
            p = z * np.array([(column - middle) / focal, (row - middle) / focal, 1.0])
            p[2] -= distance
            ring[view, :, k] = R.T @ p


@njit(**EXACT)
def _shuffle(items, count, state):
    for k in range(count - 1, 0, -1):
        other = int(uniform(state) * (k + 1))
        for j in range(items.shape[1]):
            items[k, j], items[other, j] = items[other, j], items[k, j]


@njit(**EXACT)
def _find_ring(inverse_depth, gap, found):
    """Write the pixels (row, column) about `gap` pixels outside the silhouette; returns their number."""
    height, width = inverse_depth.shape
    reach = int(np.ceil(gap + 0.6))
    squared = np.full((height, width), 1 << 30, np.int32)
    for row in range(height):
        for column in range(width):
            if inverse_depth[row, column] == 0.0 or not _on_rim(inverse_depth, row, column):
                continue
            for i in range(max(0, row - reach), min(height, row + reach + 1)):
                for j in range(max(0, column - reach), min(width, column + reach + 1)):
                    squared[i, j] = min(squared[i, j], (i - row) ** 2 + (j - column) ** 2)
    count = 0
    for row in range(height):
        for column in range(width):
            d = np.sqrt(squared[row, column])
            if inverse_depth[row, column] == 0.0 and gap - 0.6 < d <= gap + 0.6:
                found[count, 0], found[count, 1] = row, column
                count += 1
    return count


@njit(**EXACT)
def _on_rim(inverse_depth, row, column):
    height, width = inverse_depth.shape
    if row in (0, height - 1) or column in (0, width - 1):
        return True
    return (
        inverse_depth[row - 1, column] == 0.0
        or inverse_depth[row + 1, column] == 0.0
        or inverse_depth[row, column - 1] == 0.0
        or inverse_depth[row, column + 1] == 0.0
    )


@njit(**EXACT)
def _rim_depth(inverse_depth, row, column, reach):
    """Depth of the drawn pixel nearest to a pixel outside."""
    height, width = inverse_depth.shape
    r = int(np.ceil(reach))
    best, depth = 1 << 30, 0.0
    for i in range(max(0, row - r), min(height, row + r + 1)):
        for j in range(max(0, column - r), min(width, column + r + 1)):
            d = (i - row) ** 2 + (j - column) ** 2
            if inverse_depth[i, j] > 0.0 and d < best:
                best, depth = d, 1.0 / inverse_depth[i, j]
    return depth
