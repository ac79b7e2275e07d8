"""Eq. 3 to 5 against a plain computation with numpy."""

import numpy as np
import pytest
from numpy.typing import NDArray

from registration_core.config import ParticleFilterConfig
from registration_core.geometry import pose
from registration_core.geometry.camera import depth_to_points
from registration_core.geometry.kernels import centred
from registration_core.geometry.object_model import ObjectModel
from registration_core.paper.likelihood import RenderedLikelihood, strides
from registration_core.rendering.rasterizer import render_depth
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import CAMERA, SimpleScene, standing_tool

EVERY_PIXEL = ParticleFilterConfig(silhouette_pixels=1_000_000)


@pytest.fixture(scope="module")
def scene() -> SimpleScene:
    return standing_tool()


def likelihood_of(scene: SimpleScene, config: ParticleFilterConfig = EVERY_PIXEL) -> RenderedLikelihood:
    centre = pose.apply(scene.truth, scene.model.centre)
    return RenderedLikelihood(viewpoint_model(scene.model), scene.depth, CAMERA, centre, 0.17, config)


def plain_weight(scene: SimpleScene, T: NDArray[np.float64], config: ParticleFilterConfig) -> float:
    """Eq. 5 as it is written, over the whole image."""
    model: ObjectModel = scene.model
    rendered_depth = render_depth(model, CAMERA, T)
    rendered, observed = depth_to_points(rendered_depth, CAMERA), depth_to_points(scene.depth, CAMERA)
    near = np.linalg.norm(observed - pose.apply(T, model.centre), axis=-1) <= model.radius + config.epsilon
    in_crop = near & (scene.depth > 0)
    both = (rendered_depth > 0) & (scene.depth > 0)
    inliers = both & (np.linalg.norm(rendered - observed, axis=-1) < config.epsilon)  # Eq. 3
    count = inliers.sum()  # Eq. 4
    return config.alpha * count / in_crop.sum() + config.beta * count / (rendered_depth > 0).sum()


@pytest.mark.parametrize("seed", range(6))
def test_equals_equation_5(scene, seed) -> None:
    T = pose.perturbed(scene.truth, 0.01, 0.2, np.random.default_rng(seed))
    log_weight = likelihood_of(scene)(centred(T, scene.model.centre)[None])
    assert np.exp(log_weight[0]) == pytest.approx(plain_weight(scene, T, EVERY_PIXEL), rel=0.01)


def test_no_hypothesis_weighs_more_than_a_perfect_one(scene) -> None:
    moved = [pose.perturbed(scene.truth, 0.1, 1.0, np.random.default_rng(k)) for k in range(200)]
    poses = centred(np.stack(moved), scene.model.centre)
    assert likelihood_of(scene, ParticleFilterConfig())(poses).max() <= 0.0


def test_truth_beats_what_lies_beside_it(scene) -> None:
    moved = [pose.perturbed(scene.truth, 0.02, 0.3, np.random.default_rng(k)) for k in range(20)]
    poses = centred(np.stack([scene.truth, *moved]), scene.model.centre)
    log_weights = likelihood_of(scene, ParticleFilterConfig())(poses)
    assert log_weights.argmax() == 0


def test_fewer_pixels_give_about_the_same_weight(scene) -> None:
    T = centred(scene.truth, scene.model.centre)[None]
    coarse = np.exp(likelihood_of(scene, ParticleFilterConfig(silhouette_pixels=200))(T))
    np.testing.assert_allclose(coarse, np.exp(likelihood_of(scene)(T)), atol=0.06)


@pytest.mark.parametrize("distance", [0.1, 0.3, 0.45, 0.8, 2.0])
@pytest.mark.parametrize("pixels", [100, 600])
def test_as_many_pixels_are_used_as_are_needed(scene, distance, pixels) -> None:
    model = viewpoint_model(scene.model)
    across, down = strides(model, CAMERA, distance, pixels)
    silhouette = model.mean_area * CAMERA.fx * CAMERA.fy / max(distance, 0.15) ** 2
    used = silhouette / (across * down)
    assert across <= down
    assert used < 2 * pixels
    assert used >= pixels or (across, down) == (1, 1)


def test_a_weight_does_not_depend_on_the_other_hypotheses(scene) -> None:
    moved = [pose.perturbed(scene.truth, 0.03, 0.5, np.random.default_rng(k)) for k in range(20)]
    poses = centred(np.stack(moved), scene.model.centre)
    likelihood = likelihood_of(scene, ParticleFilterConfig())
    together = likelihood(poses)
    assert len(np.unique(together)) == len(together)
    np.testing.assert_array_equal(likelihood(poses[::-1])[::-1], together)
    np.testing.assert_array_equal([likelihood(T[None])[0] for T in poses], together)


@pytest.mark.parametrize("place", [(0.0, 0.0, -1.0), (5.0, 0.0, 1.0), (0.0, -5.0, 1.0)])
def test_hypothesis_out_of_sight_has_no_weight(scene, place) -> None:
    T = pose.exp([*place, 0.0, 0.0, 0.0])[None]
    assert likelihood_of(scene)(T)[0] == -np.inf
