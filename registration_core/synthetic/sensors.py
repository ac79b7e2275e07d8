# mypy: allow-untyped-defs
"""What a depth sensor makes of a perfect depth image: displaced rims, blended steps, noise, steps, holes.

A `Sensor` says how large each error is: 0 means that there is none, and each can be there without the others.
Kinds of sensors, with the ranges of their errors, are in `sensor_families`.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter, maximum_filter, minimum_filter
from scipy.special import ndtr

from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import EXACT

DepthImage = NDArray[np.float32]
Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

CELLS_A_RADIUS = 3
"""A wide field is drawn on a grid with at least so many cells in its radius, and interpolated."""
REACH = 2.0
"""Radii after which a blending kernel ends."""
GROWTH_STEP = 0.015
"""A smaller step than this lets no surface grow over another one, metres."""
ROUNDING_GAP = 0.1
"""Light that comes by way of another surface does so from no farther than this, metres at 1 m."""
ALMOST_THE_SAME = 0.7
"""Pixels by which a point may lie behind another one, as a second camera sees them, and still be seen."""


@dataclass(frozen=True)
class Sensor:
    """How large the errors are in one image. What is given at 1 m grows with distance squared."""

    # Where the depth of a pixel is measured.
    shift: tuple[float, float] = (0.0, 0.0)
    """Columns and rows by which all depth is displaced against the camera's pixels."""
    warp: float = 0.0
    """Standard deviation along each axis of a displacement that neighbours share, pixels: wavy rims."""
    warp_radius: float = 3.0
    """How far they share it, pixels."""
    jitter: float = 0.0
    """Standard deviation of a displacement of each pixel alone, pixels: frayed rims."""

    # Surfaces that run into each other.
    growth: float = 0.0
    """Radius of the window in which the nearest surface wins over others, pixels: it grows beyond its rim."""
    blend: float = 0.0
    """Radius of the window over which depth is averaged, pixels: fillets where things touch."""
    blend_gap: float = 0.02
    """Steps larger than this are not averaged over, metres at 1 m."""
    rounding: float = 0.0
    """Share in [0, 1] by which concave corners are drawn towards the average of their surroundings: light
    that comes by way of another surface."""
    rounding_radius: float = 10.0
    """Radius of those surroundings, pixels."""
    flying: float = 0.0
    """Share of the pixels at edges whose depth hangs between the two surfaces."""

    # Depth that is off.
    noise: float = 0.0
    """Standard deviation at 1 m of what is independent from pixel to pixel, metres."""
    waves: float = 0.0
    """The same of what neighbouring pixels share."""
    wave_radius: float = 4.0
    """How far they share it, pixels; their correlation falls to 1/e at twice that."""
    bias: float = 0.0
    """Error of the whole image at 1 m, metres."""
    offset: float = 0.0
    """Error of the whole image that does not grow with distance, metres."""
    step: float = 0.0
    """Quantisation step at 1 m, metres: the disparity is what is rounded."""
    unit: float = 0.0
    """What depth is stored in whole multiples of, metres."""

    # Pixels without a measurement.
    edge: float = 0.03
    """Metres between neighbours that make an edge of depth."""
    edge_holes: float = 0.0
    """Share of the pixels at such edges that are lost."""
    rim_holes: float = 0.0
    """Pixels to each side of such edges that are lost, on average; wavy, so that none or more may be."""
    rim_radius: float = 6.0
    """How far along a rim as many are lost, pixels."""
    baseline: float = 0.0
    """How far to the right of the camera stands the projector or second camera, metres: what it does not see
    is lost."""
    grazing: float = 0.0
    """Cosine between surface normal and ray under which holes begin; where it is 0 nothing is measured."""
    patches: float = 0.0
    """Share of the image that is lost in patches, as dark and shiny surfaces leave them."""
    patch_radius: float = 0.0
    """About half the width of such a patch, and of one where light grazes, pixels; 0: each pixel alone."""
    speckle_holes: float = 0.0
    """Share of single pixels that are lost anywhere."""
    blobs: int = 0
    """Largest number of round holes in an image."""
    lines: float = 0.0
    """Pixels from one lost line to the next, in columns and in rows: a pattern coarser than the image."""
    farthest: float = 4.0
    """Range, metres."""

    # Beside the depth image.
    color_shift: tuple[float, float] = (0.0, 0.0)
    """Columns and rows by which the colour image is displaced against depth."""


