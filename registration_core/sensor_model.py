"""What a structured-light depth sensor makes of a perfect depth image: noise, steps and holes."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, maximum_filter, minimum_filter

from registration_core.camera import Intrinsics, depth_to_points

DepthImage = NDArray[np.float32]


@dataclass(frozen=True)
class SensorModel:
    """How good the sensor is; the defaults resemble a first-generation Kinect or PrimeSense."""

    noise: float = 0.0010
    """Standard deviation at 1 m, independent from pixel to pixel, metres; grows with distance squared."""
    smooth_noise: float = 0.0007
    """The same for noise shared by neighbouring pixels."""
    smooth_radius: float = 4.0
    """How far that noise is shared, pixels."""
    step: float = 0.0010
    """Quantisation step at 1 m, metres; grows with distance squared, as the disparity is what is rounded."""
    jitter: float = 0.5
    """How far beside its pixel a depth may be measured, standard deviation in pixels."""
    edge: float = 0.03
    """Metres between neighbours that make an edge of depth."""
    edge_holes: float = 0.7
    """Share of pixels at such edges without a measurement."""
    grazing: float = 0.2
    """Cosine between surface normal and ray under which holes begin; at 0 there is nothing but holes."""
    speckle_holes: float = 0.01
    """Share of pixels without a measurement anywhere."""
    blobs: int = 6
    """Largest number of round holes in an image."""
    farthest: float = 4.0
    """Range, metres."""


def sensed(
    depth: DepthImage, camera: Intrinsics, rng: np.random.Generator, sensor: SensorModel = SensorModel()
) -> DepthImage:
    """What the sensor measures of perfect depth (H, W) in metres, 0 = nothing; the result likewise."""
    measured = shaken(depth, sensor.jitter, rng)
    measured = quantised(noisy(measured, sensor, rng), sensor.step)
    lost = at_edges(depth, sensor.edge) & (rng.random(depth.shape) < sensor.edge_holes)
    lost |= rng.random(depth.shape) > facing(depth, camera) / sensor.grazing
    lost |= rng.random(depth.shape) < sensor.speckle_holes
    lost |= round_holes(depth.shape, int(rng.integers(sensor.blobs + 1)), rng)
    lost |= measured > sensor.farthest
    return np.where(lost, np.float32(0.0), measured)


def shaken(depth: DepthImage, jitter: float, rng: np.random.Generator) -> DepthImage:
    """Depth looked up a little beside each pixel, which frays edges."""
    height, width = depth.shape
    rows, columns = np.mgrid[:height, :width] + np.rint(rng.normal(0.0, jitter, (2, height, width))).astype(
        int
    )
    return depth[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]


def noisy(depth: DepthImage, sensor: SensorModel, rng: np.random.Generator) -> DepthImage:
    """Depth with noise that grows with distance squared; 0 stays 0."""
    independent = rng.normal(0.0, 1.0, depth.shape)
    shared = gaussian_filter(rng.normal(0.0, 1.0, depth.shape), sensor.smooth_radius)
    shared /= shared.std()
    return (depth + (sensor.noise * independent + sensor.smooth_noise * shared) * depth**2).astype(np.float32)


def quantised(depth: DepthImage, step: float) -> DepthImage:
    """Depth whose inverse is a multiple of `step` [1/m]; 0 stays 0."""
    inverse = 1.0 / np.where(depth > 0.0, depth, np.inf)
    levels = np.rint(inverse / step) * step
    return (1.0 / np.where(levels > 0.0, levels, np.inf)).astype(np.float32)


def at_edges(depth: DepthImage, edge: float) -> NDArray[np.bool_]:
    """Pixels with a neighbour that differs by more than `edge` metres."""
    return maximum_filter(depth, size=3) - minimum_filter(depth, size=3) > edge


def facing(depth: DepthImage, camera: Intrinsics) -> NDArray[np.float64]:
    """Cosine in [0, 1] between the surface's normal and the ray, for each pixel (H, W)."""
    points = depth_to_points(depth, camera).astype(np.float64)
    normals = np.cross(np.gradient(points, axis=1), np.gradient(points, axis=0))
    lengths = np.linalg.norm(normals, axis=2) * np.linalg.norm(points, axis=2)
    dots = np.abs(np.einsum("ijk,ijk->ij", normals, points))
    return np.divide(dots, lengths, out=np.zeros_like(dots), where=lengths > 0.0)


def round_holes(shape: tuple[int, ...], count: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """A mask (H, W) of `count` discs of 3 to 14 pixels radius, as dark or shiny spots leave them."""
    rows, columns = np.ogrid[: shape[0], : shape[1]]
    holes = np.zeros(shape, dtype=bool)
    for _ in range(count):
        row, column, radius = rng.uniform(0, shape[0]), rng.uniform(0, shape[1]), rng.uniform(3.0, 14.0)
        holes |= (rows - row) ** 2 + (columns - column) ** 2 < radius**2
    return holes
