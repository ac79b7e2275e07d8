# mypy: allow-untyped-defs
"""Robust Gauss-Newton, point to plane, of many poses against the observed depth."""

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry.kernels import FAST, Array32, f4, turn, view_of
from registration_core.search.observation import Grid
from registration_core.search.sparse_score import Surface

DAMPING = 1e-3
"""Added to the diagonal, share of the sum of weights: free directions, such as a spin, then stay as they
are.
"""

MIN_WEIGHT = 0.04
"""With less than this share of the points in contact a pose is left as it is."""

MIN_PARALLEL = 0.3
"""Cosine of two normals from which on points may match."""

FINAL_TUKEY = 0.006
"""Width of the robust kernel once a pose is found, metres."""

STEADY = (0.002, np.radians(2.0))
"""How exact an operator is who is done, standard deviation in metres and radians (`eased`)."""

HELD = (0.005, np.radians(5.0))
"""How exact a polished pose is at least, for outlines hold it too, metres and radians (`eased`)."""

FADING = 8.0
"""Squared distance, in units of STEADY, beyond which that belief fades."""

MEASURED_NOISE = 0.004
"""Metres: of a depth pixel, larger than it is, for neighbouring pixels err together."""

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
) -> Array32:
    """Poses (N, 3, 4) after Gauss-Newton steps; the width [m] of Tukey's kernel goes from tukey[0] to
    tukey[1].

    Args:
        radius: of the object, metres: the length by which rotations are scaled.
        points: how many of the stored surface points are used.
    """
    polished = poses.copy()
    _polish(polished, surface, grid, f4(radius), points, iterations, f4(tukey[0]), f4(tukey[1]))
    return polished