def measure(depth: DepthImage, camera: Intrinsics, rng: np.random.Generator, sensor: Sensor) -> DepthImage:
    """What the sensor measures of perfect depth (H, W) in metres, 0 = nothing; the result likewise."""
    seen = grown(displaced(depth, sensor, rng), sensor.growth)
    measured = shaken(seen, sensor.jitter, rng)
    measured = blended(measured, sensor.blend, sensor.blend_gap)
    measured = rounded(measured, sensor)
    measured = with_flying_pixels(measured, sensor, rng)
    measured = stored(quantised(noisy(measured, sensor, rng), sensor.step), sensor.unit)
    lost = holes(seen, camera, sensor, rng) | (measured > sensor.farthest)
    return np.where(lost, np.float32(0.0), measured)


def displaced(depth: DepthImage, sensor: Sensor, rng: np.random.Generator) -> DepthImage:
    """Depth looked up beside each pixel, in the same direction for neighbours."""
    if sensor.shift == (0.0, 0.0) and sensor.warp == 0.0:
        return depth
    columns, rows = (np.full(depth.shape, -amount) for amount in sensor.shift)
    if sensor.warp > 0.0:
        columns += sensor.warp * field(depth.shape, sensor.warp_radius, rng)
        rows += sensor.warp * field(depth.shape, sensor.warp_radius, rng)
    return looked_up(depth, rows, columns)


def shaken(depth: DepthImage, jitter: float, rng: np.random.Generator) -> DepthImage:
    """Depth looked up beside each pixel, for each in a direction of its own."""
    if jitter == 0.0:
        return depth
    rows, columns = rng.normal(0.0, jitter, (2, *depth.shape))
    return looked_up(depth, rows, columns)


def looked_up(depth: DepthImage, rows: Array, columns: Array) -> DepthImage:
    """Depth (H, W) of the pixel nearest to each one moved by `rows` and `columns` (H, W)."""
    height, width = depth.shape
    own_rows, own_columns = np.ogrid[:height, :width]
    from_rows = np.clip(own_rows + np.rint(rows).astype(np.int32), 0, height - 1)
    return depth[from_rows, np.clip(own_columns + np.rint(columns).astype(np.int32), 0, width - 1)]


