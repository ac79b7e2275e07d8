# mypy: allow-untyped-defs
"""Sparse agreement: a pose hypothesis scored without rendering.

Stored surface points are looked up in the depth image, a hundred times faster than rendering. The score
also counts what Eq. 5 does not see: surface claimed where the sensor saw through, and observed surface that
goes on beyond the silhouette.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.config import AgreementConfig
from registration_core.geometry.kernels import FAST, Array32, f4, squared_angle, view_of
from registration_core.search.viewpoint_model import ViewpointModel

MIN_DEPTH = 0.02
"""Points nearer to the camera plane than this are looked up as if they were that far, metres."""


class Surface(NamedTuple):
    """The parts of a ViewpointModel that kernels take."""

    points: Array32
    normals: Array32
    ring: Array32
    area: Array32
    view_of_cell: NDArray[np.int32]


def surface_of(model: ViewpointModel) -> Surface:
    """The arrays of a viewpoint model, for kernels."""
    return Surface(model.points, model.normals, model.ring, model.area, model.view_of_cell)


class Prior(NamedTuple):
    """Where the operator put the object, and how sure that is."""

    start: Array32
    """(3, 4)."""
    translation: np.float32
    """Metres."""
    rotation: np.float32
    """Radians."""


def agreement_weights(config: AgreementConfig, softening: float = 1.0) -> Array32:
    """Weights (6,) for `sparse_score`; `softening` scales the penalties."""
    return np.array(
        [
            config.free * softening,
            config.missing,
            config.ring * softening,
            config.clear,
            config.area,
            config.prior,
        ],
        np.float32,
    )


@njit(**FAST)
def sparse_score(poses, surface, grid, prior, points, ring_points, epsilon, with_normals, weights, out):  # noqa: PLR0915 - one loop, for speed
    """Agreement of poses (N, 3, 4) with the observation, about 1 for a perfect fit in full view.

    `A (match - free F - missing M) + clear C - ring G - prior P` with shares of points: match (within
    epsilon, falling off linearly, times the pixel's weight and, if asked, the agreement of the normals), F
    seen through, M unmeasured, C ring points before a farther background, G ring points on a surface that
    goes on; A grows with the area of the view. What lies in front of the object hides it and costs no more
    than the match it prevents.

    Args:
        points, ring_points: how many of the stored points to look up.
        epsilon: metres.
        weights: as `agreement_weights` gives them.
        out: (N,), filled with the agreement.
    """
    fx, fy, cx, cy = grid.fx, grid.fy, grid.cx, grid.cy
    last_row, last_column = np.int32(grid.depth.shape[0] - 1), np.int32(grid.depth.shape[1] - 1)
    first = np.int32(0)
    zero, one, half, near = f4(0), f4(1), f4(0.5), f4(MIN_DEPTH)
    depth, pixel_weight = grid.depth, grid.weight
    observed_x, observed_y, observed_z = grid.normals[0], grid.normals[1], grid.normals[2]
    sharp = one / epsilon
    w_free, w_missing, w_ring, w_clear, w_area, w_prior = weights
    for i in range(poses.shape[0]):
        T = poses[i]
        r00, r01, r02, t0 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
        r10, r11, r12, t1 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
        r20, r21, r22, t2 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
        # projection with the intrinsics folded into the pose
        a0, a1, a2, a3 = fx * r00 + cx * r20, fx * r01 + cx * r21, fx * r02 + cx * r22, fx * t0 + cx * t2
        b0, b1, b2, b3 = fy * r10 + cy * r20, fy * r11 + cy * r21, fy * r12 + cy * r22, fy * t1 + cy * t2
        view = view_of(T, surface.view_of_cell)
        X, Y, Z = surface.points[view, 0], surface.points[view, 1], surface.points[view, 2]
        NX, NY, NZ = surface.normals[view, 0], surface.normals[view, 1], surface.normals[view, 2]
        match = free = missing = zero
        for k in range(points):
            x, y, w = X[k], Y[k], Z[k]
            z = max(near, r20 * x + r21 * y + r22 * w + t2)
            inverse = one / z
            column = np.int32((a0 * x + a1 * y + a2 * w + a3) * inverse + half)
            row = np.int32((b0 * x + b1 * y + b2 * w + b3) * inverse + half)
            column = min(max(column, first), last_column)
            row = min(max(row, first), last_row)
            seen = depth[row, column]
            behind = (seen - z) * sharp
            hit = pixel_weight[row, column] * max(zero, one - abs(behind))
            if with_normals:
                ox, oy, oz = observed_x[row, column], observed_y[row, column], observed_z[row, column]
                a, b, c = NX[k], NY[k], NZ[k]
                dot = (
                    (r00 * a + r01 * b + r02 * c) * ox
                    + (r10 * a + r11 * b + r12 * c) * oy
                    + (r20 * a + r21 * b + r22 * c) * oz
                )
                parallel = min(one, max(f4(0.1), (dot - f4(0.2)) * f4(1.6)))
                hit *= f4(0.7) if abs(ox) + abs(oy) + abs(oz) == zero else parallel
            match += hit
            free += min(one, max(zero, behind - one))
            missing += one if seen <= zero else zero
        X, Y, Z = surface.ring[view, 0], surface.ring[view, 1], surface.ring[view, 2]
        continuing = clear = zero
        for k in range(ring_points):
            x, y, w = X[k], Y[k], Z[k]
            z = max(near, r20 * x + r21 * y + r22 * w + t2)
            inverse = one / z
            column = np.int32((a0 * x + a1 * y + a2 * w + a3) * inverse + half)
            row = np.int32((b0 * x + b1 * y + b2 * w + b3) * inverse + half)
            column = min(max(column, first), last_column)
            row = min(max(row, first), last_row)
            behind = (depth[row, column] - z) * sharp
            continuing += max(zero, one - half * abs(behind))
            clear += one if behind > f4(2) else zero
        shown = one - w_area + w_area * surface.area[view]
        out[i] = (
            shown * (match - w_free * free - w_missing * missing) / f4(points)
            + (w_clear * clear - w_ring * continuing) / f4(ring_points)
            - w_prior * heavy_tail(T, prior, f4(1.5))
        )


@njit(**FAST)
def heavy_tail(T, prior, tail):
    """`log(1 + tail d^2)` where d is the distance from the start in units of the prior's spread."""
    dx, dy, dz = T[0, 3] - prior.start[0, 3], T[1, 3] - prior.start[1, 3], T[2, 3] - prior.start[2, 3]
    translation = (dx * dx + dy * dy + dz * dz) / (prior.translation * prior.translation)
    rotation = squared_angle(T, prior.start) / (prior.rotation * prior.rotation)
    return np.log(f4(1) + tail * (translation + rotation))


def heavy_tails(poses: Array32, prior: Prior) -> NDArray[np.float64]:
    """`log(1 + d^2 / 2)` (N,) for poses (N, 3, 4), d being the distance from the start in spreads of the
    prior.
    """
    return np.array([heavy_tail(T, prior, f4(0.5)) for T in poses], dtype=np.float64)
