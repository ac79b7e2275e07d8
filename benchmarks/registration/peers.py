"""Registration by other libraries from the same starts, with the courtesies that make it faster and better.

They align the part of the model that is visible at the start with the points measured near it, coarse to
fine.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import open3d as o3d
import small_gicp
from numpy.typing import NDArray

from benchmarks.registration.instances import Instance
from benchmarks.registration.starts import Shell
from registration_core import SnapConfig, region_of_interest
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, depth_to_points
from registration_core.rendering.rasterizer import render_depth

Array = NDArray[np.float64]

REACH = 0.10
"""Points are taken up to this far outside of the model's bounding sphere at the start, metres."""
LEAST_POINTS = 300
"""Pixels with less of either are no cloud: a start is left as it is."""
VOXEL = 0.004
"""Points are thinned to one in such a cube, metres."""
NORMAL_RADIUS, NORMAL_POINTS = 0.015, 30
ICP_DISTANCES, GICP_DISTANCES = (0.05, 0.02, 0.008), (0.10, 0.05, 0.02, 0.01)
"""Largest distance of points that are matched, from stage to stage, metres."""
ITERATIONS = 30
SCORED_DISTANCE = 0.008
"""Distance within which a model point counts as explained when results are compared, metres."""


@dataclass(frozen=True, eq=False)
class Clouds:
    """What is aligned, points (N, 3) in camera axes, metres."""

    visible: Array
    """Of the model at the start."""
    observed: Array
    """Measured about it."""

    @property
    def suffice(self) -> bool:
        """Whether there is anything to align."""
        return min(len(self.visible), len(self.observed)) >= LEAST_POINTS


def clouds(instance: Instance, T_start: Array) -> Clouds:
    """The visible part of the model at the start, and the points measured about it."""
    left, top, width, height = region_of_interest(instance.model, instance.camera, T_start, SnapConfig())
    camera = instance.camera.cropped(left, top, width, height)
    observed = _points(instance.depth[top : top + height, left : left + width], camera)
    centre = pose.apply(T_start, instance.model.centre)
    near = np.linalg.norm(observed - centre, axis=1) < instance.model.radius + REACH
    return Clouds(_points(render_depth(instance.model, camera, T_start), camera), observed[near])


def _points(depth: NDArray[np.float32], camera: Intrinsics) -> Array:
    return depth_to_points(depth, camera)[depth > 0].astype(np.float64)


def open3d_icp(instance: Instance, T_start: Array) -> Array:
    """Open3D, point to plane."""
    both = clouds(instance, T_start)
    return _aligned(both.visible, _with_normals(both.observed), T_start)[1] if both.suffice else T_start


def open3d_best_of(instance: Instance, T_start: Array, shell: Shell, starts: int, seed: int) -> Array:
    """The same from the start and from others about it, drawn as wide as the shell: the best fit wins."""
    rng = np.random.default_rng(seed)
    both = clouds(instance, T_start)
    if not both.suffice:
        return T_start
    target = _with_normals(both.observed)
    results = [_aligned(both.visible, target, T_start)]
    T_centre = pose.from_rotation_translation(np.eye(3), instance.model.centre)
    for _ in range(starts - 1):
        moved = pose.perturbed(
            T_start @ T_centre, shell.translation * rng.random(), shell.rotation * rng.random(), rng
        ) @ pose.inverse(T_centre)
        visible = _visible(instance, moved)
        if len(visible) >= LEAST_POINTS:
            results.append(_aligned(visible, target, moved))
    return max(results, key=lambda result: result[0])[1]


def _visible(instance: Instance, T: Array) -> Array:
    try:
        left, top, width, height = region_of_interest(instance.model, instance.camera, T, SnapConfig())
    except ValueError:  # wholly outside the image
        return np.empty((0, 3))
    camera = instance.camera.cropped(left, top, width, height)
    return _points(render_depth(instance.model, camera, T), camera)


def _aligned(visible: Array, target: Any, T_start: Array) -> tuple[tuple[float, float], Array]:
    """How well it fits (share of model points explained, then the smaller residual), and the pose."""
    registration = o3d.pipelines.registration
    source = _cloud(visible)
    moved = np.eye(4)
    criteria = registration.ICPConvergenceCriteria(max_iteration=ITERATIONS)
    for distance in ICP_DISTANCES:
        method = registration.TransformationEstimationPointToPlane()
        moved = registration.registration_icp(
            source, target, distance, moved, method, criteria
        ).transformation
    fit = registration.evaluate_registration(source, target, SCORED_DISTANCE, moved)
    return (fit.fitness, -fit.inlier_rmse), pose.orthonormalised(np.asarray(moved) @ T_start)


def _cloud(points: Array) -> Any:
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)).voxel_down_sample(VOXEL)


def _with_normals(points: Array) -> Any:
    cloud = _cloud(points)
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(NORMAL_RADIUS, NORMAL_POINTS))
    cloud.orient_normals_towards_camera_location()
    return cloud


def gicp(instance: Instance, T_start: Array) -> Array:
    """small_gicp's GICP."""
    both = clouds(instance, T_start)
    if not both.suffice:
        return T_start
    target, tree = small_gicp.preprocess_points(both.observed, VOXEL, num_threads=1)
    source, _ = small_gicp.preprocess_points(both.visible, VOXEL, num_threads=1)
    moved = np.eye(4)
    for distance in GICP_DISTANCES:
        moved = small_gicp.align(
            target, source, tree, moved, registration_type="GICP", max_correspondence_distance=distance,
            num_threads=1, max_iterations=ITERATIONS,
        ).T_target_source  # fmt: skip
    return pose.orthonormalised(np.asarray(moved) @ T_start)