def field(shape: tuple[int, ...], radius: float, rng: np.random.Generator) -> Array:
    """Random numbers (H, W) of standard deviation 1 about 0 that vary smoothly over `radius` pixels."""
    height, width = shape
    cell = max(1, int(radius / CELLS_A_RADIUS))
    if cell == 1:
        smooth = gaussian_filter(rng.normal(0.0, 1.0, shape), radius)
    else:
        nodes = rng.normal(0.0, 1.0, (height // cell + 2, width // cell + 2))
        smooth = np.empty(shape)
        _interpolate(gaussian_filter(nodes, radius / cell), cell, smooth)
    smooth /= smooth.std()
    return smooth


@njit(**EXACT)
def _interpolate(nodes, cell, out):
    """Fill `out` (H, W) linearly from a grid with a node every `cell` pixels."""
    for row in range(out.shape[0]):
        i, v = row // cell, (row % cell) / cell
        for column in range(out.shape[1]):
            j, u = column // cell, (column % cell) / cell
            upper = nodes[i, j] + u * (nodes[i, j + 1] - nodes[i, j])
            lower = nodes[i + 1, j] + u * (nodes[i + 1, j + 1] - nodes[i + 1, j])
            out[row, column] = upper + v * (lower - upper)


def grown(depth: DepthImage, radius: float) -> DepthImage:
    """Depth in which, up to `radius` pixels from a step, the nearest surface wins; 0 stays 0."""
    if radius < 1.0:
        return depth
    reach = np.arange(-int(radius), int(radius) + 1)
    disc = reach[:, None] ** 2 + reach**2 <= radius**2
    nearest = minimum_filter(np.where(depth > 0.0, depth, np.float32(np.inf)), footprint=disc)
    at_rims = maximum_filter(depth, footprint=disc) - nearest > GROWTH_STEP
    return np.where(at_rims & (depth > 0.0), nearest, depth)


def blended(depth: DepthImage, radius: float, gap: float) -> DepthImage:
    """Depth averaged over a Gaussian window of `radius` pixels, but not over steps larger than `gap` [m at
    1 m]; 0 stays 0.
    """
    if radius == 0.0:
        return depth
    reach = int(np.ceil(REACH * radius))
    weights = np.exp(-0.5 * (np.arange(reach + 1) / radius) ** 2)
    along_rows, both = np.empty_like(depth), np.empty_like(depth)
    _blend_rows(depth, weights, gap, along_rows)
    _blend_rows(along_rows.T, weights, gap, both.T)
    return both


@njit(**EXACT)
def _blend_rows(depth, weights, gap, out):
    """Average each row of `depth` (H, W) into `out`, with `weights` (reach + 1,) to both sides."""
    height, width = depth.shape
    for row in range(height):
        for column in range(width):
            here = depth[row, column]
            if here == 0.0:
                out[row, column] = 0.0
                continue
            most = gap * here * here
            total, mass = weights[0] * here, weights[0]
            for k in range(1, len(weights)):
                for other in (column - k, column + k):
                    if 0 <= other < width:
                        there = depth[row, other]
                        if there > 0.0 and abs(there - here) < most:
                            total += weights[k] * there
                            mass += weights[k]
            out[row, column] = total / mass


def rounded(depth: DepthImage, sensor: Sensor) -> DepthImage:
    """Depth with concave corners drawn towards the camera."""
    if sensor.rounding == 0.0:
        return depth
    around = blended(depth, sensor.rounding_radius, ROUNDING_GAP)
    return depth + np.float32(sensor.rounding) * np.minimum(around - depth, np.float32(0.0))


def with_flying_pixels(depth: DepthImage, sensor: Sensor, rng: np.random.Generator) -> DepthImage:
    """Depth with some of the pixels at edges anywhere between the two surfaces; 0 stays 0."""
    if sensor.flying == 0.0:
        return depth
    nearest = minimum_filter(np.where(depth > 0.0, depth, np.float32(np.inf)), size=3)
    farthest = maximum_filter(depth, size=3)
    flies = (depth > 0.0) & (farthest - nearest > sensor.edge) & (rng.random(depth.shape) < sensor.flying)
    flown = depth.copy()
    share = rng.random(np.count_nonzero(flies), dtype=np.float32)
    flown[flies] = nearest[flies] + share * (farthest - nearest)[flies]
    return flown


def noisy(depth: DepthImage, sensor: Sensor, rng: np.random.Generator) -> DepthImage:
    """Depth with what is off by distance squared and what is not; 0 stays 0."""
    error = sensor.noise * rng.normal(0.0, 1.0, depth.shape)
    if sensor.waves > 0.0:
        error += sensor.waves * field(depth.shape, sensor.wave_radius, rng)
    if sensor.bias != 0.0:
        error += sensor.bias
    measured = (depth + error * depth**2).astype(np.float32)
    if sensor.offset != 0.0:
        measured[depth > 0.0] += np.float32(sensor.offset)
    return measured


def quantised(depth: DepthImage, step: float) -> DepthImage:
    """Depth whose inverse is a multiple of `step` [1/m]; 0 stays 0."""
    if step == 0.0:
        return depth
    inverse = 1.0 / np.where(depth > 0.0, depth, np.inf)
    levels = np.rint(inverse / step) * step
    return (1.0 / np.where(levels > 0.0, levels, np.inf)).astype(np.float32)


def stored(depth: DepthImage, unit: float) -> DepthImage:
    """Depth in whole multiples of `unit`, metres."""
    return depth if unit == 0.0 else np.rint(depth / np.float32(unit)) * np.float32(unit)


def holes(depth: DepthImage, camera: Intrinsics, sensor: Sensor, rng: np.random.Generator) -> Mask:
    """Pixels (H, W) of which nothing is measured, whatever their depth."""
    lost = np.zeros(depth.shape, dtype=bool)
    if sensor.edge_holes > 0.0:
        lost |= at_edges(depth, sensor.edge) & (rng.random(depth.shape) < sensor.edge_holes)
    if sensor.rim_holes > 0.0:
        width = sensor.rim_holes * (1.0 + field(depth.shape, sensor.rim_radius, rng))
        lost |= distance_transform_edt(~at_edges(depth, sensor.edge)) + 0.5 < width
    if sensor.grazing > 0.0 or sensor.patches > 0.0:
        lost |= in_patches(depth, camera, sensor, rng)
    if sensor.speckle_holes > 0.0:
        lost |= rng.random(depth.shape) < sensor.speckle_holes
    if sensor.blobs > 0:
        lost |= round_holes(depth.shape, int(rng.integers(sensor.blobs + 1)), rng)
    if sensor.lines > 0.0:
        lost |= between_lines(depth.shape, sensor.lines, rng)
    if sensor.baseline != 0.0:
        lost |= in_shadow(depth, camera, sensor.baseline)
    return lost


def in_patches(depth: DepthImage, camera: Intrinsics, sensor: Sensor, rng: np.random.Generator) -> Mask:
    """Pixels (H, W) where too little light comes back, more of them where it grazes."""
    if sensor.patch_radius > 0.0:
        luck = ndtr(field(depth.shape, sensor.patch_radius, rng))
    else:
        luck = rng.random(depth.shape)
    seen = np.full(depth.shape, 1.0 - sensor.patches)
    if sensor.grazing > 0.0:
        seen *= np.minimum(facing(depth, camera) / sensor.grazing, 1.0)
    return np.asarray(luck > seen)


def at_edges(depth: DepthImage, edge: float) -> Mask:
    """Pixels with a neighbour that differs by more than `edge` metres."""
    return maximum_filter(depth, size=3) - minimum_filter(depth, size=3) > edge


def facing(depth: DepthImage, camera: Intrinsics) -> Array:
    """Cosine in [0, 1] between the surface's normal and the ray, for each pixel (H, W); small at edges."""
    cosines = np.zeros(depth.shape)
    _facing(depth, camera.fx, camera.fy, camera.cx, camera.cy, cosines)
    return cosines


@njit(**EXACT)
def _facing(depth, fx, fy, cx, cy, out):
    """Fill `out` (H, W) by differences between the neighbours to both sides, or to one at the border."""
    height, width = depth.shape
    for row in range(height):
        above, below = max(row - 1, 0), min(row + 1, height - 1)
        y = (row - cy) / fy
        for column in range(width):
            left, right = max(column - 1, 0), min(column + 1, width - 1)
            x, z = (column - cx) / fx, np.float64(depth[row, column])
            if z == 0.0:
                continue
            a, b = np.float64(depth[row, left]), np.float64(depth[row, right])
            c, d = np.float64(depth[above, column]), np.float64(depth[below, column])
            # Tangents along the row and along the column, not divided by the distance: only directions count.
            ux, uy, uz = b * ((right - cx) / fx) - a * ((left - cx) / fx), (b - a) * y, b - a
            vx, vy, vz = (d - c) * x, d * ((below - cy) / fy) - c * ((above - cy) / fy), d - c
            nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
            lengths = np.sqrt(nx * nx + ny * ny + nz * nz) * np.sqrt(x * x + y * y + 1.0)
            if lengths > 0.0:
                out[row, column] = abs(nx * x + ny * y + nz) / lengths


def round_holes(shape: tuple[int, ...], count: int, rng: np.random.Generator) -> Mask:
    """A mask (H, W) of `count` discs of 3 to 14 pixels radius, as dark or shiny spots leave them."""
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    lost = np.zeros(shape, dtype=bool)
    for _ in range(count):
        row, column, radius = rng.uniform(0, shape[0]), rng.uniform(0, shape[1]), rng.uniform(3.0, 14.0)
        lost |= (rows - row) ** 2 + (columns - column) ** 2 < radius**2
    return lost


def between_lines(shape: tuple[int, ...], period: float, rng: np.random.Generator) -> Mask:
    """A mask (H, W) of one column and one row in each `period`, the first ones at random."""
    starts = rng.uniform(0.0, period, 2)
    rows, columns = ((np.arange(n) + start) % period < 1.0 for n, start in zip(shape, starts, strict=True))
    return rows[:, None] | columns


def in_shadow(depth: DepthImage, camera: Intrinsics, baseline: float) -> Mask:
    """Pixels (H, W) that a projector or camera `baseline` metres to the right does not see."""
    hidden = np.zeros(depth.shape, dtype=bool)
    if baseline > 0.0:
        _hide(depth, baseline * camera.fx, hidden)
    else:
        _hide(depth[:, ::-1], -baseline * camera.fx, hidden[:, ::-1])
    return hidden


@njit(**EXACT)
def _hide(depth, disparity_at_1, hidden):
    """Mark what lies, seen from the right, behind something that is further to the right."""
    height, width = depth.shape
    for row in range(height):
        leftmost = np.inf
        for column in range(width - 1, -1, -1):
            if depth[row, column] > 0.0:
                place = column - disparity_at_1 / depth[row, column]
                hidden[row, column] = place > leftmost + ALMOST_THE_SAME
                leftmost = min(leftmost, place)
