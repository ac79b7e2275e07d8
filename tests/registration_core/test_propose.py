"""Without a start: the object is found wherever it is, or nothing is claimed."""

import numpy as np
import pytest

from registration_core import propose
from registration_core.geometry import pose
from tests.registration_core.simple_scene import standing_tool


@pytest.fixture(scope="module")
def scene():
    return standing_tool()


@pytest.fixture(scope="module")
def found(scene):
    return propose(scene.model, scene.depth, scene.camera, rng=np.random.default_rng(0))


def test_finds_the_object_first(scene, found) -> None:
    apart = pose.distance(found[0].T_camera_object, scene.truth)
    assert apart.translation < 0.004
    assert apart.rotation < np.radians(3.0)


def test_hypotheses_are_distinct_poses_best_first(found) -> None:
    assert 1 < len(found) <= 10
    weights = [hypothesis.weight for hypothesis in found]
    assert weights == sorted(weights, reverse=True)
    assert sum(weights) <= 1.0 + 1e-9
    for hypothesis in found:
        pose.checked(hypothesis.T_camera_object, "T_camera_object")


def test_same_seed_same_hypotheses(scene, found) -> None:
    again = propose(scene.model, scene.depth, scene.camera, rng=np.random.default_rng(0))
    for one, other in zip(found, again, strict=True):
        np.testing.assert_array_equal(one.T_camera_object, other.T_camera_object)


def test_looks_in_the_region_only(scene) -> None:
    x, y = (scene.truth[:2, 3] / scene.truth[2, 3] * scene.camera.fx).astype(int)
    around = (int(scene.camera.cx) + x - 60, int(scene.camera.cy) + y - 60, 120, 120)
    best = propose(scene.model, scene.depth, scene.camera, around, rng=np.random.default_rng(0))[0]
    assert pose.distance(best.T_camera_object, scene.truth).translation < 0.01
    beside = (0, 0, 60, 60)
    for hypothesis in propose(scene.model, scene.depth, scene.camera, beside, rng=np.random.default_rng(0)):
        assert pose.distance(hypothesis.T_camera_object, scene.truth).translation > 0.05


def test_infinite_depth_is_not_measured(scene, found) -> None:
    depth = np.where(scene.depth > 0, scene.depth, np.inf)
    depth[:20] = np.inf
    best = propose(scene.model, depth, scene.camera, rng=np.random.default_rng(0))[0]
    assert pose.distance(best.T_camera_object, scene.truth).translation < 0.004


def test_empty_region_proposes_nothing(scene) -> None:
    depth = scene.depth.copy()
    depth[:50, :50] = 0.0
    assert propose(scene.model, depth, scene.camera, (0, 0, 40, 40)) == ()


@pytest.mark.parametrize(
    ("region", "message"),
    [
        ((0, 0, 10), "region must be"),
        ((0, 0, 0, 10), "region must be"),
        ((0.5, 0, 10, 10), "region must be"),
        ((5000, 0, 10, 10), "region must overlap"),
    ],
)
def test_bad_region_is_named(scene, region, message) -> None:
    with pytest.raises(ValueError, match=message):
        propose(scene.model, scene.depth, scene.camera, region)
