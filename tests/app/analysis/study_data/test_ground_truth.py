"""The mean of where operators put an object."""

import numpy as np
import pytest

from app.analysis.study_data.ground_truth import given_truth, mean_truth
from app.analysis.trace.pose_errors import pose_errors
from registration_core.geometry import pose
from tests.app.analysis.hand_made import at

NO_SYMMETRY = np.eye(4)[None]
HALF_TURN = np.array([np.eye(4), pose.exp([0, 0, 0, 0, 0, np.pi])])


def test_the_mean_of_two_lies_half_way_and_their_spread_is_half_the_distance():
    truth = mean_truth(np.array([at(0.1, 0.2), at(0.3, 0.6)]), NO_SYMMETRY)
    assert np.allclose(truth.T_world_object, at(0.2, 0.4))
    assert truth.count == 2
    assert truth.translation_spread == pytest.approx(0.1)
    assert truth.rotation_spread == pytest.approx(0.2)


def test_symmetric_twins_are_brought_together_first():
    poses = np.array([at(0.0, 0.1), at(0.0, 0.3) @ HALF_TURN[1], at(0.0, 0.2)])
    truth = mean_truth(poses, HALF_TURN)
    assert np.allclose(truth.T_world_object, at(0.0, 0.2))
    assert truth.rotation_spread == pytest.approx(np.sqrt(0.02 / 3))
    alone = mean_truth(poses, NO_SYMMETRY)
    assert alone.rotation_spread > 1.0


def test_a_symmetry_beside_the_origin_moves_the_origin_along():
    about = pose.from_rotation_translation(HALF_TURN[1][:3, :3], [0.2, 0.0, 0.0])  # about (0.1, 0, 0)
    symmetries = np.array([np.eye(4), about])
    truth = mean_truth(np.array([at(0.0, 0.1), at(0.0, 0.1) @ about]), symmetries)
    assert truth.translation_spread == pytest.approx(0.0, abs=1e-12)
    errors = pose_errors(np.array([at(0.0, 0.1) @ about]), at(0.0, 0.1), symmetries)
    assert errors.translation == pytest.approx([0.0], abs=1e-12)


def test_one_registration_has_no_spread_and_a_given_pose_neither():
    assert np.isnan(mean_truth(at(0.1)[None], NO_SYMMETRY).translation_spread)
    given = given_truth(at(0.1))
    assert given.count == 0 and np.isnan(given.rotation_spread)
