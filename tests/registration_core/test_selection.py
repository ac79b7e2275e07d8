"""The winner must earn its place."""

import numpy as np
import pytest

from registration_core import SnapConfig, pose
from registration_core.agreement import Prior
from registration_core.kernels import centred, f4, to_rows
from registration_core.observation import observe
from registration_core.selection import Residual, judge, residual_shares
from registration_core.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import standing_tool


@pytest.fixture(scope="module")
def scene():
    """(viewpoint model, grid, T_camera_centre) of the standing tool."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    config = SnapConfig().observation
    grid = observe(scene.depth, scene.camera, truth[:3, 3], model, config, np.random.default_rng(0)).grid
    return model, grid, truth


def shifted(T, x=0.0, z=0.0):
    moved = T.copy()
    moved[[0, 2], 3] += [x, z]
    return moved


def test_residuals_of_the_truth_and_of_shifted_poses(scene) -> None:
    model, grid, truth = scene
    poses = to_rows(np.stack([truth, *(shifted(truth, z=z) for z in (-0.1, 0.05, 0.008))]))
    shares = residual_shares(poses, model, grid, truth[2, 3])
    claimed = shares[:, : Residual.UNMEASURED + 1].sum(axis=1)
    assert shares[0, [Residual.MATCH, Residual.PLANE_MATCH, Residual.TILTED]].sum() > 0.85 * claimed[0]
    behind = shares[1, [Residual.SEEN_THROUGH, Residual.PLANE_SEEN_THROUGH]].sum()
    assert behind > 0.8 * claimed[1]
    hidden = shares[2, [Residual.HIDDEN, Residual.PLANE_HIDDEN]].sum()
    assert hidden > 0.8 * claimed[2]
    assert shares[3, Residual.NEAR_MISS] > 0.4 * claimed[3]
    assert shares[1, Residual.UNEXPLAINED] + shares[2, Residual.UNEXPLAINED] > shares[0, Residual.UNEXPLAINED]


def start_at(T):
    return Prior(to_rows(T)[0], f4(0.04), f4(0.5))


def test_true_mode_replaces_a_wrong_start(scene) -> None:
    model, grid, truth = scene
    start = pose.perturbed(truth, 0.05, 0.4, np.random.default_rng(0))
    candidates = to_rows(np.stack([start, start, truth]))
    verdict = judge(candidates, 1, model, grid, start_at(start), SnapConfig().selection)
    assert verdict.winner == 2
    assert verdict.scores[2] > verdict.scores[0]


def test_equals_leave_the_operator_in_place(scene) -> None:
    model, grid, truth = scene
    candidates = to_rows(np.stack([truth, truth, shifted(truth, x=0.001)]))
    assert judge(candidates, 1, model, grid, start_at(truth), SnapConfig().selection).winner == 0


def test_good_start_is_not_given_up_for_a_far_mode(scene) -> None:
    model, grid, truth = scene
    far = [pose.perturbed(truth, 0.06, 1.0, np.random.default_rng(k)) for k in range(20)]
    candidates = to_rows(np.stack([truth, truth, *far]))
    assert judge(candidates, 1, model, grid, start_at(truth), SnapConfig().selection).winner == 0
