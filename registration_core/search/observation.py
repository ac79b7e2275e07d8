# mypy: allow-untyped-defs
"""The depth image around the start, made ready: cropped, reduced, with normals and the supporting plane."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.config import ObservationConfig
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import FAST, Array32, f4, random_state
from registration_core.search.color_edges import color_changes
from registration_core.search.supporting_plane import find_plane, mark_plane
from registration_core.search.viewpoint_model import ViewpointModel

ALIGNMENT = 8
"""Crops start at multiples of this, pixels, so that every reduction falls on the same blocks of pixels."""

NEAREST = 0.15
"""Metres; the window is computed as if nothing could come nearer to the camera than this."""

FARTHEST = 100.0
"""Metres; what is measured beyond counts as not measured."""


class Grid(NamedTuple):
    """A reduced depth image as kernels take it; the outermost pixels are always 0, "not measured"."""

    depth: Array32
    """(H, W), metres."""
    normals: Array32
    """(3, H, W), towards the camera; 0 where unknown."""
    weight: Array32
    """(H, W), how much a match with a pixel counts."""
    fx: np.float32
    fy: np.float32
    cx: np.float32
    cy: np.float32
    known: NDArray[np.bool_]
    """(H, W), where a known object was seen: it hides what lies behind, and is no part of what is sought."""
    on_plane: NDArray[np.bool_]
    """(H, W), where the supporting plane was seen."""
    plane: NDArray[np.float64]
    """(4,), unit normal n and offset d of the supporting plane: `n p + d` is how far a point lies above it,
    on the camera's side, metres; all 0 where there is none."""
    changes: NDArray[np.bool_]
    """((H - 2) b, (W - 2) b), pixels of the image where the colour changes, as `color_changes` has it, b of
    them along an edge of one of the grid's; (0, 0) without a colour image."""


@dataclass(frozen=True, eq=False)
class Observation:
    """What a snap sees."""

    grid: Grid
    measured: int
    """Pixels of the grid with depth within reach of the object, but for those of known objects."""
    block: int
    """Pixels of the image along an edge of one of the grid's."""


def window(
    camera: Intrinsics, centre: NDArray[np.float64], radius: float, reach: float
) -> tuple[int, int, int, int]:
    """(left, top, right, bottom) of the pixels that a snap may look at, aligned, within the image.

    Args:
        centre: (3,), of the object at the start, camera axes, metres.
        radius: of the object, metres.
        reach: how far beyond it a snap looks, metres.
    """
    r = radius + reach
    z = max(centre[2] - reach, NEAREST)
    left = camera.fx * (centre[0] - r) / z + camera.cx
    right = camera.fx * (centre[0] + r) / z + camera.cx
    top = camera.fy * (centre[1] - r) / z + camera.cy
    bottom = camera.fy * (centre[1] + r) / z + camera.cy
    return (
        _aligned(left, camera.width, np.floor),
        _aligned(top, camera.height, np.floor),
        _aligned(right, camera.width, np.ceil),
        _aligned(bottom, camera.height, np.ceil),
    )


def _aligned(value: float, size: int, rounding: np.ufunc) -> int:
    return int(min(max(rounding(value / ALIGNMENT) * ALIGNMENT, 0), size))


def reduction(camera: Intrinsics, diameter: float, distance: float, pixels_across: int, most: int) -> int:
    """The largest of 1, 2, 4 ... `most` by which the image can be reduced with the object still resolved."""
    across = diameter * min(camera.fx, camera.fy) / max(distance, NEAREST)
    block = 1
    while block < most and across >= 2 * block * pixels_across:
        block *= 2
    return block


def observe(
    depth: NDArray[np.float32],
    camera: Intrinsics,
    centre: NDArray[np.float64],
    model: ViewpointModel,
    config: ObservationConfig,
    rng: np.random.Generator,
    explained: NDArray[np.bool_] | None = None,
    color: NDArray[np.uint8] | None = None,
) -> Observation:
    """Read the depth image (H, W), metres, around an object expected at `centre` (3,), camera axes.

    Args:
        explained: (H, W), the pixels of known objects; None where there are none.
        color: (H, W, 3), aligned with the depth; None where there is none.
    """
    bounds = window(camera, centre, model.radius, config.reach)
    return observe_region(depth, camera, bounds, float(centre[2]), model, config, rng, explained, color)


