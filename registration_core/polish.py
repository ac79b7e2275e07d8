# mypy: allow-untyped-defs
"""Robust Gauss-Newton, point to plane, of many poses against the observed depth."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.agreement import Surface
from registration_core.kernels import FAST, Array32, f4, turn, view_of
from registration_core.observation import Grid

DAMPING = 1e-3
"""Added to the diagonal, share of the sum of weights: free directions, such as a spin, then stay as they
are.
"""

MIN_WEIGHT = 0.04
"""With less than this share of the points in contact a pose is left as it is."""

MAX_STEP = (0.04, 0.4)
"""Largest step, metres and radians."""


def polish(
    poses: Array32,
    surface: Surface,
    grid: Grid,
    radius: float,
    points: int,
    iterations: int,
    tukey: tuple[float, float],
    min_parallel: float = 0.3,
) -> Array32:
    """Poses (N, 3, 4) after Gauss-Newton steps; the width [m] of Tukey's kernel goes from tukey[0] to
    tukey[1].

    Args:
        radius: of the object, metres: the length by which rotations are scaled.
        points: how many of the stored surface points are used.
        min_parallel: cosine of two normals from which on points may match.
    """
    polished = poses.copy()
    _polish(
        polished, surface, grid, f4(radius), points, iterations, f4(tukey[0]), f4(tukey[1]), f4(min_parallel)
    )
    return polished


def covariance(
    T: Array32, surface: Surface, grid: Grid, radius: float, tukey: float, noise: float
) -> NDArray[np.float64]:
    """Covariance (6, 6) of one pose (3, 4), order (translation [m], rotation vector [rad]), camera axes.

    The inverse of the Gauss-Newton Hessian at the pose, scaled by the residuals' variance, but at least by
    `noise` [m] squared. A direction that nothing holds gets the standard deviation of the object's radius,
    or one radian.
    """
    system = np.zeros((7, 7), np.float32)
    buffer = np.empty((7, surface.points.shape[2]), np.float32)
    _normal_equations(T, surface, grid, f4(radius), buffer.shape[1], f4(tukey), f4(0.3), buffer, system)
    hessian = system[:6, :6].astype(np.float64)
    contact = float((buffer[:3] ** 2).sum())  # normals have length 1: the sum of weights
    variance = max(noise**2, float(system[6, 6]) / max(contact, 1.0))
    scale = np.array([1.0, 1.0, 1.0, 1 / radius, 1 / radius, 1 / radius])
    information = hessian / variance + np.eye(6) / radius**2
    inverted = np.linalg.inv(information) * np.outer(scale, scale)
    return (inverted + inverted.T) / 2.0


@njit(**FAST)
def _polish(poses, surface, grid, radius, points, iterations, tukey_start, tukey_end, min_parallel):
    buffer = np.empty((7, points), np.float32)
    system = np.empty((7, 7), np.float32)
    step = np.empty(6, np.float32)
    turned = np.empty((3, 4), np.float32)
    for i in range(poses.shape[0]):
        T = poses[i]
        for iteration in range(iterations):
            share = f4(iteration) / f4(max(1, iterations - 1))
            tukey = tukey_start * (tukey_end / tukey_start) ** share
            weight = _normal_equations(T, surface, grid, radius, points, tukey, min_parallel, buffer, system)
            if weight < f4(MIN_WEIGHT) * f4(points):
                break
            for a in range(6):
                system[a, a] += f4(DAMPING) * weight
            if not _solve(system, step):
                break
            moved = np.sqrt(step[0] ** 2 + step[1] ** 2 + step[2] ** 2)
            rotated = np.sqrt(step[3] ** 2 + step[4] ** 2 + step[5] ** 2) / radius
            limit = min(f4(1), f4(MAX_STEP[0]) / (moved + f4(1e-9)), f4(MAX_STEP[1]) / (rotated + f4(1e-9)))
            spin = limit / radius
            turn(T, step[3] * spin, step[4] * spin, step[5] * spin, turned)
            T[:] = turned
            T[0, 3] += step[0] * limit
            T[1, 3] += step[1] * limit
            T[2, 3] += step[2] * limit
            if moved < f4(1e-5) and rotated < f4(1e-4):
                break


@njit(**FAST)
def _normal_equations(T, surface, grid, radius, points, tukey, min_parallel, buffer, system):  # noqa: PLR0915 - one loop, for speed
    """Write J^T W J into `system` (7, 7), where column 6 of J is the residual [m]; returns the sum of
    weights.

    A model point is matched with the pixel it falls on; the residual is along the mean of both normals.
    Columns 3 to 5 are rotations in units of the object's radius. `buffer` (7, points) is left holding
    sqrt(W) J transposed.
    """
    fx, fy, cx, cy = grid.fx, grid.fy, grid.cx, grid.cy
    last_row, last_column = np.int32(grid.depth.shape[0] - 1), np.int32(grid.depth.shape[1] - 1)
    first = np.int32(0)
    zero, one, half = f4(0), f4(1), f4(0.5)
    r00, r01, r02, t0 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
    r10, r11, r12, t1 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
    r20, r21, r22, t2 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    view = view_of(T, surface.view_of_cell)
    X, Y, Z = surface.points[view, 0], surface.points[view, 1], surface.points[view, 2]
    NX, NY, NZ = surface.normals[view, 0], surface.normals[view, 1], surface.normals[view, 2]
    observed_x, observed_y, observed_z = grid.normals[0], grid.normals[1], grid.normals[2]
    sharp, gate = one / tukey, f4(6.25) * tukey * tukey
    inverse_fx, inverse_fy, per_radius = one / fx, one / fy, one / radius
    total = zero
    for k in range(points):
        x, y, w = X[k], Y[k], Z[k]
        px, py, pz = r00 * x + r01 * y + r02 * w, r10 * x + r11 * y + r12 * w, r20 * x + r21 * y + r22 * w
        z = max(f4(0.02), pz + t2)
        inverse = one / z
        column = np.int32((px + t0) * inverse * fx + cx + half)
        row = np.int32((py + t1) * inverse * fy + cy + half)
        column = min(max(column, first), last_column)
        row = min(max(row, first), last_row)
        seen = grid.depth[row, column]
        ox, oy, oz = observed_x[row, column], observed_y[row, column], observed_z[row, column]
        a, b, c = NX[k], NY[k], NZ[k]
        nx, ny, nz = r00 * a + r01 * b + r02 * c, r10 * a + r11 * b + r12 * c, r20 * a + r21 * b + r22 * c
        parallel = nx * ox + ny * oy + nz * oz
        ex = (f4(column) - cx) * inverse_fx * seen - px - t0
        ey = (f4(row) - cy) * inverse_fy * seen - py - t1
        ez = seen - z
        mx, my, mz = nx + ox, ny + oy, nz + oz
        scale = one / np.sqrt(mx * mx + my * my + mz * mz + f4(1e-12))
        mx, my, mz = mx * scale, my * scale, mz * scale
        residual = ex * mx + ey * my + ez * mz
        u = residual * sharp
        root = max(zero, one - u * u)
        weight = root * root * grid.weight[row, column]
        weight *= max(zero, min(one, (parallel - min_parallel) * f4(2.5)))
        weight *= one if seen > zero else zero
        weight *= one if ex * ex + ey * ey + ez * ez < gate else zero
        total += weight
        root = np.sqrt(weight)
        buffer[0, k], buffer[1, k], buffer[2, k] = root * mx, root * my, root * mz
        buffer[3, k] = root * (py * mz - pz * my) * per_radius
        buffer[4, k] = root * (pz * mx - px * mz) * per_radius
        buffer[5, k] = root * (px * my - py * mx) * per_radius
        buffer[6, k] = root * residual
    for i in range(7):
        for j in range(i + 1):
            dot = zero
            for k in range(points):
                dot += buffer[i, k] * buffer[j, k]
            system[i, j] = dot
            system[j, i] = dot
    return total


@njit(**FAST)
def _solve(system, x):
    """Solve the upper left (6, 6) against column 6 by Cholesky, in place; False where it is singular."""
    for i in range(6):
        for j in range(i + 1):
            s = system[i, j]
            for k in range(j):
                s -= system[i, k] * system[j, k]
            if i == j:
                if s <= f4(1e-12):
                    return False
                system[i, i] = np.sqrt(s)
            else:
                system[i, j] = s / system[j, j]
    for i in range(6):
        s = system[6, i]
        for k in range(i):
            s -= system[i, k] * x[k]
        x[i] = s / system[i, i]
    for i in range(5, -1, -1):
        s = x[i]
        for k in range(i + 1, 6):
            s -= system[k, i] * x[k]
        x[i] = s / system[i, i]
    return True
