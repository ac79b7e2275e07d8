# mypy: allow-untyped-defs
"""The paper's likelihood of a pose hypothesis: Eq. 3 to 5 on rendered depth images."""

import os
from concurrent.futures import ThreadPoolExecutor
from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.config import ParticleFilterConfig
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import EXACT, f4
from registration_core.rendering.rasterizer import draw_mesh, pixels_between
from registration_core.search.observation import NEAREST, window
from registration_core.search.viewpoint_model import ViewpointModel


class Likelihood(Protocol):
    """What a particle filter weighs its particles with."""

    def __call__(self, T_camera_centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log-weights (N,) of hypotheses (N, 4, 4); -inf where a hypothesis has no support at all."""
        ...


THREADS = os.cpu_count() or 1
"""Over which hypotheses are shared; each is weighed by itself, so that their number changes no weight."""

_threads = ThreadPoolExecutor(THREADS, "likelihood")


class RenderedLikelihood:
    """Eq. 3 to 5: a hypothesis is rendered with the sensor's intrinsics and compared pixel by pixel.

    The observed cloud is cropped to the points within the hypothesis's bounding sphere, widened by epsilon so
    that it holds every inlier: both shares of Eq. 5 are then at most 1.
    Only every k-th column and row is used where the object covers more pixels than are needed.
    """

    def __init__(
        self,
        model: ViewpointModel,
        depth: NDArray[np.float32],
        camera: Intrinsics,
        centre: NDArray[np.float64],
        reach: float,
        config: ParticleFilterConfig,
    ) -> None:
        left, top, right, bottom = window(camera, centre, model.radius, reach)
        across, down = strides(model, camera, float(centre[2]), config.silhouette_pixels)
        fx, fy = camera.fx / across, camera.fy / down
        # unmeasured rows around: a hypothesis that leaves the window must not gain by showing fewer pixels
        margin = int(np.ceil(2.0 * model.radius * max(fx, fy) / max(float(centre[2]), model.radius)))
        seen = np.pad(depth[top:bottom:down, left:right:across], margin)
        self._depth = np.where(seen > 0.0, seen, f4(np.inf))
        self._camera = (fx, fy, (camera.cx - left) / across + margin, (camera.cy - top) / down + margin)
        self._vertices = model.coarse_vertices
        self._faces = model.coarse_faces
        self._both_sides = not model.coarse_is_closed
        self._radius = model.radius
        self._config = config

    def __call__(self, T_camera_centre: NDArray[np.float64]) -> NDArray[np.float64]:
        weights = np.empty(len(T_camera_centre))
        parts = zip(
            np.array_split(np.ascontiguousarray(T_camera_centre), THREADS),
            np.array_split(weights, THREADS),
            strict=True,
        )
        list(_threads.map(self._weigh, *zip(*parts, strict=True)))
        with np.errstate(divide="ignore"):
            return np.log(weights)

    def _weigh(self, T_camera_centre: NDArray[np.float64], weights: NDArray[np.float64]) -> None:
        rendered_agreement(
            T_camera_centre, self._vertices, self._faces, self._both_sides, self._radius, self._depth,
            *self._camera, self._config.epsilon, self._config.alpha, self._config.beta, weights,
        )  # fmt: skip


def strides(model: ViewpointModel, camera: Intrinsics, distance: float, pixels: int) -> tuple[int, int]:
    """Steps (columns, rows) from one used pixel to the next, so that the mean silhouette covers about
    `pixels`, if it covers as many at all, and never fewer.
    """
    surplus = model.mean_area * camera.fx * camera.fy / max(distance, NEAREST) ** 2 / pixels
    across = max(1, int(np.sqrt(surplus)))
    return across, max(1, int(surplus / across))


@njit(**EXACT)
def rendered_agreement(
    poses, vertices, faces, both_sides, radius, depth, fx, fy, cx, cy, epsilon, alpha, beta, weights
):
    """W (N,) of Eq. 5 for poses (N, 4, 4); 0 where a hypothesis shows no pixel.

    Args:
        vertices, faces: the mesh (V, 3) and (F, 3), its bounding sphere about the origin of `radius`.
        depth: observed (H, W), metres, inf = no measurement, for the pinhole camera fx, fy, cx, cy.
        epsilon: Eq. 3, metres.
    """
    height, width = depth.shape
    u = ((np.arange(width) - cx) / fx).astype(np.float32)
    v = ((np.arange(height) - cy) / fy).astype(np.float32)
    inverse_depth = np.zeros((height, width), np.float32)
    points = np.empty((vertices.shape[0], 3))
    crop = radius + epsilon
    for i in range(poses.shape[0]):
        T = poses[i]
        for n in range(vertices.shape[0]):
            for a in range(3):
                points[n, a] = (
                    T[a, 0] * vertices[n, 0] + T[a, 1] * vertices[n, 1] + T[a, 2] * vertices[n, 2] + T[a, 3]
                )
        drawn = draw_mesh(points, faces, fx, fy, cx, cy, inverse_depth, None, both_sides)
        inliers, rendered = _compare(inverse_depth, depth, u, v, drawn, f4(epsilon * epsilon))
        x, y, z = T[0, 3], T[1, 3], T[2, 3]
        top, bottom = pixels_between(*_sphere_extent(y, z, crop, fy, cy, height), height)
        left, right = pixels_between(*_sphere_extent(x, z, crop, fx, cx, width), width)
        observed = _cropped(depth, u, v, (top, bottom, left, right), f4(x), f4(y), f4(z), f4(crop * crop))
        weights[i] = alpha * inliers / max(observed, 1) + beta * inliers / max(rendered, 1)  # Eq. 5


@njit(**EXACT)
def _compare(inverse_depth, depth, u, v, part, squared_epsilon):
    """(I of Eq. 4, N_r) in a part of the image, which is left cleared for the next hypothesis."""
    top, bottom, left, right = part
    inliers = rendered = 0
    for row in range(top, bottom):
        drawn, seen, across = inverse_depth[row, left:right], depth[row, left:right], u[left:right]
        rest = v[row] * v[row] + f4(1)
        for k in range(len(drawn)):
            # two points of one pixel lie on one ray: their distance is that of the depths, along the ray
            apart = f4(1) / drawn[k] - seen[k]
            inliers += apart * apart * (across[k] * across[k] + rest) < squared_epsilon  # Eq. 3
            rendered += drawn[k] > f4(0)
            drawn[k] = f4(0)
    return inliers, rendered


@njit(**EXACT)
def _cropped(depth, u, v, part, x, y, z, squared_radius):
    """N_b: the observed points in a part of the image that lie within a sphere about (x, y, z)."""
    top, bottom, left, right = part
    count = 0
    for row in range(top, bottom):
        seen, across, down = depth[row, left:right], u[left:right], v[row]
        for k in range(len(seen)):
            dx, dy, dz = across[k] * seen[k] - x, down * seen[k] - y, seen[k] - z
            count += dx * dx + dy * dy + dz * dz <= squared_radius
    return count


@njit(**EXACT)
def _sphere_extent(middle, z, radius, focal, principal, size):
    """(low, high) pixel along an axis of the image between which a sphere at (middle, z) can be seen."""
    if z <= -radius:
        return -1.0, -1.0
    if z - radius < 0.05:
        return 0.0, size - 1.0
    low, high = middle - radius, middle + radius
    return (
        low / (z - radius if low < 0.0 else z + radius) * focal + principal,
        high / (z - radius if high > 0.0 else z + radius) * focal + principal,
    )