def systems(
    poses: Array32, surface: Surface, grid: Grid, radius: float, points: int, tukey: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Hessians (N, 6, 6), right sides (N, 6) and sums of weights (N,) of one Gauss-Newton step of poses
    (N, 3, 4).

    Order (translation [m], rotation vector [rad] times the object's radius), camera axes, about the centre.
    """
    system = np.zeros((len(poses), 7, 7), np.float32)
    weights = np.zeros(len(poses), np.float32)
    _systems(poses, surface, grid, f4(radius), points, f4(tukey), system, weights)
    lower = system.astype(np.float64)
    hessians = lower[:, :6, :6] + np.tril(lower[:, :6, :6], -1).transpose(0, 2, 1)
    return hessians, lower[:, 6, :6], weights.astype(np.float64)


def eased(
    T: NDArray[np.float64], start: NDArray[np.float64], hessian: NDArray[np.float64], radius: float
) -> NDArray[np.float64]:
    """A polished pose (4, 4) drawn back towards the start (4, 4) where the depth hardly decides.

    The most probable pose between what was measured, as the Hessian (6, 6) of `systems` tells, and an
    operator who was right to within STEADY. That belief fades (Welsch) where the two poses are farther apart
    than that: then the operator had not aimed yet.
    """
    apart = np.concatenate(
        [start[:3, 3] - T[:3, 3], Rotation.from_matrix(start[:3, :3] @ T[:3, :3].T).as_rotvec()]
    )
    scale = np.repeat([1.0, radius], 3)
    measured = hessian * np.outer(scale, scale) / MEASURED_NOISE**2 + np.diag(np.repeat(HELD, 3) ** -2.0)
    believed = np.repeat(STEADY, 3) ** -2.0
    belief = np.exp(-(believed @ apart**2) / (2.0 * FADING))
    step = np.linalg.solve(measured + belief * np.diag(believed), belief * believed * apart)
    drawn = T.copy()
    drawn[:3, 3] += step[:3]
    drawn[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T[:3, :3]
    return drawn


def scaled_covariances(hessians: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """The inverse of Hessians (..., 6, 6) of `systems`, in their scale, by the variance MEASURED_NOISE^2. A
    direction that nothing holds gets the standard deviation of the object's radius [m].
    """
    information = hessians / MEASURED_NOISE**2 + np.eye(6) / radius**2
    return np.asarray(np.linalg.inv(information), dtype=np.float64)


def covariance(
    hessian: NDArray[np.float64], rotation: NDArray[np.float64], radius: float, centre: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Covariance (6, 6) of a pose, order (translation [m], rotation vector [rad]), of the object's origin.

    `scaled_covariances` of the Hessian (6, 6) of `systems` at the pose: a turn that nothing holds gets the
    standard deviation of one radian.

    Args:
        rotation: (3, 3), of the pose.
        radius: of the object, metres.
        centre: (3,), metres, in the mesh frame: what `systems` turns about.
    """
    scale = np.repeat([1.0, 1.0 / radius], 3)
    at_centre = scaled_covariances(hessian, radius) * np.outer(scale, scale)
    x, y, z = rotation @ centre
    # t_origin = t_centre - R centre, and a small turn w moves R centre by w x (R centre)
    jacobian = np.eye(6)
    jacobian[:3, 3:] = [[0, -z, y], [z, 0, -x], [-y, x, 0]]
    moved = jacobian @ at_centre @ jacobian.T
    return (moved + moved.T) / 2.0


@njit(**FAST)
def _systems(poses, surface, grid, radius, points, tukey, system, weights):
    for i in range(poses.shape[0]):
        weights[i] = normal_equations(poses[i], surface, grid, radius, points, tukey, system[i])


@njit(**FAST)
def _polish(poses, surface, grid, radius, points, iterations, tukey_start, tukey_end):
    system = np.zeros((7, 7), np.float32)
    step = np.empty(6, np.float32)
    turned = np.empty((3, 4), np.float32)
    for i in range(poses.shape[0]):
        T = poses[i]
        for iteration in range(iterations):
            share = f4(iteration) / f4(max(1, iterations - 1))
            tukey = tukey_start * (tukey_end / tukey_start) ** share
            weight = normal_equations(T, surface, grid, radius, points, tukey, system)
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
def normal_equations(T, surface, grid, radius, points, tukey, system):  # noqa: PLR0915 - one loop, for speed
    """Write J^T W J into `system` (7, 7), where column 6 of J is the residual [m]; returns the sum of
    weights.

    A model point is matched with the pixel it falls on; the residual is along the mean of both normals.
    Columns 3 to 5 are rotations in units of the object's radius. The sums are kept in 28 variables, for a
    loop that stores nothing is vectorised. Only the lower triangle is written.
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
    depth, pixel_weight = grid.depth, grid.weight
    observed_x, observed_y, observed_z = grid.normals[0], grid.normals[1], grid.normals[2]
    sharp, gate = one / tukey, f4(6.25) * tukey * tukey
    inverse_fx, inverse_fy, per_radius = one / fx, one / fy, one / radius
    total = zero
    h00 = zero
    h10 = h11 = zero
    h20 = h21 = h22 = zero
    h30 = h31 = h32 = h33 = zero
    h40 = h41 = h42 = h43 = h44 = zero
    h50 = h51 = h52 = h53 = h54 = h55 = zero
    h60 = h61 = h62 = h63 = h64 = h65 = h66 = zero
    for k in range(points):
        x, y, w = X[k], Y[k], Z[k]
        px, py, pz = r00 * x + r01 * y + r02 * w, r10 * x + r11 * y + r12 * w, r20 * x + r21 * y + r22 * w
        z = max(f4(0.02), pz + t2)
        inverse = one / z
        column = np.int32((px + t0) * inverse * fx + cx + half)
        row = np.int32((py + t1) * inverse * fy + cy + half)
        column = min(max(column, first), last_column)
        row = min(max(row, first), last_row)
        seen = depth[row, column]
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
        u6 = ex * mx + ey * my + ez * mz
        u = u6 * sharp
        root = max(zero, one - u * u)
        weight = root * root * pixel_weight[row, column]
        weight *= max(zero, min(one, (parallel - f4(MIN_PARALLEL)) * f4(2.5)))
        weight *= one if seen > zero else zero
        weight *= one if ex * ex + ey * ey + ez * ez < gate else zero
        total += weight
        u0, u1, u2 = mx, my, mz
        u3, u4, u5 = (
            (py * mz - pz * my) * per_radius,
            (pz * mx - px * mz) * per_radius,
            (px * my - py * mx) * per_radius,
        )
        v0, v1, v2, v3, v4, v5, v6 = (
            weight * u0,
            weight * u1,
            weight * u2,
            weight * u3,
            weight * u4,
            weight * u5,
            weight * u6,
        )
        h00 += v0 * u0
        h10 += v1 * u0
        h11 += v1 * u1
        h20 += v2 * u0
        h21 += v2 * u1
        h22 += v2 * u2
        h30 += v3 * u0
        h31 += v3 * u1
        h32 += v3 * u2
        h33 += v3 * u3
        h40 += v4 * u0
        h41 += v4 * u1
        h42 += v4 * u2
        h43 += v4 * u3
        h44 += v4 * u4
        h50 += v5 * u0
        h51 += v5 * u1
        h52 += v5 * u2
        h53 += v5 * u3
        h54 += v5 * u4
        h55 += v5 * u5
        h60 += v6 * u0
        h61 += v6 * u1
        h62 += v6 * u2
        h63 += v6 * u3
        h64 += v6 * u4
        h65 += v6 * u5
        h66 += v6 * u6
    system[0, 0] = h00
    system[1, 0], system[1, 1] = h10, h11
    system[2, 0], system[2, 1], system[2, 2] = h20, h21, h22
    system[3, 0], system[3, 1], system[3, 2], system[3, 3] = h30, h31, h32, h33
    system[4, 0], system[4, 1], system[4, 2], system[4, 3], system[4, 4] = h40, h41, h42, h43, h44
    system[5, 0], system[5, 1], system[5, 2], system[5, 3], system[5, 4], system[5, 5] = (
        h50,
        h51,
        h52,
        h53,
        h54,
        h55,
    )
    system[6, 0], system[6, 1], system[6, 2], system[6, 3], system[6, 4], system[6, 5], system[6, 6] = (
        h60,
        h61,
        h62,
        h63,
        h64,
        h65,
        h66,
    )
    return total


@njit(**FAST)
def _solve(system, x):
    """Solve the upper left (6, 6) against row 6 by Cholesky, from the lower triangle alone, in place; False
    where it is singular.
    """
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
