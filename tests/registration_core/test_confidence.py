"""Modes, their masses, and a confidence that rises with the evidence."""

import numpy as np
import pytest

from registration_core import SnapConfig, pose
from registration_core.confidence import confidence, mode_masses, modes_of
from registration_core.evidence import COUNT, OFF_PLANE
from registration_core.kernels import to_rows
from registration_core.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import tool

CONFIG = SnapConfig().confidence


def test_close_poses_are_one_mode() -> None:
    model = viewpoint_model(tool())
    far = pose.exp([0.1, 0, 0, 0, 0, 0])
    poses = to_rows(np.stack([np.eye(4), far, pose.exp([0.001, 0, 0, 0, 0, 0]), far]))
    np.testing.assert_array_equal(modes_of(poses, model, 0.07), [0, 1, 0, 1])


def test_mass_of_a_mode_is_that_of_its_best() -> None:
    masses = mode_masses(np.array([1.0, 0.0, 0.9, 0.0]), np.array([0, 1, 0, 1]))
    np.testing.assert_allclose(masses, [np.e / (np.e + 1), 1 / (np.e + 1)])


def shares(match: float, seen_through: float) -> np.ndarray:
    values = np.zeros(COUNT)
    values[OFF_PLANE + 4], values[OFF_PLANE + 8] = match, seen_through
    return values


def test_confidence_rises_with_mass_score_match_and_visibility() -> None:
    good, poor = shares(0.9, 0.0), shares(0.3, 0.6)
    hidden = good.copy()
    hidden[OFF_PLANE] = 1.5
    assert confidence(0.9, 8.0, good, CONFIG) > confidence(0.3, 8.0, good, CONFIG)
    assert confidence(0.9, 8.0, good, CONFIG) > confidence(0.9, 0.0, good, CONFIG)
    assert confidence(0.9, 8.0, good, CONFIG) > confidence(0.9, 8.0, poor, CONFIG)
    assert confidence(0.9, 8.0, good, CONFIG) > confidence(0.9, 8.0, hidden, CONFIG)
    assert confidence(1.0, 8.0, good, CONFIG) > 0.9
    assert confidence(0.2, -8.0, poor, CONFIG) < 0.2


@pytest.mark.parametrize("mass", [0.0, 0.5, 1.0])
def test_confidence_of_no_pixels_at_all_is_a_probability(mass) -> None:
    assert 0.0 <= confidence(mass, 0.0, np.zeros(COUNT), CONFIG) <= 1.0
