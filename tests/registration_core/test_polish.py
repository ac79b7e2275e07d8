"""Gauss-Newton recovers a known pose from close by, and knows what it does not know."""

import numpy as np
import pytest

from registration_core import Intrinsics, SnapConfig, pose
from registration_core.agreement import surface_of
from registration_core.kernels import centred, from_rows, to_rows
from registration_core.observation import observe
from registration_core.polish import covariance, polish
from registration_core.rasterizer import render_depth
from registration_core.viewpoint_model import viewpoint_model
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


def test_flat_face_is_known_in_depth_and_tilt_only() -> None:
    plate = model_of(block((0.12, 0.12, 0.02)))
    viewpoints, grid, truth = seen(plate, pose.exp([0.0, 0.0, 0.6, 0.0, 0.0, 0.0]))
    C = covariance(to_rows(truth)[0], surface_of(viewpoints), grid, viewpoints.radius, 0.006, 0.001)
    np.testing.assert_allclose(C, C.T)
    assert np.linalg.eigvalsh(C).min() > 0
    sigma = np.sqrt(np.diag(C))
    assert sigma[2] < 0.001
    assert max(sigma[3], sigma[4]) < 0.01
    assert min(sigma[0], sigma[1]) > 20 * sigma[2]
    assert sigma[5] > 20 * sigma[3]


def test_more_noise_means_more_doubt() -> None:
    viewpoints, grid, truth = seen(tool(), pose.exp([0.0, 0.0, 0.6, -2.0, 0.3, 0.4]))
    rows, surface = to_rows(truth)[0], surface_of(viewpoints)
    quiet = covariance(rows, surface, grid, viewpoints.radius, 0.006, 0.002)
    loud = covariance(rows, surface, grid, viewpoints.radius, 0.006, 0.004)
    assert np.trace(loud) / np.trace(quiet) == pytest.approx(4.0, rel=0.1)
