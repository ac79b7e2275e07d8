# mypy: allow-untyped-defs
"""The paper's likelihood of a pose hypothesis: Eq. 3 to 5 on rendered depth images."""

from typing import Protocol

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.camera import Intrinsics
from registration_core.kernels import EXACT
from registration_core.observation import reduction, window
from registration_core.rasterizer import draw_mesh
from registration_core.snap_config import ParticleFilterConfig
from registration_core.viewpoint_model import ViewpointModel


class Likelihood(Protocol):
    """What a particle filter weighs its particles with."""

    def __call__(self, T_camera_centre: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log-weights (N,) of hypotheses (N, 4, 4); -inf where a hypothesis has no support at all."""
        ...


class RenderedLikelihood:
    """Eq. 3 to 5: a hypothesis is rendered with the sensor's intrinsics and compared pixel by pixel.

    The observed cloud is cropped to the points within the hypothesis's bounding sphere, widened by epsilon so
    that it holds every inlier: both shares of Eq. 5 are then at most 1.
    Every k-th row and column is used, where the object spans more pixels than are needed.
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
        step = reduction(camera, model.diameter, float(centre[2]), config.pixels_across, 8)
        # unmeasured rows around: a hypothesis that leaves the window must not gain by showing fewer pixels
        margin = int(np.ceil(2.0 * model.radius * camera.fx / step / max(float(centre[2]), model.radius)))
        self._depth = np.pad(depth[top:bottom:step, left:right:step], margin)
        self._camera = (
            camera.fx / step,
            camera.fy / step,
            (camera.cx - left) / step + margin,
            (camera.cy - top) / step + margin,
        )
        self._vertices = model.coarse_vertices
        self._faces = model.coarse_faces
        self._both_sides = not model.coarse_is_closed
        self._radius = model.radius
        self._config = config

    def __call__(self, T_camera_centre: NDArray[np.float64]) -> NDArray[np.float64]:
        weights = np.empty(len(T_camera_centre))
        rendered_agreement(
            np.ascontiguousarray(T_camera_centre),
            self._vertices, self._faces, self._both_sides, self._radius,
            self._depth, *self._camera, self._config.epsilon, self._config.alpha, self._config.beta, weights,
        )  # fmt: skip
        with np.errstate(divide="ignore"):
            return np.log(weights)


@njit(**EXACT)
def rendered_agreement(  # noqa: PLR0912 - one loop, for speed
    poses, vertices, faces, both_sides, radius, depth, fx, fy, cx, cy, epsilon, alpha, beta, weights
):
    """W (N,) of Eq. 5 for poses (N, 4, 4); 0 where a hypothesis shows no pixel.

    Args:
        vertices, faces: the mesh (V, 3) and (F, 3), its bounding sphere about the origin of `radius`.
        depth: observed (H, W), metres, 0 = no measurement, for the pinhole camera fx, fy, cx, cy.
        epsilon: Eq. 3, metres.
    """
    height, width = depth.shape
    per_fx, per_fy = 1.0 / fx, 1.0 / fy
    crop = radius + epsilon
    inverse_depth = np.zeros((height, width))
    points = np.empty((vertices.shape[0], 3))
    for i in range(poses.shape[0]):
        T = poses[i]
        for v in range(vertices.shape[0]):
            for a in range(3):
                points[v, a] = (
                    T[a, 0] * vertices[v, 0] + T[a, 1] * vertices[v, 1] + T[a, 2] * vertices[v, 2] + T[a, 3]
                )
        x, y, z = T[0, 3], T[1, 3], T[2, 3]
        left, right = _sphere_extent(x, z, crop, fx, cx, width)
        top, bottom = _sphere_extent(y, z, crop, fy, cy, height)
        weights[i] = 0.0
        if left >= right or top >= bottom:
            continue
        for row in range(top, bottom):
            for column in range(left, right):
                inverse_depth[row, column] = 0.0
        draw_mesh(points, faces, fx, fy, cx, cy, inverse_depth, None, both_sides)
        inliers = observed = rendered = 0
        for row in range(top, bottom):
            v = (row - cy) * per_fy
            for column in range(left, right):
                u = (column - cx) * per_fx
                q, seen = inverse_depth[row, column], depth[row, column]
                if seen > 0.0 and abs(seen - z) <= crop:
                    dx, dy, dz = u * seen - x, v * seen - y, seen - z
                    if dx * dx + dy * dy + dz * dz <= crop * crop:
                        observed += 1
                if q > 0.0:
                    rendered += 1
                    # two points of one pixel lie on one ray: their distance is that of the depths, along
                    # the ray
                    apart = 1.0 / q - seen
                    if seen > 0.0 and apart * apart * (u * u + v * v + 1.0) < epsilon * epsilon:  # Eq. 3
                        inliers += 1  # Eq. 4
        if rendered > 0:
            weights[i] = alpha * inliers / max(observed, 1) + beta * inliers / rendered  # Eq. 5


@njit(**EXACT)
def _sphere_extent(middle, z, radius, focal, principal, size):
    """(first, end) of the columns, or rows, in which a sphere at (middle, z) can be seen."""
    if z <= -radius:
        return 0, 0
    if z - radius < 0.05:
        return 0, size
    low, high = middle - radius, middle + radius
    first = low / (z - radius if low < 0.0 else z + radius) * focal + principal
    last = high / (z - radius if high > 0.0 else z + radius) * focal + principal
    return int(max(0.0, np.floor(first))), int(min(size - 1.0, np.ceil(last))) + 1
