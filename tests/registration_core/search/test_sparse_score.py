"""The sparse agreement ranks hypotheses as the truth does, and pays no heed to their number or order."""

import numpy as np
import pytest

from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import centred, f4, to_rows
from registration_core.search.observation import observe
from registration_core.search.sparse_score import (
    Prior,
    agreement_weights,
    heavy_tails,
    sparse_score,
    surface_of,
)
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import standing_tool


@pytest.fixture(scope="module")
def agreement():
    """(N,) agreement of poses T_camera_object (N, 4, 4) with the standing tool, epsilon 1 cm."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    start = centred(scene.truth, model.centre)
    config = SnapConfig()
    observation = observe(
        scene.depth, scene.camera, start[:3, 3], model, config.observation, np.random.default_rng(0)
    )
    prior = Prior(to_rows(start)[0], f4(0.04), f4(0.5))

    def of(T, with_normals=True):
        rows = to_rows(centred(T, model.centre))
        out = np.empty(len(rows), np.float32)
        weights = agreement_weights(config.agreement)
        sparse_score(
            rows, surface_of(model), observation.grid, prior, 200, 64, f4(0.01), with_normals, weights, out
        )
        return out

    return of, scene.truth


@pytest.mark.parametrize("with_normals", [True, False])
def test_truth_agrees_best(agreement, with_normals) -> None:
    of, truth = agreement
    others = [pose.perturbed(truth, 0.03, 0.3, np.random.default_rng(k)) for k in range(50)]
    scores = of(np.stack([truth, *others]), with_normals)
    assert scores.argmax() == 0
    assert scores[0] > 0.5


def test_each_hypothesis_is_scored_by_itself(agreement) -> None:
    of, truth = agreement
    poses = np.stack([pose.perturbed(truth, 0.02, 0.2, np.random.default_rng(k)) for k in range(20)])
    np.testing.assert_array_equal(of(poses)[::-1], of(poses[::-1]))


def test_floating_before_the_background_is_worse_than_fitting(agreement) -> None:
    of, truth = agreement
    floating = truth.copy()
    floating[2, 3] -= 0.1
    assert of(floating[None])[0] < 0.0


def test_hypotheses_out_of_sight_stay_finite(agreement) -> None:
    of, _ = agreement
    away = pose.exp([0.0, 0.0, -1.0, 0.0, 0.0, 0.0]), pose.exp([9.0, 0.0, 1.0, 0.0, 0.0, 0.0])
    assert np.isfinite(of(np.stack(away))).all()


def test_heavy_tail_of_known_distances() -> None:
    prior = Prior(to_rows(np.eye(4))[0], f4(0.1), f4(0.5))
    poses = np.stack([pose.exp(t) for t in ([0] * 6, [0.1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0.5, 0])])
    tails = heavy_tails(to_rows(poses.astype(np.float64)), prior)
    np.testing.assert_allclose(tails, [0.0, np.log(1.5), np.log(1.5)], atol=0.01)
