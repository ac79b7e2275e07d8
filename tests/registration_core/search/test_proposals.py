"""Proposals: as wide as asked for, on the observed surface, the same for the same seed."""

import dataclasses

import numpy as np
import pytest

from registration_core import SnapConfig
from registration_core.geometry.kernels import centred, f4, to_rows
from registration_core.search.observation import observe
from registration_core.search.proposals import around_start
from registration_core.search.sparse_score import Prior, surface_of
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import standing_tool

CONFIG = SnapConfig().proposals


@pytest.fixture(scope="module")
def proposals():
    """Draw poses (N, 3, 4) about a start, `toward` metres nearer than the truth; and the truth (3, 4)."""
    scene = standing_tool()
    model = viewpoint_model(scene.model)
    truth = centred(scene.truth, model.centre)
    grid = observe(
        scene.depth, scene.camera, truth[:3, 3], model, SnapConfig().observation, np.random.default_rng(0)
    ).grid

    def draw(seed=0, toward=0.0, **changes):
        config = dataclasses.replace(CONFIG, **changes)
        start = to_rows(truth)[0].copy()
        start[2, 3] -= toward
        prior = Prior(start, f4(0.02), f4(0.2))
        return around_start(prior, surface_of(model), grid, config, config.count, np.random.default_rng(seed))

    return draw, to_rows(truth)[0]


def test_first_is_the_start_and_all_are_rotations(proposals) -> None:
    draw, start = proposals
    poses = draw()
    np.testing.assert_array_equal(poses[0], start)
    products = poses[:, :, :3] @ poses[:, :, :3].transpose(0, 2, 1)
    np.testing.assert_allclose(products, np.tile(np.eye(3), (len(poses), 1, 1)), atol=1e-5)


def test_gaussian_ones_are_as_wide_as_asked_for(proposals) -> None:
    draw, start = proposals
    poses = draw(gaussian_share=1.0, ray_share=0.0, scales=(1.0, 1.0, 1.0, 1.0))
    np.testing.assert_allclose((poses[:, :, 3] - start[:, 3]).std(axis=0), 0.02, rtol=0.05)


def test_anchored_ones_come_back_onto_the_surface(proposals) -> None:
    draw, truth = proposals

    def close(poses) -> float:
        return float((np.abs(poses[:, 2, 3] - truth[2, 3]) < 0.02).mean())

    anchored = close(draw(toward=0.06, gaussian_share=0.0))
    assert anchored > 2.0 * close(draw(toward=0.06, gaussian_share=1.0, ray_share=0.0))


def test_seed_decides(proposals) -> None:
    draw, _ = proposals
    np.testing.assert_array_equal(draw(1), draw(1))
    assert not np.array_equal(draw(1), draw(2))
