# mypy: allow-untyped-defs
"""Where the search looks first: about the operator's pose, or, without one, all over the observed surface."""

import numpy as np
from numba import njit

from registration_core.config import ProposalConfig
from registration_core.geometry.kernels import FAST, Array32, f4, normal, random_state, turn, uniform, view_of
from registration_core.search.observation import Grid
from registration_core.search.sparse_score import Prior, Surface

LARGEST_TURN = 2.8
"""Radians: the axis of a turn onto an almost opposite normal is not known."""


def around_start(
    prior: Prior,
    surface: Surface,
    grid: Grid,
    config: ProposalConfig,
    count: int,
    rng: np.random.Generator,
) -> Array32:
    """Poses (count, 3, 4), the start first, spread as the prior is wide."""
    poses = np.empty((count, 3, 4), np.float32)
    _around_start(
        prior.start, prior.translation, prior.rotation, np.array(config.scales,
        np.float32), f4(config.gaussian_share), f4(config.ray_share), f4(config.max_shift),
        f4(config.max_turn), config.tries, surface, grid, random_state(rng), poses,
    )  # fmt: skip
    return poses


@njit(**FAST)
def _around_start(
    start,
    translation,
    rotation,
    scales,
    gaussian_share,
    ray_share,
    max_shift,
    max_turn,
    tries,
    surface,
    grid,
    state,
    out,
):
    """Fill `out` (N, 3, 4).

    A draw is *anchored* so: a random visible point of the model is put on the observed pixel under it,
    along the viewing ray; then its normal is turned onto the observed normal, about that point. Pixels on
    the plane are avoided.
    """
    height, width = grid.depth.shape
    fx, fy, cx, cy = grid.fx, grid.fy, grid.cx, grid.cy
    least_cosine = np.cos(min(max_turn, f4(LARGEST_TURN)))
    out[0] = start
    for i in range(1, out.shape[0]):
        T = out[i]
        scale = scales[i % scales.shape[0]]
        r, s = rotation * scale, translation * scale
        turn(start, r * normal(state), r * normal(state), r * normal(state), T)
        kind = uniform(state)
        is_gaussian = kind < gaussian_share
        view = view_of(T, surface.view_of_cell)
        k = int(uniform(state) * surface.points.shape[2])
        x, y, z = turned_vector(T, surface.points[view, :, k])
        anchored = False
        row = column = 0
        seen = f4(0)
        for _ in range(1 if is_gaussian else tries):
            T[0, 3] = start[0, 3] + s * normal(state)
            T[1, 3] = start[1, 3] + s * normal(state)
            T[2, 3] = start[2, 3] + s * normal(state)
            depth = z + T[2, 3]
            if is_gaussian or depth < f4(0.05):
                continue
            per_depth = f4(1) / depth
            column_now = int(np.floor((x + T[0, 3]) * per_depth * fx + cx + f4(0.5)))
            row_now = int(np.floor((y + T[1, 3]) * per_depth * fy + cy + f4(0.5)))
            if column_now < 0 or row_now < 0 or column_now >= width or row_now >= height:
                continue
            seen_now = grid.depth[row_now, column_now]
            if seen_now <= f4(0) or abs(seen_now - depth) > max_shift:
                continue
            anchored = True
            row, column, seen = row_now, column_now, seen_now
            if not grid.on_plane[row, column] and not grid.known[row, column]:
                break
        if not anchored:
            continue
        ox, oy, oz = grid.normals[0, row, column], grid.normals[1, row, column], grid.normals[2, row, column]
        if kind > gaussian_share + ray_share and ox * ox + oy * oy + oz * oz > f4(0):
            a, b, c = turned_vector(T, surface.normals[view, :, k])
            if a * ox + b * oy + c * oz > least_cosine:
                turn_onto(T, a, b, c, ox, oy, oz)
                x, y, z = turned_vector(T, surface.points[view, :, k])
        T[0, 3] = (f4(column) - cx) / fx * seen - x
        T[1, 3] = (f4(row) - cy) / fy * seen - y
        T[2, 3] = seen - z


def anywhere(surface: Surface, grid: Grid, count: int, rng: np.random.Generator) -> Array32:
    """Poses (count, 3, 4), each with a point of the model on a pixel off the plane, normal on normal, turned
    about it at random; none where no pixel has a normal.
    """
    pixels = np.argwhere(~grid.on_plane & ~grid.known & (grid.normals != 0.0).any(axis=0)).astype(np.int32)
    poses = np.empty((count if len(pixels) else 0, 3, 4), np.float32)
    _anywhere(pixels, surface, grid, random_state(rng), poses)
    return poses


@njit(**FAST)
def _anywhere(pixels, surface, grid, state, out):
    T, turned = np.zeros((3, 4), np.float32), np.zeros((3, 4), np.float32)
    for i in range(out.shape[0]):
        row, column = pixels[int(uniform(state) * pixels.shape[0])]
        seen = grid.depth[row, column]
        view = int(uniform(state) * surface.points.shape[0])
        k = int(uniform(state) * surface.points.shape[2])
        T[:] = f4(0)
        T[0, 0] = T[1, 1] = T[2, 2] = f4(1)
        a, b, c = surface.normals[view, 0, k], surface.normals[view, 1, k], surface.normals[view, 2, k]
        if a * a + b * b + c * c == f4(0):  # a flat object seen edge-on shows no side
            c = f4(1)
        ox, oy, oz = grid.normals[0, row, column], grid.normals[1, row, column], grid.normals[2, row, column]
        if a * ox + b * oy + c * oz < f4(-0.9):  # opposite, nearly: half a turn about any axis across first
            ax, ay, az = (b, -a, f4(0)) if abs(c) < f4(0.9) else (f4(0), c, -b)
            half = f4(np.pi) / np.sqrt(ax * ax + ay * ay + az * az)
            turn(T, ax * half, ay * half, az * half, turned)
            T[:] = turned
            a, b, c = -a, -b, -c
        turn_onto(T, a, b, c, ox, oy, oz)
        spin = f4(2 * np.pi) * uniform(state)
        turn(T, ox * spin, oy * spin, oz * spin, out[i])
        x, y, z = turned_vector(out[i], surface.points[view, :, k])
        out[i, 0, 3] = (f4(column) - grid.cx) / grid.fx * seen - x
        out[i, 1, 3] = (f4(row) - grid.cy) / grid.fy * seen - y
        out[i, 2, 3] = seen - z


@njit(**FAST, inline="always")
def turn_onto(T, a, b, c, x, y, z):
    """Turn T (3, 4) by the smallest rotation that takes the unit vector (a, b, c) to (x, y, z), in camera
    axes; they must not be opposite.
    """
    u, v, w, cosine = b * z - c * y, c * x - a * z, a * y - b * x, a * x + b * y + c * z
    share = f4(1) / (f4(1) + cosine)
    for j in range(3):
        p, q, r = T[0, j], T[1, j], T[2, j]
        along = (u * p + v * q + w * r) * share
        T[0, j] = cosine * p + v * r - w * q + along * u
        T[1, j] = cosine * q + w * p - u * r + along * v
        T[2, j] = cosine * r + u * q - v * p + along * w


@njit(**FAST, inline="always")
def turned_vector(T, v):
    """R v of a pose (3, 4)."""
    return (
        T[0, 0] * v[0] + T[0, 1] * v[1] + T[0, 2] * v[2],
        T[1, 0] * v[0] + T[1, 1] * v[1] + T[1, 2] * v[2],
        T[2, 0] * v[0] + T[2, 1] * v[1] + T[2, 2] * v[2],
    )
