"""Modes, their masses, and a confidence that rises with the evidence."""

import numpy as np
import pytest
import trimesh

from registration_core import SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import to_rows
from registration_core.judge.confidence import (
    FEATURES,
    belief_in_first,
    confidence,
    features,
    grouped,
    modes_of,
    twins_of_first,
)
from registration_core.judge.pixel_evidence import COUNT, MATCHED, OFF_BINS
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import model_of, tool

CONFIG = SnapConfig().confidence


def test_close_poses_are_one_mode() -> None:
    apart = np.array([[0, 9, 1, 9], [9, 0, 9, 0], [1, 9, 0, 9], [9, 0, 9, 0]], np.float32) / np.float32(100)
    np.testing.assert_array_equal(modes_of(apart, 0.07), [0, 1, 0, 1])


def test_mass_of_a_mode_is_that_of_its_best_and_what_is_near_it_counts_each_candidate() -> None:
    model = viewpoint_model(tool())
    moved = [0.0, 0.2, 0.01, 0.06, 0.2]  # of the diameter; the fourth is of the winner's mode, but not near
    poses = to_rows(np.stack([pose.exp([by * model.diameter, 0, 0, 0, 0, 0]) for by in moved]))
    modes = grouped(poses, 0, np.array([1.0, 0.0, 0.9, 0.5, 0.0]), model, CONFIG)
    np.testing.assert_array_equal(modes.best, [0, 1])
    np.testing.assert_allclose(modes.masses, [np.e / (np.e + 1), 1 / (np.e + 1)])
    belief = np.exp([1.0, 0.0, 0.9, 0.5, 0.0])
    np.testing.assert_allclose(modes.near, np.array([belief[0] + belief[2], 2.0]) / belief.sum())


def test_poses_that_put_the_same_surface_there_are_twins_whatever_symmetries_are_told() -> None:
    can = viewpoint_model(model_of(trimesh.creation.cylinder(radius=0.03, height=0.1)))
    assert len(can.symmetries) == 1
    turned = pose.exp([0, 0, 0, 0, 0, 1.0])
    poses = to_rows(np.stack([np.eye(4), turned, pose.exp([0, 0, 0, 1.0, 0, 0])]))
    np.testing.assert_array_equal(twins_of_first(poses, np.full(3, 1 / 3), can), [1])
    assert not len(twins_of_first(poses[:2], np.array([1.0, 0.001]), can))  # too little mass to look at
    tooled = viewpoint_model(tool())
    assert not len(twins_of_first(poses, np.full(3, 1 / 3), tooled))


def test_twins_stay_modes_of_their_own_but_the_belief_is_in_all_of_them() -> None:
    can = viewpoint_model(model_of(trimesh.creation.cylinder(radius=0.03, height=0.1)))
    turns = [pose.exp([0, 0, 0, 0, 0, angle]) for angle in (0.0, 1.0, 2.0, 3.0)]
    poses = to_rows(np.stack([*turns, pose.exp([0.1, 0, 0, 0, 0, 0])]))
    modes = grouped(poses, 0, np.zeros(5), can, CONFIG)
    np.testing.assert_allclose(modes.masses, np.full(5, 0.2))
    assert belief_in_first(modes, poses[modes.best], can) == pytest.approx(0.8)


def test_what_has_no_mass_is_no_mode() -> None:
    model = viewpoint_model(tool())
    poses = to_rows(np.stack([np.eye(4), pose.exp([0.1, 0, 0, 0, 0, 0]), pose.exp([0.2, 0, 0, 0, 0, 0])]))
    modes = grouped(poses, 0, np.array([50.0, 49.0, 0.0]), model, CONFIG)
    np.testing.assert_array_equal(modes.best, [0, 1])
    assert modes.masses.sum() == pytest.approx(1.0)


def shares(match: float, seen_through: float) -> np.ndarray:
    values = np.zeros(COUNT)
    values[MATCHED], values[OFF_BINS - 1] = match, seen_through
    return values


def test_features_are_what_they_are_called() -> None:
    spoken = features(np.array([0.25]), np.array([3.0]), shares(0.75, 0.25)[None], np.array([0.005]))[0]
    found = dict(zip(FEATURES, spoken, strict=True))
    assert found["belief"] == pytest.approx(np.log(1 / 3))
    assert found["score"] == 3.0
    assert found["inner match"] == pytest.approx(0.75)
    assert found["shown"] == 1.0
    assert found["precision"] == pytest.approx(np.log(10.0))


def test_confidence_rises_with_belief_score_match_and_precision() -> None:
    good, poor = shares(0.9, 0.0), shares(0.3, 0.6)
    sure = confidence(0.9, 8.0, good, 0.02, CONFIG)
    assert sure > confidence(0.3, 8.0, good, 0.02, CONFIG)
    assert sure > confidence(0.9, 0.0, good, 0.02, CONFIG)
    assert sure > confidence(0.9, 8.0, poor, 0.02, CONFIG)
    assert sure > confidence(0.9, 8.0, good, 0.04, CONFIG)
    assert confidence(0.2, -8.0, poor, 0.1, CONFIG) < 0.2


@pytest.mark.parametrize("belief", [0.0, 0.5, 1.0])
def test_confidence_of_no_pixels_at_all_is_a_probability(belief) -> None:
    assert 0.0 <= confidence(belief, 0.0, np.zeros(COUNT), 0.7, CONFIG) <= 1.0
