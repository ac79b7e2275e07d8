# mypy: allow-untyped-defs
"""The plane that things lie on, found in a reduced depth image by random samples, and its pixels."""

import numpy as np
from numba import njit

from registration_core.geometry.kernels import FAST, f4, uniform


@njit(**FAST)
def find_plane(grid, trials, tolerance, state):
    """(5,): normal, offset [m] and share of the pixels of the largest plane in a grid; the share is 0 where
    there is none.

    Hypotheses come from one pixel and its normal, or from three pixels in turn.
    """
    height, width = grid.depth.shape
    step = max(1, int(np.sqrt(height * width / 1500.0)))
    p = np.empty((3, 4000), np.float32)
    n = np.empty((3, 4000), np.float32)
    count = 0
    for i in range(1, height - 1, step):
        for j in range(1, width - 1, step):
            z = grid.depth[i, j]
            if z > 0 and count < 4000:
                p[0, count], p[1, count], p[2, count] = (
                    (j - grid.cx) / grid.fx * z,
                    (i - grid.cy) / grid.fy * z,
                    z,
                )
                n[:, count] = grid.normals[:, i, j]
                count += 1
    plane = np.zeros(5, np.float32)
    if count < 50:
        return plane
    for trial in range(trials):
        a, b, c = int(uniform(state) * count), int(uniform(state) * count), int(uniform(state) * count)
        normal = n[:, a].copy()
        if trial % 2 == 0:
            normal = np.cross(p[:, b] - p[:, a], p[:, c] - p[:, a])
        length = np.sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2])
        if length < f4(1e-4):
            continue
        normal /= length
        offset = -(normal[0] * p[0, a] + normal[1] * p[1, a] + normal[2] * p[2, a])
        support = 0
        for k in range(count):
            d = normal[0] * p[0, k] + normal[1] * p[1, k] + normal[2] * p[2, k] + offset
            support += 1 if abs(d) < tolerance else 0
        share = f4(support) / f4(count)
        if share > plane[4]:
            plane[:3], plane[3], plane[4] = normal, offset, share
    if plane[4] > 0:
        for _ in range(2):
            _refit_plane(p, count, tolerance, plane)
    return plane


@njit(**FAST)
def _refit_plane(p, count, tolerance, plane):
    """Least squares over the plane's own points: the smallest principal axis of their scatter."""
    mean = np.zeros(3)
    scatter = np.zeros((3, 3))
    inliers = 0
    for sweep in range(2):
        for k in range(count):
            d = plane[0] * p[0, k] + plane[1] * p[1, k] + plane[2] * p[2, k] + plane[3]
            if abs(d) >= tolerance:
                continue
            if sweep == 0:
                inliers += 1
                for i in range(3):
                    mean[i] += p[i, k]
            else:
                for i in range(3):
                    for j in range(3):
                        scatter[i, j] += (p[i, k] - mean[i]) * (p[j, k] - mean[j])
        if sweep == 0:
            mean /= max(inliers, 1)
    normal = np.linalg.eigh(scatter)[1][:, 0]
    for i in range(3):
        plane[i] = normal[i]
    plane[3] = -(normal[0] * mean[0] + normal[1] * mean[1] + normal[2] * mean[2])


@njit(**FAST)
def mark_plane(grid, plane, tolerance, on_plane):
    """Set `on_plane` (H, W) where a pixel lies within the tolerance [m] of the plane and faces as it does."""
    for i in range(on_plane.shape[0]):
        for j in range(on_plane.shape[1]):
            z = grid.depth[i, j]
            x, y = (j - grid.cx) / grid.fx * z, (i - grid.cy) / grid.fy * z
            d = plane[0] * x + plane[1] * y + plane[2] * z + plane[3]
            nx, ny, nz = grid.normals[0, i, j], grid.normals[1, i, j], grid.normals[2, i, j]
            along = abs(plane[0] * nx + plane[1] * ny + plane[2] * nz)
            on_plane[i, j] = z > 0 and abs(d) < tolerance and (along > f4(0.8) or along == f4(0))
