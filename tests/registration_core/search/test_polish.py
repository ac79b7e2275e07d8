"""Gauss-Newton recovers a known pose from close by, and knows what it does not know."""

import numpy as np
from scipy.spatial.transform import Rotation

from registration_core import Intrinsics, SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred, from_rows, to_rows
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.observation import observe
from registration_core.search.polish import FINAL_TUKEY, covariance, eased, polish, systems
from registration_core.search.sparse_score import surface_of
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of, tool

CAMERA = Intrinsics(320, 240, 300.0, 300.0, 159.5, 119.5)


def seen(model, truth):
    """(viewpoint model, grid, T_camera_centre) of an object alone in the image."""
    viewpoints = viewpoint_model(model)
    start = centred(truth, viewpoints.centre)
    observation = observe(
        render_depth(model, CAMERA, truth), CAMERA, start[:3, 3], viewpoints, SnapConfig().observation,
        np.random.default_rng(0),
    )  # fmt: skip
    return viewpoints, observation.grid, start


def test_recovers_the_pose_from_close_by() -> None:
    viewpoints, grid, truth = seen(tool(), pose.exp([0.02, 0.0, 0.6, -2.0, 0.3, 0.4]))
    starts = np.stack([pose.perturbed(truth, 0.008, 0.08, np.random.default_rng(k)) for k in range(10)])
    polished = polish(
        to_rows(starts), surface_of(viewpoints), grid, viewpoints.radius, 256, 14, (0.015, 0.004)
    )
    for T in from_rows(polished):
        apart = pose.distance(T, truth)
        assert apart.translation < 0.002
        assert apart.rotation < np.radians(1.5)


def test_pose_without_contact_is_left_alone() -> None:
    viewpoints, grid, truth = seen(tool(), pose.exp([0.0, 0.0, 0.6, -2.0, 0.3, 0.4]))
    away = truth.copy()
    away[2, 3] -= 0.3
    rows = to_rows(away)
    np.testing.assert_array_equal(
        polish(rows, surface_of(viewpoints), grid, viewpoints.radius, 256, 5, (0.02, 0.01)), rows
    )


def test_steps_from_the_systems_of_many_poses_lead_to_the_pose() -> None:
    viewpoints, grid, truth = seen(tool(), pose.exp([0.02, 0.0, 0.6, -2.0, 0.3, 0.4]))
    poses = np.stack([pose.perturbed(truth, 0.004, 0.02, np.random.default_rng(k)) for k in range(6)])
    for _ in range(6):
        hessians, sides, weights = systems(
            to_rows(poses), surface_of(viewpoints), grid, viewpoints.radius, 256, 0.01
        )
        np.testing.assert_allclose(hessians, hessians.transpose(0, 2, 1))
        assert (weights > 100).all()
        steps = np.linalg.solve(hessians, sides[:, :, None])[:, :, 0]
        poses[:, :3, 3] += steps[:, :3]
        turned = Rotation.from_rotvec(steps[:, 3:] / viewpoints.radius).as_matrix()
        poses[:, :3, :3] = turned @ poses[:, :3, :3]
    for T in poses:
        apart = pose.distance(T, truth)
        assert apart.translation < 0.002
        assert apart.rotation < np.radians(1.0)


def hessian_at(model, truth):
    viewpoints, grid, T = seen(model, truth)
    hessians, _, _ = systems(to_rows(T), surface_of(viewpoints), grid, viewpoints.radius, 256, FINAL_TUKEY)
    return viewpoints, T, hessians[0]


FLAT = pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0])


def test_flat_face_is_known_in_depth_and_tilt_only() -> None:
    viewpoints, T, hessian = hessian_at(model_of(block((0.12, 0.12, 0.02))), FLAT)
    C = covariance(hessian, T[:3, :3], viewpoints.radius, viewpoints.centre)
    np.testing.assert_allclose(C, C.T)
    assert np.linalg.eigvalsh(C).min() > 0
    sigma = np.sqrt(np.diag(C))
    assert sigma[2] < 0.001
    assert max(sigma[3], sigma[4]) < 0.03
    assert min(sigma[0], sigma[1]) > 20 * sigma[2]
    assert sigma[5] > 20 * sigma[3]


def test_covariance_is_that_of_the_origin_of_the_mesh() -> None:
    viewpoints, T, hessian = hessian_at(tool(), pose.exp([0.0, 0.0, 0.6, -2.0, 0.3, 0.4]))
    near = covariance(hessian, T[:3, :3], viewpoints.radius, np.zeros(3))
    far = covariance(hessian, T[:3, :3], viewpoints.radius, np.array([0.0, 0.0, 0.5]))
    np.testing.assert_allclose(far[3:, 3:], near[3:, 3:])
    assert np.trace(far[:3, :3]) > 4.0 * np.trace(near[:3, :3])


def test_what_depth_does_not_hold_stays_as_the_operator_left_it() -> None:
    viewpoints, T, hessian = hessian_at(model_of(block((0.12, 0.12, 0.02))), FLAT)
    start = T @ pose.exp([0.002, 0.0, 0.001, 0.0, 0.0, 0.02])
    drawn = eased(T, start, hessian, viewpoints.radius)
    np.testing.assert_allclose(drawn[:2, 3], start[:2, 3], atol=4e-4)
    assert abs(drawn[2, 3] - T[2, 3]) < 2e-4
    assert pose.rotation_angle(drawn[:3, :3].T @ start[:3, :3]) < 0.005


def test_an_operator_who_was_far_off_is_not_believed() -> None:
    viewpoints, T, hessian = hessian_at(model_of(block((0.12, 0.12, 0.02))), FLAT)
    start = T @ pose.exp([0.05, 0.0, 0.01, 0.0, 0.0, 0.5])
    np.testing.assert_allclose(eased(T, start, hessian, viewpoints.radius), T, atol=1e-4)
