"""How wrong an estimated pose is, as bop_toolkit defines it: ADD(-S), MSSD, MSPD, VSD and their parts.

Poses are `T_camera_object` (4, 4). Symmetries are transforms (S, 4, 4) in the object's frame, identity first,
as `ObjectModel.symmetry_transforms` gives them; an error is the least one over them.
Sources: Hodan et al., "BOP: Benchmark for 6D Object Pose Estimation" (ECCV 2018) and the BOP Challenge 2019;
Hinterstoisser et al. (ACCV 2012) for ADD and ADD-S.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics, project

Array = NDArray[np.float64]

NO_SYMMETRY = np.eye(4)[None]
"""(1, 4, 4): the identity alone."""

VSD_DELTA = 0.015
"""Metres a model's surface may lie behind the observed one and still count as visible."""

VSD_TAUS = tuple(np.arange(1, 11) * 0.05)
"""Misalignment tolerances of the BOP challenge, shares of the diameter."""


def translation_error(T_estimate: Array, T_truth: Array) -> float:
    """Distance between the object's origins, metres."""
    return float(np.linalg.norm(T_estimate[:3, 3] - T_truth[:3, 3]))


def rotation_error(T_estimate: Array, T_truth: Array, symmetries: Array = NO_SYMMETRY) -> float:
    """Angle between the rotations, radians."""
    equivalent = T_truth[:3, :3] @ symmetries[:, :3, :3]
    return min(pose.rotation_angle(T_estimate[:3, :3].T @ R) for R in equivalent)


def add(T_estimate: Array, T_truth: Array, points: Array) -> float:
    """Mean distance between model points (N, 3) in both poses, metres."""
    distances = np.linalg.norm(pose.apply(T_estimate, points) - pose.apply(T_truth, points), axis=1)
    return float(distances.mean())


def adi(T_estimate: Array, T_truth: Array, points: Array) -> float:
    """ADD-S: mean distance from each model point in the true pose to the nearest in the estimate, metres."""
    distances, _ = cKDTree(pose.apply(T_estimate, points)).query(pose.apply(T_truth, points))
    return float(distances.mean())


def mssd(T_estimate: Array, T_truth: Array, points: Array, symmetries: Array = NO_SYMMETRY) -> float:
    """Largest distance between model points (N, 3) in both poses, metres.

    The distance is convex in the point, so the corners of the convex hull give the same value as all points.
    """
    difference = T_estimate - T_truth @ symmetries
    displaced = np.einsum("sij,nj->sni", difference[:, :3, :3], points) + difference[:, None, :3, 3]
    return float(np.linalg.norm(displaced, axis=2).max(axis=1).min())


def mspd(
    T_estimate: Array, T_truth: Array, points: Array, camera: Intrinsics, symmetries: Array = NO_SYMMETRY
) -> float:
    """Largest distance between the projections of model points (N, 3) in both poses, pixels.

    All points must lie in front of the camera.
    """
    estimated = project(pose.apply(T_estimate, points), camera)
    equivalent = T_truth @ symmetries
    true = np.einsum("sij,nj->sni", equivalent[:, :3, :3], points) + equivalent[:, None, :3, 3]
    return float(np.linalg.norm(project(true, camera) - estimated, axis=2).max(axis=1).min())


def vsd(
    depth_estimate: NDArray[np.floating],
    depth_truth: NDArray[np.floating],
    depth_observed: NDArray[np.floating],
    camera: Intrinsics,
    diameter: float,
    delta: float = VSD_DELTA,
    taus: tuple[float, ...] = VSD_TAUS,
) -> Array:
    """Share in [0, 1] of the visible surface that does not match, one for each of `taus` (T,).

    Args:
        depth_estimate: the object rendered in the estimated pose (H, W), metres, 0 where it is not.
        depth_truth: the same in the true pose.
        depth_observed: the sensor's depth (H, W), metres, 0 where nothing was measured.
        camera: the camera of all three.
        diameter: the object's, metres; distances are compared as shares of it.
        delta: visibility tolerance, metres.
        taus: misalignment tolerances, shares of the diameter.
    """
    ray_lengths = lengths_per_depth(camera)
    estimate, truth, observed = (
        depth * ray_lengths for depth in (depth_estimate, depth_truth, depth_observed)
    )
    visible_truth = visible(truth, observed, delta)
    visible_estimate = visible(estimate, observed, delta) | (visible_truth & (estimate > 0))
    both = visible_truth & visible_estimate
    union = np.count_nonzero(visible_truth | visible_estimate)
    if union == 0:
        return np.ones(len(taus))
    distances = np.abs(truth[both] - estimate[both]) / diameter
    mismatched = (distances[:, None] >= np.array(taus)).sum(axis=0)
    return (mismatched + union - np.count_nonzero(both)) / union


def visible(rendered: Array, observed: Array, delta: float) -> NDArray[np.bool_]:
    """Pixels (H, W) where a rendered surface shows: not hidden, or nothing measured (rule of BOP 2019)."""
    return (rendered > 0) & ((rendered - observed <= delta) | (observed == 0))


def lengths_per_depth(camera: Intrinsics) -> Array:
    """Distance from the camera's centre of a point at depth 1, for each pixel (H, W)."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    return np.sqrt(x**2 + y[:, None] ** 2 + 1.0)
