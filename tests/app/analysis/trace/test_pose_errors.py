"""Errors of many poses are those of each of them."""

import numpy as np
import pytest

from app.analysis.trace.pose_errors import pose_errors
from registration_core.geometry import pose
from registration_core.geometry.pose_error import rotation_error, translation_error


def test_they_agree_with_the_errors_of_single_poses():
    rng = np.random.default_rng(3)
    truth, *others = [pose.exp(rng.normal(size=6)) for _ in range(30)]
    symmetries = np.array([np.eye(4), pose.exp([0, 0, 0, 0, 0, np.pi]), pose.exp([0, 0, 0, np.pi, 0, 0])])
    errors = pose_errors(np.array(others), truth, symmetries)
    assert errors.translation == pytest.approx([translation_error(T, truth) for T in others])
    assert errors.rotation == pytest.approx([rotation_error(T, truth, symmetries) for T in others])


def test_a_pose_and_its_twin_are_right():
    flip = pose.exp([0, 0, 0, 0, 0, np.pi])
    T = pose.exp([0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    errors = pose_errors(np.array([T, T @ flip]), T, np.array([np.eye(4), flip]))
    assert errors.rotation == pytest.approx([0.0, 0.0], abs=1e-7)