def observe_region(
    depth: NDArray[np.float32],
    camera: Intrinsics,
    bounds: tuple[int, int, int, int],
    distance: float,
    model: ViewpointModel,
    config: ObservationConfig,
    rng: np.random.Generator,
    explained: NDArray[np.bool_] | None = None,
    color: NDArray[np.uint8] | None = None,
) -> Observation:
    """Read the part (left, top, right, bottom) of the depth image (H, W), metres, in which an object is about
    `distance` [m] off.
    """
    left, top, right, bottom = bounds
    block = reduction(camera, model.diameter, distance, config.pixels_across, 4)
    rows, columns = max(bottom - top, 0) // block, max(right - left, 0) // block
    reduced = np.zeros((rows + 2, columns + 2), np.float32)
    part = depth[top:bottom, left:right]
    measured = np.ascontiguousarray(np.where((part > 0) & (part < FARTHEST), part, f4(0)))  # NaN is neither
    _reduce(measured, block, f4(config.depth_gap), reduced)
    # a block's centre lies (block - 1) / 2 pixels beyond its first pixel; the border shifts the grid by one
    fx, fy = f4(camera.fx / block), f4(camera.fy / block)
    cx = f4((camera.cx - left - (block - 1) / 2) / block + 1)
    cy = f4((camera.cy - top - (block - 1) / 2) / block + 1)
    normals = np.zeros((3, *reduced.shape), np.float32)
    _fit_normals(reduced, fx, fy, cx, cy, config.normal_radius, f4(config.depth_gap), normals)
    weight, known = np.ones_like(reduced), np.zeros(reduced.shape, np.bool_)
    if explained is not None:
        known[1:-1, 1:-1] = _reduced_mask(explained[top:bottom, left:right], block)
    changes = np.zeros((0, 0), np.bool_)
    if color is not None:
        changes = color_changes(color[top : top + rows * block, left : left + columns * block])
    on_plane = np.zeros_like(known)
    grid = Grid(reduced, normals, weight, fx, fy, cx, cy, known, on_plane, np.zeros(4), changes)
    unknown = grid._replace(depth=np.where(known, f4(0), reduced))
    plane = find_plane(unknown, config.plane_trials, f4(config.plane_tolerance), random_state(rng))
    silhouette = model.mean_area * float(fx) * float(fy) / max(distance, NEAREST) ** 2
    least = max(
        config.plane_share, config.plane_excess * silhouette / max(int(np.count_nonzero(unknown.depth)), 1)
    )
    if plane[4] > least:
        mark_plane(grid, plane, f4(config.plane_tolerance), grid.on_plane)
        grid.plane[:] = plane[:4] if plane[3] > 0 else -plane[:4]  # towards the camera
    grid.on_plane[known] = False
    weight[grid.on_plane] = f4(config.plane_weight)
    weight[known] = f4(0)
    near = np.abs(reduced - distance) < model.radius + config.reach
    return Observation(grid, int(np.count_nonzero(near & (unknown.depth > 0))), block)


@njit(**FAST)
def is_held_out(rows, columns):
    """Whether a snap leaves a pixel, or each of some, unread wherever it reduces the image: every other one,
    as on a checkerboard. Its result can be checked by them.
    """
    return (rows + columns) % 2 == 1


def _reduced_mask(mask: NDArray[np.bool_], block: int) -> NDArray[np.bool_]:
    """Blocks of which at least half is set."""
    rows, columns = mask.shape[0] // block, mask.shape[1] // block
    blocks = mask[: rows * block, : columns * block].reshape(rows, block, columns, block)
    return 2 * blocks.sum(axis=(1, 3)) >= block * block


@njit(**FAST)
def _reduce(depth, block, gap, out):
    """Mean of each block over the pixels within `gap` of its nearest one; `out` has a border of 1.

    Of a block of more than one pixel, every other one is left out: see `is_held_out`.
    A whole row of blocks is carried along together: the inner loops are then vectorised.
    """
    columns = out.shape[1] - 2
    far = f4(1e9)
    nearest, total, count = np.empty((3, columns), np.float32)
    step = 2 if block > 1 else 1
    for i in range(out.shape[0] - 2):
        nearest[:], total[:], count[:] = far, f4(0), f4(0)
        for a in range(block):
            for b in range(a % step, block, step):
                for j in range(columns):
                    z = depth[i * block + a, j * block + b]
                    nearest[j] = min(nearest[j], z if z > f4(0) else far)
        for a in range(block):
            for b in range(a % step, block, step):
                for j in range(columns):
                    z = depth[i * block + a, j * block + b]
                    m = f4(1) if z > f4(0) and z - nearest[j] < gap else f4(0)
                    total[j] += m * z
                    count[j] += m
        for j in range(columns):
            out[i + 1, j + 1] = total[j] / max(count[j], f4(1))


@njit(**FAST)
def _fit_normals(depth, fx, fy, cx, cy, radius, gap, out):
    """Normals towards the camera by least squares of z = a + b du + c dv over neighbours within `gap`.

    The sums of a whole row of pixels are carried along together: the inner loop is then vectorised.
    """
    height, width = depth.shape
    sums = np.empty((9, width), np.float32)
    n, su, sv, suu, svv, suv, sz, suz, svz = sums
    for i in range(radius, height - radius):
        sums[:] = f4(0)
        centre = depth[i]
        for a in range(-radius, radius + 1):
            neighbours, v = depth[i + a], f4(a)
            for b in range(-radius, radius + 1):
                u = f4(b)
                uu, vv, uv = u * u, v * v, u * v
                for j in range(radius, width - radius):
                    d = neighbours[j + b] - centre[j]
                    m = f4(1) if abs(d) < gap else f4(0)
                    d *= m
                    n[j] += m
                    su[j] += u * m
                    sv[j] += v * m
                    suu[j] += uu * m
                    svv[j] += vv * m
                    suv[j] += uv * m
                    sz[j] += d
                    suz[j] += u * d
                    svz[j] += v * d
        y = (f4(i) - cy) / fy
        for j in range(radius, width - radius):
            z = centre[j]
            if z <= f4(0) or n[j] < f4(6):
                continue
            per_count = f4(1) / n[j]
            duu = suu[j] - su[j] * su[j] * per_count
            dvv = svv[j] - sv[j] * sv[j] * per_count
            duv = suv[j] - su[j] * sv[j] * per_count
            duz = suz[j] - su[j] * sz[j] * per_count
            dvz = svz[j] - sv[j] * sz[j] * per_count
            determinant = duu * dvv - duv * duv
            if determinant < f4(1e-3) * n[j]:
                continue
            zu = (duz * dvv - dvz * duv) / determinant
            zv = (dvz * duu - duz * duv) / determinant
            x = (f4(j) - cx) / fx
            ax, ay, az = z / fx + x * zu, y * zu, zu
            bx, by, bz = x * zv, z / fy + y * zv, zv
            nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            scale = f4(1) / np.sqrt(nx * nx + ny * ny + nz * nz + f4(1e-20))
            if nx * x + ny * y + nz > f4(0):
                scale = -scale
            out[0, i, j], out[1, i, j], out[2, i, j] = nx * scale, ny * scale, nz * scale
